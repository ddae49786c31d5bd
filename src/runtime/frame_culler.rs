//! A frame from beginning to end: one camera's culling in any mode, with occlusion queries and `auto`.
//!
//! In: a [`Culler`], a camera, a mode, and an oracle where there is one. Out: the objects to draw.

use super::online::OnlineCuller;
use super::{Camera, Culler, Mode, Scratch, VisibleSet};
use crate::occlusion::hierarchy::Hierarchy;
use crate::occlusion::oracle::OcclusionOracle;

/// Culls one camera's frames, in any mode, one after the other. The culler is given each time, always the same; its doors may move.
#[derive(Clone, Debug)]
pub struct FrameCuller {
    scratch: Scratch,
    /// Made by the first mode that needs it.
    online: Option<OnlineCuller>,
}

impl FrameCuller {
    /// For one camera; cameras may share a culler.
    pub fn new(culler: &Culler) -> Self {
        Self { scratch: Scratch::for_culler(culler), online: None }
    }

    /// Makes room for occlusion queries now; the first frame with queries does it otherwise.
    pub fn prepare_queries(&mut self, culler: &Culler) {
        self.online.get_or_insert_with(|| OnlineCuller::new(culler));
    }

    /// Makes room for occlusion queries, with a tree of the client's ([`Hierarchy::of_tree`], [`Hierarchy::divided`]) over the culler's
    /// objects, relative to the file's origin. Panics where the tree has more objects, or fewer.
    pub fn prepare_queries_with(&mut self, culler: &Culler, tree: Hierarchy) {
        self.online = Some(OnlineCuller::with_tree(culler, tree));
    }

    /// As if no frame had been culled yet.
    pub fn restart(&mut self, culler: &Culler) {
        let tree = self.online.take().map(OnlineCuller::into_tree);
        self.online = tree.map(|tree| OnlineCuller::with_tree(culler, tree));
    }

    /// The mode that a frame is culled by, which is never [`Mode::Auto`]: asking what portals and rows leave pays where they leave much.
    pub fn choose(&mut self, culler: &Culler, camera: &Camera, mode: Mode) -> Mode {
        match mode {
            Mode::Auto => match culler.cell_of(camera.eye, &mut self.scratch) {
                Some(cell) if !culler.is_open_cell(cell) => Mode::PortalsAndPvs,
                _ => Mode::Chc,
            },
            mode => mode,
        }
    }

    /// Culls a frame, with a near plane at `near` metres, above 0.
    ///
    /// With an `oracle`, modes with queries begin its frame and draw into it; what it drew is what they return. Without one they return what
    /// portals and rows leave: a renderer whose device answers its own queries goes on from there. Allocates nothing after the first frame of
    /// each mode.
    pub fn cull(
        &mut self,
        culler: &Culler,
        camera: &Camera,
        near: f64,
        mode: Mode,
        oracle: Option<&mut dyn OcclusionOracle>,
    ) -> VisibleSet<'_> {
        let mode = self.choose(culler, camera, mode);
        match oracle {
            Some(mut oracle) if mode.has_queries() => {
                let online = self.online.get_or_insert_with(|| OnlineCuller::new(culler));
                let view = camera.view(near);
                oracle.begin(&view);
                online.cull(culler, (camera, &view), mode, &mut oracle)
            }
            _ => culler.cull(camera, mode, &mut self.scratch),
        }
    }
}
