//! Who culls the frames of a walk: a mode with what it keeps from frame to frame.

use super::raster::View;
use crate::occlusion::depth::DepthBuffer;
use crate::occlusion::oracle::OcclusionOracle;
use crate::runtime::{Auto, Culler, Method, Mode, OnlineCuller, Scratch, VisibleSet};
use std::fmt;
use std::str::FromStr;
use std::time::Instant;

/// How the frames of a walk are culled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WalkMode {
    /// All in one way.
    Fixed(Method),
    /// Each in the way that costs the least there.
    Auto,
}

impl WalkMode {
    /// Every mode, the least culling first.
    pub fn all() -> Vec<Self> {
        Method::ALL.into_iter().map(Self::Fixed).chain([Self::Auto]).collect()
    }

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fixed(method) => method.name(),
            Self::Auto => "auto",
        }
    }

    /// Whether it may ask an occlusion oracle.
    pub const fn asks(self) -> bool {
        match self {
            Self::Fixed(method) => method.asks(),
            Self::Auto => true,
        }
    }
}

impl From<Mode> for WalkMode {
    fn from(mode: Mode) -> Self {
        Self::Fixed(mode.into())
    }
}

impl fmt::Display for WalkMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for WalkMode {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        match name {
            "auto" => Ok(Self::Auto),
            name => name.parse().map(Self::Fixed).map_err(|e| format!("{e}, auto, or all")),
        }
    }
}

/// What a frame took, microseconds.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Times {
    /// Culling; where an oracle is asked, with what it draws.
    pub cull: f64,
    /// With all that is left drawn into the oracle, where there is one.
    pub frame: Option<f64>,
}

/// Culls a walk's frames in a mode, one after the other.
pub(super) struct Walker {
    mode: WalkMode,
    scratch: Scratch,
    /// For modes that ask.
    online: Option<OnlineCuller>,
    auto: Option<Auto>,
}

impl Walker {
    pub fn new(mode: WalkMode, culler: &Culler) -> Self {
        Self {
            mode,
            scratch: Scratch::for_culler(culler),
            online: mode.asks().then(|| OnlineCuller::new(culler)),
            auto: (mode == WalkMode::Auto).then(|| Auto::new(culler.cell_count(), &Method::ALL)),
        }
    }

    /// Culls a frame, and draws what is left into the oracle, if there is one; modes that ask need it. Says how it was culled, and what it
    /// took.
    pub fn cull(
        &mut self,
        culler: &Culler,
        view: &View,
        oracle: Option<&mut DepthBuffer<'_>>,
    ) -> (VisibleSet<'_>, Method, Times) {
        let start = Instant::now();
        let us = || start.elapsed().as_nanos() as f64 / 1e3;
        let (camera, near) = (&view.camera, nearer(view).near);
        // 1. How.
        let method = match (self.mode, &mut self.auto) {
            (WalkMode::Fixed(method), _) => method,
            (WalkMode::Auto, auto) => {
                let home = culler.cell_of(camera.eye, &mut self.scratch);
                let count = |mode| culler.cull(camera, mode, &mut self.scratch).stats.triangles;
                auto.as_mut().expect("made with it").choose(home, count)
            }
        };
        // 2. By itself, or with the oracle.
        let asked = oracle.is_some();
        let (visible, cull) = match (method, oracle) {
            (Method::Plain(mode), oracle) => {
                let visible = culler.cull(camera, mode, &mut self.scratch);
                let cull = us();
                if let Some(oracle) = oracle {
                    oracle.begin(&camera.view(near));
                    visible.objects.iter().for_each(|&object| oracle.draw(object));
                }
                (visible, cull)
            }
            (_, oracle) => {
                let (online, oracle) = (self.online.as_mut().expect("it asks"), oracle.expect("modes that ask need one"));
                oracle.begin(&camera.view(near));
                let visible = online.cull(culler, camera, near, method, oracle);
                (visible, us())
            }
        };
        let frame = us();
        if let Some(auto) = &mut self.auto {
            auto.learn(frame, visible.stats.triangles);
        }
        (visible, method, Times { cull, frame: asked.then_some(frame) })
    }
}

/// The view that pictures are compared in: from the eye itself. A camera that stands nearer to a wall than its near plane looks through
/// the wall, which no culler by visibility foresees.
pub(super) fn nearer(view: &View) -> View {
    View { near: view.near * 1e-3, ..*view }
}
