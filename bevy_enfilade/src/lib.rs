//! Portal culling for Bevy: hides the meshes of a building that no marked camera can see.
//!
//! * [`Building`], a resource, holds a `.pvs` file that `enfilade bake` wrote, and the state of its doors.
//! * [`PortalCamera`] marks the cameras whose views decide.
//! * [`EnfiladeObject`] says which object of the file an entity draws.
//! * [`EnfiladePlugin`] writes [`Visibility`] of those entities in [`PostUpdate`], after transforms and before visibility is propagated, and
//!   only where it changes.
//!
//! What is marked is hidden only where the file proves it hidden (for a conservative one). Everything is visible where nothing can be said:
//! without a building, without an active [`PortalCamera`], for one that stands in no cell or has no perspective projection.
//!
//! Visibility holds for all cameras alike, so every camera that shows the building should be marked. What is hidden throws no shadow.

mod building;
mod show;

pub use building::{Building, NoSuchPortal};

use bevy_app::{App, Plugin, PostUpdate};
use bevy_camera::visibility::{Visibility, VisibilitySystems};
use bevy_camera::{Camera, CameraUpdateSystems, Projection};
use bevy_ecs::component::Component;
use bevy_ecs::schedule::IntoScheduleConfigs;
use bevy_transform::TransformSystems;
use enfilade::ObjectId;
use enfilade::runtime::Mode;

/// Hides what no [`PortalCamera`] can see.
pub struct EnfiladePlugin;

impl Plugin for EnfiladePlugin {
    fn build(&self, app: &mut App) {
        let placed = show::show.after(TransformSystems::Propagate).after(CameraUpdateSystems);
        app.add_systems(PostUpdate, placed.before(VisibilitySystems::VisibilityPropagate));
    }
}

/// A camera whose view decides what is visible; of several, what any of them may see is.
///
/// Cameras that are not active don't count.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Default)]
#[require(Camera, Projection)]
pub enum PortalCamera {
    /// Shows what may be seen from where the camera stands, whichever way it looks. Something is written when it comes into another cell, or
    /// when a door moves; what is outside of the view is left to Bevy's own culling.
    #[default]
    PerCell,
    /// Shows what this view sees, in this mode: with [`Mode::PortalsAndPvs`], through portals into what the row of its cell has. Asked in each update
    /// in which the camera moves. What is behind the camera is hidden, and so is its shadow.
    PerFrame(Mode),
}

/// What an entity draws of the building.
///
/// The plugin owns the entity's [`Visibility`]: it is [`EnfiladeObject::shown`] while a camera may see the object, and
/// [`Visibility::Hidden`] otherwise. No other entity is written to. Children inherit it as usual, so an entity is not hidden while a
/// descendant of it with this component is seen.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug)]
#[require(Visibility)]
pub struct EnfiladeObject {
    /// The first object that it draws. Most meshes are one object; larger ones are cut into several when they are imported, with ids in a row.
    pub first: ObjectId,
    /// The last, not before the first. It is visible when one of them is.
    pub last: ObjectId,
    /// What its visibility is when it is seen: `Inherited` at first. `Hidden` hides it for good, for reasons of your own.
    pub shown: Visibility,
}

impl EnfiladeObject {
    /// One object. An id that the building doesn't have is warned of, and the entity is always shown.
    pub const fn new(id: ObjectId) -> Self {
        Self { first: id, last: id, shown: Visibility::Inherited }
    }

    /// The object that a node of an exported model draws, by the node's extras: the JSON text that Bevy's glTF loader keeps in
    /// `GltfExtras::value`. `None` for nodes that `enfilade export` didn't make.
    pub fn from_extras(extras: &str) -> Option<Self> {
        let extras: serde_json::Value = serde_json::from_str(extras).ok()?;
        let id = extras.get("enfilade")?.get("object")?.as_u64()?;
        Some(Self::new(ObjectId(u32::try_from(id).ok()?)))
    }
}

/// The README's example compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
