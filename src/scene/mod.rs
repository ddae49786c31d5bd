//! A scene: triangles grouped into objects, with the author's hints about rooms and doors. It knows no file format: importers give their
//! meshes to [`SceneBuilder`].

pub mod builder;
pub(crate) mod bulk;
mod cluster;
mod error;
pub(crate) mod floors;
mod meshed;
pub mod naming;
mod objects;
pub mod pipes;
pub mod rays;
pub mod sidecar;
pub mod sky;
mod tube_count;
pub mod up;
pub mod whole_file;

pub use crate::types::hints::{Hints, LeakHint, Leaves, OpeningHint, OpeningKind, RoomHint, StoreyHint};
pub use crate::types::import::ImportOptions;
pub use crate::types::scene::{Look, Material, Object, Picture, Role, Scene, Source, Trace};
pub use builder::{Facts, Mesh, SceneBuilder};
pub use error::{ImportError, Place};
pub use objects::split_objects;
pub use tube_count::TubeCount;

use crate::math::geom;
use glam::DVec3;

/// Area of a triangle, square metres.
pub(crate) fn triangle_area([a, b, c]: [DVec3; 3]) -> f64 {
    geom::area(&[a, b, c])
}
