//! Asks what the cameras see, and writes it where it changes.

use crate::{Building, EnfiladeObject, PortalCamera};
use bevy_camera::visibility::Visibility;
use bevy_camera::{Camera, Projection};
use bevy_ecs::change_detection::{DetectChanges, DetectChangesMut};
use bevy_ecs::entity::{Entity, EntityHashSet};
use bevy_ecs::hierarchy::ChildOf;
use bevy_ecs::query::{Changed, Or};
use bevy_ecs::system::{Local, Query, Res};
use bevy_math::Mat4;
use bevy_transform::components::GlobalTransform;
use enfilade::glam::Vec3;
use enfilade::runtime::{self, Culler, Mode, View};
use std::sync::Arc;

/// What decides.
pub(crate) type Cameras<'w, 's> =
    Query<'w, 's, (&'static PortalCamera, &'static Camera, &'static Projection, &'static GlobalTransform)>;
/// What may ask for something to be written, beside the cameras: new objects, and others above or below them.
type Moved = Or<(Changed<EnfiladeObject>, Changed<ChildOf>)>;
/// What is written to.
type Entities<'w, 's> = Query<'w, 's, (Entity, &'static EnfiladeObject, &'static mut Visibility)>;

/// The plugin's system.
pub(crate) fn show(
    building: Option<Res<'_, Building>>,
    cameras: Cameras<'_, '_>,
    moved: Query<'_, '_, (), Moved>,
    mut entities: Entities<'_, '_>,
    parents: Query<'_, '_, &ChildOf>,
    mut known: Local<'_, Known>,
) {
    let is_new = match &building {
        Some(building) => known.ask(building, building.is_changed(), &cameras),
        None => known.answers.take().is_some(),
    };
    if is_new || !moved.is_empty() {
        known.write(&mut entities, &parents);
    }
}

/// What a camera asks.
#[derive(Clone, Copy)]
pub(crate) enum Question {
    /// Nothing that can be answered.
    Everything,
    /// What is there to be seen around here?
    Around(Vec3),
    /// What does this view see?
    View(runtime::Camera, Mode),
}

impl Question {
    /// Whether a camera with this view that asked `before` now gets another answer.
    fn is_new(self, before: Self, view: &mut View) -> bool {
        match (self, before) {
            (Self::Around(eye), Self::Around(_)) => view.around(eye).is_new,
            (Self::View(camera, mode), Self::View(camera_before, mode_before)) => {
                (camera, mode) != (camera_before, mode_before)
            }
            (Self::Everything, Self::Everything) => false,
            _ => true,
        }
    }
}

/// What is known from the updates before.
#[derive(Default)]
pub(crate) struct Known {
    /// `None` without a building.
    answers: Option<Answers>,
    /// How many entities name objects that the building doesn't have.
    strangers: usize,
}

struct Answers {
    culler: Arc<Culler>,
    /// One a camera, with its view.
    asked: Vec<(Question, View)>,
    /// How many objects the building has.
    objects: usize,
    /// A bit for each of them that is seen.
    seen: Vec<u64>,
}

impl Known {
    /// Asks what the cameras see; says whether the answer is a new one. The same questions, as long as no door moves, have the same answer.
    fn ask(&mut self, building: &Building, is_changed: bool, cameras: &Cameras<'_, '_>) -> bool {
        let culler = building.culler();
        let is_other = self.answers.as_ref().is_none_or(|answers| !Arc::ptr_eq(&answers.culler, culler));
        if is_other {
            let (objects, seen) = (culler.object_count(), Vec::new());
            self.answers = Some(Answers { culler: culler.clone(), asked: Vec::new(), objects, seen });
        }
        let Some(answers) = &mut self.answers else { return false };
        let questions = questions(building, cameras);
        let mut is_new = is_changed || is_other || questions.len() != answers.asked.len();
        answers.asked.truncate(questions.len());
        for (i, &question) in questions.iter().enumerate() {
            match answers.asked.get_mut(i) {
                Some((before, view)) => {
                    if is_changed {
                        view.set_doors(building.doors());
                    }
                    is_new |= question.is_new(*before, view);
                    *before = question;
                }
                None => {
                    let mut view = View::new(culler);
                    view.set_doors(building.doors());
                    answers.asked.push((question, view));
                }
            }
        }
        if !is_new {
            return false;
        }
        let mut seen = vec![0; answers.objects.div_ceil(64)];
        for (question, view) in &mut answers.asked {
            let objects = match question {
                Question::Everything => {
                    seen.fill(u64::MAX);
                    break;
                }
                Question::Around(eye) => view.around(*eye).objects,
                Question::View(camera, mode) => view.cull(camera, *mode).objects,
            };
            objects.iter().for_each(|object| seen[object.index() / 64] |= 1 << (object.index() % 64));
        }
        let is_other = is_changed || seen != answers.seen;
        answers.seen = seen;
        is_other
    }

