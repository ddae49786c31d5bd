//! The cells along a free line, by the portals that it crosses.
//!
//! Based on: Bittner, Mattausch, Wonka, Havran, Wimmer, *Adaptive global visibility sampling*, 2009: one ray serves every cell that it
//! crosses. Here portals give the cells, because there are far fewer portals than pieces.

use crate::cells::CellGraph;
use crate::math::box_tree::BoxTree;
use crate::math::geom::{Aabb, Plane};
use crate::{CellId, DirectedPortal, PortalId};
use glam::DVec3;

/// The part of a line in one cell.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(in crate::pvs) struct Span {
    /// The cell.
    pub cell: CellId,
    /// Start and end, metres along the line.
    pub range: [f64; 2],
}

/// Most portals of a cell that are tested without the tree.
const FEW: usize = 24;

/// Portals of a graph, indexed for line queries.
pub(in crate::pvs) struct PortalTree<'g> {
    graph: &'g CellGraph,
    tree: BoxTree,
    faces: Vec<Face>,
}

struct Face {
    cells: [CellId; 2],
    plane: Plane,
    /// Planes through the edges, normals pointing out of the winding.
    edges: Vec<Plane>,
}

impl Face {
    /// Intersection of the line with the winding, to within `eps` metres.
    #[inline]
    fn hit(&self, origin: DVec3, direction: DVec3, eps: f64) -> Option<f64> {
        let t = -self.plane.distance(origin) / self.plane.n.dot(direction);
        let p = origin + direction * t;
        (t.is_finite() && self.edges.iter().all(|e| e.distance(p) <= eps)).then_some(t)
    }
}

impl<'g> PortalTree<'g> {
    /// Builds the tree.
    pub fn new(graph: &'g CellGraph) -> Self {
        let boxes: Vec<Aabb> = graph.portals.iter().map(|p| Aabb::of(p.winding.iter().copied())).collect();
        let faces =
            graph.portals.iter().map(|p| Face { cells: p.cells, plane: p.plane, edges: edges(&p.winding, p.plane.n) });
        Self { graph, tree: BoxTree::over(&boxes), faces: faces.collect() }
    }

