//! Portal culling for Bevy: hides the meshes of a building that no marked camera can see.
//!
//! * [`Building`], a resource, holds a `.pvs` file that `enfilade bake` wrote, and the state of its doors. It is an asset, too, and
//!   [`LevelHandle`] inserts it when it is loaded.
//! * [`PortalCamera`] marks the cameras whose views decide.
//! * [`EnfiladeObject`] says which object of the file an entity draws. [`EnfiladeModel`] marks a root whose descendants get it by themselves.
//! * [`EnfiladeMover`] is what moves; meshes that are not the building's get it by themselves.
//! * [`EnfiladePlugins`] writes [`Visibility`] of objects and movers in [`PostUpdate`], after transforms and before visibility is propagated, and
//!   only where it changes.
//!
//! What is marked is hidden only where the file proves it hidden (for a conservative one). Everything is visible where nothing can be said:
//! without a building, without an active [`PortalCamera`], for one that stands in no cell or has no perspective projection.
//!
//! Visibility holds for all cameras alike, so every camera that shows the building should be marked. What is hidden throws no shadow.

mod building;
#[cfg(feature = "gizmos")]
mod gizmos;
mod level;
mod mark;
mod movers;
mod show;

pub use building::{Building, NoSuchPortal};
#[cfg(feature = "gizmos")]
pub use gizmos::{EnfiladeGizmos, EnfiladeGizmosPlugin};
pub use level::{LevelHandle, PvsLoader};

use bevy_app::{App, Plugin, PluginGroup, PluginGroupBuilder, PostUpdate};
use bevy_asset::{AssetApp, AssetPlugin};
use bevy_camera::visibility::{Visibility, VisibilitySystems};
use bevy_camera::{Camera, CameraUpdateSystems, Projection};
use bevy_ecs::component::Component;
use bevy_ecs::reflect::ReflectComponent;
use bevy_ecs::schedule::{IntoScheduleConfigs, SystemSet};
use bevy_reflect::{Reflect, std_traits::ReflectDefault};
use bevy_transform::TransformSystems;
use enfilade::ObjectId;
use enfilade::runtime::Mode;

/// What most apps use: `use bevy_enfilade::prelude::*;`.
pub mod prelude {
    #[cfg(feature = "gizmos")]
    pub use crate::EnfiladeGizmos;
    pub use crate::{Building, EnfiladeModel, EnfiladeMover, EnfiladeObject, EnfiladePlugins, LevelHandle, PortalCamera};
    pub use enfilade::runtime::Mode;
    pub use enfilade::{DirectedPortal, ObjectId, PortalId};
}

/// All plugins: [`EnfiladePlugin`], [`EnfiladeLevelPlugin`], [`EnfiladeMoversPlugin`], and `EnfiladeGizmosPlugin` with the feature `gizmos`. Add
/// them after Bevy's own; `EnfiladePlugins.build().disable::<EnfiladeMoversPlugin>()` leaves one out.
pub struct EnfiladePlugins;

impl PluginGroup for EnfiladePlugins {
    fn build(self) -> PluginGroupBuilder {
        let group = PluginGroupBuilder::start::<Self>();
        let group = group.add(EnfiladePlugin).add(EnfiladeLevelPlugin).add(EnfiladeMoversPlugin);
        #[cfg(feature = "gizmos")]
        let group = group.add(EnfiladeGizmosPlugin);
        group
    }
}

/// Systems of the plugins, in [`PostUpdate`], in this order.
#[derive(SystemSet, Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum EnfiladeSystems {
    /// Inserts the [`Building`] that [`LevelHandle`] names, when it is loaded.
    Load,
    /// Gives [`EnfiladeObject`] and [`EnfiladeMover`] to what was spawned.
    Mark,
    /// Writes [`Visibility`].
    Show,
}

/// Hides the objects that no [`PortalCamera`] can see.
pub struct EnfiladePlugin;

impl Plugin for EnfiladePlugin {
    fn build(&self, app: &mut App) {
        use EnfiladeSystems::{Load, Mark, Show};
        app.register_type::<PortalCamera>().register_type::<EnfiladeObject>();
        app.configure_sets(PostUpdate, (Load, Mark, Show).chain());
        let placed = Show.after(TransformSystems::Propagate).after(CameraUpdateSystems);
        app.configure_sets(PostUpdate, placed.before(VisibilitySystems::VisibilityPropagate));
        app.add_systems(PostUpdate, show::show.in_set(Show));
    }
}

/// Loads levels, if Bevy's `AssetPlugin` was added before, and marks what a loader spawns of their models.
pub struct EnfiladeLevelPlugin;

impl Plugin for EnfiladeLevelPlugin {
    fn build(&self, app: &mut App) {
        if app.is_plugin_added::<AssetPlugin>() {
            app.init_asset::<Building>().register_asset_loader(PvsLoader);
        }
        app.register_type::<EnfiladeModel>();
        app.add_systems(PostUpdate, level::insert.in_set(EnfiladeSystems::Load));
        app.add_systems(PostUpdate, mark::mark.in_set(EnfiladeSystems::Mark));
    }
}

/// Hides what moves where no [`PortalCamera`] can see it.
pub struct EnfiladeMoversPlugin;

impl Plugin for EnfiladeMoversPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<EnfiladeMover>();
        let boxed = movers::adopt.after(mark::mark).after(VisibilitySystems::CalculateBounds);
        app.add_systems(PostUpdate, boxed.in_set(EnfiladeSystems::Mark));
        app.add_systems(PostUpdate, movers::show.after(show::show).in_set(EnfiladeSystems::Show));
    }
}

/// The root of a model that the level was baked from, such as an entity with a glTF scene: its descendants get an [`EnfiladeObject`] as they are
/// spawned, by the extras that `enfilade export` wrote, or else by their names. Those that have one are left alone. Another level marks them anew.
#[derive(Component, Reflect, Clone, Copy, PartialEq, Eq, Debug, Default)]
#[reflect(Component, Clone, PartialEq, Debug, Default)]
pub struct EnfiladeModel;

/// What moves: hidden while no camera may see its `Aabb`.
///
/// Entities with a `Mesh3d` get it as soon as they get an `Aabb`, unless they are within an [`EnfiladeModel`] or an [`EnfiladeObject`], or have
/// `NoFrustumCulling`. For others, such as lights with a range, insert both. The plugin owns the entity's [`Visibility`], as for an
/// [`EnfiladeObject`]. An entity is not hidden while a mover below it is seen.
#[derive(Component, Reflect, Clone, Copy, PartialEq, Eq, Debug, Default)]
#[reflect(Component, Clone, PartialEq, Debug, Default)]
#[require(Visibility)]
pub struct EnfiladeMover {
    /// What its visibility is when it is seen.
    pub shown: Visibility,
}

/// A camera whose view decides what is visible; of several, what any of them may see is.
///
/// Cameras that are not active don't count.
#[derive(Component, Reflect, Clone, Copy, PartialEq, Eq, Debug, Default)]
#[reflect(opaque)]
#[reflect(Component, Clone, PartialEq, Debug, Default)]
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
#[derive(Component, Reflect, Clone, Copy, PartialEq, Eq, Debug)]
#[reflect(opaque)]
#[reflect(Component, Clone, PartialEq, Debug)]
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
