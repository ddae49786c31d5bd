//! Samples of tiles, in whole numbers, so that neighbours agree on every border.
//!
//! A tile of level `k` has `side` x `side` samples, `2^k` samples of the raster apart. Level 0 is the raster. If the raster ends
//! within a tile, the tile's last samples are on its last column or row, so all levels end there.

use std::ops::Range;

/// Allowed samples along a side of a tile.
pub const SIDES: [u32; 3] = [33, 65, 129];
/// Maximum samples of a raster.
pub const MOST_SAMPLES: u64 = 1 << 31;

/// A raster divided into a quadtree of tiles.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Grid {
    columns: u32,
    rows: u32,
    side: u32,
    /// By level, from 0: the first tile's number, and tiles across and down.
    levels: Vec<Level>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Level {
    first: u32,
    across: u32,
    down: u32,
}

/// Level and position of a tile.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Key {
    /// Its samples are `2^level` samples of the raster apart.
    pub level: u32,
    /// Tiles of this level to the west of it.
    pub x: u32,
    /// Tiles of this level to the north of it.
    pub y: u32,
}

/// The sides of a tile, in the order of all lists over sides.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Side {
    /// Row 0.
    North,
    /// Column 0.
    West,
    /// The last row.
    South,
    /// The last column.
    East,
}

impl Side {
    /// All four.
    pub const ALL: [Self; 4] = [Self::North, Self::West, Self::South, Self::East];

    /// Its bit in a set of sides.
    pub fn bit(self) -> u8 {
        1 << self as u8
    }
}

impl Grid {
    /// Tiles of `side` samples over a raster. With `coarse`, levels up to a single tile; otherwise level 0 only. `None` for fewer
    /// than two columns or rows, more than [`MOST_SAMPLES`], or a side that is not in [`SIDES`].
    pub fn new(columns: u32, rows: u32, side: u32, coarse: bool) -> Option<Self> {
        let fits = columns.min(rows) >= 2 && u64::from(columns) * u64::from(rows) <= MOST_SAMPLES;
        if !fits || !SIDES.contains(&side) {
            return None;
        }
        let mut across = (columns - 1).div_ceil(side - 1);
        let mut down = (rows - 1).div_ceil(side - 1);
        let mut sizes = vec![[across, down]];
        while coarse && across.max(down) > 1 {
            (across, down) = (across.div_ceil(2), down.div_ceil(2));
            sizes.push([across, down]);
        }
        // The coarsest tile is tile 0.
        let mut first = 0;
        let mut levels = Vec::new();
        for [across, down] in sizes.into_iter().rev() {
            levels.push(Level { first, across, down });
            first += across * down;
        }
        levels.reverse();
        Some(Self { columns, rows, side, levels })
    }

    /// Columns and rows of the raster.
    pub fn size(&self) -> [u32; 2] {
        [self.columns, self.rows]
    }

    /// Samples of a tile along a side.
    pub fn side(&self) -> u32 {
        self.side
    }

    /// The coarsest level.
    pub fn top(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    /// Tiles of all levels, including those without a surface.
    pub fn tiles(&self) -> u32 {
        let finest = self.levels[0];
        finest.first + finest.across * finest.down
    }

    /// The numbers of a level's tiles.
    pub fn tiles_of(&self, level: u32) -> Range<u32> {
        let Level { first, across, down } = self.levels[level as usize];
        first..first + across * down
    }

    /// Tiles of a level, across and down.
    pub fn across(&self, level: u32) -> [u32; 2] {
        let Level { across, down, .. } = self.levels[level as usize];
        [across, down]
    }

    /// The number of a tile, if it is in the raster.
    pub fn tile(&self, key: Key) -> Option<u32> {
        let level = self.levels.get(key.level as usize)?;
        (key.x < level.across && key.y < level.down).then(|| level.first + key.y * level.across + key.x)
    }

    /// The level and position of a tile.
    pub fn key(&self, tile: u32) -> Key {
        let level = self.levels.iter().position(|l| l.first <= tile).unwrap_or(0);
        let Level { first, across, .. } = self.levels[level];
        Key { level: level as u32, x: (tile - first) % across, y: (tile - first) / across }
    }

    /// The parent of a tile.
    pub fn parent(&self, key: Key) -> Option<Key> {
        let level = key.level + 1;
        (level <= self.top()).then_some(Key { level, x: key.x / 2, y: key.y / 2 })
    }

    /// The children of a tile: up to four, north before south, west before east.
    pub fn children(&self, key: Key) -> impl Iterator<Item = u32> + '_ {
        let level = key.level.checked_sub(1);
        let at = move |i: u32| level.and_then(|level| self.tile(Key { level, x: 2 * key.x + i % 2, y: 2 * key.y + i / 2 }));
        (0..4).filter_map(at)
    }

