//! Repair of holes in the cell graph, which clear segments prove.
//!
//! In a sound graph, a segment with clearance goes from cell to cell through portals only. Each proof of the lower bound is followed
//! through the graph. If it passes between two cells without a portal, or through space in no cell, a portal is added: the common facet of
//! the two pieces, or, across a gap, the facet where the segment left. The portal is the whole facet, because the extent of the hole is
//! unknown and the upper bound may only grow.

use super::facets::facet;
use super::sampling::lines::{self, PortalTree, Span, Start};
use super::sampling::witness::Witnessed;
use crate::cells::{CellGraph, Locator, Portal, PortalKind, PortalState, Stretch};
use crate::math::geom::{self, Aabb, Plane};
use crate::math::parallel;
use crate::math::polyhedron::square;
use crate::scene::Scene;
use crate::types::proof::Repair;
use crate::{CellId, PortalId};
use glam::DVec3;
use std::collections::BTreeMap;

/// A segment passes a portal if it comes within this distance of the portal's plane, in clearances.
const OFF_PLANE: f64 = 4.0;
/// Largest distance of that point from the change of cells along the segment, in clearances: a grazing line stays near a plane for long.
const BEYOND_RIM: f64 = 64.0;

/// Planes are parallel if the cosine of their normals is at least this (0.08 degrees).
const SAME_PLANE: f64 = 0.999_999;

/// A hole: a passage without a portal.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Hole {
    from: Side,
    to: Side,
    /// False if there is a gap between the pieces.
    touching: bool,
    at: DVec3,
    segment: [DVec3; 2],
}

/// A piece of a cell.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Side {
    cell: CellId,
    piece: usize,
}

/// Adds missing portals according to proofs from number `known` on (witnesses, then sights).
pub(super) fn mend(scene: &Scene, graph: &mut CellGraph, lower: &Witnessed, known: [usize; 2]) -> Vec<Repair> {
    let clearance = scene.tolerance().clearance;
    let witnesses = lower.witnesses.iter().zip(&lower.ends).skip(known[0]).map(|(w, &end)| (w.cell, [w.from, end]));
    let proofs: Vec<(CellId, [DVec3; 2])> =
        witnesses.chain(lower.sights.iter().skip(known[1]).map(|s| (s.cells[0], s.segment))).collect();
    let follower = Follower { graph, locator: Locator::new(graph), portals: PortalTree::new(graph), eps: clearance };
    let holes: Vec<Hole> = parallel::flat_map(&proofs, |&(cell, segment)| follower.follow(cell, segment));
    // One portal for each pair of pieces, for both directions of segments; the first segment is reported.
    let mut distinct: BTreeMap<(Side, Side), Hole> = BTreeMap::new();
    for hole in holes {
        distinct.entry((hole.from.min(hole.to), hole.from.max(hole.to))).or_insert(hole);
    }
    let within = scene.bounds().inflated(0.25 * scene.bounds().diagonal() + 1.0);
    let mut repairs = Vec::new();
    for hole in distinct.into_values() {
        graph.portals.push(passage(graph, &hole, within, clearance));
        repairs.push(Repair { cells: [hole.from.cell, hole.to.cell], at: hole.at, segment: hole.segment });
    }
    if !repairs.is_empty() {
        graph.link();
    }
    repairs
}

/// Follows segments through a graph.
struct Follower<'g> {
    graph: &'g CellGraph,
    locator: Locator<'g>,
    portals: PortalTree<'g>,
    /// Tolerance of passing a portal, metres.
    eps: f64,
}

