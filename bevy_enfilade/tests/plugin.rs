//! The plugin in a world without a window: buildings whose answers are known, and what is written, counted.

mod rooms;

use bevy_app::{App, Last};
use bevy_camera::visibility::Visibility::{self, Hidden, Inherited, Visible};
use bevy_camera::{Camera, OrthographicProjection, PerspectiveProjection, Projection};
use bevy_ecs::prelude::*;
use bevy_enfilade::{Building, EnfiladeObject, EnfiladePlugin, NoSuchPortal, PortalCamera};
use bevy_math::Vec3;
use bevy_transform::TransformPlugin;
use bevy_transform::components::Transform;
use enfilade::file::PvsFile;
use enfilade::runtime::{Culler, Mode, View};
use enfilade::{ObjectId, PortalId};
use glam::DVec3;
use rooms::{EYES, at, bevy, three_rooms};
use testing::boxes::{flat, p};

/// Entities whose visibility was written since the update before.
#[derive(Resource, Default)]
struct Written(Vec<Entity>);

fn note(changed: Query<Entity, Changed<Visibility>>, mut written: ResMut<Written>) {
    written.0.extend(&changed);
}

/// The app, with an entity for each of `ids`.
fn app(file: &PvsFile, ids: impl IntoIterator<Item = u32>) -> (App, Vec<Entity>) {
    let mut app = App::new();
    app.add_plugins((TransformPlugin, EnfiladePlugin)).add_systems(Last, note).init_resource::<Written>();
    app.insert_resource(Building::new(file));
    let entities = ids.into_iter().map(|id| app.world_mut().spawn(EnfiladeObject::new(ObjectId(id))).id()).collect();
    (app, entities)
}

fn camera(app: &mut App, x: f32) -> Entity {
    app.world_mut().spawn((PortalCamera::default(), at(x))).id()
}

fn place(app: &mut App, camera: Entity, x: f32) {
    *app.world_mut().get_mut::<Transform>(camera).unwrap() = at(x);
}

/// An update; whose visibility it wrote.
fn update(app: &mut App) -> Vec<Entity> {
    app.world_mut().resource_mut::<Written>().0.clear();
    app.update();
    std::mem::take(&mut app.world_mut().resource_mut::<Written>().0)
}

fn visibility<const N: usize>(app: &App, entities: &[Entity]) -> [Visibility; N] {
    std::array::from_fn(|i| *app.world().get(entities[i]).unwrap())
}

#[test]
fn visibility_is_written_when_the_cell_changes_and_not_in_between() {
    let (mut app, things) = app(&three_rooms(), 0..3);
    let eye = camera(&mut app, EYES[0]);
    update(&mut app);
    assert_eq!(visibility(&app, &things), [Inherited, Inherited, Hidden]);
    // About the room, and looking about.
    for x in [1.0, 2.0, 3.0, 0.5] {
        place(&mut app, eye, x);
        app.world_mut().get_mut::<Transform>(eye).unwrap().rotate_y(x);
        assert_eq!(update(&mut app), []);
    }
    // Through the door: what was hidden is written, once, and nothing else.
    place(&mut app, eye, EYES[1]);
    assert_eq!(update(&mut app), [things[2]]);
    assert_eq!(visibility(&app, &things), [Inherited; 3]);
    assert_eq!(update(&mut app), []);
    place(&mut app, eye, EYES[2]);
    assert_eq!(update(&mut app), [things[0]]);
    assert_eq!(visibility(&app, &things), [Hidden, Inherited, Inherited]);
    // On the threshold of both: what either sees.
    place(&mut app, eye, 8.0);
    update(&mut app);
    assert_eq!(visibility(&app, &things), [Inherited; 3]);
}

#[test]
fn a_door_that_shuts_hides_what_is_behind_in_the_next_update() {
    let (mut app, things) = app(&three_rooms(), 0..3);
    let eye = camera(&mut app, EYES[1]);
    update(&mut app);
    let set = |app: &mut App, open| app.world_mut().resource_mut::<Building>().set_open(PortalId(0), open).unwrap();
    set(&mut app, false);
    assert_eq!(update(&mut app), [things[0]]);
    assert_eq!(visibility(&app, &things), [Hidden, Inherited, Inherited]);
    // Twice between updates: as before, so nothing is written.
    set(&mut app, true);
    set(&mut app, false);
    assert_eq!(update(&mut app), []);
    // In the doorway the leaf may be behind the eye.
    app.world_mut().get_mut::<Transform>(eye).unwrap().translation = at(4.2).translation - Vec3::Z * 1.5;
    assert_eq!(update(&mut app), [things[0]]);
    place(&mut app, eye, EYES[1]);
    assert_eq!(update(&mut app), [things[0]]);
    set(&mut app, true);
    assert_eq!(update(&mut app), [things[0]]);
    assert_eq!(visibility(&app, &things), [Inherited; 3]);
    // A door that isn't there: an error that says so.
    let none = app.world_mut().resource_mut::<Building>().set_open(PortalId(2), false).unwrap_err();
    assert_eq!(none, NoSuchPortal { portal: PortalId(2), portals: 2 });
    assert_eq!(none.to_string(), "no portal 2: the building has 2");
}

