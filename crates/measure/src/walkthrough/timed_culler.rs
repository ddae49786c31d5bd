//! Measures the time of culling a walk's frames.

use super::raster::View;
use enfilade::ObjectId;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::hierarchy::Hierarchy;
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::runtime::{Culler, FrameCuller, Mode, VisibleSet};
use std::time::Instant;

/// Times of a frame, microseconds.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Times {
    /// Culling; in modes with queries, including the triangles that the oracle draws.
    pub cull: f64,
    /// The same plus drawing all remaining objects into the oracle, if there is one.
    pub frame: Option<f64>,
}

/// Times the culling of a walk's frames in one mode.
pub(super) struct TimedCuller {
    mode: Mode,
    frames: FrameCuller,
}

impl TimedCuller {
    /// `tree`: the hierarchy of the culler's objects, for modes with queries.
    pub fn new(mode: Mode, culler: &Culler, tree: impl FnOnce() -> Hierarchy) -> Self {
        let mut frames = FrameCuller::new(culler);
        if mode.has_queries() {
            frames.prepare_queries_with(culler, tree());
        }
        Self { mode, frames }
    }

    /// Culls a frame and draws the remaining objects into the oracle, if there is one; modes with queries need it. Returns the
    /// set, the mode that was used and the times.
    pub fn cull(
        &mut self,
        culler: &Culler,
        view: &View,
        mut oracle: Option<&mut DepthBuffer<'_>>,
    ) -> (VisibleSet<'_>, Mode, Times) {
        let start = Instant::now();
        let us = || start.elapsed().as_nanos() as f64 / 1e3;
        let (camera, near) = (&view.camera, nearer(view).near);
        let mode = self.frames.choose(culler, camera, self.mode);
        let visible = self.frames.cull(culler, camera, near, mode, oracle.as_deref_mut().map(|oracle| oracle as _));
        let cull = us();
        let with_oracle = oracle.is_some();
        if let Some(oracle) = oracle.filter(|_| !mode.has_queries()) {
            draw_rest(oracle, view, visible.objects);
        }
        let took = us();
        (visible, mode, Times { cull, frame: with_oracle.then_some(took) })
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
