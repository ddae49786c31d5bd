//! The culling of a frame: the objects to draw for a camera.
//!
//! ```no_run
//! # fn demo(file: &enfilade::file::PvsFile) {
//! use enfilade::runtime::{Camera, Culler, Mode, View};
//! use glam::DVec3;
//!
//! let culler = Culler::new(file);
//! let mut view = View::new(&culler);
//! let eye = DVec3::new(2.0, 1.6, 3.0) - file.origin;
//! let camera = Camera::look_at(eye, eye + DVec3::X, 60f64.to_radians(), 16.0 / 9.0);
//! for indices in view.cull(&camera, Mode::PortalsAndPvs).runs() {
//!     println!("draw indices {indices:?}");
//! }
//! # }
//! ```
//!
//! # Guarantees for every camera
//!
//! * An object with a pixel on the screen is in the set, if cells, portals and rows are sound: every tolerance here errs towards *visible*
//!   (by [`Culler::tolerance`]), and so does every limit on work, which [`FrameStats::capped`] counts.
//! * If the eye is in no cell, the set is everything in the frustum, never nothing.
//! * Small objects are left out if the client sets a limit ([`View::set_min_pixels`]), and [`FrameStats::small`] counts them.
//! * The set depends on the camera and the mode, not on earlier frames.
//! * [`View::cull`] allocates nothing.

mod around;
mod boxes;
mod camera;
mod cull;
mod culler;
mod doors;
mod locate;
mod mirrors;
mod mode;
mod motion;
mod movers;
mod objects;
mod online;
mod paths;
mod portals;
pub mod prefetch;
mod relevance;
mod scratch;
mod sets;
mod small;
mod view;
mod visible;
mod world;

pub use around::Around;
pub use camera::{Axes, Camera, NotACamera, Rect};
pub use culler::Culler;
pub use doors::Doors;
pub use mirrors::{MOST_REFLECTIONS, Mirror, Reflection};
pub use mode::Mode;
pub use motion::Motion;
pub use movers::{MoverError, MoverId, Movers};
pub use paths::{Path, Pathfinder};
pub use relevance::Relevance;
pub use sets::MOST_PLANES;
pub use small::MinPixels;
pub use view::View;
pub use visible::{CrossedPortal, FrameStats, VisibleSet};
pub use world::{ModuleId, NotRigid, Placement, World, WorldError, WorldView};
