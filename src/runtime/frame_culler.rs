//! A complete frame: one camera's culling in any mode, with occlusion queries and `auto`.
//!
//! In: a [`Culler`], a camera, a mode, and an optional oracle. Out: the objects to draw.

use super::online::OnlineCuller;
use super::{Camera, Culler, Mode, Scratch, VisibleSet};
use crate::occlusion::hierarchy::Hierarchy;
use crate::occlusion::oracle::OcclusionOracle;

/// Culls the frames of one camera, in any mode. Pass the same culler each time; its doors may move.
#[derive(Clone, Debug)]
pub struct FrameCuller {
    scratch: Scratch,
    /// Created by the first mode that needs it.
    online: Option<OnlineCuller>,
}

impl FrameCuller {
    /// A frame culler for one camera; cameras may share a culler.
    pub fn new(culler: &Culler) -> Self {
        Self { scratch: Scratch::for_culler(culler), online: None }
    }

    /// Allocates for occlusion queries now, instead of in the first frame with queries.
    pub fn prepare_queries(&mut self, culler: &Culler) {
        self.online.get_or_insert_with(|| OnlineCuller::new(culler));
    }

    /// Allocates for occlusion queries, with a client's tree ([`Hierarchy::of_tree`]) over the culler's objects,
    /// relative to the file's origin. Panics if the number of objects differs.
    pub fn prepare_queries_with(&mut self, culler: &Culler, tree: Hierarchy) {
        self.online = Some(OnlineCuller::with_tree(culler, tree));
    }

    /// Resets the state between frames.
    pub fn restart(&mut self, culler: &Culler) {
        let tree = self.online.take().map(OnlineCuller::into_tree);
        self.online = tree.map(|tree| OnlineCuller::with_tree(culler, tree));
    }

    /// The mode of a frame, with [`Mode::Auto`] resolved: queries pay if portals and rows leave much.
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
    /// With an `oracle`, modes with queries begin its frame, draw into it and return the drawn objects. Without one, they return the result
    /// of portals and rows, for renderers with their own queries. Allocates nothing after the first frame of each mode.
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
