//! Tiles, and things on them, that nearer ground hides: a horizon about the eye, raised from near to far.
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
//! * **Things** are boxes, cut along the finest tiles ([`things`]), and each piece is held against the horizon at its own place in the order: before a
//!   patch raises it, all pieces that don't come after all of the patch have been. So what raised it comes before the piece's tile, and no
//!   ray leads from the piece's tile back to it: the piece is behind, as a patch of that place would be.
//! * **The eye** may not be below the ground, over a void or beside the raster, and the near plane may not cut the ground: else all is kept.

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

/// Memory of the horizon of one ground, to be used again each frame.
pub struct Horizon {
    columns: Columns,
    /// Tiles with voids.
    holes: Vec<u32>,
    /// Patches and, after them, holes: by their place in the order, near ones first.
    order: Vec<(u64, u32)>,
    /// The latest patch in that order.
    latest: Option<Key>,
    patches: Vec<Patch>,
    triangles: u64,
    /// Pieces of things that were asked about, in the same order, and how many of them are decided.
    asked: Vec<(u64, u32)>,
    decided: usize,
    /// By thing.
    found: Vec<Found>,
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

    /// Of the patches that were selected for a view, those that nearer ones don't hide, near ones first. `near`: metres from the eye to the
    /// near plane. The ground is that of [`new`](Self::new). Allocates nothing.
    pub fn hide(&mut self, ground: &Ground, view: &GroundView<'_>, near: f64, patches: &[Patch]) -> &[Patch] {
        self.hide_with(ground, view, near, patches, &Things::default(), [])
    }

    /// The same, and finds which of the things that are `asked` about, by their numbers, the ground hides: [`hides`](Self::hides) tells.
    /// Allocates nothing after the first frame with these things.
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

    /// What the last frame has kept.
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// Its triangles, those that stitching makes nothing of included.
    pub fn triangles(&self) -> u64 {
        self.triangles
    }

    /// True where what of a thing is in the last frame's view certainly was behind ground. False for what the frame didn't ask about, and for
    /// what is all beside the view.
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

    /// Puts pieces of things in order.
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

    /// Holds pieces that come before a place in the order against the horizon as it is.
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

    /// The next patch or hole in the order.
    fn take(&mut self, ground: &Ground, eye: DVec3, patches: &[Patch], (rank, k): (u64, u32), things: &Things) {
        let (header, k) = (ground.header(), k as usize);
        let Some(patch) = patches.get(k) else {
            let hole = self.holes[k - patches.len()];
            let key = header.grid.key(hole);
            // What is drawn there was looked at block by block.
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
            // Finest tiles of a tile of a level are so many places.
            self.decide(things, eye, rank + (1 << (2 * patch.key.level)));
            self.columns.raise(ground, patch, eye);
        }
    }
}
