//! A ground: its table in memory, its tiles on disk and in a cache, and the selection for the screen.
//!
//! Based on: the thesis' two threads, one for drawing and one for loading. Deviation: the caller's thread decides which tiles it
//! needs; the other only reads and checks. So the picture depends only on the arrived tiles.

use super::cache::Cache;
use super::disk::{Disk, FileDisk, read_tile};
use super::error::{GroundError, Part};
use super::format::{ENTRY, HEADER, Header, Tile, read_table};
use super::grid::Key;
use super::select::{GroundScratch, GroundView, Limit, Patch, Selector};
use enfilade::runtime::Motion;
use std::fs::File;
use std::io::{Read, Seek};
use std::path::Path;
use std::sync::Arc;

/// Terrain drawn from tiles.
pub struct Ground {
    header: Header,
    tiles: Arc<[Tile]>,
    cache: Cache,
    /// `None` if all tiles are in memory.
    disk: Option<Box<dyn Disk>>,
    /// Tiles under way, and those that cannot be read.
    asked: Vec<bool>,
    /// Tiles that cannot be read. They and their descendants are not requested again.
    lost: Vec<bool>,
    wanted: Wanted,
    bytes: Vec<u8>,
    faults: Vec<GroundError>,
    changed: Vec<u32>,
    frame: u32,
    /// No tile is requested before this frame.
    idle_until: u32,
}

/// State of the loader.
#[derive(Default)]
struct Wanted {
    scratch: GroundScratch,
    /// Needed and missing tiles: depth, number.
    missing: Vec<(u32, u32)>,
    /// By tile, the last frame that noted it as missing.
    noted: Vec<u32>,
    counts: Loading,
}

/// Loading in a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Loading {
    /// Tiles of the selection with all tiles in memory.
    pub wanted: u32,
    /// Number of these in memory.
    pub present: u32,
    /// Tiles that arrived.
    pub loaded: u32,
    /// Tiles under way.
    pub under_way: u32,
}

/// Frames without requests after a tile arrived that found no slot in the cache. More: needed tiles come later. Fewer: the same
/// tiles are read again and again if a view needs more than the cache holds.
const IDLE: u32 = 30;
/// Maximum tiles under way.
const MOST_UNDER_WAY: u32 = 64;

