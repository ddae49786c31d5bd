//! Converts a file's cells and portals to a graph.

use super::{FileCell, FilePortal, PvsFile};
use crate::cells::{Cell, CellGraph, Piece, Portal};
use crate::math::geom::{Aabb, Plane};
use crate::math::tolerance::Tolerance;
use crate::types::note::Note;
use glam::Vec4;

impl PvsFile {
    /// Cells and portals, rounded to `f32` as in the file. Pieces that are empty after rounding are left out.
    pub fn graph(&self) -> CellGraph {
        let eps = self.tolerance().coplanar;
        let piece = |planes: &Vec<Vec4>| Piece::new(planes.iter().map(plane).collect(), eps);
        let cell = |FileCell { name, source, open, pieces }: &FileCell| Cell {
            name: name.clone(),
            source: source.clone(),
            open: *open,
            pieces: pieces.iter().filter_map(piece).collect(),
            portals: Vec::new(),
        };
        let mut graph = CellGraph {
            strategy: self.strategy,
            reason: self.reason.clone(),
            cells: self.cells.iter().map(cell).collect(),
            portals: self.portals.iter().map(portal).collect(),
            smallest_hole: self.smallest_hole,
            closed_holes: self.closed_holes.iter().map(|hole| hole.iter().map(|p| p.as_dvec3()).collect()).collect(),
            notes: self.notes.iter().map(Note::taken).collect(),
        };
        graph.link();
        graph
    }

    /// The model's tolerances, to within the rounding of its objects' boxes.
    pub fn tolerance(&self) -> Tolerance {
        Tolerance::for_extent(self.object_bounds().fold(Aabb::EMPTY, Aabb::union).diagonal())
    }

    /// The objects' boxes, metres relative to [`PvsFile::origin`].
    pub fn object_bounds(&self) -> impl Iterator<Item = Aabb> + '_ {
        self.objects.iter().map(|o| {
            let [min, max] = o.bounds.map(|p| p.as_dvec3());
            Aabb { min, max }
        })
    }
}

/// A half-space with a renormalized normal.
fn plane(plane: &Vec4) -> Plane {
    let n = plane.truncate().as_dvec3();
    let length = n.length();
    Plane { n: n / length, d: f64::from(plane.w) / length }
}

fn portal(p: &FilePortal) -> Portal {
    Portal {
        cells: p.cells,
        plane: plane(&p.plane),
        winding: p.winding.iter().map(|p| p.as_dvec3()).collect(),
        kind: p.kind,
        state: p.state,
        source: p.source.clone(),
    }
}
