//! Samples of a tile in blocks, and its voids.

use crate::{Ground, Header, Key, Tile, Width};

/// Maximum tiles with voids per frame. If there are more, coarser ones are used.
const MOST_HOLES: usize = 256;
/// Cells along the side of a block. Each row of blocks has a line that raises the horizon, and voids are known by block. Fewer:
/// higher horizons, and more time. Even, and a divisor of all tiles' sides.
pub(super) const BLOCK: usize = 8;
/// Maximum samples along a side of a tile; blocks.
pub(super) const MOST: usize = 129;
pub(super) const MOST_BLOCKS: usize = (MOST - 1) / BLOCK;

/// Height of a void: a line ends there. Metres.
pub(super) const NOWHERE: f64 = -1e30;

/// The height of a sample, metres above the ground's origin; `None` for a void.
pub(super) fn height(header: &Header, words: &[u32], at: usize) -> Option<f64> {
    let number = match header.width {
        Width::Two => words[at / 2] >> (16 * (at % 2)) & 0xffff,
        Width::Four => words[at],
    };
    (number < header.width.void()).then(|| f64::from(number as f32 * header.step as f32))
}

/// Whether a tile has samples with and without a height.
pub(super) fn has_voids(header: &Header, key: Key, tile: &Tile) -> bool {
    let last = header.grid.side() - 1;
    let columns = header.grid.column(key, last) - header.grid.column(key, 0) + 1;
    let rows = header.grid.row(key, last) - header.grid.row(key, 0) + 1;
    tile.samples > 0 && u64::from(tile.samples) < u64::from(columns) * u64::from(rows)
}

/// Tiles with voids, of the finest level with few enough, and unreadable tiles of a ground of one level. Tiles without any height
/// do not count: their neighbours do.
pub(super) fn holes(ground: &Ground) -> Vec<u32> {
    let header = ground.header();
    let has_one_level = header.grid.top() == 0;
    let is_hole = |&tile: &u32| {
        let of = &ground.tiles()[tile as usize];
        let is_lost = has_one_level && of.samples > 0 && ground.slot(tile).is_none();
        is_lost || has_voids(header, header.grid.key(tile), of)
    };
    let of = |level: u32| header.grid.tiles_of(level).filter(is_hole);
    let level = (0..header.grid.top()).find(|&level| of(level).take(MOST_HOLES + 1).count() <= MOST_HOLES);
    of(level.unwrap_or(header.grid.top())).collect()
}

/// By row and column of blocks, the greatest height of blocks with both voids and heights; [`NOWHERE`] for others.
pub(super) fn tops_of_holes(header: &Header, words: &[u32]) -> [[f64; MOST_BLOCKS]; MOST_BLOCKS] {
    let side = header.grid.side() as usize;
    let mut tops = [[NOWHERE; MOST_BLOCKS]; MOST_BLOCKS];
    for (j, row) in tops[..(side - 1) / BLOCK].iter_mut().enumerate() {
        for (i, top) in row[..(side - 1) / BLOCK].iter_mut().enumerate() {
            let mut has_voids = false;
            let mut highest = NOWHERE;
            for k in 0..(BLOCK + 1) * (BLOCK + 1) {
                let [dj, di] = [k / (BLOCK + 1), k % (BLOCK + 1)];
                match height(header, words, (j * BLOCK + dj) * side + i * BLOCK + di) {
                    Some(height) => highest = highest.max(height),
                    None => has_voids = true,
                }
            }
            *top = if has_voids { highest } else { NOWHERE };
        }
    }
    tops
}
