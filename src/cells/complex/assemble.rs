//! From labelled pieces to a cell graph: portals from the open faces between labels, and pieces merged while they stay convex.
//!
//! Portals only grow on the way: the open parts of one plane between two cells are united, each part is replaced by its convex hull (split
//! first if the hull would be much larger), and the hull grows by the width that coverage removed.

use super::arrange::Plan;
use super::bands::Cut;
use super::columns::Columns;
use super::coverage::Open;
use super::faces::{Face, Surface};
use super::facets::Facets;
use super::lift;
use super::polygon::{Shape, area, convex_hull, points, shape_area};
use crate::CellId;
use crate::cells::{Piece, Portal, PortalKind, PortalState};
use crate::job::{Job, Stopped};
use crate::math::geom::{Aabb, Plane};
use crate::math::parallel;
use glam::{DVec2, DVec3};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;
use std::collections::{BTreeMap, HashMap};

/// Vertical planes are equal if their unit normals are nearer than this.
const SAME_NORMAL: f64 = 1e-9;

/// A hull is split if the hulls of its halves have less than this share of its area.
const WORTH: f64 = 0.98;

/// A hull is split if its area exceeds that of its contents by this factor.
const LOOSE_HULL: f64 = 1.2;
/// Most halvings of one opening.
const MOST_SPLITS: u32 = 4;

/// The parts of a column complex.
pub struct Complex<'c> {
    /// The plan.
    pub plan: &'c Plan,
    /// The columns over it.
    pub columns: &'c Columns,
    /// The planes.
    pub facets: &'c Facets,
    /// The faces.
    pub faces: &'c [Face],
    /// Heights of the levels, metres.
    pub levels: &'c [f64],
    /// The space that the plan and the rims enclose.
    pub domain: Aabb,
}

impl Complex<'_> {
    /// For each piece, whether it touches the rim of the domain, so that it borders on the outside.
    pub fn at_rim(&self) -> Vec<bool> {
        let mut rim = Vec::with_capacity(self.columns.pieces());
        for (t, slices) in self.columns.slices.iter().enumerate() {
            let at_edge = self.plan.neighbours[t].iter().any(Option::is_none);
            rim.extend(slices.windows(2).map(|w| at_edge || w[0].cut == Cut::Bottom || w[1].cut == Cut::Top));
        }
        rim
    }

    /// The plane of a face with its normal from piece `a` to piece `b`, and the map from face coordinates to the world.
    fn frame(&self, face: &Face) -> (Plane, Box<dyn Fn(DVec2) -> DVec3 + '_>) {
        // Decided by the edge of the plan, because the column may be thinner than the wall's flatness.
        let upright = |along: DVec2, on: DVec2| {
            let right = -along.perp();
            Plane::through(lift(on, 0.0), lift(if face.a_is_left { right } else { -right }, 0.0))
        };
        match face.surface {
            Surface::Wall(w) => {
                let wall = &self.facets.walls[w as usize];
                (upright(wall.along(), wall.at(0.0)), Box::new(move |p| lift(wall.at(p.x), p.y)))
            }
            Surface::Edge { triangle, edge } => {
                let t = self.plan.triangles[triangle as usize];
                let a = self.plan.points[t[edge as usize] as usize];
                let along = (self.plan.points[t[(edge as usize + 1) % 3] as usize] - a).normalize();
                (upright(along, a), Box::new(move |p| lift(a + along * p.x, p.y)))
            }
            Surface::Cut(Cut::Sheet(s)) => {
                let sheet = &self.facets.sheets[s as usize];
                (sheet.plane, Box::new(move |p| lift(p, sheet.height(p))))
            }
            Surface::Cut(cut) => {
                let y = match cut {
                    Cut::Level(l) => self.levels[l as usize],
                    Cut::Top => self.domain.max.y,
                    _ => self.domain.min.y,
                };
                (Plane { n: DVec3::Y, d: y }, Box::new(move |p| lift(p, y)))
            }
        }
    }
}

