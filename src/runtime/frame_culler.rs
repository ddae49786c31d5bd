//! A frame from beginning to end: one camera's culling in any mode, with occlusion queries and `auto`.
//!
//! In: a [`Culler`], a camera, a mode, and an oracle where there is one. Out: the objects to draw.

use super::online::OnlineCuller;
use super::{Camera, Culler, Mode, Scratch, VisibleSet};
use crate::occlusion::hierarchy::Hierarchy;
use crate::occlusion::oracle::OcclusionOracle;
use std::fmt;
use std::str::FromStr;

/// How frames are culled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FrameMode {
    /// [`Mode::None`].
    None,
    /// [`Mode::Frustum`].
    Frustum,
    /// [`Mode::Portals`].
    Portals,
    /// [`Mode::Pvs`].
    Pvs,
    /// [`Mode::Both`].
    Both,
    /// [`Mode::Both`], and CHC for what that leaves.
    Chc,
    /// [`Mode::Both`], and CHC++ for what that leaves.
    ChcPlus,
    /// [`Mode::Both`] in a closed cell; CHC in an open one, where portals and rows hide little.
    Auto,
}

impl FrameMode {
    /// Every mode, the least culling first.
    pub const ALL: [Self; 8] =
        [Self::None, Self::Frustum, Self::Portals, Self::Pvs, Self::Both, Self::Chc, Self::ChcPlus, Self::Auto];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Frustum => "frustum",
            Self::Portals => "portals",
            Self::Pvs => "pvs",
            Self::Both => "both",
            Self::Chc => "chc",
            Self::ChcPlus => "chc++",
            Self::Auto => "auto",
        }
    }

    /// Whether it may issue occlusion queries.
    pub const fn has_queries(self) -> bool {
        matches!(self, Self::Chc | Self::ChcPlus | Self::Auto)
    }

    /// The part that needs no queries; `None` where queries decide the rest.
    pub(super) const fn without_queries(self) -> Option<Mode> {
        match self {
            Self::None => Some(Mode::None),
            Self::Frustum => Some(Mode::Frustum),
            Self::Portals => Some(Mode::Portals),
            Self::Pvs => Some(Mode::Pvs),
            Self::Both => Some(Mode::Both),
            Self::Chc | Self::ChcPlus | Self::Auto => None,
        }
    }
}

impl From<Mode> for FrameMode {
    fn from(mode: Mode) -> Self {
        match mode {
            Mode::None => Self::None,
            Mode::Frustum => Self::Frustum,
            Mode::Portals => Self::Portals,
            Mode::Pvs => Self::Pvs,
            Mode::Both => Self::Both,
        }
    }
}

impl fmt::Display for FrameMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for FrameMode {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|mode| mode.name() == name);
        found.ok_or_else(|| format!("no mode \"{name}\"; give none, frustum, portals, pvs, both, chc, chc++, auto, or all"))
    }
}

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

    /// The mode that a frame is culled by, which is never [`FrameMode::Auto`]: asking what portals and rows leave pays where they leave much.
    pub fn choose(&mut self, culler: &Culler, camera: &Camera, mode: FrameMode) -> FrameMode {
        match mode {
            FrameMode::Auto => match culler.cell_of(camera.eye, &mut self.scratch) {
                Some(cell) if !culler.is_open_cell(cell) => FrameMode::Both,
                _ => FrameMode::Chc,
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
        mode: FrameMode,
        oracle: Option<&mut dyn OcclusionOracle>,
    ) -> VisibleSet<'_> {
        let mode = self.choose(culler, camera, mode);
        match (mode.without_queries(), oracle) {
            (None, Some(mut oracle)) => {
                let online = self.online.get_or_insert_with(|| OnlineCuller::new(culler));
                let view = camera.view(near);
                oracle.begin(&view);
                online.cull(culler, (camera, &view), mode, &mut oracle)
            }
            (plain, _) => culler.cull(camera, plain.unwrap_or(Mode::Both), &mut self.scratch),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_are_known_by_name() {
        for mode in FrameMode::ALL {
            assert_eq!(mode.to_string().parse(), Ok(mode));
        }
        for mode in Mode::ALL {
            assert_eq!((FrameMode::from(mode).without_queries(), FrameMode::from(mode).name()), (Some(mode), mode.name()));
        }
        assert!("Both".parse::<FrameMode>().unwrap_err().contains("no mode"));
    }
}
