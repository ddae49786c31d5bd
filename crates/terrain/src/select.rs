//! Selects the drawn tiles: division from the coarsest level on, with neighbours at most one level apart.
//!
//! Based on: the thesis' refinement, with Hill's balance (2002): before a tile is divided, its coarser neighbours are. Deviation:
//! a division with all its requirements is planned first, and made only if all of it is possible; Röttger et al., 1998, fold the
//! balance into the errors, which cannot take memory into account. Visibility is tested as by Assarsson and Möller, 2000, once
//! per tile and frame.

use super::format::{Header, Tile};
use super::grid::{Key, Side};
use super::metric::{Box3, Lens, Measure};
use enfilade::runtime::{Camera, Rect};
use glam::DVec3;
use std::collections::BinaryHeap;

/// The criterion for a tile that is good enough.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Limit {
    /// Greatest error of any sample of the raster, pixels, as far as tiles are in memory and the raster extends.
    Pixels(f64),
    /// The measure of the thesis and Lindstrom, to compare: error over distance, pixels. No bound off the middle of the screen.
    Distance(f64),
    /// Maximum triangles, with the least error that they allow.
    Triangles(u32),
}

/// The view of a frame.
#[derive(Clone, Copy, Debug)]
pub struct GroundView<'a> {
    /// The eye is in metres, relative to the ground's origin.
    pub camera: Camera,
    /// Pixels of the screen, across and down.
    pub size: [u32; 2],
    /// Windows of the screen through which ground can show: portals to the outside, or [`Rect::FULL`]. Empty: no ground.
    pub windows: &'a [Rect],
}

/// A drawn tile.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Patch {
    /// Its number.
    pub tile: u32,
    /// Its level and position.
    pub key: Key,
    /// Sides (bits of [`Side`]) with a coarser neighbour: there, each second sample moves ([`snapped`](super::snapped)).
    pub coarser: u8,
    /// Drawn parts of its [`PARTS`](super::PARTS) x `PARTS`, which may show: bits, from the north-west to the east, row by row.
    pub parts: u16,
    /// Its error, pixels.
    pub error: f32,
}

/// Maximum windows. More: further ones are joined with the last.
const MOST_WINDOWS: usize = 8;

/// Memory of a selection, reused each frame.
#[derive(Clone, Debug, Default)]
pub struct GroundScratch {
    frame: u32,
    /// By tile, the last frame in which its parent was divided (or it has none).
    reached: Vec<u32>,
    divided: Vec<u32>,
    /// The last frame in which its visibility was tested, and the result.
    asked: Vec<u32>,
    seen: Vec<bool>,
    pub(super) lenses: Vec<Lens>,
    pub(super) eye: DVec3,
    planned: Vec<u32>,
    stack: Vec<(u32, f32)>,
    heap: BinaryHeap<Ranked>,
    patches: Vec<Patch>,
    triangles: u64,
    worst: f32,
}

/// A tile by its error.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Ranked {
    error: f32,
    tile: u32,
}

impl Eq for Ranked {}

impl PartialOrd for Ranked {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Ranked {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.error.total_cmp(&other.error).then(other.tile.cmp(&self.tile))
    }
}

impl GroundScratch {
    /// Patches of the last selection.
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// Whether the last selection tested a tile and it may show.
    pub(super) fn saw(&self, tile: u32) -> bool {
        self.asked[tile as usize] == self.frame && self.seen[tile as usize]
    }

    /// Triangles of the last selection, including those that stitching collapses.
    pub fn triangles(&self) -> u64 {
        self.triangles
    }

    /// Greatest error of the last selection, pixels.
    pub fn worst(&self) -> f32 {
        self.worst
    }
}

/// Selects from a tree of tiles.
pub(super) struct Selector<'a, R> {
    pub header: &'a Header,
    pub tiles: &'a [Tile],
    /// Whether a tile is in memory.
    pub resident: R,
    /// Whether visibility uses the sphere around a box.
    pub spheres: bool,
}

