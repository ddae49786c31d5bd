//! Tiles that nearer ground hides: a horizon about the eye, raised from near to far.
//!
//! Based on: Stewart, *Hierarchical visibility in terrains*, 1998, and Lloyd, Egbert, *Horizon occlusion culling for real-time rendering of
//! hierarchical terrains*, 2002: by direction in the plan, how high nearer ground reaches; a box that stays below it is hidden. What
//! differs: directions are columns of four upright pictures around the eye, where straight lines stay straight, not angles; and what raises
//! the horizon are lines of samples of the very tiles that are drawn, not bounds of their heights.
//!
//! # Why what is hidden doesn't show
//!
//! Say the eye is above the ground, and a ray from it is below a line of samples where it crosses that line in the plan. Then it has gone
//! through the ground before: a heightfield without a hole is drawn between the eye and the line. Each column keeps the greatest slope that
//! such lines reach *everywhere* in it. A box that is behind these lines and below their slope in all its columns has no ray.
//!
//! * **What is drawn counts**, not the raster: samples are taken from the patches of the frame, whatever their levels. Lines that stitching
//!   may move ([`snapped`](super::snapped)) are left out. So a patch that is hidden is so in this picture; how wrong the picture is stays as it was.
//! * **Order**: patches are taken in the order of the quadtree, near quarters first. No ray leads from a later one to an earlier one.
//! * **Patches and parts outside the windows** are not drawn, and no ray of the picture meets their boxes: the surface isn't crossed there.
//! * **Voids**: a ray can pass below the ground through a hole. No line behind cells with voids raises a column, unless the column hid all of
//!   these already.
//! * **The eye** may not be below the ground, over a void or beside the raster, and the near plane may not cut the ground: else all is kept.

use super::{Ground, GroundView, Header, Key, Patch, Sample, Tile, Width, drawn};
use glam::{DVec2, DVec3};

/// Columns of a picture, of which four are around the eye. More: finer tops of hills, and more time.
const COLUMNS: usize = 256;
/// Cells along the side of a block: each row of blocks has a line that raises the horizon, and voids are known by block. Fewer: higher
/// horizons, and more time. Even, and a part of all tiles' sides.
const BLOCK: usize = 8;
/// The line of a row of blocks: not on the tile's border, where samples move, and even, since odd samples beside a border do, too.
const LINE: usize = 4;
/// Of slopes (1 is 45 degrees), what roundings may amount to. More: tiles are kept that hardly are hidden.
const ROUNDING: f64 = 1e-6;
/// Tiles with voids that are looked at a frame, at most. Where there are more, coarser ones are.
const MOST_HOLES: usize = 256;
/// Samples of a tile along a side, at most; blocks.
const MOST: usize = 129;
const MOST_BLOCKS: usize = (MOST - 1) / BLOCK;
/// Stands for the height of a void: a line ends there. Metres.
const NOWHERE: f64 = -1e30;

/// Memory of the horizon of one ground, to be used again each frame.
pub struct Horizon {
    /// By picture and column: rays below this slope have met ground. Infinite where the view has none.
    slopes: Vec<f32>,
    /// What is known of a part of a column only.
    seams: Vec<Seam>,
    /// There, rays may be below the ground.
    is_closed: Vec<bool>,
    /// Tiles with voids.
    holes: Vec<u32>,
    /// Patches and, after them, holes: by their place in the order, near ones first.
    order: Vec<(u64, u32)>,
    /// The latest patch in that order.
    latest: Option<Key>,
    patches: Vec<Patch>,
    triangles: u64,
}

impl std::fmt::Debug for Horizon {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Horizon").field("patches", &self.patches.len()).finish_non_exhaustive()
    }
}

impl Horizon {
    /// Of a ground.
    pub fn new(ground: &Ground) -> Self {
        let tiles = ground.tiles().len();
        let holes = holes(ground);
        Self {
            slopes: vec![f32::NEG_INFINITY; FACES.len() * COLUMNS],
            seams: vec![Seam::NONE; FACES.len() * COLUMNS],
            is_closed: vec![false; FACES.len() * COLUMNS],
            order: Vec::with_capacity(tiles + holes.len()),
            holes,
            latest: None,
            patches: Vec::with_capacity(tiles),
            triangles: 0,
        }
    }

