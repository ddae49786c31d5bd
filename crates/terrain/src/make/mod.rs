//! From a raster to a `.ground` file, some rows at a time.
//!
//! Based on: the tiles of a thesis (PUC-Rio) on terrain larger than memory, with the nested errors of Lindstrom et al.,
//! *Real-time, continuous level of detail rendering of height fields*, 1996. Deviation: errors are exact, and include stitching
//! to coarser neighbours, rounding of heights and samples without a height.
//!
//! The raster is read twice: for its least and greatest height, then for the tiles. The second time, memory holds a band of rows,
//! as high as the distance of the coarsest tiles' samples, and one row of tiles per level.

mod band;
mod deviation;
mod footprint;
mod from_raster;
mod heights;
mod rim;
mod write;

use super::error::GroundError;
use super::format::{ENTRY, HEADER, Header, Tile, Width};
use super::grid::{Grid, Key, MOST_SAMPLES};
use band::{Band, Scale};
use enfilade::math::parallel;
use footprint::Keeper;
use glam::DVec2;
pub use heights::Heights;
use std::collections::BTreeMap;
use std::io::{Seek, SeekFrom, Write};
use std::ops::Range;
use xxhash_rust::xxh3::xxh3_64;

/// Options for making a ground.
#[derive(Clone, Debug)]
pub struct MakeOptions {
    /// Samples along a side of a tile: 33, 65 or 129.
    pub side: u32,
    /// Triangles, seen from above, under which no ground is made: metres in the ground's own coordinates, to the east and to the
    /// south of the raster's middle.
    pub keep_out: Vec<[DVec2; 3]>,
}

impl Default for MakeOptions {
    fn default() -> Self {
        Self { side: 33, keep_out: Vec::new() }
    }
}

/// A ground with fewer triangles in the raster's full mesh has one level and is drawn whole.
pub const LEAST_TRIANGLES: u64 = 100_000;

/// The greatest relief, metres.
const MOST_RELIEF: f64 = 1e7;
/// Maximum rounding of heights with two bytes, in half of this: metres, and a share of the spacing. Larger: ground within a few
/// metres of the eye is off by a pixel. Smaller: even plains take four bytes a height.
const FINE: f64 = 1e-3;

/// Least step between two heights: a micrometre, as a power of two.
const LEAST_STEP: f64 = 1.0 / (1 << 20) as f64;

/// Result of making a ground.
#[derive(Clone, PartialEq, Debug)]
pub struct Made {
    /// Properties of the whole ground.
    pub header: Header,
    /// Samples under the keep-out triangles; they also count as voids.
    pub kept_out: u64,
    /// Greatest height above the least, metres.
    pub relief: f64,
    /// Triangles of the full mesh.
    pub triangles: u64,
    /// Tiles with samples.
    pub tiles: u32,
    /// Bytes written.
    pub bytes: u64,
}

/// Writes the `.ground` of a raster. The bytes depend only on the heights and the options.
pub fn make(from: &mut dyn Heights, options: &MakeOptions, out: &mut (impl Write + Seek)) -> Result<Made, GroundError> {
    let [columns, rows] = from.size();
    let triangles = 2 * u64::from(columns.saturating_sub(1)) * u64::from(rows.saturating_sub(1));
    let grid = Grid::new(columns, rows, options.side, triangles >= LEAST_TRIANGLES).ok_or_else(|| {
        GroundError::Heights(format!(
            "{columns} x {rows} samples in tiles of {}: at least 2 x 2 samples, at most {MOST_SAMPLES}, tiles of 33, 65 or 129",
            options.side
        ))
    })?;
    let middle = DVec2::new(f64::from(columns - 1), f64::from(rows - 1)) / 2.0;
    let spacing = from.spacing();
    let in_samples = |p: DVec2| p / DVec2::from(spacing) + middle;
    let kept_out: Vec<[DVec2; 3]> = options.keep_out.iter().map(|t| t.map(in_samples)).collect();
    let keeper = Keeper::new(&kept_out);
    let survey = Survey::of(from, &keeper)?;
    let scale = survey.scale(from.lattice(), spacing)?;
    let [east, north] = from.first();
    let header = Header {
        grid,
        spacing,
        origin: [east + middle.x * spacing[0], north - middle.y * spacing[1], scale.base],
        step: scale.step,
        width: scale.width,
        voids: survey.voids,
    };
    header.check().map_err(|e| match e {
        GroundError::Malformed { what, .. } => GroundError::Heights(format!("{what}; no ground can be made")),
        other => other,
    })?;
    let mut maker =
        Maker { tiles: vec![Tile::default(); header.grid.tiles() as usize], open: BTreeMap::new(), header, scale };
    maker.run(from, &keeper, out)?;
    let made = maker.tiles.iter().filter(|t| t.samples > 0).count() as u32;
    let bytes = maker.header.place(maker.header.grid.tiles());
    let relief = survey.high - survey.low;
    Ok(Made { header: maker.header, kept_out: survey.kept_out, relief, triangles, tiles: made, bytes })
}

