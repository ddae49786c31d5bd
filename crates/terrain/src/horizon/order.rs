//! The order of tiles from near to far.

use crate::{Header, Key};
use glam::{DVec2, DVec3};

/// The eye in the plan, in tiles of the finest level from the raster's first corner.
pub(super) fn tiles_from_corner(header: &Header, eye: DVec3) -> DVec2 {
    let cells = f64::from(header.grid.side() - 1);
    (DVec2::new(eye.x, eye.z) - DVec2::from(header.plan(0, 0))) / DVec2::from(header.spacing) / cells
}

/// Rank of a tile from near to far: at each level and axis, whether it is in the eye's half or in the other one.
pub(super) fn rank(header: &Header, key: Key, eye: DVec2) -> u64 {
    let top = header.grid.top();
    let [across, down] = header.grid.across(top);
    // Levels above the coarsest one, as if they led to one tile.
    let above = u32::BITS - (across.max(down) - 1).leading_zeros();
    let mut rank = 0;
    for level in (0..top + above).rev() {
        let far = |at: u32, eye: f64| {
            let at = if level >= key.level { at >> (level - key.level) } else { return 0 };
            let middle = f64::from(at | 1) * f64::from(level).exp2();
            u64::from((at & 1 == 1) != (eye >= middle))
        };
        rank = rank << 2 | far(key.x, eye.x) << 1 | far(key.y, eye.y);
    }
    rank
}

/// Whether a tile is equal to another one or contains it.
pub(super) fn contains(tile: Key, other: Key) -> bool {
    let up = tile.level.checked_sub(other.level);
    up.is_some_and(|up| [other.x >> up, other.y >> up] == [tile.x, tile.y])
}

/// The raster's last corner, in the same tiles.
pub(super) fn ends(header: &Header) -> DVec2 {
    let grid = &header.grid;
    DVec2::from(grid.size().map(|samples| f64::from(samples - 1) / f64::from(grid.side() - 1)))
}
