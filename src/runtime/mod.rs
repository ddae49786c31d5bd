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
//! let visible = culler.cull(&camera, Mode::PortalsAndPvs, &mut scratch);
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
//! * Objects that are too small are left out where the client says so ([`Culler::set_min_pixels`]), and counted in [`FrameStats::small`].
//! * The set depends on the camera and the mode, not on earlier frames.
//! * After [`Scratch::for_culler`], [`Culler::cull`] allocates nothing.

mod around;
mod boxes;
mod cull;
mod culler;
mod doors;
mod frame_culler;
mod frustum;
mod locate;
mod mirrors;
mod mode;
mod motion;
mod objects;
mod online;
mod portals;
pub mod prefetch;
mod scratch;
mod sets;
mod small;

pub use around::Place;
pub use culler::Culler;
pub use frame_culler::FrameCuller;
pub use frustum::{Camera, NotPerspective, Rect};
pub use mirrors::{MOST_REFLECTIONS, Mirror, Reflection, Reflections};
pub use mode::Mode;
pub use motion::Motion;
pub use scratch::{CrossedPortal, FrameStats, Scratch, VisibleSet};
pub use sets::MOST_PLANES;
pub use small::MinPixels;