impl<R: Fn(u32) -> bool> Selector<'_, R> {
    /// Selects; the scratch has the patches.
    pub fn select(&self, view: &GroundView<'_>, limit: Limit, s: &mut GroundScratch) {
        self.begin(view, s);
        match limit {
            Limit::Pixels(pixels) => self.by_error(pixels, Measure::Bound, s),
            Limit::Distance(pixels) => self.by_error(pixels, Measure::Distance, s),
            Limit::Triangles(most) => self.by_triangles(u64::from(most), s),
        }
        self.collect(limit, s);
    }

    /// The tiles of the coarsest level.
    fn roots(&self) -> impl Iterator<Item = u32> {
        self.header.grid.tiles_of(self.header.grid.top())
    }

    fn begin(&self, view: &GroundView<'_>, s: &mut GroundScratch) {
        let count = self.tiles.len();
        s.frame = s.frame.wrapping_add(1);
        if s.reached.len() != count || s.frame == 0 {
            s.frame = 1;
            for marks in [&mut s.reached, &mut s.divided, &mut s.asked] {
                marks.clear();
                marks.resize(count, 0);
            }
            s.seen.clear();
            s.seen.resize(count, false);
            s.planned.reserve(count);
            s.stack.reserve(count);
            s.heap.reserve(count);
            s.patches.reserve(count);
            s.lenses.reserve(MOST_WINDOWS);
        }
        s.eye = view.camera.eye.as_dvec3();
        s.lenses.clear();
        let (alone, rest) = view.windows.split_at(view.windows.len().min(MOST_WINDOWS - 1));
        let joined = rest.iter().copied().reduce(Rect::union);
        for &window in alone.iter().chain(&joined).filter(|w| !w.is_empty()) {
            s.lenses.push(Lens::new(&view.camera, view.size, window));
        }
        for root in self.roots() {
            s.reached[root as usize] = s.frame;
        }
    }

    fn by_error(&self, limit: f64, measure: Measure, s: &mut GroundScratch) {
        s.stack.clear();
        s.stack.extend(self.roots().map(|root| (root, f32::INFINITY)));
        while let Some((tile, above)) = s.stack.pop() {
            if !self.shows(tile, s) {
                continue;
            }
            let error = self.pixels(tile, measure, limit, s).min(above);
            if f64::from(error) > limit && self.divide(tile, s) {
                s.stack.extend(self.header.grid.children(self.key(tile)).map(|child| (child, error)));
            }
        }
    }

    fn by_triangles(&self, most: u64, s: &mut GroundScratch) {
        let each = self.triangles_of_a_part();
        let mut parts = 0;
        s.heap.clear();
        for root in self.roots() {
            if self.shows(root, s) {
                let error = self.pixels(root, Measure::Bound, 0.0, s);
                s.heap.push(Ranked { error, tile: root });
                parts += self.count_of_parts(root, s);
            }
        }
        while let Some(Ranked { tile, error }) = s.heap.pop() {
            if error == 0.0 || self.is_divided(tile, s) || !self.plan_anew(tile, s) {
                continue;
            }
            let [mut more, mut less] = [0; 2];
            for k in 0..s.planned.len() {
                more += self.parts_of_children(s.planned[k], s);
                less += self.count_of_parts(s.planned[k], s);
            }
            let after = parts + more - less;
            if after * each > most {
                self.forget_plan(s);
                break;
            }
            parts = after;
            for k in 0..s.planned.len() {
                for child in self.header.grid.children(self.key(s.planned[k])) {
                    if self.shows(child, s) {
                        let error = self.pixels(child, Measure::Bound, 0.0, s).min(error);
                        s.heap.push(Ranked { error, tile: child });
                    }
                }
            }
        }
    }

    pub(super) fn key(&self, tile: u32) -> Key {
        self.header.grid.key(tile)
    }

    /// A tile's box, relative to the eye.
    pub(super) fn bounds(&self, tile: u32, s: &GroundScratch) -> Box3 {
        self.header.bounds(self.key(tile), &self.tiles[tile as usize], s.eye)
    }

    /// Whether a tile has samples and may show.
    pub(super) fn shows(&self, tile: u32, s: &mut GroundScratch) -> bool {
        let at = tile as usize;
        if s.asked[at] != s.frame {
            s.asked[at] = s.frame;
            let bounds = self.bounds(tile, s);
            let sees = |lens: &Lens| if self.spheres { lens.sees_sphere(&bounds) } else { lens.sees(&bounds) };
            s.seen[at] = self.tiles[at].samples > 0 && s.lenses.iter().any(sees);
        }
        s.seen[at]
    }

    /// Error of a tile in the worst window, pixels.
    fn pixels(&self, tile: u32, measure: Measure, enough: f64, s: &GroundScratch) -> f32 {
        let Tile { error, rim, .. } = self.tiles[tile as usize];
        let errors = [f64::from(error), f64::from(rim)];
        let bounds = self.bounds(tile, s);
        let worst = s.lenses.iter().map(|lens| lens.pixels(&bounds, errors, measure, enough)).fold(0.0, f64::max);
        worst as f32
    }

    fn is_divided(&self, tile: u32, s: &GroundScratch) -> bool {
        s.divided[tile as usize] == s.frame
    }

    /// Divides a tile and all tiles that balance requires, or none.
    fn divide(&self, tile: u32, s: &mut GroundScratch) -> bool {
        self.is_divided(tile, s) || self.plan_anew(tile, s)
    }

    fn plan_anew(&self, tile: u32, s: &mut GroundScratch) -> bool {
        s.planned.clear();
        let done = self.plan(tile, s);
        if !done {
            self.forget_plan(s);
        }
        done
    }

    fn forget_plan(&self, s: &mut GroundScratch) {
        while let Some(tile) = s.planned.pop() {
            s.divided[tile as usize] = 0;
            self.header.grid.children(self.key(tile)).for_each(|child| s.reached[child as usize] = 0);
        }
    }

    /// Marks a tile as divided, coarser neighbours first; false if one cannot be divided.
    fn plan(&self, tile: u32, s: &mut GroundScratch) -> bool {
        if self.is_divided(tile, s) {
            return true;
        }
        let key = self.key(tile);
        let grid = &self.header.grid;
        if key.level == 0 || grid.children(key).any(|child| self.shows(child, s) && !(self.resident)(child)) {
            return false;
        }
        for side in Side::ALL {
            if grid.beside(key, side).is_some_and(|other| !self.reach(other, s)) {
                return false;
            }
        }
        s.planned.push(tile);
        s.divided[tile as usize] = s.frame;
        for child in grid.children(key) {
            if self.shows(child, s) {
                s.reached[child as usize] = s.frame;
            }
        }
        true
    }

    /// Ensures that nothing coarser than a tile is drawn in its place; false if that is impossible.
    fn reach(&self, tile: u32, s: &mut GroundScratch) -> bool {
        if s.reached[tile as usize] == s.frame {
            return true;
        }
        let grid = &self.header.grid;
        let Some(parent) = grid.parent(self.key(tile)).and_then(|key| grid.tile(key)) else { return true };
        // If the parent does not show, neither it nor its ancestors are drawn there.
        !self.shows(parent, s) || (self.reach(parent, s) && self.plan(parent, s))
    }

    /// Collects the tiles that show and are not divided.
    fn collect(&self, limit: Limit, s: &mut GroundScratch) {
        s.patches.clear();
        s.stack.clear();
        (s.worst, s.triangles) = (0.0, 0);
        s.stack.extend(self.roots().map(|root| (root, f32::INFINITY)));
        let (measure, enough) = match limit {
            Limit::Pixels(pixels) => (Measure::Bound, pixels),
            Limit::Distance(pixels) => (Measure::Distance, pixels),
            Limit::Triangles(_) => (Measure::Bound, 0.0),
        };
        while let Some((tile, above)) = s.stack.pop() {
            if !self.shows(tile, s) {
                continue;
            }
            let error = self.pixels(tile, measure, enough, s).min(above);
            if self.is_divided(tile, s) {
                s.stack.extend(self.header.grid.children(self.key(tile)).map(|child| (child, error)));
            } else if (self.resident)(tile) {
                let parts = self.parts(tile, s);
                if parts != 0 {
                    let coarser = self.coarser(tile, s);
                    let patch = Patch { tile, key: self.key(tile), coarser, parts, error };
                    s.triangles += patch.triangles(self.header.grid.side());
                    s.worst = s.worst.max(error);
                    s.patches.push(patch);
                }
            }
        }
    }

    /// Sides with a coarser neighbour.
    fn coarser(&self, tile: u32, s: &mut GroundScratch) -> u8 {
        let grid = &self.header.grid;
        let key = self.key(tile);
        let is_coarser = |side: &Side, s: &mut GroundScratch| {
            let Some(other) = grid.beside(key, *side).filter(|&other| s.reached[other as usize] != s.frame) else {
                return false;
            };
            let parent = grid.parent(grid.key(other)).and_then(|key| grid.tile(key));
            parent.is_some_and(|p| self.shows(p, s) && !self.is_divided(p, s))
        };
        Side::ALL.iter().filter(|side| is_coarser(side, s)).fold(0, |bits, side| bits | side.bit())
    }
}

