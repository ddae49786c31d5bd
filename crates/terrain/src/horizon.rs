//! Culls tiles and objects that nearer ground hides: a horizon around the eye, raised from near to far.
//!
//! Based on: Stewart, *Hierarchical visibility in terrains*, 1998, and Lloyd, Egbert, *Horizon occlusion culling for real-time
//! rendering of hierarchical terrains*, 2002: for each direction in the plan, the slope up to which nearer ground reaches; a box
//! below it is hidden. Deviations: directions are columns of four upright pictures around the eye, in which straight lines stay
//! straight; and lines of samples of the drawn tiles raise the horizon, not bounds of their heights.
//!
//! # Why hidden tiles cannot show
//!
//! Let a ray from an eye above the ground be below a line of samples where it crosses that line in the plan. Then it has passed
//! through the ground before: a height field without holes is drawn up to the line. Each column keeps the greatest slope that
//! such lines reach *everywhere* in it. No ray meets a box behind these lines and below their slope in all its columns.
//!
//! * **The drawn surface counts**, not the raster: samples come from the patches of the frame, without lines that stitching may
//!   move ([`snapped`](super::snapped)). So a hidden patch is hidden in this picture, whose error stays the same.
//! * **Order**: patches follow the order of the quadtree, near quarters first. No ray leads from a later one to an earlier one.
//! * **Patches and parts outside the windows** are not drawn, and no ray of the picture crosses their surface.
//! * **Voids**: a ray can pass below the ground through a hole. Lines behind cells with voids do not raise a column, unless the
//!   column hid all of these cells already.
//! * **Objects** are boxes, cut along the finest tiles ([`things`]). Each piece is tested at its own place in the order: before a
//!   patch raises the horizon, all pieces are tested that do not come entirely after it. So the patches that raised it come
//!   before the piece's tile, and no ray leads from that tile back.
//! * **The eye** must be above ground, over the raster, not over a void, and the near plane must not cut ground; else all is
//!   kept.

mod above;
mod columns;
mod holes;
mod line;
mod order;
mod picture;
mod things;

use super::{Ground, GroundView, Key, Patch};
use above::is_above;
use columns::{Columns, Found};
use glam::DVec3;
use holes::holes;
use order::{contains, rank, tiles_from_corner};
use picture::{FACES, Footprint};
pub use things::Things;

/// Memory of the horizon of one ground, reused each frame.
pub struct Horizon {
    columns: Columns,
    /// Tiles with voids.
    holes: Vec<u32>,
    /// Patches and, after them, holes: by rank in the order, near ones first.
    order: Vec<(u64, u32)>,
    /// The latest patch in that order.
    latest: Option<Key>,
    patches: Vec<Patch>,
    triangles: u64,
    /// Pieces of objects to test, in the same order, and the number tested so far.
    asked: Vec<(u64, u32)>,
    decided: usize,
    /// Result by object.
    found: Vec<Found>,
}

impl std::fmt::Debug for Horizon {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Horizon").field("patches", &self.patches.len()).finish_non_exhaustive()
    }
}

impl Horizon {
    /// For a ground.
    pub fn new(ground: &Ground) -> Self {
        let tiles = ground.tiles().len();
        let holes = holes(ground);
        Self {
            columns: Columns::new(),
            order: Vec::with_capacity(tiles + holes.len()),
            holes,
            latest: None,
            patches: Vec::with_capacity(tiles),
            triangles: 0,
            asked: Vec::new(),
            decided: 0,
            found: Vec::new(),
        }
    }

    /// The patches of a selection that nearer ones do not hide, near ones first. `near`: metres from the eye to the near plane.
    /// The ground is that of [`new`](Self::new). Allocates nothing.
    pub fn hide(&mut self, ground: &Ground, view: &GroundView<'_>, near: f64, patches: &[Patch]) -> &[Patch] {
        self.hide_with(ground, view, near, patches, &Things::default(), [])
    }