    /// Of the patches that were selected for a view, those that nearer ones don't hide, near ones first. `near`: metres from the eye to the
    /// near plane. The ground is that of [`new`](Self::new). Allocates nothing.
    pub fn hide(&mut self, ground: &Ground, view: &GroundView<'_>, near: f64, patches: &[Patch]) -> &[Patch] {
        let eye = view.camera.eye.as_dvec3();
        self.patches.clear();
        if is_above(ground, view, near, patches) {
            self.begin(ground, view, patches);
            for k in 0..self.order.len() {
                self.take(ground, eye, patches, self.order[k].1 as usize);
            }
        } else {
            self.patches.extend_from_slice(patches);
        }
        let side = ground.header().grid.side();
        self.triangles = self.patches.iter().map(|patch| patch.triangles(side)).sum();
        &self.patches
    }

    /// What the last frame has kept.
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// Its triangles, those that stitching makes nothing of included.
    pub fn triangles(&self) -> u64 {
        self.triangles
    }

    fn begin(&mut self, ground: &Ground, view: &GroundView<'_>, patches: &[Patch]) {
        let (header, eye) = (ground.header(), view.camera.eye.as_dvec3());
        let sides = sides(view);
        for (k, slope) in self.slopes.iter_mut().enumerate() {
            let borders = [0, 1].map(|end| direction(k / COLUMNS, k % COLUMNS + end));
            let is_beside = sides.iter().any(|side| borders.iter().all(|&border| side.dot(border) < -ROUNDING));
            *slope = if is_beside { f32::INFINITY } else { f32::NEG_INFINITY };
        }
        self.seams.fill(Seam::NONE);
        self.is_closed.fill(false);
        self.order.clear();
        self.latest = None;
        let at = tiles_from_corner(header, eye);
        let keys = patches.iter().map(|patch| patch.key).chain(self.holes.iter().map(|&hole| header.grid.key(hole)));
        self.order.extend(keys.zip(0..).map(|(key, k)| (rank(header, key, at), k)));
        self.order.sort_unstable();
    }

    /// The next patch or hole in the order.
    fn take(&mut self, ground: &Ground, eye: DVec3, patches: &[Patch], k: usize) {
        let header = ground.header();
        let Some(patch) = patches.get(k) else {
            let hole = self.holes[k - patches.len()];
            let key = header.grid.key(hole);
            // What is drawn there was looked at block by block.
            if !self.latest.is_some_and(|latest| contains(latest, key)) {
                let of = Footprint::new(header, key, &ground.tiles()[hole as usize], eye);
                (0..FACES.len()).for_each(|face| self.close(&of, face));
            }
            return;
        };
        self.latest = Some(patch.key);
        let of = Footprint::new(header, patch.key, &ground.tiles()[patch.tile as usize], eye);
        if self.shows(&of) {
            self.patches.push(*patch);
            self.raise(ground, patch, eye);
        }
    }

    /// False where all of a footprint is below the horizon.
    fn shows(&self, of: &Footprint) -> bool {
        (0..FACES.len()).filter_map(|face| of.seen_from(face)).any(|part| {
            let least = self.slopes[part.first..=part.last].iter().copied().fold(f32::INFINITY, f32::min);
            part.slope > least
        })
    }

    /// Rays of a picture through a footprint may be below the ground behind it.
    fn close(&mut self, of: &Footprint, face: usize) {
        let Some(part) = of.seen_from(face) else { return };
        for column in part.first..=part.last {
            self.is_closed[column] |= self.slopes[column] < part.slope;
        }
    }

