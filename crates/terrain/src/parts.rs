//! Parts of tiles: only those that may show are drawn.
//!
//! A tile that is good enough may be large, and a window narrow. Each part of a tile has the heights of its descendant two levels
//! down, which the table knows even if only the tile itself is in memory.

use super::grid::Key;
use super::select::{GroundScratch, Patch, Selector};

/// Parts along a side of a tile; each is drawn or not. More: fewer triangles beside a window. Fewer: shorter lists.
pub const PARTS: u32 = 4;

impl Patch {
    /// The drawn parts: to the east and to the south.
    pub fn drawn_parts(&self) -> impl Iterator<Item = [u32; 2]> {
        let parts = self.parts;
        (0..PARTS * PARTS).filter(move |part| parts >> part & 1 == 1).map(|part| [part % PARTS, part / PARTS])
    }

    /// Drawn triangles of a tile of `side` samples, including those that stitching collapses.
    pub fn triangles(&self, side: u32) -> u64 {
        u64::from(self.parts.count_ones()) * of_a_part(side)
    }

    /// The drawn cells of a tile of `side` samples.
    pub fn drawn_cells(&self, side: u32) -> impl Iterator<Item = [u32; 2]> {
        let wide = (side - 1) / PARTS;
        let cells = move |[x, y]: [u32; 2]| (0..wide * wide).map(move |k| [x * wide + k % wide, y * wide + k / wide]);
        self.drawn_parts().flat_map(cells)
    }
}

/// Triangles of a part of a tile.
fn of_a_part(side: u32) -> u64 {
    2 * u64::from((side - 1) / PARTS).pow(2)
}

impl<R: Fn(u32) -> bool> Selector<'_, R> {
    /// Triangles of a part of a patch.
    pub(super) fn triangles_of_a_part(&self) -> u64 {
        of_a_part(self.header.grid.side())
    }

    pub(super) fn count_of_parts(&self, tile: u32, s: &GroundScratch) -> u64 {
        u64::from(self.parts(tile, s).count_ones())
    }

    pub(super) fn parts_of_children(&self, tile: u32, s: &mut GroundScratch) -> u64 {
        let children = self.header.grid.children(self.key(tile));
        children.map(|child| if self.shows(child, s) { self.count_of_parts(child, s) } else { 0 }).sum()
    }

    /// The parts of a tile that may show: each has the heights of its descendant two levels down, if there is one.
    pub(super) fn parts(&self, tile: u32, s: &GroundScratch) -> u16 {
        let bounds = self.bounds(tile, s);
        if self.spheres || s.lenses.iter().any(|lens| lens.holds(&bounds)) {
            return u16::MAX;
        }
        let (grid, key) = (&self.header.grid, self.key(tile));
        let wide = (grid.side() - 1) / PARTS;
        let down = key.level.min(PARTS.ilog2());
        let shows = |[x, y]: [u32; 2]| {
            let within = |part: u32, tile: u32| (tile << down) + (part >> (PARTS.ilog2() - down));
            let below = Key { level: key.level - down, x: within(x, key.x), y: within(y, key.y) };
            let Some(below) = grid.tile(below).map(|t| &self.tiles[t as usize]).filter(|t| t.samples > 0) else {
                return false;
            };
            let columns = [x, x + 1].map(|part| grid.column(key, part * wide));
            let rows = [y, y + 1].map(|part| grid.row(key, part * wide));
            let bounds = self.header.bounds_of(columns, rows, below, s.eye);
            s.lenses.iter().any(|lens| lens.sees(&bounds))
        };
        (0..PARTS * PARTS).filter(|part| shows([part % PARTS, part / PARTS])).fold(0, |bits, part| bits | 1 << part)
    }
}