#[test]
fn what_is_spawned_late_is_right_in_the_next_update() {
    let (mut app, _) = app(&three_rooms(), 0..3);
    camera(&mut app, EYES[0]);
    update(&mut app);
    let late = [0, 2].map(|id| app.world_mut().spawn(EnfiladeObject::new(ObjectId(id))).id());
    // Spawning counts as a change; of the others nothing is written.
    let written = update(&mut app);
    assert!(written.len() == 2 && late.iter().all(|entity| written.contains(entity)));
    assert_eq!(visibility(&app, &late), [Inherited, Hidden]);
    assert_eq!(update(&mut app), []);
    // One that becomes another's.
    *app.world_mut().get_mut::<EnfiladeObject>(late[1]).unwrap() = EnfiladeObject::new(ObjectId(1));
    assert_eq!(update(&mut app), [late[1]]);
}

#[test]
fn several_cameras_show_what_any_of_them_may_see() {
    let (mut app, things) = app(&three_rooms(), 0..3);
    let eyes = [EYES[0], EYES[2]].map(|x| camera(&mut app, x));
    update(&mut app);
    assert_eq!(visibility(&app, &things), [Inherited; 3]);
    // One that isn't drawn doesn't count.
    app.world_mut().get_mut::<Camera>(eyes[1]).unwrap().is_active = false;
    assert_eq!(update(&mut app), [things[2]]);
    app.world_mut().get_mut::<Camera>(eyes[1]).unwrap().is_active = true;
    assert_eq!(update(&mut app), [things[2]]);
    app.world_mut().despawn(eyes[0]);
    assert_eq!(update(&mut app), [things[0]]);
    // Nor does one that isn't marked, and without any there is nothing to go by.
    app.world_mut().entity_mut(eyes[1]).remove::<PortalCamera>();
    assert_eq!(update(&mut app), [things[0]]);
    assert_eq!(visibility(&app, &things), [Inherited; 3]);
}

#[test]
fn where_nothing_can_be_said_everything_is_visible() {
    let file = three_rooms();
    let (mut app, things) = app(&file, 0..3);
    let eye = camera(&mut app, EYES[0]);
    let hidden = |app: &mut App| {
        update(app);
        visibility::<3>(app, &things) != [Inherited; 3]
    };
    assert!(hidden(&mut app));
    for outside in [-5.0, f32::NAN] {
        place(&mut app, eye, outside);
        assert!(!hidden(&mut app), "{outside}");
        place(&mut app, eye, EYES[0]);
        assert!(hidden(&mut app));
    }
    // No eye.
    let set = |app: &mut App, projection: Projection| *app.world_mut().get_mut::<Projection>(eye).unwrap() = projection;
    set(&mut app, Projection::Orthographic(OrthographicProjection::default_3d()));
    assert!(!hidden(&mut app));
    set(&mut app, Projection::Perspective(PerspectiveProjection::default()));
    assert!(hidden(&mut app));
    // No building; and another in its place, in which everything is in one room.
    app.world_mut().remove_resource::<Building>();
    assert!(!hidden(&mut app));
    app.insert_resource(Building::new(&file));
    assert!(hidden(&mut app));
}

/// In each update what the culler says of the view.
#[test]
fn a_camera_that_is_asked_in_each_frame_shows_what_the_culler_says() {
    let (_, file) = flat().0.finish();
    let mut view = View::new(&Culler::new(&file));
    for mode in Mode::WITHOUT_QUERIES {
        let (mut app, things) = app(&file, 0..file.objects.len() as u32);
        let lens = PerspectiveProjection { fov: 1.1, aspect_ratio: 1.6, ..Default::default() };
        let eye = app.world_mut().spawn((PortalCamera::PerFrame(mode), Projection::Perspective(lens))).id();
        let (mut hidden, mut updates) = (0, 0);
        for turn in 0..60 {
            let (sin, cos) = (f64::from(turn) * 0.4).sin_cos();
            let from = p(0.5 + f64::from(turn % 19) * 0.5, 1.6, 4.5 + sin);
            let to = from + DVec3::new(cos, 0.1, sin);
            *app.world_mut().get_mut(eye).unwrap() = Transform::from_translation(bevy(from)).looking_at(bevy(to), Vec3::Y);
            update(&mut app);
            let camera = enfilade::runtime::Camera::look_at(from - file.origin, to - file.origin, 1.1, 1.6);
            let seen = view.cull(&camera, mode).objects;
            for (id, &thing) in (0u32..).zip(&things) {
                let is_seen = *app.world().get::<Visibility>(thing).unwrap() == Inherited;
                assert_eq!(is_seen, seen.contains(&ObjectId(id)), "{mode}, turn {turn}, object {id}");
                hidden += usize::from(!is_seen);
            }
            updates += usize::from(update(&mut app).is_empty());
        }
        assert_eq!((hidden > 0, updates), (mode != Mode::None, 60), "{mode}");
    }
}