    /// Raises the horizon by lines of a patch's samples, and closes it behind voids: a row of blocks after another, near ones first.
    fn raise(&mut self, ground: &Ground, patch: &Patch, eye: DVec3) {
        let header = ground.header();
        let Some(words) = ground.slot(patch.tile).map(|slot| ground.words(slot)) else {
            // It isn't drawn.
            self.is_closed.fill(true);
            return;
        };
        let side = header.grid.side() as usize;
        let mut from_eye = [[0.0; MOST]; 2];
        let [from_eye_x, from_eye_z] = &mut from_eye;
        for ((to_x, to_z), k) in from_eye_x.iter_mut().zip(from_eye_z).zip(0..header.grid.side()) {
            let [x, z] = header.plan(header.grid.column(patch.key, k), header.grid.row(patch.key, k));
            (*to_x, *to_z) = (x - eye.x, z - eye.z);
        }
        let has_voids = has_voids(header, patch.key, &ground.tiles()[patch.tile as usize]);
        let tops = has_voids.then(|| tops_of_holes(header, words));
        for (face, &Face { axis, sign }) in FACES.iter().enumerate() {
            let (depths, along) = (&from_eye[axis], &from_eye[1 - axis][..side]);
            let farthest = (sign * depths[0]).max(sign * depths[side - 1]);
            // What is farther to the side than away is on another picture.
            let aside = along[0].max(-along[side - 1]).max(0.0);
            if aside >= farthest {
                continue;
            }
            let steps = if axis == 0 { [1, side] } else { [side, 1] };
            let rows = (side - 1) / BLOCK;
            for row in 0..rows {
                let row = if sign > 0.0 { row } else { rows - 1 - row };
                if let Some(tops) = &tops {
                    self.close_blocks(tops, &from_eye, side, eye.y, (face, row));
                }
                let k = row * BLOCK + LINE;
                let depth = sign * depths[k];
                if depth > aside {
                    let mut heights = [0.0; MOST];
                    for (m, to) in heights[..side].iter_mut().enumerate() {
                        *to = height(header, words, k * steps[0] + m * steps[1]).map_or(NOWHERE, |height| height - eye.y);
                    }
                    let columns = face * COLUMNS..(face + 1) * COLUMNS;
                    let line = Line { depth, along, heights: &heights[..side] };
                    line.raise(
                        &mut self.slopes[columns.clone()],
                        &mut self.seams[columns.clone()],
                        &self.is_closed[columns],
                    );
                }
            }
        }
    }

    /// Closes a picture behind the blocks with voids in a row of blocks.
    fn close_blocks(
        &mut self,
        tops: &[[f64; MOST_BLOCKS]; MOST_BLOCKS],
        from_eye: &[[f64; MOST]; 2],
        side: usize,
        eye: f64,
        (face, row): (usize, usize),
    ) {
        for column in 0..(side - 1) / BLOCK {
            let [i, j] = if FACES[face].axis == 0 { [row, column] } else { [column, row] };
            if tops[j][i] > NOWHERE {
                let at = |end: usize| [from_eye[0][(i + end) * BLOCK], from_eye[1][(j + end) * BLOCK]];
                self.close(&Footprint { low: at(0), high: at(1), top: tops[j][i] - eye }, face);
            }
        }
    }
}