/// Portals between different labels, in a fixed order; pieces without a label have none.
pub fn portals(complex: &Complex<'_>, labels: &[Option<u32>], seal: f64, work: &Job<'_>) -> Result<Vec<Portal>, Stopped> {
    // Faces of one plane between the same two cells, the lower label on the same side.
    let mut groups: BTreeMap<(u32, u32, [u32; 3], bool), Vec<usize>> = BTreeMap::new();
    for (i, f) in complex.faces.iter().enumerate() {
        let (Some(a), Some(b)) = (labels[f.a as usize], labels[f.b as usize]) else {
            continue;
        };
        if a == b || f.is_thin || f.open_area <= 0.0 {
            continue;
        }
        let (plane, _) = complex.frame(f);
        let forward = if a < b { plane.n } else { -plane.n };
        let positive = [forward.x, forward.y, forward.z].into_iter().find(|x| x.abs() > 1e-6).is_some_and(|x| x > 0.0);
        groups.entry((a.min(b), a.max(b), f.surface.key(), positive)).or_default().push(i);
    }
    let groups: Vec<_> = groups.into_iter().collect();
    let of_group = |((low, high, ..), members): &((u32, u32, [u32; 3], bool), Vec<usize>)| {
        if work.is_stopped() {
            return Vec::new();
        }
        let first = &complex.faces[members[0]];
        let (plane, to_world) = complex.frame(first);
        let plane = if labels[first.a as usize] == Some(*low) { plane } else { plane.flipped() };
        let mut parts: Vec<Shape> = Vec::new();
        for &i in members {
            match &complex.faces[i].open {
                Open::Whole => parts.push(vec![complex.faces[i].polygon.iter().map(|p| p.to_array()).collect()]),
                Open::Parts(p) => parts.extend(p.iter().cloned()),
            }
        }
        let hulls = hulls(parts, seal).into_iter();
        hulls
            .filter_map(|hull| {
                let mut winding: Vec<DVec3> = hull.iter().map(|&p| to_world(p)).collect();
                let n = crate::math::geom::newell(&winding.iter().map(|&p| p - winding[0]).collect::<Vec<_>>());
                if n.dot(plane.n) < 0.0 {
                    winding.reverse();
                }
                let cells = [CellId(*low), CellId(*high)];
                let kind = PortalKind::Opening;
                (n.length() > 0.0).then_some(Portal {
                    cells,
                    plane,
                    winding,
                    kind,
                    state: PortalState::of_kind(kind),
                    source: None,
                })
            })
            .collect::<Vec<_>>()
    };
    let found = parallel::flat_map(&groups, of_group);
    work.go_on().map(|()| found)
}

/// False if the open part of a face is too thin for a portal.
pub fn has_portal(face: &Face, seal: f64) -> bool {
    match &face.open {
        _ if face.is_thin => false,
        Open::Whole => true,
        Open::Parts(parts) => parts.iter().any(|part| !hulls(vec![part.clone()], seal).is_empty()),
    }
}

/// Convex polygons that contain all parts, each grown to compensate for coverage.
pub fn hulls(mut parts: Vec<Shape>, seal: f64) -> Vec<Vec<DVec2>> {
    // Corners are rounded, so that parts of neighbouring faces unite.
    let grid = seal / 8.0;
    for p in parts.iter_mut().flatten().flatten() {
        *p = p.map(|x| (x / grid).round() * grid);
    }
    let none: Vec<Shape> = Vec::new();
    let united = if parts.len() > 1 { parts.overlay(&none, OverlayRule::Subject, FillRule::NonZero) } else { parts };
    let mut out = Vec::new();
    for shape in united {
        split(shape, MOST_SPLITS, &mut out);
    }
    out.iter()
        .map(|hull| {
            let by = 1.5 * seal;
            let grown =
                hull.iter().flat_map(|p| [(-by, -by), (by, -by), (by, by), (-by, by)].map(|(x, y)| *p + DVec2::new(x, y)));
            convex_hull(grown.collect())
        })
        .collect()
}

