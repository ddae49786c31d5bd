//! Buildings made of closed solids and of sheets.

use crate::meshes::builder;
use crate::solids::{Box3, less};
use enfilade::math::geom::newell;
use enfilade::scene::{Mesh, Role, Scene, SceneBuilder};
use glam::{DVec2, DVec3, dvec3 as v};

/// How thick walls and slabs of a shell are.
pub const WALL: f64 = 0.2;

/// A building as closed solids.
pub struct Building {
    pub builder: SceneBuilder,
    parts: usize,
}

impl Default for Building {
    fn default() -> Self {
        Self { builder: builder(), parts: 0 }
    }
}

impl Building {
    pub fn mesh(&mut self, node: &str, role: Role, opaque: bool, polygons: &[Vec<DVec3>]) {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for polygon in polygons {
            let first = positions.len() as u32;
            triangles.extend((2..polygon.len() as u32).map(|k| [first, first + k - 1, first + k]));
            positions.extend(polygon);
        }
        self.parts += 1;
        let node = if node.is_empty() { format!("part {}", self.parts) } else { node.to_owned() };
        self.builder.add(Mesh { node, role, opaque, positions, triangles }).expect("a sound building");
    }

    /// What lies between a convex polygon and the same polygon moved by `by`.
    pub fn swept(&mut self, base: &[DVec3], by: DVec3) {
        self.swept_as("", Role::Structure, true, base, by);
    }

    pub fn swept_as(&mut self, node: &str, role: Role, opaque: bool, base: &[DVec3], by: DVec3) {
        // Counter-clockwise from outside, so from below where it goes up.
        let mut base = base.to_vec();
        if newell(&base.iter().map(|&p| p - base[0]).collect::<Vec<_>>()).dot(by) > 0.0 {
            base.reverse();
        }
        let top: Vec<DVec3> = base.iter().map(|&p| p + by).collect();
        let sides = (0..base.len()).map(|i| (i, (i + 1) % base.len())).map(|(i, j)| vec![base[j], base[i], top[i], top[j]]);
        let mut polygons: Vec<Vec<DVec3>> = sides.collect();
        polygons.extend([base, top.into_iter().rev().collect()]);
        self.mesh(node, role, opaque, &polygons);
    }

    pub fn solid_as(&mut self, node: &str, role: Role, opaque: bool, [min, max]: Box3) {
        let base = [min, v(max.x, min.y, min.z), v(max.x, min.y, max.z), v(min.x, min.y, max.z)];
        self.swept_as(node, role, opaque, &base, DVec3::Y * (max.y - min.y));
    }

    pub fn solid(&mut self, min: DVec3, max: DVec3) {
        self.solid_as("", Role::Structure, true, [min, max]);
    }

    /// A box less some others.
    pub fn holed(&mut self, min: DVec3, max: DVec3, holes: &[Box3]) {
        let parts =
            holes.iter().fold(vec![[min, max]], |parts, &hole| parts.into_iter().flat_map(|p| less(p, hole)).collect());
        parts.into_iter().for_each(|[min, max]| self.solid(min, max));
    }

    /// Outer walls around the inside of a box, and slabs under and over it; all less `holes`.
    pub fn shell(&mut self, min: DVec3, max: DVec3, holes: &[Box3]) {
        let (a, b) = (min - WALL, max + WALL);
        self.holed(v(a.x, min.y, a.z), v(min.x, max.y, b.z), holes);
        self.holed(v(max.x, min.y, a.z), v(b.x, max.y, b.z), holes);
        self.holed(v(min.x, min.y, a.z), v(max.x, max.y, min.z), holes);
        self.holed(v(min.x, min.y, max.z), v(max.x, max.y, b.z), holes);
        self.holed(a, v(b.x, min.y, b.z), holes);
        self.holed(v(a.x, max.y, a.z), b, holes);
    }

    /// One side of a box that is flat along one axis, less some others.
    pub fn sheet(&mut self, a: DVec3, c: DVec3, holes: &[Box3]) {
        let parts =
            holes.iter().fold(vec![[a, c]], |parts, &hole| parts.into_iter().flat_map(|p| less_flat(p, hole)).collect());
        for [a, c] in parts {
            let flat = (0..3).find(|&k| a[k] == c[k]).expect("a sound building");
            let (s, t) = ((flat + 1) % 3, (flat + 2) % 3);
            let corner = |k: usize, p: DVec3| {
                let mut q = a;
                q[k] = p[k];
                q
            };
            self.mesh("", Role::Structure, true, &[vec![a, corner(s, c), c, corner(t, c)]]);
        }
    }

    /// An upright wall along a line of the plan, `from` to `to`, `thick` to its left, with a doorway from `door[0]` to `door[1]`
    /// along it.
    pub fn wall_along(&mut self, from: DVec2, to: DVec2, heights: [f64; 2], thick: f64, door: Option<[f64; 2]>) {
        let along = (to - from).normalize();
        let across = along.perp() * thick;
        let mut part = |a: f64, b: f64, low: f64, high: f64| {
            let base = [from + along * a, from + along * b, from + along * b + across, from + along * a + across];
            self.swept(&base.map(|p| v(p.x, low, p.y)), DVec3::Y * (high - low));
        };
        let ([low, high], length) = (heights, from.distance(to));
        match door {
            Some([a, b]) => {
                part(0.0, a, low, high);
                part(b, length, low, high);
                part(a, b, low + 2.1, high);
            }
            None => part(0.0, length, low, high),
        }
    }

    pub fn finish(self) -> Scene {
        self.builder.finish("hand-made").expect("a sound building")
    }
}

/// As [`less`], for boxes that are flat along one axis.
fn less_flat([a, c]: Box3, hole: Box3) -> Vec<Box3> {
    let flat = (0..3).find(|&k| a[k] == c[k]).expect("a sound building");
    let (mut low, mut high) = (a, c);
    (low[flat], high[flat]) = (a[flat] - 0.01, a[flat] + 0.01);
    let back = |mut p: DVec3| {
        p[flat] = a[flat];
        p
    };
    less([low, high], hole).into_iter().map(|p| p.map(back)).collect()
}