/// By row and column of blocks, how high samples are in those that have voids and heights; [`NOWHERE`] for others.
fn tops_of_holes(header: &Header, words: &[u32]) -> [[f64; MOST_BLOCKS]; MOST_BLOCKS] {
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

/// True where a tile is another one or within it.
fn contains(tile: Key, other: Key) -> bool {
    let up = tile.level.checked_sub(other.level);
    up.is_some_and(|up| [other.x >> up, other.y >> up] == [tile.x, tile.y])
}

/// One of the pictures around the eye: what is nearer to this half axis than to the others.
struct Face {
    /// 0: east and west, 1: south and north.
    axis: usize,
    sign: f64,
}

const FACES: [Face; 4] =
    [Face { axis: 0, sign: 1.0 }, Face { axis: 0, sign: -1.0 }, Face { axis: 1, sign: 1.0 }, Face { axis: 1, sign: -1.0 }];

/// A tile's rectangle in the plan, metres from the eye, and how high it reaches above the eye.
struct Footprint {
    low: [f64; 2],
    high: [f64; 2],
    top: f64,
}

/// What of a footprint is on a picture: the greatest slope at which something can be, and columns, the last included.
struct Part {
    slope: f32,
    first: usize,
    last: usize,
}

impl Footprint {
    fn new(header: &Header, key: Key, tile: &Tile, eye: DVec3) -> Self {
        let at = |k: u32| {
            let [x, z] = header.plan(header.grid.column(key, k), header.grid.row(key, k));
            [x - eye.x, z - eye.z]
        };
        Self { low: at(0), high: at(header.grid.side() - 1), top: f64::from(tile.high) - eye.y }
    }

    fn seen_from(&self, face: usize) -> Option<Part> {
        let Face { axis, sign } = FACES[face];
        let [from, to] = [self.low[axis] * sign, self.high[axis] * sign];
        let (nearest, farthest) = (from.min(to), from.max(to));
        let [left, right] = [self.low[1 - axis], self.high[1 - axis]];
        // On this picture, depth is not less than what is to the side.
        let nearest = nearest.max(left).max(-right).max(0.0);
        if farthest <= 0.0 || nearest > farthest {
            return None;
        }
        let whole = face * COLUMNS;
        if nearest == 0.0 {
            // It reaches under the eye.
            let slope = if self.top > 0.0 { f64::INFINITY } else { self.top / farthest };
            return Some(Part { slope: raised(slope), first: whole, last: whole + COLUMNS - 1 });
        }
        let low = left / if left < 0.0 { nearest } else { farthest };
        let high = right / if right < 0.0 { farthest } else { nearest };
        let column = |at: f64| (column(at).max(0.0) as usize).min(COLUMNS - 1);
        Some(Part {
            slope: raised(self.top / if self.top > 0.0 { nearest } else { farthest }),
            first: whole + column(low - ROUNDING),
            last: whole + column(high + ROUNDING),
        })
    }
}

/// A slope with what roundings may add.
fn raised(slope: f64) -> f32 {
    (slope + ROUNDING * (1.0 + slope.abs())) as f32
}

/// Where something is on a picture, in columns; -1 is its left border and 1 the right one.
fn column(at: f64) -> f64 {
    (at + 1.0) * (COLUMNS as f64 / 2.0)
}

/// A line of samples across a picture, all at one depth.
struct Line<'a> {
    /// Metres, above 0.
    depth: f64,
    /// Metres to the side, by sample, from less to more.
    along: &'a [f64],
    /// Metres above the eye, by sample.
    heights: &'a [f64],
}

impl Line<'_> {
    /// Raises the columns that it crosses from side to side, to the lowest of it in each. Where it begins or ends within a column, another
    /// one may go on, that of the patch beside this one.
    fn raise(&self, slopes: &mut [f32], seams: &mut [Seam], is_closed: &[bool]) {
        let over = 1.0 / self.depth;
        let at = |m: usize| [column(self.along[m] * over), self.heights[m] * over];
        // 1. The first border of a column on the line, and the sample after it.
        let [begin, height] = at(0);
        let first = begin.ceil().max(0.0);
        let start = self.along.partition_point(|&a| column(a * over) < first).max(1);
        if first > slopes.len() as f64 || start >= self.along.len() {
            return;
        }
        // 2. From border to border.
        let (mut next, mut least, mut before) = (first as usize, f64::INFINITY, at(start - 1));
        if begin >= 0.0 {
            least = (1..start).map(|m| at(m)[1]).fold(height, f64::min);
        }
        for m in start..self.along.len() {
            let after = at(m);
            if next as f64 <= after[0] {
                let rise = (after[1] - before[1]) / (after[0] - before[0]);
                while next as f64 <= after[0] {
                    let border = before[1] + rise * (next as f64 - before[0]);
                    if let Some(done) = next.checked_sub(1).filter(|&done| !is_closed[done]) {
                        let slope = least.min(border) as f32;
                        let is_first = next as f64 == first;
                        let known = if is_first { seams[done].from(begin, slope) } else { slope };
                        slopes[done] = slopes[done].max(known);
                    }
                    if next == slopes.len() {
                        return;
                    }
                    (least, next) = (border, next + 1);
                }
            }
            least = least.min(after[1]);
            before = after;
        }
        // 3. What is left of the last column.
        if let Some(done) = next.checked_sub(1).filter(|&done| !is_closed[done]) {
            slopes[done] = slopes[done].max(seams[done].until(before[0], least as f32));
        }
    }
}