    /// Whether an entity's object is seen; `None` where the building has no such object.
    fn is_seen(&self, object: &EnfiladeObject) -> Option<bool> {
        let Some(answers) = &self.answers else { return Some(true) };
        let (first, last) = (object.first.index(), object.last.index());
        let is_known = first <= last && last < answers.objects;
        is_known.then(|| (first..=last).any(|i| answers.seen[i / 64] >> (i % 64) & 1 != 0))
    }

    /// Writes what is seen, where it differs.
    fn write(&mut self, entities: &mut Entities<'_, '_>, parents: &Query<'_, '_, &ChildOf>) {
        // 1. What is above something that shows can't be hidden, or that would be hidden with it.
        let (mut kept, mut strangers, mut first) = (EntityHashSet::default(), 0, None);
        for (entity, object, _) in entities.iter() {
            let is_seen = self.is_seen(object);
            if is_seen.is_none() {
                strangers += 1;
                first.get_or_insert((entity, object.last));
            }
            if is_seen != Some(false) {
                above(entity, parents, &mut kept);
            }
        }

        // 2. Each entity; those that stay as they are don't count as changed.
        for (entity, object, mut visibility) in entities.iter_mut() {
            let is_hidden = self.is_seen(object) == Some(false) && !kept.contains(&entity);
            visibility.set_if_neq(if is_hidden { Visibility::Hidden } else { object.shown });
        }

        // 3. One line for all entities that nothing is known of.
        if let (Some((entity, object)), Some(answers)) = (first, &self.answers)
            && strangers != self.strangers
        {
            let objects = answers.objects;
            log::warn!(
                "{strangers} entities are always shown: {entity} has object {object}, and the building has {objects}"
            );
        }
        self.strangers = strangers;
    }
}

/// Adds what is above an entity.
pub(crate) fn above(entity: Entity, parents: &Query<'_, '_, &ChildOf>, to: &mut EntityHashSet) {
    // What is above what is there already is there, too.
    let _ = parents.iter_ancestors(entity).try_for_each(|parent| to.insert(parent).then_some(()));
}

/// What the active cameras ask; never empty.
pub(crate) fn questions(building: &Building, cameras: &Cameras<'_, '_>) -> Vec<Question> {
    let mut questions = Vec::new();
    for (rule, _, projection, transform) in cameras.iter().filter(|(_, camera, ..)| camera.is_active) {
        questions.push(match (rule, view(building, projection, transform)) {
            (_, None) => Question::Everything,
            (PortalCamera::PerFrame(mode), Some(camera)) => Question::View(camera, *mode),
            (PortalCamera::PerCell, Some(camera)) => Question::Around(camera.eye),
        });
    }
    if questions.is_empty() {
        questions.push(Question::Everything);
    }
    questions
}

/// A camera as the building has it; `None` where its lines of sight don't meet in an eye.
fn view(building: &Building, projection: &Projection, transform: &GlobalTransform) -> Option<runtime::Camera> {
    let clip_from_view = projection.get_clip_from_view();
    let clip = clip_from_view * Mat4::from(transform.affine()).inverse();
    let row = |i| clip.row(i).truncate().to_array().into();
    let (at, origin) = (transform.translation().to_array(), building.origin);
    let eye = [0, 1, 2].map(|i| (f64::from(at[i]) - origin[i]) as f32);
    (clip_from_view.w_axis.w == 0.0).then(|| runtime::Camera { eye: eye.into(), x: row(0), y: row(1), w: row(3) })
}