    /// The portals that the line crosses for `0 < t < limit`, within `eps` metres of their windings, by ascending `t`.
    pub fn crossings(&self, origin: DVec3, direction: DVec3, limit: f64, eps: f64, out: &mut Vec<(f64, PortalId)>) {
        out.clear();
        self.tree.on_ray(origin, direction, limit, eps, &mut |i| {
            if let Some(t) = self.faces[i as usize].hit(origin, direction, eps).filter(|&t| t > 0.0 && t < limit) {
                out.push((t, PortalId(i)));
            }
        });
        out.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// True if a directed portal has the direction of a line.
    fn leads_along(&self, portal: DirectedPortal, direction: DVec3) -> bool {
        let forward = self.faces[portal.portal().index()].plane.n.dot(direction);
        if portal.side() == 0 { forward > 0.0 } else { forward < 0.0 }
    }

    /// Appends the cells along a free ray up to `limit` metres to `out`, in order. `crossings` is scratch space.
    ///
    /// From each cell it continues through the first of the cell's own portals; other cells' portals do not matter, because cells may lie
    /// in each other's notches.
    pub fn chain(&self, start: Start, limit: f64, crossings: &mut Vec<(f64, PortalId)>, out: &mut Vec<Span>) {
        let (mut cell, mut t, mut last) = (start.cell, 0.0, start.skip);
        crossings.clear();
        let mut looked_up = false;
        // No line passes a portal twice, so no sound graph needs more steps than it has portals.
        for _ in 0..self.faces.len() {
            let portals = &self.graph.cells[cell.index()].portals;
            let ahead = |&(s, portal): &(f64, PortalId)| s >= t && s < limit && last != Some(portal);
            let nearer = |a: &(f64, PortalId), b: &(f64, PortalId)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
            let next = if portals.len() <= FEW {
                let hit = |p: &DirectedPortal| {
                    Some((self.faces[p.portal().index()].hit(start.at, start.direction, EPS)?, p.portal()))
                };
                portals
                    .iter()
                    .filter(|&&p| self.leads_along(p, start.direction))
                    .filter_map(hit)
                    .filter(ahead)
                    .min_by(nearer)
            } else {
                if !std::mem::replace(&mut looked_up, true) {
                    self.crossings(start.at, start.direction, limit, EPS, crossings);
                }
                let own = |&&(_, portal): &&(f64, PortalId)| {
                    let side = self.faces[portal.index()].cells.iter().position(|&c| c == cell);
                    side.is_some_and(|side| self.leads_along(portal.directed(side as u32), start.direction))
                };
                crossings.iter().filter(own).copied().find(ahead)
            };
            let Some((s, portal)) = next else { break };
            out.push(Span { cell, range: [t, s] });
            let cells = self.faces[portal.index()].cells;
            (cell, t, last) = (if cells[0] == cell { cells[1] } else { cells[0] }, s, Some(portal));
        }
        out.push(Span { cell, range: [t, limit] });
    }
}

/// A line within this distance of a winding's rim passes through it, metres.
const EPS: f64 = 1e-9;

/// The start of a chain of cells.
#[derive(Clone, Copy, Debug)]
pub(in crate::pvs) struct Start {
    /// The point.
    pub at: DVec3,
    /// A unit vector.
    pub direction: DVec3,
    /// The cell that the ray enters.
    pub cell: CellId,
    /// The portal that the point is on.
    pub skip: Option<PortalId>,
}

/// The planes through a convex winding's edges, normals pointing out; `n` is the winding's normal.
pub(in crate::pvs) fn edges(winding: &[DVec3], n: DVec3) -> Vec<Plane> {
    let next = winding.iter().cycle().skip(1);
    winding.iter().zip(next).filter_map(|(&a, &b)| Some(Plane::through(a, (b - a).cross(n).try_normalize()?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::{Cell, Portal, PortalKind, PortalState};

    /// Cells in a row along x, with a 2 m square portal at each whole metre; `twice`: each portal as two halves.
    fn row(cells: u32, twice: bool) -> CellGraph {
        let half = |x: f64, low: f64, high: f64| {
            [(low, -1.0), (high, -1.0), (high, 1.0), (low, 1.0)].map(|(y, z)| DVec3::new(x, y, z)).to_vec()
        };
        let mut portals = Vec::new();
        for i in 1..cells {
            let x = f64::from(i);
            let parts = if twice { vec![half(x, -1.0, 0.0), half(x, 0.0, 1.0)] } else { vec![half(x, -1.0, 1.0)] };
            for winding in parts {
                let (cells, plane) = ([CellId(i - 1), CellId(i)], Plane { n: DVec3::X, d: x });
                let state = PortalState::default();
                portals.push(Portal { cells, plane, winding, kind: PortalKind::Opening, state, source: None });
            }
        }
        CellGraph::given(vec![Cell::default(); cells as usize], portals)
    }

    fn chain(graph: &CellGraph, at: DVec3, direction: DVec3, cell: u32) -> Vec<(u32, f64, f64)> {
        let (mut crossings, mut spans) = (Vec::new(), Vec::new());
        let start = Start { at, direction: direction.normalize(), cell: CellId(cell), skip: None };
        PortalTree::new(graph).chain(start, 2.25, &mut crossings, &mut spans);
        spans.iter().map(|s| (s.cell.0, s.range[0], s.range[1])).collect()
    }

    #[test]
    fn a_line_goes_through_the_portals_ahead_and_no_others() {
        let graph = row(6, false);
        let middle = DVec3::new(2.5, 0.0, 0.0);
        assert_eq!(chain(&graph, middle, DVec3::X, 2), [(2, 0.0, 0.5), (3, 0.5, 1.5), (4, 1.5, 2.25)]);
        assert_eq!(chain(&graph, middle, -DVec3::X, 2), [(2, 0.0, 0.5), (1, 0.5, 1.5), (0, 1.5, 2.25)]);
        assert_eq!(chain(&graph, middle, DVec3::Y, 2), [(2, 0.0, 2.25)]);
        assert_eq!(chain(&graph, middle + DVec3::Y * 1.5, DVec3::X, 2), [(2, 0.0, 2.25)], "beside the windings");
    }

    #[test]
    fn a_line_along_the_seam_of_two_portals_passes_once() {
        let graph = row(6, true);
        assert_eq!(chain(&graph, DVec3::new(2.5, 0.0, 0.0), DVec3::X, 2), [(2, 0.0, 0.5), (3, 0.5, 1.5), (4, 1.5, 2.25)]);
    }

    #[test]
    fn a_cell_with_many_portals_is_looked_up_in_the_tree() {
        let mut graph = row(6, false);
        let far = Portal { cells: [CellId(2), CellId(0)], ..graph.portals[0].clone() };
        let apart = |i: usize| far.winding.iter().map(|p| p + DVec3::Y * (10.0 + 3.0 * i as f64)).collect();
        graph.portals.extend((0..2 * FEW).map(|i| Portal { winding: apart(i), ..far.clone() }));
        graph.link();
        assert_eq!(chain(&graph, DVec3::new(2.5, 0.0, 0.0), DVec3::X, 2), [(2, 0.0, 0.5), (3, 0.5, 1.5), (4, 1.5, 2.25)]);
    }
}