/// Lines that end in a column, and that begin there: of each the highest, with the place, in columns.
#[derive(Clone, Copy)]
struct Seam {
    until: (f64, f32),
    from: (f64, f32),
}

impl Seam {
    const NONE: Self = Self { until: (0.0, f32::NEG_INFINITY), from: (0.0, f32::NEG_INFINITY) };

    /// A line covers the column's left part, to a place. Gives what is known of the whole column.
    fn until(&mut self, at: f64, slope: f32) -> f32 {
        if slope > self.until.1 {
            self.until = (at, slope);
        }
        if self.from.0 <= at { slope.min(self.from.1) } else { f32::NEG_INFINITY }
    }

    /// A line covers the column's right part, from a place.
    fn from(&mut self, at: f64, slope: f32) -> f32 {
        if slope > self.from.1 {
            self.from = (at, slope);
        }
        if self.until.0 >= at { slope.min(self.until.1) } else { f32::NEG_INFINITY }
    }
}

/// The border of a column, in the plan.
fn direction(face: usize, border: usize) -> DVec2 {
    let Face { axis, sign } = FACES[face];
    let aside = border as f64 * (2.0 / COLUMNS as f64) - 1.0;
    if axis == 0 { DVec2::new(sign, aside) } else { DVec2::new(aside, sign) }
}

/// Normals in the plan of what the view holds: all of it is on the side that they point to. None where it looks steeply up or down.
fn sides(view: &GroundView<'_>) -> [DVec2; 2] {
    let corners = CORNERS.map(|at| view.camera.unproject() * at.extend(1.0)).map(|ray| DVec2::new(ray.x, ray.z));
    let ahead = DVec2::new(f64::from(view.camera.w.x), f64::from(view.camera.w.z));
    if corners.iter().any(|corner| ahead.dot(*corner) <= 0.0) {
        return [DVec2::ZERO; 2];
    }
    [1.0, -1.0].map(|sign| {
        let normals = corners.map(|corner| sign * corner.perp().normalize());
        let is_side = |normal: &&DVec2| corners.iter().all(|&corner| normal.dot(corner) >= -ROUNDING * corner.length());
        normals.iter().find(is_side).copied().unwrap_or(DVec2::ZERO)
    })
}

/// Of the screen.
const CORNERS: [DVec2; 4] = [DVec2::ONE, DVec2::NEG_ONE, DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)];

/// The height of a sample, metres above the ground's origin; `None` for a void.
fn height(header: &Header, words: &[u32], at: usize) -> Option<f64> {
    let number = match header.width {
        Width::Two => words[at / 2] >> (16 * (at % 2)) & 0xffff,
        Width::Four => words[at],
    };
    (number < header.width.void()).then(|| f64::from(number as f32 * header.step as f32))
}

/// True for a tile with samples that have a height and samples that have none.
fn has_voids(header: &Header, key: Key, tile: &Tile) -> bool {
    let last = header.grid.side() - 1;
    let columns = header.grid.column(key, last) - header.grid.column(key, 0) + 1;
    let rows = header.grid.row(key, last) - header.grid.row(key, 0) + 1;
    tile.samples > 0 && u64::from(tile.samples) < u64::from(columns) * u64::from(rows)
}

