//! Cells and portals in the single precision of a file. A bake works on rounded values, so its proofs hold for the written file, and cells
//! read from a file have the same bits.

use super::{CellGraph, Piece, Portal};
use crate::cells::complex::polygon::convex_hull;
use crate::math::geom::{Aabb, Plane, newell, width};
use crate::math::polyhedron;
use crate::math::tolerance::single_precision;
use crate::scene::Scene;
use glam::{DVec2, DVec3};

/// Largest error of the length of a unit vector rounded to `f32`. Larger: other vectors count as unit normals, and lengths are wrong.
/// Smaller: normals from a file are scaled, and distances are wrong by `d` times that.
pub(in crate::cells) const SINGLE_UNIT: f64 = f32::EPSILON as f64;

/// An `f32` is the rounded value of any number within this share of the step to the next. Larger: numbers half way round to the next.
/// Smaller: there may be no vector of length 1 that near.
const HALF_WAY: f64 = 0.4999;

/// A number equals an `f32` within this relative error, the loss in reading a decimal.
pub(in crate::cells) const DECIMAL: f64 = 4.0 * f64::EPSILON;

/// Planes are opposite if the cosine of their normals is below this (0.8 degrees). Larger: flat wedges count as slivers, and get a box.
/// Smaller: slivers grow by metres.
const OPPOSITE: f64 = -0.9999;

impl CellGraph {
    /// Rounds planes and corners as a file does, far below the scene's tolerances. Pieces without volume and degenerate portals, which
    /// users may give, stay unchanged.
    pub(crate) fn round(&mut self, scene: &Scene) {
        let (tolerance, bounds) = (scene.tolerance(), scene.bounds());
        let coplanar = tolerance.coplanar;
        let rounding = single_precision(bounds.min.abs().max(bounds.max.abs()).max_element());
        for piece in self.cells.iter_mut().flat_map(|cell| &mut cell.pieces) {
            let planes: Vec<Plane> = piece.planes.iter().map(plane).collect();
            let Some(rounded) = held(planes.clone(), coplanar, rounding) else { continue };
            // Rounded, the nearly parallel planes of a sliver may meet metres farther off, or nowhere.
            let most = piece.bounds.inflated(tolerance.clearance);
            let is_longer = is_sliver(piece, 2.0 * tolerance.clearance)
                && !(most.contains(rounded.bounds.min) && most.contains(rounded.bounds.max));
            let sides = || box_planes(piece.bounds.inflated(coplanar));
            let boxed = || held(planes.iter().copied().chain(sides()).collect(), coplanar, rounding);
            *piece = if is_longer { boxed().unwrap_or(rounded) } else { rounded };
        }
        for portal in &mut self.portals {
            let (plane, rounded) = (plane(&portal.plane), winding(&portal.winding));
            let reach = rounded.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
            if width(&rounded) > single_precision(reach) {
                let winding = convex(rounded, plane.n, single_precision(reach));
                *portal = Portal { plane, winding, ..portal.clone() };
            }
        }
        self.closed_holes.iter_mut().for_each(|hole| *hole = winding(hole));
    }
}

/// A piece from planes in a file's precision. A sliver without volume stays a piece, because portals lead through it: its box is then that
/// of the planes moved by `rounding`.
pub(in crate::cells) fn held(planes: Vec<Plane>, coplanar: f64, rounding: f64) -> Option<Piece> {
    if planes.len() > polyhedron::MAX_PLANES {
        return None;
    }
    let bounds = |planes: &[Plane]| polyhedron::bounds(planes, coplanar);
    let grown = || planes.iter().map(|p| Plane { d: p.d + rounding, ..*p }).collect::<Vec<Plane>>();
    let bounds = bounds(&planes).or_else(|| bounds(&grown()))?;
    Some(Piece { planes, bounds })
}