    /// The neighbour of the same level beyond a side.
    pub fn beside(&self, key: Key, side: Side) -> Option<u32> {
        let Key { level, x, y } = key;
        let (x, y) = match side {
            Side::North => (Some(x), y.checked_sub(1)),
            Side::West => (x.checked_sub(1), Some(y)),
            Side::South => (Some(x), y.checked_add(1)),
            Side::East => (x.checked_add(1), Some(y)),
        };
        self.tile(Key { level, x: x?, y: y? })
    }

    /// The raster's column of a tile's sample.
    pub fn column(&self, key: Key, i: u32) -> u32 {
        at(key.level, key.x, self.side, i, self.columns)
    }

    /// The raster's row of a tile's sample.
    pub fn row(&self, key: Key, j: u32) -> u32 {
        at(key.level, key.y, self.side, j, self.rows)
    }
}

/// Sample `i` of tile number `x` of a level along one axis.
fn at(level: u32, x: u32, side: u32, i: u32, samples: u32) -> u32 {
    let at = (u64::from(x) * u64::from(side - 1) + u64::from(i)) << level;
    at.min(u64::from(samples) - 1) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_thousand_and_ninety_seven_samples_have_seven_levels_of_65() {
        let grid = Grid::new(4097, 4097, 65, true).unwrap();
        assert_eq!((grid.top(), grid.tiles()), (6, (0..7).map(|l| 4u32.pow(l)).sum()));
        assert_eq!(grid.key(0), Key { level: 6, x: 0, y: 0 });
        assert_eq!(grid.column(Key { level: 6, x: 0, y: 0 }, 64), 4096);
    }

    #[test]
    fn numbers_and_places_are_each_others_inverse_and_children_cover_their_parent() {
        for (columns, rows, side) in [(2, 5000, 33), (1197, 643, 65), (130, 131, 129), (3, 3, 33)] {
            let grid = Grid::new(columns, rows, side, true).unwrap();
            for tile in 0..grid.tiles() {
                let key = grid.key(tile);
                assert_eq!(grid.tile(key), Some(tile));
                let last = side - 1;
                let ends: Vec<_> = grid.children(key).map(|c| grid.key(c)).collect();
                assert!(ends.iter().all(|&c| grid.parent(c) == Some(key)));
                if key.level > 0 {
                    let east = ends.iter().map(|&c| grid.column(c, last)).max();
                    let south = ends.iter().map(|&c| grid.row(c, last)).max();
                    assert_eq!((east, south), (Some(grid.column(key, last)), Some(grid.row(key, last))));
                }
                assert!(grid.column(key, 0) < grid.column(key, last), "{key:?} has no width");
            }
        }
    }

    #[test]
    fn a_tile_and_the_one_beside_it_share_a_border() {
        let grid = Grid::new(1197, 643, 65, true).unwrap();
        for tile in 0..grid.tiles() {
            let key = grid.key(tile);
            if let Some(east) = grid.beside(key, Side::East) {
                assert_eq!(grid.column(grid.key(east), 0), grid.column(key, 64));
                assert_eq!(grid.beside(grid.key(east), Side::West), Some(tile));
            }
            if let Some(south) = grid.beside(key, Side::South) {
                assert_eq!(grid.row(grid.key(south), 0), grid.row(key, 64));
            }
        }
    }
}
