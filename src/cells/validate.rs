//! Validation of a cell graph: ids, windings, pieces, and soundness.

use super::{CellGraph, Locator, Piece, Portal, Stretch};
use crate::cells::complex::polygon::convex_hull;
use crate::math::box_tree::BoxTree;
use crate::math::geom::{Aabb, Plane, area, clip, middle, newell};
use crate::math::parallel;
use crate::math::polyhedron;
use crate::math::random::SplitMix;
use crate::scene::Scene;
use crate::scene::rays::RayScene;
use crate::{CellId, PortalId};
use glam::{DVec2, DVec3};
use std::fmt;

/// A fault of a graph.
#[derive(Clone, PartialEq, Debug)]
pub enum Fault {
    /// A portal names a missing cell, or the same cell twice.
    Cells(PortalId),
    /// A winding has fewer than three corners, or numbers that aren't finite.
    Corners(PortalId),
    /// A corner is this far from the portal's plane, metres.
    NotPlanar(PortalId, f64),
    /// A winding isn't convex, or runs clockwise about its normal.
    NotConvex(PortalId),
    /// No point of the portal has its two cells on its two sides.
    NotBetween(PortalId),
    /// A cell doesn't list its portals.
    NotLinked(CellId),
    /// Two pieces overlap at a point.
    Overlap([CellId; 2], DVec3),
    /// An unobstructed segment leaves a cell without a portal to the next cell (`None`: no cell).
    Leak {
        /// From which cell to which.
        cells: [Option<CellId>; 2],
        /// Where.
        at: DVec3,
        /// The segment.
        segment: [DVec3; 2],
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |c: &Option<CellId>| c.map_or("no cell".to_owned(), |c| format!("cell {c}"));
        match self {
            Self::Cells(p) => write!(f, "portal {p} does not join two cells"),
            Self::Corners(p) => write!(f, "portal {p} has too few corners, or one that is not a number"),
            Self::NotPlanar(p, d) => write!(f, "portal {p}: a corner is {d:.2e} m off its plane"),
            Self::NotConvex(p) => write!(f, "portal {p} is not convex and counter-clockwise about its normal"),
            Self::NotBetween(p) => write!(f, "portal {p} does not lie between its two cells"),
            Self::NotLinked(c) => write!(f, "cell {c} does not list its portals"),
            Self::Overlap([a, b], p) => write!(f, "cells {a} and {b} both contain {p}"),
            Self::Leak { cells, at, .. } => write!(f, "leak from {} to {} at {at}", name(&cells[0]), name(&cells[1])),
        }
    }
}

/// All faults that need no triangles; `tolerance` in metres.
pub fn structure(graph: &CellGraph, tolerance: f64) -> Vec<Fault> {
    let mut faults = Vec::new();
    let mut linked = graph.clone();
    let mut sound = vec![false; graph.portals.len()];
    let whole = |c: CellId| c.index() < graph.cells.len();
    for (i, portal) in graph.portals.iter().enumerate() {
        let id = PortalId(i as u32);
        if !portal.cells.iter().all(|&c| whole(c)) || portal.cells[0] == portal.cells[1] {
            faults.push(Fault::Cells(id));
            return faults;
        }
        let w = &portal.winding;
        if w.len() < 3 || !w.iter().all(|p| p.is_finite()) {
            faults.push(Fault::Corners(id));
            continue;
        }
        let off = w.iter().map(|&p| portal.plane.distance(p).abs()).fold(0.0, f64::max);
        if off > tolerance {
            faults.push(Fault::NotPlanar(id, off));
        }
        let turns = (0..w.len()).all(|i| {
            let (a, b, c) = (w[i], w[(i + 1) % w.len()], w[(i + 2) % w.len()]);
            (b - a).cross(c - b).dot(portal.plane.n) >= -tolerance * (b - a).length().max((c - b).length())
        });
        let relative: Vec<DVec3> = w.iter().map(|&p| p - w[0]).collect();
        if !turns || newell(&relative).dot(portal.plane.n) <= 0.0 {
            faults.push(Fault::NotConvex(id));
        }
        sound[i] = true;
    }
    let pieces = Pieces::new(graph);
    let judged = |i: usize| {
        (sound[i] && !between(&graph.portals[i], &pieces, tolerance)).then_some(Fault::NotBetween(PortalId(i as u32)))
    };
    faults.extend(parallel::flat_map_range(0..graph.portals.len(), judged));
    linked.link();
    let pairs = graph.cells.iter().zip(&linked.cells).enumerate();
    faults.extend(pairs.filter(|(_, (a, b))| a.portals != b.portals).map(|(i, _)| Fault::NotLinked(CellId(i as u32))));
    faults.extend(overlaps(&pieces, tolerance));
    faults
}