/// True if two opposite planes are at most `thick` apart at the centre of a piece.
fn is_sliver(piece: &Piece, thick: f64) -> bool {
    let middle = piece.bounds.centre();
    let room = |p: &Plane| -p.distance(middle);
    let is_thin = |a: &Plane, b: &Plane| a.n.dot(b.n) < OPPOSITE && room(a) + room(b) <= thick;
    piece.planes.iter().enumerate().any(|(i, a)| piece.planes[i + 1..].iter().any(|b| is_thin(a, b)))
}

/// The planes of the finite sides of a box, in a file's precision.
fn box_planes(bounds: Aabb) -> impl Iterator<Item = Plane> {
    let sides = DVec3::AXES.into_iter().flat_map(move |n| [Plane::through(bounds.max, n), Plane::through(bounds.min, -n)]);
    sides.filter(|side| side.d.is_finite()).map(|side| plane(&side))
}

fn winding(corners: &[DVec3]) -> Vec<DVec3> {
    corners.iter().map(|p| p.as_vec3().as_dvec3()).collect()
}

/// A convex winding about `n`. Rounding may turn an edge of a tenth of a millimetre so far that it cuts off corners metres away. If a
/// corner is farther than `rounding` beyond an edge, the convex hull replaces the winding: a portal may be larger than its opening, and
/// never smaller.
fn convex(corners: Vec<DVec3>, n: DVec3, rounding: f64) -> Vec<DVec3> {
    let local: Vec<DVec3> = corners.iter().map(|p| p - corners[0]).collect();
    let is_beyond = |(a, b): (&DVec3, &DVec3)| {
        let out = (b - a).cross(n).normalize_or_zero();
        local.iter().any(|p| out.dot(p - a) > rounding)
    };
    let mut edges = local.iter().zip(local.iter().cycle().skip(1));
    if newell(&local).dot(n) <= 0.0 || !edges.any(is_beyond) {
        return corners;
    }
    let u = n.any_orthonormal_vector();
    let v = n.cross(u);
    let flat: Vec<DVec2> = local.iter().map(|p| DVec2::new(u.dot(*p), v.dot(*p))).collect();
    let hull = convex_hull(flat.clone()).into_iter().filter_map(|q| flat.iter().position(|p| *p == q));
    let mut kept: Vec<usize> = hull.collect();
    let first = (0..kept.len()).min_by_key(|&i| kept[i]).unwrap_or(0);
    kept.rotate_left(first);
    kept.into_iter().map(|i| corners[i]).collect()
}

fn plane(plane: &Plane) -> Plane {
    Plane { n: unit(plane.n.as_vec3().as_dvec3()), d: f64::from(plane.d as f32) }
}

/// A unit vector that `f32` rounds to `held`. Flow rejects planes whose normals are not unit vectors, and a baked file must be read back
/// with the same bits. It is scaled, but no component by more than `f32` rounds it.
pub(in crate::cells) fn unit(held: DVec3) -> DVec3 {
    if held.length_squared() == 1.0 {
        return held;
    }
    let towards = |next: fn(f32) -> f32| held + HALF_WAY * (held.map(|x| f64::from(next(x as f32))) - held);
    let (low, high) = (towards(f32::next_down), towards(f32::next_up));
    let scaled = |by: f64| (held * by).clamp(low, high);
    let (mut short, mut long) = (1.0 - 2.0 * SINGLE_UNIT, 1.0 + 2.0 * SINGLE_UNIT);
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (short + long);
        if scaled(middle).length() < 1.0 { short = middle } else { long = middle }
    }
    scaled(long)
}

