//! What moves: entities with a box that are not the building's.

use crate::show::{Cameras, Question, above, questions};
use crate::{Building, EnfiladeModel, EnfiladeMover, EnfiladeObject};
use bevy_camera::primitives::Aabb;
use bevy_camera::visibility::{NoFrustumCulling, Visibility};
use bevy_ecs::change_detection::{DetectChanges, DetectChangesMut, Ref};
use bevy_ecs::entity::{Entity, EntityHashMap, EntityHashSet};
use bevy_ecs::hierarchy::ChildOf;
use bevy_ecs::lifecycle::RemovedComponents;
use bevy_ecs::query::{Added, Or, With, Without};
use bevy_ecs::system::{Commands, Local, Query, Res};
use bevy_mesh::Mesh3d;
use bevy_transform::components::GlobalTransform;
use enfilade::glam::Vec3;
use enfilade::runtime::{Culler, MoverId, Movers, View};
use std::sync::Arc;

/// A mesh that is no mover yet.
type Unknown = (With<Mesh3d>, Added<Aabb>, Without<EnfiladeMover>, Without<EnfiladeObject>, Without<NoFrustumCulling>);
/// What is the building's.
type Own = Or<(With<EnfiladeModel>, With<EnfiladeObject>)>;
/// Movers, and what is written.
type All<'w, 's> = Query<
    'w,
    's,
    (Entity, &'static EnfiladeMover, Ref<'static, Aabb>, Ref<'static, GlobalTransform>, &'static mut Visibility),
    Without<EnfiladeObject>,
>;

/// Makes movers of meshes that have got a box, and are not within the building's model.
pub(crate) fn adopt(
    unknown: Query<'_, '_, (Entity, &Visibility), Unknown>,
    own: Query<'_, '_, (), Own>,
    parents: Query<'_, '_, &ChildOf>,
    mut commands: Commands<'_, '_>,
) {
    for (entity, &shown) in &unknown {
        if !parents.iter_ancestors(entity).any(|above| own.contains(above)) {
            commands.entity(entity).insert(EnfiladeMover { shown });
        }
    }
}

/// What is known of movers from the updates before.
#[derive(Default)]
pub(crate) struct Crowd {
    /// `None` without a building.
    placed: Option<Placed>,
}

struct Placed {
    culler: Arc<Culler>,
    movers: Movers,
    /// Those with a box that can be placed; others are always shown.
    ids: EntityHashMap<MoverId>,
    /// By camera.
    views: Vec<View>,
    /// A bit for each slot that is seen.
    seen: Vec<u64>,
}

/// Shows the movers that a camera may see, and hides the others.
pub(crate) fn show(
    building: Option<Res<'_, Building>>,
    cameras: Cameras<'_, '_>,
    mut all: All<'_, '_>,
    mut gone: RemovedComponents<'_, '_, EnfiladeMover>,
    parents: Query<'_, '_, &ChildOf>,
    mut crowd: Local<'_, Crowd>,
) {
    let gone: Vec<Entity> = gone.read().collect();
    let Some(building) = building else {
        if crowd.placed.take().is_some() {
            all.iter_mut().for_each(|(_, mover, _, _, mut visibility)| _ = visibility.set_if_neq(mover.shown));
        }
        return;
    };
    if crowd.placed.as_ref().is_none_or(|placed| !Arc::ptr_eq(&placed.culler, building.culler())) {
        crowd.placed = Some(Placed::new(building.culler()));
    }
    let Some(placed) = &mut crowd.placed else { return };
    gone.into_iter().for_each(|entity| placed.remove(entity));
    for (entity, _, aabb, transform, _) in &all {
        if aabb.is_changed() || transform.is_changed() || !placed.ids.contains_key(&entity) {
            placed.set(entity, bounds(&building, &aabb, &transform));
        }
    }
    placed.look(&building, &cameras);
    // What is above a mover that is seen can't be hidden, or that would be hidden with it.
    let mut kept = EntityHashSet::default();
    all.iter().filter(|(entity, ..)| placed.is_seen(*entity)).for_each(|(entity, ..)| above(entity, &parents, &mut kept));
    for (entity, mover, _, _, mut visibility) in &mut all {
        let is_shown = placed.is_seen(entity) || kept.contains(&entity);
        visibility.set_if_neq(if is_shown { mover.shown } else { Visibility::Hidden });
    }
}

impl Placed {
    fn new(culler: &Arc<Culler>) -> Self {
        let (ids, views, seen) = (EntityHashMap::default(), Vec::new(), Vec::new());
        Self { culler: culler.clone(), movers: Movers::new(culler), ids, views, seen }
    }

    fn remove(&mut self, entity: Entity) {
        if let Some(id) = self.ids.remove(&entity) {
            // It is there, since its entity had it.
            let _ = self.movers.remove(id);
        }
    }

    fn set(&mut self, entity: Entity, bounds: [Vec3; 2]) {
        let placed = match self.ids.get(&entity) {
            Some(&id) => self.movers.set(id, bounds).map(|()| id),
            None => self.movers.insert(bounds),
        };
        match placed {
            Ok(id) => _ = self.ids.insert(entity, id),
            // No box, as of a transform with NaN.
            Err(_) => self.remove(entity),
        }
    }

    /// Asks what the cameras see.
    fn look(&mut self, building: &Building, cameras: &Cameras<'_, '_>) {
        let questions = questions(building, cameras);
        self.views.resize_with(questions.len(), || View::new(&self.culler));
        self.seen.clear();
        self.seen.resize(self.movers.slots().div_ceil(64), 0);
        for (question, view) in questions.into_iter().zip(&mut self.views) {
            view.set_doors(building.doors());
            let ids = match question {
                Question::Everything => return self.seen.fill(u64::MAX),
                Question::Around(eye) => view.movers_around(&self.movers, eye),
                Question::View(camera, mode) => {
                    view.cull(&camera, mode);
                    view.movers(&self.movers)
                }
            };
            ids.iter().for_each(|id| self.seen[id.slot as usize / 64] |= 1 << (id.slot % 64));
        }
    }

    fn is_seen(&self, entity: Entity) -> bool {
        self.ids.get(&entity).is_none_or(|id| self.seen[id.slot as usize / 64] >> (id.slot % 64) & 1 != 0)
    }
}

/// The box of a mover, relative to the building's origin.
fn bounds(building: &Building, aabb: &Aabb, transform: &GlobalTransform) -> [Vec3; 2] {
    let affine = transform.affine();
    let centre = affine.transform_point3a(aabb.center).to_array();
    let rows = affine.matrix3.transpose();
    let half = [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.abs().dot(aabb.half_extents));
    let at =
        |axis: usize, side: f64| (f64::from(centre[axis]) + side * f64::from(half[axis]) - building.origin[axis]) as f32;
    [-1.0, 1.0].map(|side| Vec3::new(at(0, side), at(1, side), at(2, side)))
}
