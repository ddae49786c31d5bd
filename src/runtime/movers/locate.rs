//! The cells that a box meets: those of the piece that held it last, if it is still well inside, else those of a search.
//!
//! A box meets a piece unless it is outside one of the piece's planes. Near an edge of the piece that is not certain, and then the box counts
//! as meeting it.

use super::super::culler::{Culler, PLACED};
use super::super::locate::Span;
use super::MOST_CELLS;
use crate::CellId;
use crate::math::sorting;
use glam::Vec3;

/// Tolerances that a box must be inside a piece, so that it meets no other: pieces overlap by less than two, and [`PLACED`] count as met.
const WELL_INSIDE: f64 = 2.0 + PLACED;

/// The cells of a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// A piece that the box meets.
    pub piece: u32,
    cells: [CellId; MOST_CELLS],
    count: usize,
    /// Whether there are more cells than fit.
    has_more: bool,
}

impl Found {
    /// The cells of a box; `piece`: where it was last, if it was anywhere.
    pub fn new(culler: &Culler, bounds: [Vec3; 2], piece: u32) -> Self {
        let mut found = Self { piece, cells: [CellId::default(); MOST_CELLS], count: 0, has_more: false };
        found.find(culler, bounds);
        found
    }

    pub fn cells(&self) -> &[CellId] {
        &self.cells[..self.count]
    }

    /// Whether the box meets no cell, or too many.
    pub fn is_anywhere(&self) -> bool {
        self.count == 0 || self.has_more
    }

    pub fn set_only(&mut self, cell: CellId) {
        (self.cells[0], self.count) = (cell, 1);
    }

    fn find(&mut self, culler: &Culler, bounds: [Vec3; 2]) {
        let (locator, span) = (&culler.locator, Span::new(bounds));
        if let Some(cell) = locator.cell_around(self.piece, &span, WELL_INSIDE * culler.tolerance) {
            return self.set_only(cell);
        }
        let mut piece = u32::MAX;
        locator.met_by(&span, PLACED * culler.tolerance, &mut |met, cell| {
            piece = piece.min(met);
            if !self.has_more && !self.cells().contains(&cell) {
                self.has_more = self.count == MOST_CELLS;
                if !self.has_more {
                    self.cells[self.count] = cell;
                    self.count += 1;
                }
            }
        });
        self.piece = piece;
        // In one order, wherever the search began.
        sorting::sort_few(&mut self.cells[..self.count], &|a, b| a < b);
    }
}
