//! The culling of a frame: the objects to draw for a camera.
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
//! # Guarantees for every camera
//!
//! * An object with a pixel on the screen is in the set, if cells, portals and rows are sound: every tolerance here errs towards *visible*
//!   (by [`Culler::tolerance`]), and so does every limit on work, which [`FrameStats::capped`] counts.
//! * If the eye is in no cell, the set is everything in the frustum, never nothing.
//! * Small objects are left out if the client sets a limit ([`Culler::set_min_pixels`]), and [`FrameStats::small`] counts them.
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
