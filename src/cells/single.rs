//! A graph as a file holds it: in single precision.
//!
//! Rows are worked out for the graph that the run time will have, so that a graph that comes back from a file, as
//! `--cells-file` takes it, gives the same rows to the bit. What rounding moves, [`single_precision`](crate::tolerance) allows for.

use super::{CellGraph, Piece};
use crate::geom::Plane;
use crate::parallel;
use glam::DVec3;

/// Near the origin `f32` is finer than what is left of a coordinate in `f64` once a far origin was added and taken away. So numbers
/// are multiples of this share of the model's extent, too. Larger: planes through the origin lose digits that `f32` has. Smaller: a
/// graph that was written in the model's own coordinates, thousands of kilometres from zero, comes back with other bits.
const STEP: f64 = 1.0 / (1u64 << 32) as f64;

/// A grid of numbers that `f32` holds.
struct Grid {
    /// A power of two, metres.
    step: f64,
}

impl Grid {
    /// For a model of this extent, metres.
    fn new(extent: f64) -> Self {
        Self { step: extent.max(f64::MIN_POSITIVE).log2().ceil().exp2() * STEP }
    }

    fn length(&self, x: f64) -> f64 {
        // Adding 0 leaves no -0, which does not come back from a sum.
        f64::from(((x / self.step).round() * self.step) as f32) + 0.0
    }

    fn point(&self, p: DVec3) -> DVec3 {
        p.map(|x| self.length(x))
    }

    fn plane(&self, plane: &Plane) -> Plane {
        Plane { n: plane.n.as_vec3().as_dvec3(), d: self.length(plane.d) }
    }
}

/// Rounds planes and corners to `f32`. `extent`: the model's diagonal; `eps`: how far off a plane its corners may be; metres.
///
/// Pieces that hold no point then, slivers thinner than a rounding, are left out: in the file they hold none either. A cell of
/// nothing else keeps them, since portals lead through it.
pub fn round(graph: &mut CellGraph, extent: f64, eps: f64) {
    let grid = Grid::new(extent);
    let pieces = parallel::map(&graph.cells, |cell| {
        let rounded = cell.pieces.iter().map(|piece| piece.planes.iter().map(|p| grid.plane(p)).collect::<Vec<_>>());
        let held: Vec<Piece> = rounded.clone().filter_map(|planes| Piece::new(planes, eps)).collect();
        if held.is_empty() {
            let thin = rounded.zip(&cell.pieces);
            return thin.map(|(planes, piece)| Piece { planes, bounds: piece.bounds }).collect();
        }
        held
    });
    graph.cells.iter_mut().zip(pieces).for_each(|(cell, pieces)| cell.pieces = pieces);
    for portal in &mut graph.portals {
        portal.plane = grid.plane(&portal.plane);
        portal.winding.iter_mut().for_each(|p| *p = grid.point(*p));
    }
    graph.closed_holes.iter_mut().flatten().for_each(|p| *p = grid.point(*p));
}