impl Header {
    /// Metres to the east and to the south of a column and a row, from the ground's origin.
    pub fn plan(&self, column: u32, row: u32) -> [f64; 2] {
        let [columns, rows] = self.grid.size();
        let at = |k: u32, samples: u32, spacing: f64| (f64::from(k) - f64::from(samples - 1) / 2.0) * spacing;
        [at(column, columns, self.spacing[0]), at(row, rows, self.spacing[1])]
    }

    /// A tile's box, relative to a point.
    pub(super) fn bounds(&self, key: Key, tile: &Tile, eye: DVec3) -> Box3 {
        let ends = [0, self.grid.side() - 1];
        self.bounds_of(ends.map(|i| self.grid.column(key, i)), ends.map(|j| self.grid.row(key, j)), tile, eye)
    }

    /// The box of a range of columns and rows, with a tile's heights.
    pub(super) fn bounds_of(&self, columns: [u32; 2], rows: [u32; 2], tile: &Tile, eye: DVec3) -> Box3 {
        let [west, north] = self.plan(columns[0], rows[0]);
        let [east, south] = self.plan(columns[1], rows[1]);
        let low = DVec3::new(west, f64::from(tile.low), north) - eye;
        Box3 { low, high: DVec3::new(east, f64::from(tile.high), south) - eye }
    }
}
