//! What a renderer asks once a frame: given this camera, what is worth drawing?
//!
//! ```no_run
//! # fn demo(file: &enfilade::file::PvsFile) {
//! use enfilade::runtime::{Camera, Culler, Mode, Scratch};
//! use glam::DVec3;
//!
//! let culler = Culler::new(file);
//! let mut scratch = Scratch::for_culler(&culler);
//! let eye = DVec3::new(2.0, 1.6, 3.0) - file.origin;
//! let camera = Camera::look_at(eye, eye + DVec3::X, 60f64.to_radians(), 16.0 / 9.0);
//! let visible = culler.cull(&camera, Mode::Both, &mut scratch);
//! for object in visible.objects {
//!     println!("draw object {object}");
//! }
//! # }
//! ```
//!
//! # What holds, whatever the camera
//!
//! * An object with a pixel on the screen is in the set, as far as cells, portals and rows are sound: every tolerance here
//!   errs towards *visible* ([`Culler::tolerance`] says by how much), and so does every bound on work, which is counted in
//!   [`FrameStats::capped`].
//! * Where the eye is in no cell, the set is everything in the frustum, never nothing.
//! * The set depends on the camera and the mode, not on earlier frames.
//! * After [`Scratch::for_culler`], [`Culler::cull`] allocates nothing.

mod around;
mod auto;
mod boxes;
mod culler;
mod doors;
mod frame_culler;
mod frustum;
mod locate;
mod mirrors;
mod objects;
mod online;
mod portals;
mod scratch;
mod sets;

pub use around::Place;
pub use auto::Auto;
pub use culler::Culler;
pub use frame_culler::{AutoOptions, FrameCuller, FrameMode};
pub use frustum::{Camera, Rect};
pub use mirrors::{MOST_REFLECTIONS, Mirror, Reflection, Reflections};
pub use scratch::{CrossedPortal, FrameStats, Scratch, VisibleSet};
pub use sets::MOST_PLANES;

use std::fmt;

/// How to cull.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Mode {
    /// Everything: what the others are measured against.
    None,
    /// Objects whose box meets the view frustum.
    Frustum,
    /// Through portals, with the frustum narrowed at each.
    Portals,
    /// The row of the eye's cell, and the frustum.
    Pvs,
    /// Through portals into cells of the row, and of those the objects of the row.
    Both,
}

impl Mode {
    /// Every mode, the least culling first.
    pub const ALL: [Self; 5] = [Self::None, Self::Frustum, Self::Portals, Self::Pvs, Self::Both];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        FrameMode::from(self).name()
    }
}

/// What a portal narrows the view to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Narrowing {
    /// The rectangle around it on the screen.
    #[default]
    Rectangles,
    /// An octagon with upright, level and diagonal sides: less of what is beside a portal that stands slanted on the screen, at more
    /// cost a portal and an object. What the difference is, is measured in docs/results.md.
    Octagons,
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
