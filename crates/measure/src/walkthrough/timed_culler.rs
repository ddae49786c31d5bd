//! Measures the time of culling a walk's frames.

use super::raster::View;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::hierarchy::Hierarchy;
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::runtime::{self, CrossedPortal, Culler, Doors, FrameStats, MinPixels, Mode, MoverId, Movers, VisibleSet};
use enfilade::{CellId, ObjectId};
use std::sync::Arc;
use std::time::Instant;

/// Times of a frame, microseconds.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Times {
    /// Culling; in modes with queries, including the triangles that the oracle draws.
    pub cull: f64,
    /// The same plus drawing all remaining objects into the oracle, if there is one.
    pub frame: Option<f64>,
}

/// What a culler sees in a frame, the library's or the exact one.
#[derive(Clone, Copy)]
pub(super) struct Seen<'s> {
    pub objects: &'s [ObjectId],
    pub cells: &'s [CellId],
    pub portals: &'s [CrossedPortal],
    /// The eye's cell; `None` if it is in none, or unknown.
    pub home: Option<CellId>,
    pub stats: FrameStats,
}

impl<'s> From<VisibleSet<'s>> for Seen<'s> {
    fn from(set: VisibleSet<'s>) -> Self {
        let VisibleSet { objects, cells, portals, homes, stats, .. } = set;
        Self { objects, cells, portals, home: homes.first().copied(), stats }
    }
}

/// Times the culling of a walk's frames in one mode.
pub(super) struct TimedCuller {
    mode: Mode,
    view: runtime::View,
}

impl TimedCuller {
    /// `tree`: the hierarchy of the culler's objects, for modes with queries.
    pub fn new(mode: Mode, culler: &Arc<Culler>, doors: &Doors, limit: MinPixels, tree: impl FnOnce() -> Hierarchy) -> Self {
        let mut view = runtime::View::new(culler);
        view.set_doors(doors);
        view.set_min_pixels(limit);
        if mode.has_queries() {
            view.prepare_queries(Some(tree()));
        }
        Self { mode, view }
    }

    /// Culls a frame and draws the remaining objects into the oracle, if there is one; modes with queries need it. Returns the
    /// set, the mode that was used and the times.
    pub fn cull(&mut self, view: &View, mut oracle: Option<&mut DepthBuffer<'_>>) -> (Seen<'_>, Mode, Times) {
        let start = Instant::now();
        let us = || start.elapsed().as_nanos() as f64 / 1e3;
        let (camera, near) = (&view.camera, nearer(view).near);
        let mode = self.view.choose(camera, self.mode);
        let visible = match oracle.as_deref_mut() {
            Some(oracle) => self.view.cull_with(camera, mode, near, oracle),
            None => self.view.cull(camera, mode),
        };
        let visible = Seen::from(visible);
        let cull = us();
        let with_oracle = oracle.is_some();
        if let Some(oracle) = oracle.filter(|_| !mode.has_queries()) {
            draw_rest(oracle, view, visible.objects);
        }
        let took = us();
        (visible, mode, Times { cull, frame: with_oracle.then_some(took) })
    }
}

impl TimedCuller {
    /// The movers of the frame that was just culled, with the oracle that drew it, if one did.
    pub fn movers(&mut self, movers: &Movers, oracle: Option<&mut DepthBuffer<'_>>) -> &[MoverId] {
        match oracle {
            Some(oracle) => self.view.movers_with(movers, oracle),
            None => self.view.movers(movers),
        }
    }
}

/// Draws the remaining objects of a frame without queries.
pub(super) fn draw_rest(oracle: &mut DepthBuffer<'_>, view: &View, objects: &[ObjectId]) {
    let view = nearer(view);
    oracle.begin(&view.camera.view(view.near));
    objects.iter().for_each(|&object| OcclusionOracle::draw(oracle, object));
}

/// The view used to compare pictures, from the eye itself. A camera nearer to a wall than its near plane sees through the wall,
/// which a visibility culler does not model.
pub(super) fn nearer(view: &View) -> View {
    View { near: view.near * 1e-3, ..*view }
}