impl Follower<'_> {
    /// The holes that a clear segment from `cell` passes.
    fn follow(&self, cell: CellId, [a, b]: [DVec3; 2]) -> Vec<Hole> {
        let length = a.distance(b);
        let Some(direction) = (b - a).try_normalize() else { return Vec::new() };
        // The fast path, nearly always sufficient: portals lead to the cell of its end.
        let (mut crossings, mut spans) = (Vec::new(), Vec::<Span>::new());
        self.portals.chain(Start { at: a, direction, cell, skip: None }, length, &mut crossings, &mut spans);
        if spans.last().is_some_and(|s| self.locator.holds(s.cell, b)) {
            return Vec::new();
        }
        // A proof may start on a portal.
        let back = 4.0 * self.eps;
        self.portals.crossings(a - direction * back, direction, length + 2.0 * back, self.eps, &mut crossings);
        crossings.iter_mut().for_each(|c| c.0 -= back);
        self.walk(cell, [a, b], &crossings)
    }

    /// The slow path: from piece to piece.
    fn walk(&self, cell: CellId, segment: [DVec3; 2], crossings: &[(f64, PortalId)]) -> Vec<Hole> {
        let length = segment[0].distance(segment[1]);
        let stretches = self.locator.along(segment[0], segment[1], 1e-9 * (1.0 + length));
        let Some(first) = stretches.iter().find(|s| s.cell == cell) else { return Vec::new() };
        let (mut holes, mut here) = (Vec::new(), *first);
        // The last stretch longer than a sliver: a segment passes through a sliver from the piece before it.
        let mut last = here;
        let slack = self.eps / length;
        let direction = (segment[1] - segment[0]) / length;
        loop {
            let t = here.span[1];
            // Continue in the same cell if possible; else in any piece; else across the gap.
            let onward = |s: &&Stretch| s.span[0] <= t + slack && s.span[1] > t;
            let farthest = |a: &&Stretch, b: &&Stretch| a.span[1].total_cmp(&b.span[1]);
            let next = stretches.iter().filter(onward).filter(|s| s.cell == here.cell).max_by(farthest);
            let passed = |from: &Stretch, s: &Stretch| {
                self.passed([from.cell, s.cell], [from.span[1] * length, s.span[0] * length], direction, crossings)
            };
            let through = |s: &&Stretch| passed(&here, s);
            let next = next
                .or_else(|| stretches.iter().filter(onward).find(through))
                .or_else(|| stretches.iter().filter(onward).max_by(farthest))
                .or_else(|| stretches.iter().find(|s| s.span[0] > t));
            let Some(&next) = next else { return holes };
            // Less than the clearance beyond a face does not count: rounding may put a proof's end behind a pane of glass.
            let deep = (next.span[1] - t) * length > self.eps;
            let goes_on = last.cell == next.cell || passed(&last, &next);
            if next.cell != here.cell && deep && !through(&&next) && !goes_on {
                let [from, to] = [last, next].map(|s| Side { cell: s.cell, piece: s.piece });
                let t = last.span[1];
                let at = segment[0].lerp(segment[1], t);
                holes.push(Hole { from, to, touching: next.span[0] <= t + slack, at, segment });
            }
            here = next;
            if (here.span[1] - here.span[0]) * length > self.eps {
                last = here;
            }
        }
    }

    /// True if a segment along `direction` passes a portal between two cells within `range`, metres, to within a few clearances of the
    /// portal's plane: rounding separates pieces and portals, and grazing lines amplify that.
    fn passed(&self, [a, b]: [CellId; 2], range: [f64; 2], direction: DVec3, crossings: &[(f64, PortalId)]) -> bool {
        crossings.iter().any(|&(t, portal)| {
            let portal = &self.graph.portals[portal.index()];
            let beyond = (range[0] - t).max(t - range[1]).max(0.0);
            let off = beyond * portal.plane.n.dot(direction).abs();
            (portal.cells == [a, b] || portal.cells == [b, a])
                && off <= OFF_PLANE * self.eps
                && beyond <= BEYOND_RIM * self.eps
        })
    }
}