/// In debug builds, panics at the first stage with a faulty graph and names up to ten faults; it also follows `segments` segments. Release
/// builds do nothing.
pub(crate) fn stage(name: &str, graph: &CellGraph, scene: &Scene, segments: u64) {
    if cfg!(debug_assertions) {
        let mut faults = structure(graph, scene.tolerance().coplanar.max(1e-9));
        if segments > 0 {
            faults.extend(sealing(graph, &RayScene::with_closed_holes(scene, &graph.closed_holes), segments, 0).leaks);
        }
        let lines: Vec<String> = faults.iter().take(10).map(ToString::to_string).collect();
        assert!(faults.is_empty(), "{} faults after {name}: {}", faults.len(), lines.join("; "));
    }
}

/// Every piece of a graph, by cell.
struct Pieces<'g> {
    of: Vec<(CellId, &'g Piece)>,
    /// A box around all finite corners, and each piece's box clipped to it.
    region: Aabb,
    boxes: Vec<Aabb>,
    tree: BoxTree,
}

impl<'g> Pieces<'g> {
    fn new(graph: &'g CellGraph) -> Self {
        let cells = (0u32..).map(CellId).zip(&graph.cells);
        let of: Vec<(CellId, &Piece)> = cells.flat_map(|(c, cell)| cell.pieces.iter().map(move |p| (c, p))).collect();
        let finite = |p: DVec3| p.map(|x| if x.is_finite() { x } else { 0.0 });
        let corners = of.iter().flat_map(|(_, p)| [finite(p.bounds.min), finite(p.bounds.max)]);
        let windings = graph.portals.iter().flat_map(|p| &p.winding).copied().filter(|p| p.is_finite());
        let region = Aabb::of(corners.chain(windings)).inflated(1.0);
        let cut = |b: Aabb| Aabb { min: b.min.max(region.min), max: b.max.min(region.max) };
        let boxes: Vec<Aabb> = of.iter().map(|(_, p)| cut(p.bounds)).collect();
        let tree = BoxTree::over(&boxes);
        Self { of, region, boxes, tree }
    }

    /// Pieces whose box intersects `bounds`, ascending.
    fn near(&self, bounds: &Aabb) -> Vec<usize> {
        let mut near = Vec::new();
        self.tree.in_box(bounds, &mut |i| near.push(i as usize));
        near.sort_unstable();
        near
    }
}

/// Pairs of pieces with a common point deeper in both than twice the tolerance; one fault a pair, at most [`MOST_LEAKS`].
fn overlaps(all: &Pieces<'_>, tolerance: f64) -> Vec<Fault> {
    let depth = 2.0 * tolerance;
    let (pieces, region) = (&all.of, &all.region);
    let corners: Vec<Vec<DVec3>> =
        parallel::map(pieces, |(_, p)| polyhedron::faces(&p.planes, region).into_iter().flatten().collect());
    // Most neighbours are separated by a face of one of them.
    let apart =
        |a: usize, b: usize| pieces[a].1.planes.iter().any(|plane| corners[b].iter().all(|&p| plane.distance(p) >= -depth));
    let shared = |a: usize, b: usize| {
        let deep = pieces[a].1.planes.iter().chain(&pieces[b].1.planes).map(|p| Plane { d: p.d - depth, ..*p });
        let deep: Vec<Plane> = deep.collect();
        let corners: Vec<DVec3> = polyhedron::faces(&deep, region).into_iter().flatten().collect();
        let at = middle(&corners);
        (corners.len() > 3 && deep.iter().all(|p| p.distance(at) < 0.5 * depth)).then_some(at)
    };
    let of_piece = |a: usize| {
        let near = all.near(&all.boxes[a]).into_iter();
        let pairs = near.filter(|&b| b > a && !apart(a, b) && !apart(b, a));
        pairs.filter_map(|b| Some(Fault::Overlap([pieces[a].0, pieces[b].0], shared(a, b)?))).collect::<Vec<_>>()
    };
    let mut found: Vec<Fault> = parallel::flat_map_range(0..pieces.len(), of_piece);
    found.truncate(MOST_LEAKS);
    found
}