/// The hull of a shape; if it is too loose, the hulls of its two halves along the best line through its corners.
fn split(shape: Shape, splits: u32, out: &mut Vec<Vec<DVec2>>) {
    let Some(outer) = shape.first() else { return };
    let hull = convex_hull(points(outer));
    if hull.len() < 3 {
        return;
    }
    if splits == 0 || area(&hull) <= LOOSE_HULL * shape_area(&shape) {
        out.push(hull);
        return;
    }
    let (lo, hi) = hull.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |a, p| (a.0.min(*p), a.1.max(*p)));
    let half = |axis: usize, at: f64, upper: bool| {
        let (mut a, mut b) = (lo - 1.0, hi + 1.0);
        if upper {
            a[axis] = at
        } else {
            b[axis] = at
        }
        let window = vec![[a.x, a.y], [b.x, a.y], [b.x, b.y], [a.x, b.y]];
        shape.overlay(&window, OverlayRule::Intersect, FillRule::NonZero)
    };
    let loose =
        |shapes: &[Shape]| -> f64 { shapes.iter().filter_map(|s| s.first()).map(|c| area(&convex_hull(points(c)))).sum() };
    let mut lines: Vec<(usize, f64)> = Vec::new();
    for axis in 0..2 {
        let mut at: Vec<f64> = shape.iter().flatten().map(|p| p[axis]).collect();
        at.sort_by(f64::total_cmp);
        at.dedup();
        let step = at.len().div_ceil(12).max(1);
        lines.extend(at.into_iter().step_by(step).filter(|&x| x > lo[axis] && x < hi[axis]).map(|x| (axis, x)));
    }
    let best = lines
        .iter()
        .map(|&(axis, at)| {
            let halves = [half(axis, at, false), half(axis, at, true)];
            (loose(&halves[0]) + loose(&halves[1]), halves)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        Some((total, halves)) if total < WORTH * area(&hull) => {
            halves.into_iter().flatten().for_each(|s| split(s, splits - 1, out));
        }
        _ => out.push(hull),
    }
}

/// Convex pieces of each label: runs of one column, then neighbouring columns between the same two cuts, joined across the
/// longest edges first while the polygon stays convex (after Hertel, Mehlhorn 1983).
pub fn pieces(complex: &Complex<'_>, labels: &[Option<u32>], cells: usize) -> Vec<Vec<Piece>> {
    let (plan, columns) = (complex.plan, complex.columns);
    /// A column with the lowest and the highest point of its prism.
    type Prism = (u32, f64, f64);
    let mut prisms: BTreeMap<(u32, Cut, Cut), Vec<Prism>> = BTreeMap::new();
    for (t, slices) in columns.slices.iter().enumerate() {
        let label = |k: usize| labels[columns.first_piece[t] as usize + k];
        let mut k = 0;
        while k + 1 < slices.len() {
            let from = k;
            while k + 2 < slices.len() && label(k + 1) == label(from) {
                k += 1;
            }
            if let Some(l) = label(from) {
                let low = slices[from].heights.iter().fold(f64::INFINITY, |a, &b| a.min(b));
                let high = slices[k + 1].heights.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
                prisms.entry((l, slices[from].cut, slices[k + 1].cut)).or_default().push((t as u32, low, high));
            }
            k += 1;
        }
    }
    let mut out: Vec<Vec<Piece>> = vec![Vec::new(); cells];
    for ((label, floor, ceiling), members) in prisms {
        let plane = |cut: Cut| match cut {
            Cut::Bottom => Plane { n: DVec3::Y, d: complex.domain.min.y },
            Cut::Top => Plane { n: DVec3::Y, d: complex.domain.max.y },
            Cut::Level(l) => Plane { n: DVec3::Y, d: complex.levels[l as usize] },
            Cut::Sheet(s) => complex.facets.sheets[s as usize].plane,
        };
        for (polygon, low, high) in convex_unions(plan, &members) {
            let mut planes = vec![plane(floor).flipped(), plane(ceiling)];
            let mut bounds = Aabb::EMPTY;
            let q: Vec<DVec2> = polygon.iter().map(|&i| plan.points[i as usize]).collect();
            for (i, &a) in q.iter().enumerate() {
                bounds = bounds.with(lift(a, low)).with(lift(a, high));
                let b = q[(i + 1) % q.len()];
                let out = -(b - a).perp().normalize();
                // Collinear edges give one plane.
                let known = |p: &Plane| p.n.y == 0.0 && p.n.distance(lift(out, 0.0)) < SAME_NORMAL;
                if !planes.iter().any(known) {
                    planes.push(Plane::through(lift(a, 0.0), lift(out, 0.0)));
                }
            }
            out[label as usize].push(Piece { planes, bounds });
        }
    }
    out
}

