//! Portals, rows and occlusion queries together: what the first two leave is walked as a tree, and asked about on the way.
//!
//! Based on: Bittner et al. 2004 and Mattausch et al. 2008 ([`crate::occlusion::chc`], [`crate::occlusion::chc_plus`]) within what Luebke and
//! Georges' traversal leaves. In an open cell, where a portal leads to half of the scene, the queries do the work; in a room the portals
//! do, and few nodes are left to ask about. An object is in the walk only where a portal opens the part of the screen that it is
//! on, so the queries never look beyond the portals' frusta.

use super::{Camera, Culler, FrameStats, Mode, Scratch, VisibleSet};
use crate::ObjectId;
use crate::geom::Aabb;
use crate::occlusion::chc::{Chc, Reduction};
use crate::occlusion::chc_plus::{ChcPlus, ChcPlusOptions};
use crate::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use crate::occlusion::mask::Mask;
use crate::occlusion::oracle::OcclusionOracle;
use crate::occlusion::view::Frustum;
use std::fmt;
use std::str::FromStr;

/// How to cull where an occlusion oracle is at hand.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Method {
    /// Without asking it.
    Plain(Mode),
    /// [`Mode::Both`], and of what that leaves, what CHC draws.
    Chc,
    /// [`Mode::Both`], and of what that leaves, what CHC++ draws.
    ChcPlus,
}

impl Method {
    /// Every method, those that ask nothing first.
    pub const ALL: [Self; 7] = [
        Self::Plain(Mode::None),
        Self::Plain(Mode::Frustum),
        Self::Plain(Mode::Portals),
        Self::Plain(Mode::Pvs),
        Self::Plain(Mode::Both),
        Self::Chc,
        Self::ChcPlus,
    ];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plain(mode) => mode.name(),
            Self::Chc => "chc",
            Self::ChcPlus => "chc++",
        }
    }

    /// Whether it asks the oracle.
    pub const fn asks(self) -> bool {
        !matches!(self, Self::Plain(_))
    }
}

impl From<Mode> for Method {
    fn from(mode: Mode) -> Self {
        Self::Plain(mode)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|method| method.name() == name);
        found.ok_or_else(|| format!("no mode \"{name}\"; give none, frustum, portals, pvs, both, chc or chc++"))
    }
}

/// Culls with an oracle; keeps what one camera needs from frame to frame.
#[derive(Clone, Debug)]
pub struct OnlineCuller {
    tree: Hierarchy,
    mask: Mask,
    chc: Chc,
    plus: ChcPlus,
    scratch: Scratch,
}

impl OnlineCuller {
    /// Makes a tree of all objects' boxes.
    pub fn new(culler: &Culler) -> Self {
        let objects = 0..culler.object_count();
        let aabb = |i: usize| {
            let (centre, half) = culler.boxes.get(i);
            let (centre, half) = (centre.as_dvec3(), half.as_dvec3());
            Aabb { min: centre - half, max: centre + half }
        };
        let boxes: Vec<Aabb> = objects.clone().map(aabb).collect();
        let triangles: Vec<u32> = objects.map(|i| culler.triangles(ObjectId(i as u32))).collect();
        let tree = Hierarchy::of_boxes(&boxes, &triangles, &HierarchyOptions::default());
        Self {
            mask: Mask::new(&tree),
            tree,
            chc: Chc::new(Reduction::None, 0),
            plus: ChcPlus::new(ChcPlusOptions::default()),
            scratch: Scratch::for_culler(culler),
        }
    }

    /// Draws a frame with an oracle that has just begun one with [`Camera::view`] of this camera and `near` (metres, above 0). Returns
    /// what was drawn: every object that has a pixel at the oracle's size and no nearer than `near`, as far as [`Culler::cull`] has it.
    /// `culler` is that of [`Self::new`]; its doors may have moved. Allocates nothing after the first frame of each method.
    pub fn cull(
        &mut self,
        culler: &Culler,
        camera: &Camera,
        near: f64,
        method: Method,
        oracle: &mut impl OcclusionOracle,
    ) -> VisibleSet<'_> {
        let mode = if let Method::Plain(mode) = method { mode } else { Mode::Both };
        let visible = culler.cull(camera, mode, &mut self.scratch);
        if !method.asks() {
            visible.objects.iter().for_each(|&object| oracle.draw(object));
            return visible;
        }
        self.mask.set(&self.tree, visible.objects);
        let frustum = Frustum::new(&camera.view(near));
        let (objects, asked) = if method == Method::ChcPlus {
            self.plus.cull_of(&self.tree, &self.mask, &frustum, oracle);
            (self.plus.objects(), self.plus.stats())
        } else {
            self.chc.cull_of(&self.tree, &self.mask, &frustum, oracle);
            (self.chc.objects(), self.chc.stats())
        };
        let triangles = objects.iter().map(|&o| u64::from(culler.triangles(o))).sum();
        let stats = FrameStats { objects: objects.len() as u64, triangles, queries: asked.queries, ..visible.stats };
        VisibleSet { objects, stats, ..visible }
    }
}