impl Ground {
    /// Opens a file with a cache of this many bytes. If all tiles fit into it, they are read now, and no thread is started.
    pub fn open(path: &Path, cache_bytes: u64) -> Result<Self, GroundError> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        Self::read(file, length, cache_bytes)
    }

    /// The same from any reader of `length` bytes.
    pub fn read(mut file: impl Read + Seek + Send + 'static, length: u64, cache_bytes: u64) -> Result<Self, GroundError> {
        let mut first = [0; HEADER];
        let known = length.min(HEADER as u64) as usize;
        file.read_exact(&mut first[..known]).map_err(|e| GroundError::of(Part::Header, e))?;
        let (header, checksum) = Header::read(&first[..known], length)?;
        let mut table = vec![0; header.grid.tiles() as usize * ENTRY];
        file.read_exact(&mut table).map_err(|e| GroundError::of(Part::Table, e))?;
        let tiles: Arc<[Tile]> = read_table(&table, checksum)?.into();
        drop(table);
        let whole = u64::from(header.grid.tiles()) * 4 * header.slot_words() as u64;
        if header.grid.top() > 0 && whole > cache_bytes {
            let disk = FileDisk::new(file, &header, Arc::clone(&tiles))?;
            return Ok(Self::new(header, tiles, Some(Box::new(disk)), cache_bytes));
        }
        let mut ground = Self::new(header, tiles, None, whole);
        ground.read_all(&mut file);
        Ok(ground)
    }

    /// A ground with another source of tiles: to test how late tiles look.
    pub fn from_disk(of: &Ground, disk: Box<dyn Disk>, cache_bytes: u64) -> Self {
        Self::new(of.header.clone(), Arc::clone(&of.tiles), Some(disk), cache_bytes)
    }

    fn new(header: Header, tiles: Arc<[Tile]>, disk: Option<Box<dyn Disk>>, cache_bytes: u64) -> Self {
        let cache = Cache::new(&header, cache_bytes);
        Self {
            asked: vec![false; tiles.len()],
            lost: vec![false; tiles.len()],
            wanted: Wanted { missing: Vec::with_capacity(tiles.len()), noted: vec![0; tiles.len()], ..Wanted::default() },
            bytes: vec![0; header.tile_bytes(0)],
            faults: Vec::with_capacity(tiles.len().min(MOST_FAULTS)),
            changed: Vec::with_capacity(cache.slots()),
            frame: 0,
            idle_until: 0,
            header,
            tiles,
            cache,
            disk,
        }
    }

    /// Reads all tiles, coarse ones first. A tile that cannot be read is missing, with its descendants.
    fn read_all(&mut self, file: &mut (impl Read + Seek)) {
        for tile in 0..self.header.grid.tiles() {
            if self.tiles[tile as usize].samples > 0 {
                let mut bytes = std::mem::take(&mut self.bytes);
                let found = read_tile(file, &self.header, &self.tiles, tile, &mut bytes);
                self.bytes = bytes;
                self.admit(tile, found);
            }
        }
    }

    /// Properties of the whole ground.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Entries of all tiles.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Selects the tiles to draw from those in memory. Allocates only in the first frame of a scratch.
    pub fn select<'s>(&self, view: &GroundView<'_>, limit: Limit, scratch: &'s mut GroundScratch) -> &'s [Patch] {
        let resident = |tile| self.cache.has(tile);
        Selector { header: &self.header, tiles: &self.tiles, resident, spheres: false }.select(view, limit, scratch);
        scratch.patches()
    }

    /// Selects as if all tiles were in memory.
    pub fn select_all<'s>(&self, view: &GroundView<'_>, limit: Limit, scratch: &'s mut GroundScratch) -> &'s [Patch] {
        self.selector_of_all(false).select(view, limit, scratch);
        scratch.patches()
    }

    fn selector_of_all(&self, spheres: bool) -> Selector<'_, impl Fn(u32) -> bool> {
        Selector { header: &self.header, tiles: &self.tiles, resident: |_| true, spheres }
    }

    /// Ends a frame: takes in arrived tiles, and requests those that the view needs and those that `motion` will need in `ahead`
    /// seconds. Without windows it requests nothing. Never waits, and allocates only in its first frame.
    pub fn load(&mut self, view: &GroundView<'_>, limit: Limit, motion: &Motion, ahead: f64, drawn: &[Patch]) -> Loading {
        self.frame += 1;
        self.changed.clear();
        self.wanted.counts = Loading { under_way: self.wanted.counts.under_way, ..Loading::default() };
        for patch in drawn {
            self.cache.touch(patch.tile, self.frame);
        }
        self.take_in();
        if self.disk.is_none() {
            self.count(view, limit);
            return self.wanted.counts;
        }
        self.wanted.missing.clear();
        self.count(view, limit);
        self.note_missing(view, limit);
        if let Some(camera) = motion.ahead(ahead).filter(|c| ahead > 0.0 && *c != view.camera) {
            self.note_missing(&GroundView { camera, ..*view }, limit);
        }
        self.ask();
        self.wanted.counts
    }

    fn take_in(&mut self) {
        let Some(mut disk) = self.disk.take() else { return };
        let mut bytes = std::mem::take(&mut self.bytes);
        while let Some((tile, found)) = disk.take(&mut bytes) {
            self.wanted.counts.under_way = self.wanted.counts.under_way.saturating_sub(1);
            self.asked[tile as usize] = found.is_err();
            std::mem::swap(&mut self.bytes, &mut bytes);
            self.admit(tile, found);
            std::mem::swap(&mut self.bytes, &mut bytes);
        }
        self.bytes = bytes;
        self.disk = Some(disk);
    }

    /// Puts an arrived tile into the cache.
    fn admit(&mut self, tile: u32, found: Result<(), GroundError>) {
        if let Err(fault) = found {
            self.lost[tile as usize] = true;
            if self.faults.len() < MOST_FAULTS {
                self.faults.push(fault);
            }
            return;
        }
        let Some(slot) = self.cache.admit(&self.header, tile, self.frame) else {
            // The cache is full, or the parent was evicted: an immediate new request would read it every frame.
            self.idle_until = self.frame + IDLE;
            return;
        };
        self.cache.fill(&self.header, tile, slot, &self.bytes[..self.header.tile_bytes(tile)]);
        self.wanted.counts.loaded += 1;
        self.changed.push(slot);
    }

    /// Counts the tiles that the view needs, and those of them in memory.
    fn count(&mut self, view: &GroundView<'_>, limit: Limit) {
        let mut scratch = std::mem::take(&mut self.wanted.scratch);
        self.selector_of_all(false).select(view, limit, &mut scratch);
        let counts = &mut self.wanted.counts;
        counts.wanted = scratch.patches().len() as u32;
        counts.present = scratch.patches().iter().filter(|p| self.cache.has(p.tile)).count() as u32;
        self.wanted.scratch = scratch;
    }

    /// Notes the missing tiles of a view with all their ancestors. The siblings of each that may show are needed, too, even if
    /// none of their descendants shows: without them, their parent is not divided.
    fn note_missing(&mut self, view: &GroundView<'_>, limit: Limit) {
        let mut scratch = std::mem::take(&mut self.wanted.scratch);
        self.selector_of_all(true).select(view, limit, &mut scratch);
        let grid = &self.header.grid;
        let depth = |tile| grid.top() - grid.key(tile).level;
        let mut note = |tile: u32| {
            if self.cache.has(tile) {
                // Tiles in memory are kept.
                self.cache.touch(tile, self.frame);
            } else if !self.asked[tile as usize] && self.wanted.noted[tile as usize] != self.frame {
                self.wanted.noted[tile as usize] = self.frame;
                self.wanted.missing.push((depth(tile), tile));
            }
        };
        for patch in scratch.patches() {
            note(patch.tile);
            let mut at = grid.parent(patch.key);
            while let Some(key) = at {
                grid.children(key).filter(|&child| scratch.saw(child)).for_each(&mut note);
                at = grid.parent(key);
                if at.is_none() {
                    grid.tile(key).into_iter().for_each(&mut note);
                }
            }
        }
        self.wanted.scratch = scratch;
    }

    fn ask(&mut self) {
        let Some(disk) = self.disk.as_mut().filter(|_| self.frame >= self.idle_until) else { return };
        let missing = &mut self.wanted.missing;
        missing.sort_unstable();
        for &(_, tile) in missing.iter() {
            // A tile is requested after its parent.
            let comes = |p: u32| self.asked[p as usize] && !self.lost[p as usize];
            let has_parent = self.header.parent(tile).is_none_or(|p| self.cache.has(p) || comes(p));
            if self.wanted.counts.under_way >= MOST_UNDER_WAY {
                break;
            }
            if has_parent && !self.asked[tile as usize] {
                if !disk.ask(tile) {
                    break;
                }
                self.asked[tile as usize] = true;
                self.wanted.counts.under_way += 1;
            }
        }
    }

    /// Slots filled by the last [`load`](Self::load), or by [`open`](Self::open).
    pub fn changed(&self) -> &[u32] {
        &self.changed
    }

    /// The slot of a tile in memory.
    pub fn slot(&self, tile: u32) -> Option<u32> {
        self.cache.slot(tile)
    }

    /// Slots of the cache.
    pub fn slots(&self) -> usize {
        self.cache.slots()
    }

    /// Bytes of the cache.
    pub fn cache_bytes(&self) -> u64 {
        self.cache.bytes()
    }

    /// The numbers of a slot, row after row: two per word, the first in the low half, or one ([`Width`](super::Width)).
    pub fn words(&self, slot: u32) -> &[u32] {
        self.cache.words(slot)
    }

    /// Why tiles could not be read: each once, the first ones only.
    pub fn faults(&self) -> &[GroundError] {
        &self.faults
    }

    /// The height of a tile's sample, metres above the origin; `None` for a void, and if the tile is not in memory.
    pub fn sample(&self, tile: u32, [i, j]: [u32; 2]) -> Option<f32> {
        let number = self.cache.number(&self.header, self.cache.slot(tile)?, [i, j]);
        (number < self.header.width.void()).then_some(number as f32 * self.header.step as f32)
    }

    /// The height of the ground at a place (metres to the east and to the south of the origin), from the finest tile in memory.
    /// `None` outside, over voids, and without tiles in memory.
    pub fn height_at(&self, x: f64, z: f64) -> Option<f64> {
        let grid = &self.header.grid;
        let [columns, rows] = grid.size();
        let at = |v: f64, samples: u32, spacing: f64| v / spacing + f64::from(samples - 1) / 2.0;
        let (u, v) = (at(x, columns, self.header.spacing[0]), at(z, rows, self.header.spacing[1]));
        if !(u >= 0.0 && v >= 0.0 && u <= f64::from(columns - 1) && v <= f64::from(rows - 1)) {
            return None;
        }
        (0..=grid.top()).find_map(|level| self.height_by(level, u, v)).flatten()
    }

    /// The same from the tile of a level, at a column and row; `None` if that is not in memory.
    fn height_by(&self, level: u32, u: f64, v: f64) -> Option<Option<f64>> {
        let grid = &self.header.grid;
        let cells = grid.side() - 1;
        let step = 1u32 << level;
        // The last sample belongs to the last cell.
        let cell = |at: f64, samples: u32| (at as u32 / step).min((samples - 1).div_ceil(step) - 1);
        let [columns, rows] = grid.size();
        let (c, r) = (cell(u, columns), cell(v, rows));
        let key = Key { level, x: c / cells, y: r / cells };
        let tile = grid.tile(key)?;
        if self.tiles[tile as usize].samples == 0 {
            return Some(None);
        }
        if !self.cache.has(tile) {
            return None;
        }
        let (i, j) = (c % cells, r % cells);
        let [c0, c1] = [i, i + 1].map(|i| f64::from(grid.column(key, i)));
        let [r0, r1] = [j, j + 1].map(|j| f64::from(grid.row(key, j)));
        let (p, q) = ((u - c0) / (c1 - c0), (v - r0) / (r1 - r0));
        let height = |i: u32, j: u32| self.sample(tile, [i, j]).map(f64::from);
        let (north_east, south_west) = (height(i + 1, j), height(i, j + 1));
        let (corner, p, q) = if p + q <= 1.0 { (height(i, j), p, q) } else { (height(i + 1, j + 1), 1.0 - q, 1.0 - p) };
        Some(corner.zip(north_east).zip(south_west).map(|((at, east), south)| at + p * (east - at) + q * (south - at)))
    }
}

/// Maximum faults kept.
const MOST_FAULTS: usize = 1024;

impl Header {
    /// The parent of a tile.
    pub fn parent(&self, tile: u32) -> Option<u32> {
        self.grid.parent(self.grid.key(tile)).and_then(|key| self.grid.tile(key))
    }
}