/// True if at some place, to within the tolerance, a portal has a piece of one cell behind it and a piece of the other in front. A portal
/// may be larger than the opening, as in slivers, where coverage is compensated. So the common area does not matter; the segment tests also
/// enlarge portals by the tolerance.
///
/// Each piece is clipped to the prism over the winding, within the tolerance of its plane. The piece is on the side with more of that part,
/// however thin, and covers the projection of that part.
fn between(portal: &Portal, pieces: &Pieces<'_>, tolerance: f64) -> bool {
    let (w, plane) = (&portal.winding, portal.plane);
    let (u, v) = plane.n.any_orthonormal_pair();
    let edges = (0..w.len()).map(|i| (w[i], w[(i + 1) % w.len()] - w[i]));
    let rim = edges.filter_map(|(a, e)| Some(Plane::through(a, e.cross(plane.n).try_normalize()?)));
    let around = rim.chain([plane, plane.flipped()]).map(|p| Plane { d: p.d + tolerance, ..p });
    let around: Vec<Plane> = around.collect();
    let bounds = Aabb::of(w.iter().copied()).inflated(2.0 * tolerance);
    // So that two shadows within the tolerance of each other meet.
    let half = 0.5 * tolerance;
    let grown = [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(x, y)| DVec2::new(x, y));
    let mut shadows: [Vec<Vec<DVec2>>; 2] = Default::default();
    for (cell, piece) in pieces.near(&bounds).into_iter().map(|i| pieces.of[i]).filter(|p| portal.cells.contains(&p.0)) {
        let planes: Vec<Plane> = piece.planes.iter().chain(&around).copied().collect();
        let corners: Vec<DVec3> = polyhedron::faces(&planes, &bounds).into_iter().flatten().collect();
        let (behind, before) = corners.iter().fold((0.0f64, 0.0f64), |(b, f), &p| {
            let d = plane.distance(p);
            (b.max(-d), f.max(d))
        });
        let side = usize::from(cell == portal.cells[1]);
        // Equal parts on both sides: the portal cuts the piece in two.
        let [here, there] = if side == 0 { [behind, before] } else { [before, behind] };
        if !corners.is_empty() && here >= (1.0 - 1e-6) * there {
            let flat = corners.iter().map(|&p| DVec2::new(u.dot(p - w[0]), v.dot(p - w[0])));
            shadows[side].push(convex_hull(flat.flat_map(|q| grown.map(|by| q + by)).collect()));
        }
    }
    let [a, b] = &shadows;
    a.iter().any(|a| b.iter().any(|b| shared_area(a, b) > 0.0))
}

/// For each portal, whether it lies between its two cells as given, and whether it would if reversed; `tolerance` in metres, for each.
pub(super) fn lie_between(graph: &CellGraph, tolerance: impl Fn(&Portal) -> f64 + Sync) -> Vec<[bool; 2]> {
    let pieces = Pieces::new(graph);
    parallel::map(&graph.portals, |portal| {
        let turned = portal.clone().turned();
        [portal, &turned].map(|portal| between(portal, &pieces, tolerance(portal)))
    })
}

/// Area of the intersection of two convex polygons, both counter-clockwise.
fn shared_area(a: &[DVec2], b: &[DVec2]) -> f64 {
    let mut left: Vec<DVec3> = a.iter().map(|p| p.extend(0.0)).collect();
    for (i, &from) in b.iter().enumerate() {
        let out = -(b[(i + 1) % b.len()] - from).perp().normalize_or_zero();
        left = clip(&left, &Plane { n: out.extend(0.0), d: out.dot(from) }, 0.0);
    }
    area(&left)
}

/// The result of [`sealing`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Sealing {
    /// Number of unobstructed segments.
    pub segments: u64,
    /// Segments that left a cell without a portal, ordered by number; at most [`MOST_LEAKS`].
    pub leaks: Vec<Fault>,
}

/// Most leaks in a list.
pub const MOST_LEAKS: usize = 100;

