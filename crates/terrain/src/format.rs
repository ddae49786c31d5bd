//! The `.ground` file: a header, a table of tiles, then the tiles, placed by their numbers. docs/format.md has the layout.
//!
//! A tile stores only samples that its parent does not have: every other one of every other row is there. So the file is a
//! twentieth longer than the heights, not a third, and a tile can be read only if its parent is in memory.
//!
//! The header, the table and each tile have checksums. All lengths follow from the header's first numbers, and are compared with
//! the file's length before anything is allocated.

use super::error::{GroundError, Part};
use super::grid::Grid;
use xxhash_rust::xxh3::xxh3_64;

/// First bytes of every file: not text, and damaged by text transfers.
pub(super) const MAGIC: [u8; 8] = *b"\x89GRN\r\n\x1a\n";
/// The version written, and the only one read.
pub(super) const VERSION: u32 = 1;
/// Bytes of the header.
pub(super) const HEADER: usize = 112;
/// Offset of the header's checksum, which covers the bytes before it.
const CHECKSUM_AT: usize = 104;
/// Bytes of one entry of the table.
pub(super) const ENTRY: usize = 32;

/// Properties of a whole ground.
#[derive(Clone, PartialEq, Debug)]
pub struct Header {
    /// Samples and tiles.
    pub grid: Grid,
    /// Metres between columns (to the east, +X) and between rows (to the south, +Z).
    pub spacing: [f64; 2],
    /// Metres to the east, to the north and up of the ground's own origin: the raster's middle at its least height.
    pub origin: [f64; 3],
    /// Metres between two heights.
    pub step: f64,
    /// How heights are stored.
    pub width: Width,
    /// Samples without a height.
    pub voids: u64,
}

/// Bytes of a stored height.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Width {
    /// `u16`: 65,535 heights.
    Two,
    /// `u32` with 24 bits used: exact in `f32`.
    Four,
}

impl Width {
    /// Bytes.
    pub fn bytes(self) -> usize {
        match self {
            Self::Two => 2,
            Self::Four => 4,
        }
    }

    /// The number of a sample without a height; all lower numbers are heights.
    pub fn void(self) -> u32 {
        match self {
            Self::Two => 0xffff,
            Self::Four => 0xff_ffff,
        }
    }
}

/// The entry of a tile, kept in memory.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Tile {
    /// Least height of the raster and of the tile within its borders: metres above the ground's origin.
    pub low: f32,
    /// Greatest height, likewise.
    pub high: f32,
    /// Greatest vertical distance of the tile's surface from a sample of the raster, with any coarser neighbours: metres. Never
    /// less than that of a tile within this one.
    pub error: f32,
    /// Greatest distance, in any direction, of the rim of the tile's surface from the raster's rim at samples without a height:
    /// metres. Infinite if nothing of the tile is near.
    pub rim: f32,
    /// Samples of the raster with a height. A tile without any does not exist.
    pub samples: u32,
    /// Checksum of the tile's bytes.
    pub checksum: u64,
}

impl Header {
    /// Bytes of a tile in the file.
    pub fn tile_bytes(&self, tile: u32) -> usize {
        let side = self.grid.side();
        let known = if self.has_parent(tile) { side.div_ceil(2).pow(2) } else { 0 };
        (side * side - known) as usize * self.width.bytes()
    }

    /// Offset of a tile in the file; the number after the last one gives the file's length.
    pub fn place(&self, tile: u32) -> u64 {
        let table = u64::from(self.grid.tiles()) * ENTRY as u64;
        let whole = self.grid.tiles_of(self.grid.top()).end.min(tile);
        let bytes = |tiles: u32, of: u32| u64::from(tiles) * self.tile_bytes(of) as u64;
        HEADER as u64 + table + bytes(whole, 0) + bytes(tile - whole, self.grid.tiles())
    }

    /// Whether a tile has a parent.
    fn has_parent(&self, tile: u32) -> bool {
        tile >= self.grid.tiles_of(self.grid.top()).end
    }

    /// The samples stored with a tile, in order; its parent has the others.
    pub(super) fn own_samples(&self, tile: u32) -> impl Iterator<Item = [u32; 2]> {
        let (side, whole) = (self.grid.side(), !self.has_parent(tile));
        let samples = (0..side).flat_map(move |j| (0..side).map(move |i| [i, j]));
        samples.filter(move |[i, j]| whole || (i | j) & 1 == 1)
    }

    /// The samples that a tile takes from its parent: place here, place there.
    pub(super) fn parents_samples(&self, tile: u32) -> impl Iterator<Item = [[u32; 2]; 2]> {
        let (key, half) = (self.grid.key(tile), (self.grid.side() - 1) / 2);
        let count = if self.has_parent(tile) { half + 1 } else { 0 };
        let first = [key.x % 2 * half, key.y % 2 * half];
        let samples = (0..count).flat_map(move |j| (0..count).map(move |i| [i, j]));
        samples.map(move |[i, j]| [[2 * i, 2 * j], [first[0] + i, first[1] + j]])
    }