    /// The same, and also tests the objects with the numbers `asked`; [`hides`](Self::hides) returns the results. Allocates only
    /// in the first frame with these objects.
    pub fn hide_with(
        &mut self,
        ground: &Ground,
        view: &GroundView<'_>,
        near: f64,
        patches: &[Patch],
        things: &Things,
        asked: impl IntoIterator<Item = usize>,
    ) -> &[Patch] {
        let eye = view.camera.eye.as_dvec3();
        self.patches.clear();
        self.found.clear();
        if is_above(ground, view, near, patches) {
            self.begin(ground, view, patches);
            self.ask(ground, eye, things, asked);
            for k in 0..self.order.len() {
                self.take(ground, eye, patches, self.order[k], things);
            }
            self.decide(things, eye, u64::MAX);
        } else {
            self.patches.extend_from_slice(patches);
        }
        let side = ground.header().grid.side();
        self.triangles = self.patches.iter().map(|patch| patch.triangles(side)).sum();
        &self.patches
    }

    /// The patches kept in the last frame.
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// Its triangles, including those that stitching collapses.
    pub fn triangles(&self) -> u64 {
        self.triangles
    }

    /// Whether the part of an object in the last frame's view was certainly behind ground. False for objects that were not
    /// tested, and for objects entirely outside the view.
    pub fn hides(&self, thing: usize) -> bool {
        self.found.get(thing) == Some(&Found::Hidden)
    }

    fn begin(&mut self, ground: &Ground, view: &GroundView<'_>, patches: &[Patch]) {
        let (header, eye) = (ground.header(), view.camera.eye.as_dvec3());
        self.columns.begin(view);
        self.order.clear();
        self.latest = None;
        let at = tiles_from_corner(header, eye);
        let keys = patches.iter().map(|patch| patch.key).chain(self.holes.iter().map(|&hole| header.grid.key(hole)));
        self.order.extend(keys.zip(0..).map(|(key, k)| (rank(header, key, at), k)));
        self.order.sort_unstable();
    }

    /// Sorts pieces of objects by rank.
    fn ask(&mut self, ground: &Ground, eye: DVec3, things: &Things, asked: impl IntoIterator<Item = usize>) {
        let (header, at) = (ground.header(), tiles_from_corner(ground.header(), eye));
        self.found.resize(things.len(), Found::Beside);
        self.asked.clear();
        self.asked.reserve(things.pieces().len());
        for k in asked.into_iter().flat_map(|thing| things.pieces_of(thing)) {
            self.asked.push((rank(header, things.pieces()[k].tile, at), k as u32));
        }
        self.asked.sort_unstable();
        self.decided = 0;
    }

    /// Tests pieces before a rank against the current horizon.
    fn decide(&mut self, things: &Things, eye: DVec3, end: u64) {
        while let Some((_, k)) = self.asked.get(self.decided).filter(|(rank, _)| *rank < end) {
            let piece = &things.pieces()[*k as usize];
            let found = &mut self.found[piece.thing];
            if *found < Found::Shows {
                *found = (*found).max(self.columns.judge_piece(&piece.footprint(eye)));
            }
            self.decided += 1;
        }
    }

    /// Processes the next patch or hole in the order.
    fn take(&mut self, ground: &Ground, eye: DVec3, patches: &[Patch], (rank, k): (u64, u32), things: &Things) {
        let (header, k) = (ground.header(), k as usize);
        let Some(patch) = patches.get(k) else {
            let hole = self.holes[k - patches.len()];
            let key = header.grid.key(hole);
            // Drawn tiles were handled block by block.
            if !self.latest.is_some_and(|latest| contains(latest, key)) {
                let of = Footprint::new(header, key, &ground.tiles()[hole as usize], eye);
                (0..FACES.len()).for_each(|face| self.columns.close(&of, face));
            }
            return;
        };
        self.latest = Some(patch.key);
        let of = Footprint::new(header, patch.key, &ground.tiles()[patch.tile as usize], eye);
        if self.columns.judge(&of) == Found::Shows {
            self.patches.push(*patch);
            // A tile covers this many finest tiles in the order.
            self.decide(things, eye, rank + (1 << (2 * patch.key.level)));
            self.columns.raise(ground, patch, eye);
        }
    }
}
