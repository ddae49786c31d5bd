//! What culling a walk's frames takes.

use super::raster::View;
use enfilade::ObjectId;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::hierarchy::Hierarchy;
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::runtime::{Culler, FrameCuller, FrameMode, VisibleSet};
use std::time::Instant;

/// What a frame took, microseconds.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Times {
    /// Culling; where an oracle is asked, with what it draws.
    pub cull: f64,
    /// With all that is left drawn into the oracle, where there is one.
    pub frame: Option<f64>,
}

/// Times the culling of a walk's frames in a mode, one after the other.
pub(super) struct TimedCuller {
    mode: FrameMode,
    frames: FrameCuller,
}

impl TimedCuller {
    /// `tree`: of the culler's objects, for modes with queries.
    pub fn new(mode: FrameMode, culler: &Culler, tree: impl FnOnce() -> Hierarchy) -> Self {
        let mut frames = FrameCuller::new(culler);
        if mode.has_queries() {
            frames.prepare_queries_with(culler, tree());
        }
        Self { mode, frames }
    }

    /// Culls a frame, and draws what is left into the oracle, if there is one; modes with queries need it. Says how the frame was culled,
    /// and what it took.
    pub fn cull(
        &mut self,
        culler: &Culler,
        view: &View,
        mut oracle: Option<&mut DepthBuffer<'_>>,
    ) -> (VisibleSet<'_>, FrameMode, Times) {
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

/// Draws what is left of a frame that no query was asked in.
pub(super) fn draw_rest(oracle: &mut DepthBuffer<'_>, view: &View, objects: &[ObjectId]) {
    let view = nearer(view);
    oracle.begin(&view.camera.view(view.near));
    objects.iter().for_each(|&object| OcclusionOracle::draw(oracle, object));
}

/// The view that pictures are compared in: from the eye itself. A camera that stands nearer to a wall than its near plane looks through
/// the wall, which no culler by visibility foresees.
pub(super) fn nearer(view: &View) -> View {
    View { near: view.near * 1e-3, ..*view }
}