    /// Reads the header of a file of `length` bytes; also returns the table's checksum.
    pub(super) fn read(bytes: &[u8], length: u64) -> Result<(Self, u64), GroundError> {
        if !bytes.starts_with(&MAGIC) {
            return Err(GroundError::NotGround);
        }
        let Some(bytes) = bytes.first_chunk::<HEADER>() else {
            return Err(GroundError::Length { has: length, needs: HEADER as u64 });
        };
        let u32_at = |at: usize| u32::from_le_bytes(array(bytes, at));
        let u64_at = |at: usize| u64::from_le_bytes(array(bytes, at));
        let f64_at = |at: usize| f64::from_le_bytes(array(bytes, at));
        if u32_at(8) != VERSION {
            return Err(GroundError::Version(u32_at(8)));
        }
        if xxh3_64(&bytes[..CHECKSUM_AT]) != u64_at(CHECKSUM_AT) {
            return Err(GroundError::Checksum(Part::Header));
        }
        let wrong = |offset, what| GroundError::Malformed { offset, what };
        let width = match u32_at(12) {
            2 => Width::Two,
            4 => Width::Four,
            _ => return Err(wrong(12, "heights have 2 or 4 bytes")),
        };
        let grid = match u32_at(28) {
            coarse @ 0..=1 => Grid::new(u32_at(16), u32_at(20), u32_at(24), coarse == 1),
            _ => None,
        };
        let grid = grid.ok_or(wrong(16, "invalid number of columns, rows or samples per tile"))?;
        let header = Self {
            grid,
            spacing: [f64_at(40), f64_at(48)],
            origin: [f64_at(56), f64_at(64), f64_at(72)],
            step: f64_at(80),
            width,
            voids: u64_at(88),
        };
        header.check()?;
        let needs = header.place(header.grid.tiles());
        if needs != length || u64_at(32) != length {
            return Err(GroundError::Length { has: length, needs });
        }
        Ok((header, u64_at(96)))
    }

    /// Rejects numbers that no ground has: the run time computes with `f32`.
    pub(super) fn check(&self) -> Result<(), GroundError> {
        let wrong = |offset, what| Err(GroundError::Malformed { offset, what });
        let positive = |x: f64| x as f32 > 0.0 && (x as f32).is_finite();
        let size = self.grid.size();
        let is_wide = |k: usize| positive(self.spacing[k]) && positive(self.spacing[k] * f64::from(size[k]));
        if !(is_wide(0) && is_wide(1)) {
            return wrong(40, "the spacing is not above 0, or the ground is infinite");
        }
        if !self.origin.iter().all(|x| x.is_finite()) {
            return wrong(56, "the origin is not finite");
        }
        if !(positive(self.step) && positive(self.step * f64::from(self.width.void()))) {
            return wrong(80, "the step of heights is not above 0, or heights are infinite");
        }
        if self.voids > size.map(u64::from).into_iter().product() {
            return wrong(88, "more samples without a height than samples");
        }
        Ok(())
    }
}

impl Tile {
    /// Reads an entry; `None` if its numbers are invalid.
    pub(super) fn read(bytes: &[u8; ENTRY]) -> Option<Self> {
        let f32_at = |at: usize| f32::from_le_bytes(array(bytes, at));
        let tile = Self {
            low: f32_at(0),
            high: f32_at(4),
            error: f32_at(8),
            rim: f32_at(12),
            samples: u32::from_le_bytes(array(bytes, 16)),
            checksum: u64::from_le_bytes(array(bytes, 24)),
        };
        let finite = [tile.low, tile.high, tile.error].iter().all(|x| x.is_finite());
        let has_zeros = bytes[20..24] == [0; 4];
        (finite && has_zeros && tile.low <= tile.high && tile.error >= 0.0 && tile.rim >= 0.0).then_some(tile)
    }
}

/// Checks a table's checksum and reads it.
pub(super) fn read_table(bytes: &[u8], checksum: u64) -> Result<Vec<Tile>, GroundError> {
    if xxh3_64(bytes) != checksum {
        return Err(GroundError::Checksum(Part::Table));
    }
    let wrong = |k: usize| GroundError::Malformed {
        offset: (HEADER + k * ENTRY) as u64,
        what: "invalid heights or errors of a tile",
    };
    let (entries, _) = bytes.as_chunks::<ENTRY>();
    entries.iter().enumerate().map(|(k, entry)| Tile::read(entry).ok_or_else(|| wrong(k))).collect()
}

fn array<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let mut out = [0; N];
    out.copy_from_slice(&bytes[at..at + N]);
    out
}