/// Follows random unobstructed segments from random points of cells: they may leave a cell through portals only. A leak counts only if the
/// segment keeps the scene's clearance there. The same seed gives the same result.
pub fn sealing(graph: &CellGraph, rays: &RayScene<'_>, segments: u64, seed: u64) -> Sealing {
    let locator = Locator::new(graph);
    let tolerance = rays.tolerance();
    let far = rays.bounds().diagonal() * 1.5;
    let around = rays.bounds().inflated(0.03 * rays.bounds().diagonal());
    let boxes = boxes_within(graph, around);
    if boxes.is_empty() {
        return Sealing::default();
    }
    let volumes: Vec<f64> = (boxes.iter())
        .scan(0.0, |sum, (.., b)| {
            *sum += b.size().element_product();
            Some(*sum)
        })
        .collect();
    let pairs = portal_pairs(graph);
    const CHUNK: u64 = 4096;
    let follow = |chunk: usize| {
        let chunk = chunk as u64;
        let mut random = SplitMix::new(seed ^ chunk.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut out = Sealing::default();
        for _ in 0..CHUNK.min(segments - chunk * CHUNK) {
            // Half are uniform over pieces, so that small ones get their share, and half are uniform over volume, because points of small
            // pieces are mostly too near a wall.
            let chosen = if random.bits().is_multiple_of(2) {
                (random.bits() % boxes.len() as u64) as usize
            } else {
                let at = random.unit() * volumes[volumes.len() - 1];
                volumes.partition_point(|&v| v < at).min(boxes.len() - 1)
            };
            let (cell, piece, b) = boxes[chosen];
            let from = b.min + b.size() * DVec3::new(random.unit(), random.unit(), random.unit());
            if !graph.cells[cell.index()].pieces[piece].contains(from, -tolerance.clearance) {
                continue;
            }
            let direction = direction(&mut random);
            let reach = rays.first_opaque(from, direction, far).map_or(far, |hit| hit.t - tolerance.clearance);
            if reach <= tolerance.clearance {
                continue;
            }
            let to = from + direction * reach;
            out.segments += 1;
            if let Some(leak) = leak(graph, &locator, &pairs, rays, from, to) {
                out.leaks.push(leak);
            }
        }
        out
    };
    let chunks: Vec<Sealing> = parallel::map_range(0..segments.div_ceil(CHUNK) as usize, follow);
    let mut all = Sealing::default();
    for c in chunks {
        all.segments += c.segments;
        all.leaks.extend(c.leaks);
    }
    all.leaks.truncate(MOST_LEAKS);
    all
}

/// The boxes of all pieces, as far as they are in another, with the cell and the number of each.
fn boxes_within(graph: &CellGraph, around: Aabb) -> Vec<(CellId, usize, Aabb)> {
    (0u32..)
        .zip(&graph.cells)
        .flat_map(|(c, cell)| cell.pieces.iter().enumerate().map(move |(i, p)| (CellId(c), i, p.bounds)))
        .map(|(c, i, b)| (c, i, Aabb { min: b.min.max(around.min), max: b.max.min(around.max) }))
        .filter(|(.., b)| !b.is_empty())
        .collect()
}

type Pairs = std::collections::HashMap<(CellId, CellId), Vec<PortalId>>;

fn portal_pairs(graph: &CellGraph) -> Pairs {
    let mut pairs = Pairs::new();
    for (i, p) in graph.portals.iter().enumerate() {
        for (a, b) in [(p.cells[0], p.cells[1]), (p.cells[1], p.cells[0])] {
            pairs.entry((a, b)).or_default().push(PortalId(i as u32));
        }
    }
    pairs
}

/// The first place where the segment changes cell without a portal.
fn leak(
    graph: &CellGraph,
    locator: &Locator<'_>,
    pairs: &Pairs,
    rays: &RayScene<'_>,
    from: DVec3,
    to: DVec3,
) -> Option<Fault> {
    let tolerance = rays.tolerance();
    let length = from.distance(to);
    let slack = tolerance.clearance / length;
    let stretches = locator.along(from, to, 0.0);
    let mut here: Stretch = *stretches.first()?;
    let really = |at: f64| {
        // Only the clearance near the crossing matters.
        let (a, b) = (from.lerp(to, (at - 20.0 * slack).max(0.0)), from.lerp(to, (at + 20.0 * slack).min(1.0)));
        rays.is_clear(a, b, tolerance.clearance, None)
    };
    for next in stretches.iter().skip(1) {
        if next.span[1] <= here.span[1] {
            continue;
        }
        let at = here.span[1];
        let point = from.lerp(to, at);
        if next.span[0] > at + 2.0 * slack {
            let fault = Fault::Leak { cells: [Some(here.cell), None], at: point, segment: [from, to] };
            return really(at).then_some(fault);
        }
        if next.cell != here.cell {
            let through = pairs.get(&(here.cell, next.cell)).is_some_and(|list| {
                list.iter().any(|p| {
                    passes(&graph.portals[p.index()].winding, graph.portals[p.index()].plane, point, graph.smallest_hole)
                })
            });
            if !through && next.span[1] - next.span[0] > 2.0 * slack && really(at) {
                return Some(Fault::Leak { cells: [Some(here.cell), Some(next.cell)], at: point, segment: [from, to] });
            }
        }
        here = *next;
    }
    if here.span[1] < 1.0 - 2.0 * slack && really(here.span[1]) {
        let at = from.lerp(to, here.span[1]);
        return Some(Fault::Leak { cells: [Some(here.cell), None], at, segment: [from, to] });
    }
    None
}

/// True if `p` is on the winding, within `tolerance` metres.
fn passes(winding: &[DVec3], plane: Plane, p: DVec3, tolerance: f64) -> bool {
    plane.distance(p).abs() <= tolerance
        && (0..winding.len()).all(|i| {
            let (a, b) = (winding[i], winding[(i + 1) % winding.len()]);
            let inward = plane.n.cross(b - a).normalize_or_zero();
            inward.dot(p - a) >= -tolerance
        })
}

/// Uniform on the unit sphere, by angles.
fn direction(random: &mut SplitMix) -> DVec3 {
    let (z, phi) = (2.0 * random.unit() - 1.0, std::f64::consts::TAU * random.unit());
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * phi.cos(), z, r * phi.sin())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::{Cell, PortalKind, PortalState};

    fn block(min: DVec3, max: DVec3) -> Piece {
        let planes = DVec3::AXES.map(|n| [Plane { n, d: n.dot(max) }, Plane { n: -n, d: -n.dot(min) }]);
        Piece { planes: planes.into_iter().flatten().collect(), bounds: Aabb { min, max } }
    }

    const TOLERANCE: f64 = 1e-6;

    fn graph(pieces: Vec<Vec<Piece>>, portals: Vec<Portal>) -> CellGraph {
        let cells = pieces.into_iter().map(|pieces| Cell { pieces, ..Cell::default() }).collect();
        CellGraph::given(cells, portals)
    }

    fn faults(pieces: Vec<Vec<Piece>>) -> Vec<Fault> {
        structure(&graph(pieces, Vec::new()), TOLERANCE)
    }

    /// From cell 0 to cell 1, around `corners`.
    fn portal(corners: &[DVec3]) -> Portal {
        let n = newell(&corners.iter().map(|&p| p - corners[0]).collect::<Vec<_>>()).normalize();
        let (plane, kind) = (Plane::through(corners[0], n), PortalKind::Opening);
        let (cells, state) = ([CellId(0), CellId(1)], PortalState::of_kind(kind));
        Portal { cells, plane, winding: corners.to_vec(), kind, state, source: None }
    }

    /// A door of 1 x 2 m, moved by `by`, between two rooms of 4 x 3 x 4 m that touch at `x = 0`.
    fn door(by: DVec3) -> Vec<Fault> {
        let room = |x: f64| block(DVec3::new(x, 0.0, 0.0), DVec3::new(x + 4.0, 3.0, 4.0));
        let corners = [(1.0, 1.0), (3.0, 1.0), (3.0, 2.0), (1.0, 2.0)].map(|(y, z)| DVec3::new(0.0, y - 1.0, z) + by);
        structure(&graph(vec![vec![room(-4.0)], vec![room(0.0)]], vec![portal(&corners)]), TOLERANCE)
    }

    #[test]
    fn a_portal_that_does_not_lie_between_its_cells_is_found() {
        let blamed = [Fault::NotBetween(PortalId(0))];
        for x in [0.0, 0.5 * TOLERANCE, -0.5 * TOLERANCE] {
            assert_eq!(door(DVec3::X * x), []);
        }
        for by in [1.1 * TOLERANCE, 10.0 * TOLERANCE, 0.3, 5.0] {
            assert_eq!((&door(DVec3::X * by)[..], &door(DVec3::X * -by)[..]), (&blamed[..], &blamed[..]), "{by} m");
        }
        // Beside the common wall of the rooms; then half over its end, by a sliver, and within the tolerance of it.
        let end = DVec3::Y * 3.0;
        assert_eq!((door(end + DVec3::Y * 2.5 * TOLERANCE), door(DVec3::Z * 4.0)), (blamed.to_vec(), blamed.to_vec()));
        for by in [DVec3::Z * 2.5, end - DVec3::Y * 0.01 * TOLERANCE, end + DVec3::Y * 0.9 * TOLERANCE] {
            assert_eq!(door(by), [], "{by}");
        }
        // The two cells the other way round.
        let rooms = [0.0, -4.0].map(|x| vec![block(DVec3::new(x, 0.0, 0.0), DVec3::new(x + 4.0, 3.0, 4.0))]);
        let corners = [(0.0, 1.0), (2.0, 1.0), (2.0, 2.0), (0.0, 2.0)].map(|(y, z)| DVec3::new(0.0, y, z));
        assert_eq!(structure(&graph(rooms.to_vec(), vec![portal(&corners)]), TOLERANCE), blamed);
    }

    /// Pieces and portals far thinner than the tolerance, as at planes with a shallow angle.
    #[test]
    fn slivers_are_not_blamed() {
        for thin in [0.3, 0.02].map(|t| t * TOLERANCE) {
            // A slice behind the portal, with another cell behind that.
            let slab = |x0: f64, x1: f64| vec![block(DVec3::new(x0, 0.0, 0.0), DVec3::new(x1, 3.0, 4.0))];
            let corners = |z: f64| [(0.0, 1.0), (2.0, 1.0), (2.0, z), (0.0, z)].map(|(y, z)| DVec3::new(0.0, y, z));
            let sliced =
                |z: f64| graph(vec![slab(-thin, 0.0), slab(0.0, 4.0), slab(-4.0, -thin)], vec![portal(&corners(z))]);
            assert_eq!(structure(&sliced(2.0), TOLERANCE), []);
            // A portal as thin as that; its cells and no others.
            assert_eq!(structure(&sliced(1.0 + thin), TOLERANCE), []);
            let mut other = sliced(1.0 + thin);
            other.portals[0].cells = [CellId(1), CellId(0)];
            other.portals[0].plane = other.portals[0].plane.flipped();
            other.portals[0].winding.reverse();
            other.link();
            assert_eq!(structure(&other, TOLERANCE), []);
            // A wedge that ends at the portal.
            let mut wedge = slab(-4.0, 0.0);
            let n = DVec3::new(-1.0, 0.0, -thin).normalize();
            wedge[0].planes.push(Plane::through(DVec3::ZERO, n));
            assert_eq!(structure(&graph(vec![wedge, slab(0.0, 4.0)], vec![portal(&corners(2.0))]), TOLERANCE), []);
        }
    }

    #[test]
    fn pieces_that_hold_one_point_are_found_and_those_that_touch_are_not() {
        let unit = |x: f64, y: f64| block(DVec3::new(x, y, 0.0), DVec3::new(x + 1.0, y + 1.0, 1.0));
        let half = || {
            let planes = vec![Plane { n: -DVec3::X, d: -2.0 }];
            Piece { planes, bounds: Aabb { min: DVec3::NEG_INFINITY.with_x(2.0), max: DVec3::INFINITY } }
        };
        assert_eq!(
            faults(vec![vec![unit(0.0, 0.0), unit(1.0, 0.0)], vec![unit(0.0, 1.0), unit(1.0, 1.0)], vec![half()]]),
            []
        );
        // A corner of one in the other; one within the other; an unbounded one.
        for (piece, cell) in [(unit(0.9, 0.9), 0), (block(DVec3::splat(0.2), DVec3::splat(0.4)), 0), (unit(1.5, 5.0), 1)] {
            let found = faults(vec![vec![unit(0.0, 0.0)], vec![half()], vec![piece.clone()]]);
            let [Fault::Overlap(cells, at)] = found.as_slice() else { panic!("{found:?}") };
            assert_eq!(*cells, [CellId(cell), CellId(2)]);
            assert!(piece.contains(*at, 0.0), "{at}");
        }
        // Wedges with overlapping boxes that only touch along a slanted face.
        let mut wedges = [unit(0.0, 0.0), unit(0.0, 0.0)];
        let slant = Plane { n: DVec3::new(1.0, 1.0, 0.0).normalize(), d: 0.5f64.sqrt() };
        wedges[0].planes.push(slant);
        wedges[1].planes.push(slant.flipped());
        let [a, b] = wedges;
        assert_eq!(faults(vec![vec![a], vec![b]]), []);
    }
}