/// Tiles with voids, of the finest level that has few enough, and those of a ground of one level that can't be read. Tiles without any
/// height are no holes: what is beside them is.
fn holes(ground: &Ground) -> Vec<u32> {
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

/// Where the eye is in the plan, in tiles of the finest level from the raster's first corner.
fn tiles_from_corner(header: &Header, eye: DVec3) -> DVec2 {
    let cells = f64::from(header.grid.side() - 1);
    (DVec2::new(eye.x, eye.z) - DVec2::from(header.plan(0, 0))) / DVec2::from(header.spacing) / cells
}

/// A tile's place in the order from near to far: at each level, whether it is in the eye's half or in the other one, both ways.
fn rank(header: &Header, key: Key, eye: DVec2) -> u64 {
    let top = header.grid.top();
    let [across, down] = header.grid.across(top);
    // Above the coarsest level, as if it were divided from one tile, too.
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

/// True where the eye is over the raster, and what is drawn is below it by more than the near plane can cut.
fn is_above(ground: &Ground, view: &GroundView<'_>, near: f64, patches: &[Patch]) -> bool {
    let (header, eye) = (ground.header(), view.camera.eye.as_dvec3());
    let grid = &header.grid;
    let at = tiles_from_corner(header, eye);
    let ends = DVec2::from(grid.size().map(|samples| f64::from(samples - 1) / f64::from(grid.side() - 1)));
    // At most so far from the eye is what the near plane cuts off.
    let slant = CORNERS.map(|at| (view.camera.unproject() * at.extend(1.0)).length()).into_iter().fold(1.0, f64::max);
    let cut = near * slant;
    let is_over = at.cmpge(DVec2::ZERO).all() && at.cmplt(ends).all();
    let is_narrow = cut < header.spacing[0].min(header.spacing[1]) * f64::from(grid.side() - 1);
    if !(is_over && is_narrow) {
        return false;
    }
    let key = Key { level: 0, x: at.x as u32, y: at.y as u32 };
    let Some(tile) = grid.tile(key).map(|tile| &ground.tiles()[tile as usize]) else { return false };
    let below = -cut;
    let mut covers = false;
    for patch in patches {
        let of = Footprint::new(header, patch.key, &ground.tiles()[patch.tile as usize], eye);
        let reaches = |far: f64| (0..2).all(|k| of.low[k] <= far && of.high[k] >= -far);
        covers |= reaches(0.0);
        if reaches(cut) && !is_below(ground, patch, eye, cut, below) {
            return false;
        }
    }
    covers || f64::from(tile.high) - eye.y < below
}

/// True where a patch is lower than `below` (metres above the eye) wherever it is not farther than `cut` from the eye, both ways in the plan.
fn is_below(ground: &Ground, patch: &Patch, eye: DVec3, cut: f64, below: f64) -> bool {
    let header = ground.header();
    let Some(words) = ground.slot(patch.tile).map(|slot| ground.words(slot)) else { return false };
    let side = header.grid.side();
    let place = |[i, j]: Sample| {
        let [x, z] = header.plan(header.grid.column(patch.key, i), header.grid.row(patch.key, j));
        DVec3::new(x, height(header, words, (j * side + i) as usize).unwrap_or(f64::NAN), z) - eye
    };
    // Cells that the square is in, and those beside them, which stitching draws into these.
    let range = |axis: usize| {
        let until = |far: f64| (0..side - 1).take_while(|&k| place([k, k]).to_array()[axis] <= far).count() as u32;
        until(-cut).saturating_sub(2)..(until(cut) + 1).min(side - 1)
    };
    let (columns, rows) = (range(0), range(2));
    let triangles = rows.flat_map(|j| columns.clone().flat_map(move |i| drawn(i, j, side, patch.coarser)));
    triangles.map(|triangle| triangle.map(place)).all(|triangle| is_lower(triangle, cut, below))
}

/// True where a triangle, relative to the eye, is lower than `below` over the square of `cut` to each side of it.
fn is_lower([a, b, c]: [DVec3; 3], cut: f64, below: f64) -> bool {
    let normal = (b - a).cross(c - a);
    // From above it is counter-clockwise: inside is to the left of an edge.
    let is_beside = |p: DVec3, q: DVec3| {
        let along = q - p;
        along.z * p.x - along.x * p.z > cut * (along.x.abs() + along.z.abs())
    };
    let greatest = if normal.y.is_nan() {
        // What closes a void beside it may rise to the corners that are there.
        [a, b, c].iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max)
    } else {
        (normal.dot(a) + cut * (normal.x.abs() + normal.z.abs())) / normal.y
    };
    is_beside(a, b) || is_beside(b, c) || is_beside(c, a) || greatest < below
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::SIDES;
    use std::collections::HashSet;

    /// What raises the horizon is drawn, whatever neighbours are coarser, and what lies between voids and heights is within a block.
    #[test]
    fn lines_are_edges_of_what_is_drawn_and_triangles_stay_in_their_block() {
        for side in SIDES {
            for coarser in 0..16u8 {
                let mut edges = HashSet::new();
                for (i, j) in (0..side - 1).flat_map(|j| (0..side - 1).map(move |i| (i, j))) {
                    let within = |k: u32, cell: u32| {
                        k / BLOCK as u32 * BLOCK as u32 <= cell && cell <= (k / BLOCK as u32 + 1) * BLOCK as u32
                    };
                    for [a, b, c] in drawn(i, j, side, coarser) {
                        assert!(
                            [a, b, c].iter().all(|&[x, y]| within(i, x) && within(j, y)),
                            "{coarser:04b}: cell {i}, {j}"
                        );
                        edges.extend([[a, b], [b, a], [b, c], [c, b], [c, a], [a, c]]);
                    }
                }
                for k in (LINE as u32..side - 1).step_by(BLOCK) {
                    for m in 0..side - 1 {
                        assert!(edges.contains(&[[k, m], [k, m + 1]]), "{coarser:04b}: column {k}, sample {m}");
                        assert!(edges.contains(&[[m, k], [m + 1, k]]), "{coarser:04b}: row {k}, sample {m}");
                    }
                }
            }
        }
        assert!(SIDES.iter().all(|side| ((side - 1) as usize).is_multiple_of(BLOCK) && *side as usize <= MOST));
    }

    /// Columns that a line covers get its lowest slope there, whichever way it leans and wherever it has a notch.
    #[test]
    fn a_line_raises_a_column_to_its_lowest_place_there() {
        let mut horizon = Raised::new();
        horizon.line(&[(10.0, 4.0), (14.0, 8.0), (16.0, 2.0), (16.5, 1.0), (18.0, 7.0)]);
        assert_eq!(horizon.slopes[9..19], [LOW, 4.0, 5.0, 6.0, 7.0, 5.0, 2.0, 1.0, 3.0, LOW]);
        // A lower one changes nothing, and one with a void nothing beside it.
        horizon.line(&[(10.0, 1.0), (18.0, 1.0)]);
        assert_eq!(horizon.slopes[10], 4.0);
        horizon.line(&[(10.0, 9.0), (12.0, 9.0), (13.0, NOWHERE), (14.0, 9.0), (15.0, 9.0)]);
        assert_eq!(horizon.slopes[10..14], [9.0, 9.0, 6.0, 7.0]);
        horizon.is_closed[11] = true;
        horizon.line(&[(10.0, 20.0), (13.0, 20.0)]);
        assert_eq!(horizon.slopes[10..13], [20.0, 9.0, 20.0]);
    }

    /// Two lines that meet within a column are one; those that don't leave a gap.
    #[test]
    fn lines_go_on_where_others_end() {
        for (from, is_whole) in [(20.25, true), (20.125, true), (20.5, false)] {
            for turned in [false, true] {
                let mut horizon = Raised::new();
                let mut lines = [[(18.0, 3.0), (20.25, 3.0)], [(from, 2.0), (22.0, 2.0)]];
                if turned {
                    lines.reverse();
                }
                lines.iter().for_each(|line| horizon.line(line));
                assert_eq!(horizon.slopes[19..22], [3.0, if is_whole { 2.0 } else { LOW }, 2.0], "{from}, {turned}");
            }
        }
    }

    const LOW: f32 = f32::NEG_INFINITY;

    /// One picture.
    struct Raised {
        slopes: Vec<f32>,
        seams: Vec<Seam>,
        is_closed: Vec<bool>,
    }

    impl Raised {
        fn new() -> Self {
            Self { slopes: vec![LOW; COLUMNS], seams: vec![Seam::NONE; COLUMNS], is_closed: vec![false; COLUMNS] }
        }

        /// A line through places in columns, with slopes.
        fn line(&mut self, of: &[(f64, f64)]) {
            let along: Vec<f64> = of.iter().map(|(at, _)| at / (COLUMNS / 2) as f64 - 1.0).collect();
            let heights: Vec<f64> = of.iter().map(|(_, slope)| *slope).collect();
            Line { depth: 1.0, along: &along, heights: &heights }.raise(&mut self.slopes, &mut self.seams, &self.is_closed);
        }
    }
}