/// Results of the first reading.
struct Survey {
    low: f64,
    high: f64,
    voids: u64,
    kept_out: u64,
}

impl Survey {
    fn of(from: &mut dyn Heights, keeper: &Keeper<'_>) -> Result<Self, GroundError> {
        let [columns, rows] = from.size();
        let (mut low, mut high, mut voids, mut kept_out) = (f64::INFINITY, f64::NEG_INFINITY, 0, 0);
        let at_once = Band::rows(columns, 1);
        let mut heights = Vec::new();
        for first in (0..rows).step_by(at_once as usize) {
            let last = (first + at_once).min(rows);
            heights.clear();
            heights.resize(columns as usize * (last - first) as usize, f64::NAN);
            from.read(first..last, &mut heights).map_err(GroundError::Raster)?;
            let count = |heights: &[f64]| heights.iter().filter(|h| h.is_nan()).count() as u64;
            let before = count(&heights);
            keeper.keep_out(first, columns as usize, &mut heights);
            let after = count(&heights);
            (voids, kept_out) = (voids + after, kept_out + after - before);
            for &h in heights.iter().filter(|h| !h.is_nan()) {
                (low, high) = (low.min(h), high.max(h));
            }
        }
        Ok(Self { low, high, voids, kept_out })
    }

    /// Two bytes a height if that is exact or fine enough.
    fn scale(&self, lattice: Option<f64>, spacing: [f64; 2]) -> Result<Scale, GroundError> {
        let (base, relief) = (self.low, self.high - self.low);
        if !relief.is_finite() {
            let what = "no sample has a height; give another raster, or correct its no-data value";
            return Err(GroundError::Heights(what.to_owned()));
        }
        if relief > MOST_RELIEF {
            return Err(GroundError::Heights(format!(
                "heights from {} to {} m: at most {MOST_RELIEF} m apart",
                self.low, self.high
            )));
        }
        let steps = |width: Width| f64::from(width.void() - 1);
        if let Some(step) = lattice.filter(|&step| step >= LEAST_STEP && relief / step <= steps(Width::Two)) {
            return Ok(Scale { base, step, width: Width::Two });
        }
        // A power of two: products with it are exact.
        let step =
            |width: Width| if relief > 0.0 { (relief / steps(width)).log2().ceil().exp2().max(LEAST_STEP) } else { 1.0 };
        let fine = FINE.min(FINE * spacing[0].min(spacing[1]));
        let width = if step(Width::Two) <= fine { Width::Two } else { Width::Four };
        Ok(Scale { base, step: step(width), width })
    }
}

/// State of the second reading.
struct Maker {
    header: Header,
    scale: Scale,
    tiles: Vec<Tile>,
    /// Tiles that are partly read.
    open: BTreeMap<u32, Vec<u8>>,
}

/// The part of a tile in a band.
struct Piece {
    tile: u32,
    /// Rows of its cells.
    cells: Range<u32>,
}

impl Maker {
    fn run(
        &mut self,
        from: &mut dyn Heights,
        keeper: &Keeper<'_>,
        out: &mut (impl Write + Seek),
    ) -> Result<(), GroundError> {
        let [columns, rows] = self.header.grid.size();
        out.seek(SeekFrom::Start(self.header.place(0)))?;
        let at_once = Band::rows(columns, 1 << self.header.grid.top());
        let mut band = Band::new();
        for first in (0..rows - 1).step_by(at_once as usize) {
            let last = first.saturating_add(at_once).min(rows - 1);
            band.read(from, [first, last], &self.scale, keeper)?;
            let pieces = self.pieces(&band);
            let (header, scale) = (&self.header, &self.scale);
            let known = parallel::map(&pieces, |piece| piece.measure(&band, header));
            for (piece, of) in pieces.iter().zip(known) {
                let tile = &mut self.tiles[piece.tile as usize];
                *tile = if tile.samples == 0 { of } else { joined(*tile, of, of.samples) };
                let bytes = self.open.entry(piece.tile).or_insert_with(|| vec![0; header.tile_bytes(piece.tile)]);
                piece.store(&band, header, scale, bytes);
            }
            self.close(&band, out)?;
        }
        self.nest();
        self.write_table(out)
    }