/// The `f32` that became `x` when it was moved by `by`; `x - by` if there is none. `size`: the largest summand.
pub(in crate::cells) fn moved_back(x: f64, by: f64, size: f64) -> f64 {
    let local = x - by;
    let held = f64::from(local as f32);
    if (local - held).abs() <= DECIMAL * size { held } else { local }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CellId;
    use crate::cells::{Cell, Portal, PortalKind, PortalState};

    /// Two boxes with a portal in an inclined plane.
    fn graph() -> CellGraph {
        let n = DVec3::new(0.6, 0.48, 0.64);
        let plane = Plane { n, d: 0.1 };
        let cuboid = |plane: Plane| {
            let sides = DVec3::AXES.into_iter().flat_map(|n| [Plane { n, d: 1.1 }, Plane { n: -n, d: 1.3 }]);
            Piece::new(sides.chain([plane]).collect(), 1e-6).expect("a box that is cut")
        };
        let cell = |name: &str, plane: Plane| Cell { name: name.into(), pieces: vec![cuboid(plane)], ..Cell::default() };
        let [u, v] = [n.any_orthonormal_vector(), n.cross(n.any_orthonormal_vector())];
        let winding = [(0.1, 0.1), (0.3, 0.1), (0.2, 0.4)].map(|(x, y)| n * 0.1 + u * x + v * y).to_vec();
        let (kind, state) = (PortalKind::Opening, PortalState::of_kind(PortalKind::Opening));
        let portal = Portal { cells: [CellId(0), CellId(1)], plane, winding, kind, state, source: None };
        CellGraph::given(vec![cell("below", plane), cell("above", plane.flipped())], vec![portal])
    }

    #[test]
    fn what_is_rounded_is_what_a_file_holds_and_stays() {
        let (scene, before) = (testing_scene(), graph());
        let mut once = before.clone();
        once.round(&scene);
        assert_ne!(once, before);
        for (a, b) in once.portals[0].winding.iter().zip(&before.portals[0].winding) {
            assert_eq!(a.as_vec3(), b.as_vec3(), "the file is the same");
            assert_eq!(a.as_vec3().as_dvec3(), *a, "nothing is lost in it");
        }
        let planes = |graph: &CellGraph| graph.cells.iter().flat_map(|c| c.pieces[0].planes.clone()).collect::<Vec<_>>();
        for (a, b) in planes(&once).into_iter().zip(planes(&before)) {
            assert_eq!((a.n.as_vec3(), a.d as f32), (b.n.as_vec3(), b.d as f32), "the file is the same");
            assert!((a.n.length() - 1.0).abs() < 1e-15 && f64::from(a.d as f32) == a.d);
        }
        let mut twice = once.clone();
        twice.round(&scene);
        assert_eq!(twice, once);
    }

    /// A wedge 12 m long and 10 micrometres thick: after rounding, its sides meet elsewhere.
    #[test]
    fn a_sliver_reaches_no_farther_when_it_is_rounded() {
        let corner = |x: f64, z: f64| DVec3::new(100.0 + x, 0.0, 300.0 + z);
        let ends = [corner(0.0, 0.0), corner(12.0, 4.0), corner(6.0, 2.0 + 1e-5)];
        let side = |a: DVec3, b: DVec3| Plane::through(a, (b - a).cross(DVec3::Y).normalize());
        let inward = |p: Plane| if p.distance(ends.iter().sum::<DVec3>() / 3.0) < 0.0 { p } else { p.flipped() };
        let sides = (0..3).map(|i| inward(side(ends[i], ends[(i + 1) % 3])));
        let level = [Plane { n: DVec3::Y, d: 3.0 }, Plane { n: -DVec3::Y, d: 0.0 }];
        let bounds = Aabb::of(ends.into_iter().flat_map(|p| [p, p + DVec3::Y * 3.0]));
        let planes: Vec<Plane> = sides.chain(level).collect();
        let scene = testing_scene();
        let clearance = scene.tolerance().clearance;
        let within = bounds.inflated(2.0 * clearance);
        let loose = held(planes.iter().map(plane).collect(), scene.tolerance().coplanar, 1e-4).expect("a sliver");
        assert!(
            !within.contains(loose.bounds.min) || !within.contains(loose.bounds.max),
            "rounding moves nothing: {loose:?}"
        );
        let cell = Cell { pieces: vec![Piece { planes, bounds }], ..Cell::default() };
        let mut graph = CellGraph::given(vec![cell], Vec::new());
        graph.round(&scene);
        let once = graph.cells[0].pieces[0].clone();
        assert!(within.contains(once.bounds.min) && within.contains(once.bounds.max), "{once:?}");
        assert!(once.planes.iter().all(|p| f64::from(p.d as f32) == p.d));
        graph.round(&scene);
        assert_eq!(graph.cells[0].pieces[0].planes, once.planes);
    }

    #[test]
    fn a_portal_that_single_precision_would_close_stays_open() {
        let mut graph = graph();
        let wall = DVec3::new(1000.0, 0.1, 0.1);
        graph.portals[0].winding = [DVec3::ZERO, DVec3::Y * 2.0, DVec3::new(1e-6, 2.0, 0.0)].map(|p| p + wall).to_vec();
        let before = graph.portals[0].clone();
        graph.round(&testing_scene());
        assert_eq!(graph.portals[0], before);
    }

    /// A side of 79 m ends in an edge of 13 mm along it. Rounded, that edge points 40 mm past the side's other end.
    #[test]
    fn a_short_edge_that_rounding_turns_cuts_nothing_off() {
        let mut graph = graph();
        let portal = &mut graph.portals[0];
        let (n, at) = (portal.plane.n, portal.plane.n * 170.0);
        let u = n.any_orthonormal_vector();
        let v = n.cross(u);
        let corners = [(0.0, 0.0), (40.0, 0.0), (40.0, 79.0), (40.0, 79.013), (0.0, 79.013)];
        portal.plane = Plane::through(at, n);
        portal.winding = corners.map(|(x, y)| at + u * x + v * y).to_vec();
        let exact = portal.winding.clone();
        let beyond = |portal: &Portal| {
            let edges = portal.winding.iter().zip(portal.winding.iter().cycle().skip(1));
            let out = |(a, b): (&DVec3, &DVec3)| Plane::through(*a, (b - a).cross(portal.plane.n).normalize());
            let farthest = |edge: Plane| portal.winding.iter().map(|p| edge.distance(*p)).fold(0.0, f64::max);
            edges.map(out).map(farthest).fold(0.0, f64::max)
        };
        let rounding = single_precision(200.0);
        let bent = Portal { winding: winding(&exact), ..graph.portals[0].clone() };
        assert!(beyond(&bent) > 10.0 * rounding, "rounding turns no edge: {}", beyond(&bent));
        let scene = testing_scene();
        graph.round(&scene);
        let once = graph.portals[0].clone();
        assert!(beyond(&once) <= rounding, "{}", beyond(&once));
        assert!(once.winding.iter().all(|p| bent.winding.contains(p)), "{once:?}");
        let edges: Vec<Plane> = once
            .winding
            .iter()
            .zip(once.winding.iter().cycle().skip(1))
            .map(|(a, b)| Plane::through(*a, (b - a).cross(n).normalize()))
            .collect();
        for p in &exact {
            assert!(edges.iter().all(|edge| edge.distance(*p) <= rounding), "{p} is cut off");
        }
        graph.round(&scene);
        assert_eq!(graph.portals[0], once);
    }

    #[test]
    fn what_was_moved_comes_back_with_the_same_bits() {
        for by in [0.0, 0.1, -1234.567, 1e6 / 3.0] {
            for x in [0.1f32, -77.77, 1e-3, 640.125] {
                let held = f64::from(x);
                assert_eq!(moved_back(held + by, by, (held + by).abs().max(by.abs())), held);
            }
        }
        // Written to the millimetre: not an f32.
        assert_eq!(moved_back(1000.1, 1000.0, 1000.1), 1000.1 - 1000.0);
    }

    fn testing_scene() -> Scene {
        let mesh = crate::scene::Mesh {
            node: "wall".into(),
            role: crate::scene::Role::Structure,
            opaque: true,
            positions: vec![DVec3::NEG_ONE, DVec3::ONE, DVec3::X],
            triangles: vec![[0, 1, 2]],
        };
        let mut builder = crate::scene::SceneBuilder::new(&Default::default(), Default::default());
        builder.add(mesh).expect("one triangle");
        builder.finish("one triangle").expect("a scene")
    }
}