#[test]
fn what_is_seen_shows_as_its_component_says() {
    let (mut app, _) = app(&three_rooms(), []);
    let things = [Visible, Hidden, Inherited].map(|shown| {
        let object = EnfiladeObject { shown, ..EnfiladeObject::new(ObjectId(2)) };
        app.world_mut().spawn((object, Visible)).id()
    });
    let eye = camera(&mut app, EYES[0]);
    update(&mut app);
    assert_eq!(visibility(&app, &things), [Hidden; 3]);
    place(&mut app, eye, EYES[1]);
    update(&mut app);
    assert_eq!(visibility(&app, &things), [Visible, Hidden, Inherited]);
}

#[test]
fn in_a_hierarchy_only_marked_entities_are_written_and_none_hides_what_is_seen() {
    let (mut app, _) = app(&three_rooms(), []);
    let world = app.world_mut();
    let object = |id: u32| EnfiladeObject::new(ObjectId(id));
    let group = world.spawn(Visible).id();
    let far = world.spawn((object(2), ChildOf(group))).id();
    let between = world.spawn((Inherited, ChildOf(far))).id();
    let near = world.spawn((object(0), ChildOf(between))).id();
    let leaf = world.spawn((Visible, ChildOf(near))).id();
    let eye = camera(&mut app, EYES[0]);
    update(&mut app);
    // The far one is above the near one.
    assert_eq!(visibility(&app, &[group, far, between, near, leaf]), [Visible, Inherited, Inherited, Inherited, Visible]);
    // Taken apart, it is hidden as soon as anything is written.
    app.world_mut().entity_mut(near).insert(ChildOf(group));
    assert_eq!(update(&mut app), [far]);
    assert_eq!(visibility(&app, &[group, far, between, near, leaf]), [Visible, Hidden, Inherited, Inherited, Visible]);
    app.world_mut().entity_mut(near).insert(ChildOf(between));
    assert_eq!(update(&mut app), [far]);
    place(&mut app, eye, EYES[2]);
    assert_eq!(update(&mut app), [near]);
}

#[test]
fn objects_are_found_by_their_nodes_and_one_of_several_is_enough() {
    let (mut app, _) = app(&three_rooms(), []);
    let of = |app: &App, node: &str| app.world().resource::<Building>().object(node);
    assert_eq!(of(&app, "bath"), Some(EnfiladeObject::new(ObjectId(2))));
    assert_eq!(of(&app, "shed"), None);
    let both = EnfiladeObject { first: ObjectId(0), ..of(&app, "bath").unwrap() };
    let things = [both, of(&app, "bath").unwrap()].map(|object| app.world_mut().spawn(object).id());
    camera(&mut app, EYES[0]);
    update(&mut app);
    assert_eq!(visibility(&app, &things), [Inherited, Hidden]);
    // Nodes that share a name show when any of them does.
    let mut file = three_rooms();
    file.objects.iter_mut().for_each(|object| object.node = "thing".into());
    let all = Building::new(&file).object("thing").unwrap();
    assert_eq!((all.first, all.last), (ObjectId(0), ObjectId(2)));
}

#[test]
fn nodes_of_an_exported_model_say_which_object_they_draw() {
    let object = |extras: &str| EnfiladeObject::from_extras(extras).map(|o| (o.first, o.last));
    let seventeen = Some((ObjectId(17), ObjectId(17)));
    assert_eq!(object(r#"{"enfilade":{"object":17,"cells":[0,3]}}"#), seventeen);
    assert_eq!(object(r#"{"artist":"A","enfilade":{"object":17,"cells":[],"role":"door"}}"#), seventeen);
    for other in [
        "",
        "17",
        "{}",
        r#"{"enfilade":{"role":"door"}}"#,
        r#"{"enfilade":{"object":-1}}"#,
        r#"{"enfilade":{"object":4294967296}}"#,
    ] {
        assert_eq!(object(other), None, "{other}");
    }
}
