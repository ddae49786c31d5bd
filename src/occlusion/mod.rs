//! Online culling: what can be seen, found while the frame is drawn, where portals don't help.
//!
//! ```no_run
//! # fn demo(scene: &enfilade::scene::Scene) {
//! use enfilade::occlusion::chc_plus::{ChcPlus, ChcPlusOptions};
//! use enfilade::occlusion::depth::DepthBuffer;
//! use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
//! use enfilade::occlusion::view::{Frustum, View};
//! use glam::DVec3;
//!
//! let tree = Hierarchy::build(scene, &HierarchyOptions::default());
//! let mut oracle = DepthBuffer::new(scene, 1920, 1080);
//! let mut culler = ChcPlus::new(ChcPlusOptions::default());
//! // Every frame:
//! let view = View::look_at(DVec3::new(2.0, 1.6, 3.0), DVec3::ZERO, 60f64.to_radians(), 16.0 / 9.0, 0.05);
//! oracle.begin(&view);
//! for object in culler.cull(&tree, &Frustum::new(&view), &mut oracle) {
//!     println!("draw object {object}");
//! }
//! # }
//! ```
//!
//! A tree of boxes over the objects ([`bounds`], [`hierarchy`]) is walked from near to far within the frustum ([`view`], [`frustum`]); what
//! might be hidden is asked of an [`oracle`], which also draws. [`depth`] is one without a graphics processor, `queries`
//! (with the feature `gpu`) one by its occlusion queries. Whom to ask about, and when, is where [`chc`] and [`chc_plus`]
//! differ; a client's own rule is a policy over the same [`walk`].
//!
//! # What holds, whatever the camera did before
//!
//! * An object that has a pixel, at the oracle's size, is drawn in that frame: nothing shows late, after a jump either.
//! * How late the oracle answers decides what is drawn beyond that, and never loses anything.
//! * After the first frame of a tree, no frame allocates.
//!
//! Everything is in metres in one frame of coordinates, that of the scene. `f64` up to the pixels: boxes are held against planes and pixels
//! relative to the eye, so the distance from the origin costs nothing.

pub mod bounds;
pub mod chc;
pub mod chc_plus;
pub mod depth;
pub mod frustum;
pub mod geometry;
pub mod hierarchy;
#[cfg(feature = "bake")]
pub mod mask;
#[cfg(not(feature = "bake"))]
pub(crate) mod mask;
pub mod oracle;
#[cfg(feature = "gpu")]
pub mod queries;
pub mod stats;
pub mod view;
#[cfg(feature = "bake")]
pub mod walk;
#[cfg(not(feature = "bake"))]
pub(crate) mod walk;

mod pixels;
mod slabs;

#[cfg(test)]
mod scenes;
#[cfg(test)]
mod tests;
