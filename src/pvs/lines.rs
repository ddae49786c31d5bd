//! Which cells a free line passes through: portals crossed in order.
//!
//! Based on: Bittner, Mattausch, Wonka, Havran, Wimmer, *Adaptive global visibility sampling*, 2009: one ray serves every cell
//! that it crosses. Here the cells are found through the portals, which are far fewer than the cells' pieces.

use crate::cells::CellGraph;
use crate::cells::locate::BoxTree;
use crate::geom::{Aabb, Plane};
use crate::{CellId, PortalId};
use glam::DVec3;

/// A part of a line that lies in one cell.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Span {
    /// The cell.
    pub cell: CellId,
    /// From where to where, metres along the line.
    pub range: [f64; 2],
}

/// A tree over the portals of a graph.
pub(super) struct PortalTree {
    tree: BoxTree,
    faces: Vec<Face>,
}

struct Face {
    cells: [CellId; 2],
    plane: Plane,
    /// Planes through the edges, normals pointing out of the winding.
    edges: Vec<Plane>,
}

impl PortalTree {
    /// Builds the tree.
    pub fn new(graph: &CellGraph) -> Self {
        let boxes: Vec<Aabb> = graph.portals.iter().map(|p| Aabb::of(p.winding.iter().copied())).collect();
        let faces =
            graph.portals.iter().map(|p| Face { cells: p.cells, plane: p.plane, edges: edges(&p.winding, p.plane.n) });
        Self { tree: BoxTree::new(&boxes, (0..boxes.len() as u32).collect()), faces: faces.collect() }
    }

    /// The portals that the line meets for `0 < t < limit`, within `eps` metres of their windings, by ascending `t`.
    pub fn crossings(&self, origin: DVec3, direction: DVec3, limit: f64, eps: f64, out: &mut Vec<(f64, PortalId)>) {
        out.clear();
        self.tree.on_ray(origin, direction, limit, eps, &mut |i| {
            let face = &self.faces[i as usize];
            let t = -face.plane.distance(origin) / face.plane.n.dot(direction);
            if t > 0.0 && t < limit {
                let p = origin + direction * t;
                if face.edges.iter().all(|e| e.distance(p) <= eps) {
                    out.push((t, PortalId(i)));
                }
            }
        });
        out.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// The cells that a free ray out of `start` passes through up to `limit` metres (`direction` a unit vector); the portal
    /// that it starts on, if any, is `skip`. `crossings` is scratch space.
    pub fn chain(&self, start: Start, limit: f64, crossings: &mut Vec<(f64, PortalId)>, out: &mut Vec<Span>) {
        self.crossings(start.at, start.direction, limit, 1e-9, crossings);
        let mut span = Span { cell: start.cell, range: [0.0, limit] };
        for &(t, portal) in crossings.iter() {
            let cells = self.faces[portal.index()].cells;
            // Portals of other cells don't matter: cells may lie in each other's notches.
            if start.skip == Some(portal) || !cells.contains(&span.cell) {
                continue;
            }
            let next = if cells[0] == span.cell { cells[1] } else { cells[0] };
            out.push(Span { range: [span.range[0], t], ..span });
            span = Span { cell: next, range: [t, limit] };
        }
        out.push(span);
    }
}

/// Where a chain of cells begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// The point.
    pub at: DVec3,
    /// A unit vector.
    pub direction: DVec3,
    /// The cell that the ray goes into.
    pub cell: CellId,
    /// The portal that the point is on.
    pub skip: Option<PortalId>,
}

/// The planes through a convex winding's edges, normals pointing out; `n` is the winding's normal.
pub(super) fn edges(winding: &[DVec3], n: DVec3) -> Vec<Plane> {
    let next = winding.iter().cycle().skip(1);
    winding.iter().zip(next).filter_map(|(&a, &b)| Some(Plane::through(a, (b - a).cross(n).try_normalize()?))).collect()
}