    /// The parts of tiles in a band.
    fn pieces(&self, band: &Band) -> Vec<Piece> {
        let grid = &self.header.grid;
        let cells = grid.side() - 1;
        let mut pieces = Vec::new();
        for level in 0..=grid.top() {
            let step = 1u32 << level;
            // Rows of cells of the whole level.
            let end = grid.across(level)[1] * cells;
            // Samples beyond the last row are on it.
            let to = if band.last + 1 == grid.size()[1] { end } else { band.last / step };
            let from = band.first / step;
            for y in from / cells..to.div_ceil(cells) {
                let of = from.max(y * cells) - y * cells..to.min((y + 1) * cells) - y * cells;
                let numbers = (0..grid.across(level)[0]).filter_map(|x| grid.tile(Key { level, x, y }));
                pieces.extend(numbers.map(|tile| Piece { tile, cells: of.clone() }));
            }
        }
        pieces
    }

    /// Writes the tiles that end in the band.
    fn close(&mut self, band: &Band, out: &mut (impl Write + Seek)) -> Result<(), GroundError> {
        let (grid, header, tiles) = (&self.header.grid, &self.header, &mut self.tiles);
        let is_whole = |tile: u32| grid.row(grid.key(tile), grid.side() - 1) <= band.last;
        let mut next = None;
        for (&tile, bytes) in self.open.iter().filter(|&(&tile, _)| is_whole(tile)) {
            tiles[tile as usize].checksum = xxh3_64(bytes);
            if next != Some(tile) {
                out.seek(SeekFrom::Start(header.place(tile)))?;
            }
            out.write_all(bytes)?;
            next = Some(tile + 1);
        }
        self.open.retain(|&tile, _| !is_whole(tile));
        Ok(())
    }

    /// Propagates errors: no tile is better than its children.
    fn nest(&mut self) {
        let grid = &self.header.grid;
        for tile in (0..grid.tiles()).rev() {
            let of = self.tiles[tile as usize];
            if let Some(parent) = grid.parent(grid.key(tile)).and_then(|key| grid.tile(key)).filter(|_| of.samples > 0) {
                let parent = &mut self.tiles[parent as usize];
                *parent = joined(*parent, of, 0);
            }
        }
    }

    fn write_table(&self, out: &mut (impl Write + Seek)) -> Result<(), GroundError> {
        let mut table = Vec::with_capacity(self.tiles.len() * ENTRY);
        self.tiles.iter().for_each(|tile| table.extend(tile.write()));
        out.seek(SeekFrom::Start(0))?;
        out.write_all(&self.header.write(xxh3_64(&table)))?;
        debug_assert_eq!(out.stream_position().ok(), Some(HEADER as u64));
        out.write_all(&table)?;
        out.flush()?;
        Ok(())
    }
}

/// The worse values of both, with `more` samples.
fn joined(a: Tile, b: Tile, more: u32) -> Tile {
    Tile {
        low: a.low.min(b.low),
        high: a.high.max(b.high),
        error: a.error.max(b.error),
        rim: a.rim.max(b.rim),
        samples: a.samples + more,
        checksum: a.checksum,
    }
}

impl Piece {
    /// Computes heights and errors.
    fn measure(&self, band: &Band, header: &Header) -> Tile {
        let grid = &header.grid;
        let key = grid.key(self.tile);
        let [left, right] = [grid.column(key, 0), grid.column(key, grid.side() - 1)];
        let [top, bottom] = [grid.row(key, self.cells.start), grid.row(key, self.cells.end)];
        let (mut low, mut high, mut samples) = (f64::INFINITY, f64::NEG_INFINITY, 0);
        for row in top..=bottom {
            let heights = band.true_row(row, left, right);
            for (k, &h) in heights.iter().enumerate().filter(|(_, h)| !h.is_nan()) {
                let drawn = band.drawn(left + k as u32, row);
                (low, high) = (low.min(h).min(drawn), high.max(h).max(drawn));
                // The first row was the last one of the previous piece.
                samples += u32::from(row > top || self.cells.start == 0);
            }
        }
        if low > high {
            return Tile::default();
        }
        let error = deviation::of_cells(band, grid, key, self.cells.clone());
        let rim = rim::of_cells(band, grid, header.spacing, key, self.cells.clone());
        Tile {
            low: (low as f32).next_down(),
            high: (high as f32).next_up(),
            error: up(error),
            rim: up(rim),
            samples,
            checksum: 0,
        }
    }

    /// Stores the heights at their places in the tile.
    fn store(&self, band: &Band, header: &Header, scale: &Scale, bytes: &mut [u8]) {
        let (grid, width) = (&header.grid, scale.width);
        let key = grid.key(self.tile);
        let places = header.own_samples(self.tile).zip(bytes.chunks_exact_mut(width.bytes()));
        for ([i, j], place) in places.filter(|([_, j], _)| (self.cells.start..=self.cells.end).contains(j)) {
            let number = scale.number(band.true_height(grid.column(key, i), grid.row(key, j)));
            place.copy_from_slice(&number.to_le_bytes()[..width.bytes()]);
        }
    }
}

/// The next greater `f32`; 0 stays 0.
fn up(error: f64) -> f32 {
    if error == 0.0 { 0.0 } else { (error as f32).next_up() }
}
