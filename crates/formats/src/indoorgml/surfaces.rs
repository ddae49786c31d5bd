//! The visible surface of a cell space: its solid without the surfaces of transitions.

use super::super::gltf::flat_hull;
use super::{CellSpace, IndoorGml};
use enfilade::math::geom::{Aabb, middle};
use enfilade::math::polygon::Polygon;
use enfilade::scene::{Mesh, Role};
use glam::{DVec2, DVec3};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::{BTreeSet, HashMap};

/// Greatest distance of two surfaces of one wall, in coplanar tolerances.
const SAME_PLANE: f64 = 10.0;

/// A cell space as triangles.
pub(super) struct Skin {
    /// The rest of its surface.
    pub mesh: Mesh,
    /// Its whole surface.
    pub surface: Vec<[DVec3; 3]>,
}

/// The skins of all cell spaces.
pub(super) fn skin(model: &IndoorGml) -> Vec<Skin> {
    let eps = model.coplanar();
    let mut openings: Vec<Vec<Polygon>> = vec![Vec::new(); model.spaces.len()];
    let mut through: Vec<Vec<usize>> = vec![Vec::new(); model.spaces.len()];
    for transition in &model.transitions {
        for (side, &space) in transition.cells.iter().enumerate() {
            match &transition.boundary {
                Some(boundary) => openings[space].extend(Polygon::new(vec![boundary.winding.clone()])),
                None => through[space].push(transition.cells[1 - side]),
            }
        }
    }
    let skin_of = |(i, space): (usize, &CellSpace)| {
        let across = through[i].iter().flat_map(|&other| &model.spaces[other].surface);
        let holes: Vec<&Polygon> = openings[i].iter().chain(across).collect();
        let mut all = Vec::new();
        let mut kept = Vec::new();
        for polygon in &space.surface {
            let near = Aabb::of(polygon.rings[0].iter().copied()).inflated(SAME_PLANE * eps);
            let in_plane = |hole: &&&Polygon| {
                let corners = || hole.rings.iter().flatten();
                near.touches(&Aabb::of(corners().copied()))
                    && corners().all(|&p| polygon.plane.distance(p).abs() <= SAME_PLANE * eps)
            };
            let holes: Vec<&Polygon> = holes.iter().filter(in_plane).copied().collect();
            for triangle in triangles(polygon, &holes, eps) {
                let p = middle(&triangle);
                all.push(triangle);
                if !holes.iter().any(|hole| hole.holds(p)) {
                    kept.push(triangle);
                }
            }
        }
        let mesh = Mesh {
            node: space.id.clone(),
            role: Role::Structure,
            opaque: true,
            positions: kept.iter().flatten().copied().collect(),
            triangles: (0..kept.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        };
        Skin { mesh, surface: all }
    };
    model.spaces.iter().enumerate().map(skin_of).collect()
}

/// The triangles of a polygon, cut along the outlines of coplanar others, so that each triangle is inside or outside of each.
pub(super) fn triangles(polygon: &Polygon, cuts: &[&Polygon], eps: f64) -> Vec<[DVec3; 3]> {
    let frame = Frame::of(polygon);
    // A power of two keeps grid coordinates exact.
    let grid = (eps * 0.5).log2().floor().exp2();
    let mut numbers: HashMap<(i64, i64), usize> = HashMap::new();
    let mut corners: Vec<Point2<f64>> = Vec::new();
    // Corners keep their places; the grid only merges equal ones, so neighbours share them.
    let mut exact: Vec<DVec3> = Vec::new();
    let mut edges: BTreeSet<[usize; 2]> = BTreeSet::new();
    let own = polygon.rings.iter().map(|ring| (ring, true));
    let foreign = cuts.iter().flat_map(|cut| &cut.rings).map(|ring| (ring, false));
    for (ring, is_own) in own.chain(foreign) {
        let ids: Vec<usize> = (ring.iter())
            .map(|&p| {
                let q = frame.flat(p) / grid;
                let key = (q.x.round() as i64, q.y.round() as i64);
                *numbers.entry(key).or_insert_with(|| {
                    corners.push(Point2::new(key.0 as f64 * grid, key.1 as f64 * grid));
                    exact.push(if is_own { p } else { frame.lift(frame.flat(p)) });
                    corners.len() - 1
                })
            })
            .collect();
        for (k, &a) in ids.iter().enumerate() {
            let b = ids[(k + 1) % ids.len()];
            if a != b {
                edges.insert([a.min(b), a.max(b)]);
            }
        }
    }
    let mut crossing = Vec::new();
    let loaded = ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(
        corners.clone(),
        edges.into_iter().collect(),
        |edge| crossing.push(edge),
    );
    let Ok(mut plan) = loaded else { return Vec::new() };
    for [a, b] in crossing {
        if let (Ok(a), Ok(b)) = (plan.insert(corners[a]), plan.insert(corners[b]))
            && a != b
        {
            plan.add_constraint_and_split(a, b, |p| p);
        }
    }
    let faces = plan.inner_faces().map(|face| face.vertices().map(|v| v.position()));
    let lifted = faces.map(|t| {
        t.map(|p| {
            let key = ((p.x / grid).round() as i64, (p.y / grid).round() as i64);
            let known = numbers.get(&key).filter(|&&i| corners[i] == p).map(|&i| exact[i]);
            known.unwrap_or_else(|| frame.lift(DVec2::new(p.x, p.y)))
        })
    });
    lifted.filter(|t| polygon.holds(middle(t))).collect()
}

/// The convex hull of a polygon, counter-clockwise about its normal.
pub(super) fn hull(polygon: &Polygon) -> Vec<DVec3> {
    let frame = Frame::of(polygon);
    flat_hull(polygon.rings[0].iter().map(|&p| frame.flat(p)).collect()).into_iter().map(|q| frame.lift(q)).collect()
}

/// Coordinates in a polygon's plane.
struct Frame {
    origin: DVec3,
    u: DVec3,
    v: DVec3,
}

impl Frame {
    fn of(polygon: &Polygon) -> Self {
        let first = polygon.rings[0][0];
        let (u, v) = polygon.plane.n.any_orthonormal_pair();
        let (u, v) = if u.cross(v).dot(polygon.plane.n) > 0.0 { (u, v) } else { (v, u) };
        Self { origin: first - polygon.plane.n * polygon.plane.distance(first), u, v }
    }

    fn flat(&self, p: DVec3) -> DVec2 {
        let p = p - self.origin;
        DVec2::new(p.dot(self.u), p.dot(self.v))
    }

    fn lift(&self, q: DVec2) -> DVec3 {
        self.origin + self.u * q.x + self.v * q.y
    }
}