/// The six unbounded pieces around a box.
pub fn around(domain: Aabb) -> Vec<Piece> {
    let mut inside_so_far: Vec<Plane> = Vec::new();
    let mut out = Vec::new();
    for axis in [1, 0, 2] {
        for high in [false, true] {
            let mut n = DVec3::ZERO;
            n[axis] = if high { 1.0 } else { -1.0 };
            let rim = Plane { n, d: if high { domain.max[axis] } else { -domain.min[axis] } };
            let mut planes = inside_so_far.clone();
            planes.push(rim.flipped());
            let mut bounds = Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
            for p in &planes {
                for a in 0..3 {
                    if p.n[a] > 0.5 {
                        bounds.max[a] = p.d;
                    } else if p.n[a] < -0.5 {
                        bounds.min[a] = -p.d;
                    }
                }
            }
            out.push(Piece { planes, bounds });
            inside_so_far.push(rim);
        }
    }
    out
}

/// Convex unions of triangles, as corner lists, with the lowest and highest point of their prisms.
fn convex_unions(plan: &Plan, members: &[(u32, f64, f64)]) -> Vec<(Vec<u32>, f64, f64)> {
    let mut polygons: Vec<Option<(Vec<u32>, f64, f64)>> =
        members.iter().map(|&(t, low, high)| Some((plan.triangles[t as usize].to_vec(), low, high))).collect();
    let place: HashMap<u32, usize> = members.iter().enumerate().map(|(i, m)| (m.0, i)).collect();
    let mut owner: Vec<usize> = (0..members.len()).collect();
    fn find(owner: &mut [usize], mut i: usize) -> usize {
        while owner[i] != i {
            owner[i] = owner[owner[i]];
            i = owner[i];
        }
        i
    }
    let mut edges: Vec<(f64, usize, usize, u32, u32)> = Vec::new();
    for (i, &(t, ..)) in members.iter().enumerate() {
        for e in 0..3 {
            if let Some(&j) = plan.neighbours[t as usize][e].and_then(|n| place.get(&n))
                && i < j
            {
                let (a, b) = (plan.triangles[t as usize][e], plan.triangles[t as usize][(e + 1) % 3]);
                edges.push((plan.points[a as usize].distance(plan.points[b as usize]), i, j, a, b));
            }
        }
    }
    edges.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    for (_, i, j, a, b) in edges {
        let (i, j) = (find(&mut owner, i), find(&mut owner, j));
        if i == j {
            continue;
        }
        let (Some(p), Some(q)) = (&polygons[i], &polygons[j]) else {
            continue;
        };
        if let Some(merged) = join(plan, &p.0, &q.0, a, b) {
            let (low, high) = (p.1.min(q.1), p.2.max(q.2));
            polygons[i] = Some((merged, low, high));
            polygons[j] = None;
            owner[j] = i;
        }
    }
    polygons.into_iter().flatten().collect()
}

/// Two polygons joined across their edge `a`-`b`, if the result is convex.
fn join(plan: &Plan, p: &[u32], q: &[u32], a: u32, b: u32) -> Option<Vec<u32>> {
    let from = |ring: &[u32], start: u32| -> Option<Vec<u32>> {
        let at = ring.iter().position(|&v| v == start)?;
        Some(ring[at..].iter().chain(&ring[..at]).copied().collect())
    };
    // p: b ... a, q: a ... b (both counter-clockwise, without the shared edge).
    let mut ring = from(p, b)?;
    let other = from(q, a)?;
    if *ring.last()? != a || *other.last()? != b {
        return None;
    }
    ring.extend(&other[1..other.len() - 1]);
    // If they share more than one edge, degenerate spikes are removed.
    while ring.len() > 3 {
        let n = ring.len();
        let Some(i) = (0..n).find(|&i| ring[i] == ring[(i + 2) % n]) else {
            break;
        };
        let (x, y) = ((i + 1) % n, (i + 2) % n);
        ring.remove(x.max(y));
        ring.remove(x.min(y));
    }
    let coord = |v: u32| {
        let q = plan.points[v as usize];
        robust::Coord { x: q.x, y: q.y }
    };
    let n = ring.len();
    let convex = n >= 3
        && (0..n).all(|i| robust::orient2d(coord(ring[i]), coord(ring[(i + 1) % n]), coord(ring[(i + 2) % n])) >= 0.0);
    let mut seen = ring.clone();
    seen.sort_unstable();
    seen.dedup();
    (convex && seen.len() == n).then_some(ring)
}
