//! Marks what a loader spawns of the building's model.

use crate::{Building, EnfiladeModel, EnfiladeObject};
use bevy_camera::visibility::Visibility;
use bevy_ecs::component::Component;
use bevy_ecs::entity::{Entity, EntityHashSet};
use bevy_ecs::hierarchy::{ChildOf, Children};
use bevy_ecs::name::Name;
use bevy_ecs::query::{Added, Changed, Or, With};
use bevy_ecs::reflect::{AppTypeRegistry, ReflectComponent};
use bevy_ecs::system::{Commands, Local, Query, Res};
use bevy_ecs::world::EntityRef;
use bevy_reflect::TypeRegistry;
use enfilade::runtime::Culler;
use std::sync::Arc;

/// It got its [`EnfiladeObject`] from [`mark`].
#[derive(Component)]
pub(crate) struct Marked;

/// What may make an entity a part of a model.
type Grown = Or<(Added<Name>, Changed<ChildOf>, Added<EnfiladeModel>)>;

/// The component in which Bevy's loader keeps a node's extras, as JSON text in its field `value`. It is read by reflection, so the plugin needs
/// no loader.
const EXTRAS: &str = "GltfExtras";

/// Marks the nodes of models.
pub(crate) fn mark(
    building: Option<Res<'_, Building>>,
    registry: Res<'_, AppTypeRegistry>,
    (models, grown): (Query<'_, '_, Entity, With<EnfiladeModel>>, Query<'_, '_, Entity, Grown>),
    (parents, children): (Query<'_, '_, &ChildOf>, Query<'_, '_, &Children>),
    nodes: Query<'_, '_, EntityRef<'_>, (With<Name>, With<Visibility>)>,
    mut known: Local<'_, Option<Arc<Culler>>>,
    mut commands: Commands<'_, '_>,
) {
    let Some(building) = building else { return };
    let is_other = known.replace(building.culler().clone()).is_none_or(|known| !Arc::ptr_eq(&known, building.culler()));
    let is_within =
        |entity: Entity| std::iter::once(entity).chain(parents.iter_ancestors(entity)).any(|e| models.contains(e));
    let roots: Vec<Entity> =
        if is_other { models.iter().collect() } else { grown.iter().filter(|&e| is_within(e)).collect() };
    let registry = registry.read();
    let mut done = EntityHashSet::default();
    for root in roots {
        for entity in std::iter::once(root).chain(children.iter_descendants(root)) {
            let Ok(node) = nodes.get(entity) else { continue };
            let was_marked = node.contains::<Marked>();
            let is_own = node.contains::<EnfiladeObject>() && !was_marked;
            // What is marked stays so, until there is another building.
            if is_own || was_marked && !is_other || !done.insert(entity) {
                continue;
            }
            let shown = node.get::<EnfiladeObject>().map(|object| object.shown);
            match object(&building, &registry, node) {
                Some(object) => {
                    let object = EnfiladeObject { shown: shown.unwrap_or(object.shown), ..object };
                    commands.entity(entity).insert((object, Marked));
                }
                None if was_marked => {
                    commands.entity(entity).remove::<(EnfiladeObject, Marked)>().insert(shown.unwrap_or_default());
                }
                None => {}
            }
        }
    }
}

/// What a node draws: by its extras, if `enfilade export` wrote the model; else by its name.
fn object(building: &Building, registry: &TypeRegistry, node: EntityRef<'_>) -> Option<EnfiladeObject> {
    let by_extras = || {
        let component = registry.get_with_short_type_path(EXTRAS)?.data::<ReflectComponent>()?;
        let extras = component.reflect(node)?.reflect_ref().as_struct().ok()?;
        EnfiladeObject::from_extras(extras.field("value")?.try_downcast_ref::<String>()?)
    };
    by_extras().or_else(|| building.object(node.get::<Name>()?))
}