/// The portal for a hole.
fn passage(graph: &CellGraph, hole: &Hole, within: Aabb, clearance: f64) -> Portal {
    let direction = (hole.segment[1] - hole.segment[0]).normalize_or(DVec3::X);
    let [from, to] = [hole.from, hole.to].map(|s| &graph.cells[s.cell.index()].pieces[s.piece]);
    // The plane where the segment leaves.
    let leaves = |i: &usize| from.planes[*i].n.dot(direction) > 0.0;
    let nearest = |a: &usize, b: &usize| from.planes[*a].distance(hole.at).total_cmp(&from.planes[*b].distance(hole.at));
    let out = (0..from.planes.len()).filter(leaves).max_by(nearest);
    let mut winding = out.map(|i| facet(from, i, within)).unwrap_or_default();
    let plane = out.map_or(Plane::through(hole.at, direction), |i| from.planes[i]);
    if hole.touching {
        let shared = to.planes.iter().filter(|p| p.n.dot(plane.n).abs() < SAME_PLANE);
        let shared = shared.fold(winding.clone(), |w, p| geom::clip(&w, &Plane { d: p.d + clearance, ..*p }, 0.0));
        let holds = lines::edges(&shared, plane.n).iter().all(|e| e.distance(hole.at) <= 0.0);
        if shared.len() >= 3 && holds {
            winding = shared;
        }
    }
    if winding.len() < 3 {
        winding = square(hole.at, plane.n, 4.0 * clearance);
    }
    let cells = [hole.from.cell, hole.to.cell];
    Portal { cells, plane, winding, kind: PortalKind::Opening, state: PortalState::default(), source: None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::{Cell, Piece};

    /// The clearance, metres.
    const EPS: f64 = 1e-3;

    /// Slabs along x between these places, with their cells; and portals at x.
    fn slabs(places: &[f64], cells: &[u32], portals: &[([u32; 2], f64)]) -> CellGraph {
        let mut all = vec![Cell::default(); 1 + cells.iter().copied().max().unwrap_or(0) as usize];
        for (ends, &cell) in places.windows(2).zip(cells) {
            let sides = [DVec3::Y, DVec3::Z].into_iter().flat_map(|n| [Plane { n, d: 1.0 }, Plane { n: -n, d: 1.0 }]);
            let ends = [Plane { n: -DVec3::X, d: -ends[0] }, Plane { n: DVec3::X, d: ends[1] }];
            all[cell as usize].pieces.push(Piece::new(sides.chain(ends).collect(), 1e-9).expect("a slab"));
        }
        let portal = |&(cells, x): &([u32; 2], f64)| Portal {
            cells: cells.map(CellId),
            plane: Plane { n: DVec3::X, d: x },
            winding: [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(y, z)| DVec3::new(x, y, z)).to_vec(),
            kind: PortalKind::Opening,
            state: PortalState::default(),
            source: None,
        };
        CellGraph::given(all, portals.iter().map(portal).collect())
    }

    /// The cells of the holes along x.
    fn holes(graph: &CellGraph) -> Vec<[u32; 2]> {
        let (locator, portals) = (Locator::new(graph), PortalTree::new(graph));
        let follower = Follower { graph, locator, portals, eps: EPS };
        let found = follower.follow(CellId(0), [DVec3::new(0.5, 0.1, 0.1), DVec3::new(3.5, 0.2, 0.3)]);
        found.iter().map(|hole| [hole.from.cell.0, hole.to.cell.0]).collect()
    }

    #[test]
    fn a_sliver_is_passed_over() {
        // A sliver of another cell within one, and then a third cell.
        let four = |thick: f64| slabs(&[0.0, 1.0, 1.0 + thick, 3.0, 4.0], &[0, 1, 0, 2], &[]);
        assert_eq!(holes(&four(0.1 * EPS)), [[0, 2]]);
        assert_eq!(holes(&four(1.0)), [[0, 1], [1, 0], [0, 2]]);
        let (thin, thick) = ([0.0, 2.0, 2.0 + 0.1 * EPS, 4.0], [0.0, 2.0, 3.0, 4.0]);
        // A sliver between two cells: the hole is between those.
        assert_eq!(holes(&slabs(&thin, &[0, 1, 2], &[])), [[0, 2]]);
        assert_eq!(holes(&slabs(&thick, &[0, 1, 2], &[])), [[0, 1], [1, 2]]);
        // Portals past it, or into it and out of it.
        assert_eq!(holes(&slabs(&thin, &[0, 1, 2], &[([0, 2], 2.0)])), [[0; 2]; 0]);
        assert_eq!(holes(&slabs(&thin, &[0, 1, 2], &[([0, 1], 2.0), ([1, 2], thin[2])])), [[0; 2]; 0]);
        assert_eq!(holes(&slabs(&thick, &[0, 1, 2], &[([0, 1], 2.0)])), [[1, 2]]);
    }
}
