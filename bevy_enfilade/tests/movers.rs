//! What moves: hidden and shown by where its box is.

mod rooms;

use bevy_app::App;
use bevy_camera::primitives::Aabb;
use bevy_camera::visibility::NoFrustumCulling;
use bevy_camera::visibility::Visibility::{self, Hidden, Inherited, Visible};
use bevy_camera::{PerspectiveProjection, Projection};
use bevy_ecs::prelude::*;
use bevy_enfilade::prelude::*;
use bevy_math::{Quat, Vec3};
use bevy_mesh::Mesh3d;
use bevy_transform::TransformPlugin;
use bevy_transform::components::Transform;
use enfilade::runtime::{Culler, Movers, View};
use glam::DVec3;
use rooms::{EYES, at, bevy, three_rooms};
use testing::boxes::{flat, p};

fn app() -> App {
    let mut app = App::new();
    app.add_plugins((TransformPlugin, EnfiladePlugins)).insert_resource(Building::new(&three_rooms()));
    app
}

/// A box of 0.5 x 1.6 x 0.5 m.
fn body() -> Aabb {
    Aabb::from_min_max(Vec3::new(-0.25, -0.8, -0.25), Vec3::new(0.25, 0.8, 0.25))
}

/// A mesh of that box at a place, as Bevy has it when its bounds are known.
fn mesh(place: Transform) -> impl Bundle {
    (Mesh3d::default(), body(), place, Visibility::default())
}

fn seen(app: &App, entity: Entity) -> Visibility {
    *app.world().get(entity).unwrap()
}

fn place(app: &mut App, entity: Entity, x: f32) {
    *app.world_mut().get_mut::<Transform>(entity).unwrap() = at(x);
    app.update();
}

#[test]
fn meshes_that_are_not_the_buildings_are_hidden_where_no_camera_may_see_them() {
    let mut app = app();
    let walker = app.world_mut().spawn(mesh(at(EYES[2]))).id();
    app.update();
    assert_eq!(seen(&app, walker), Inherited, "there is no camera");
    let eye = app.world_mut().spawn((PortalCamera::default(), at(EYES[0]))).id();
    app.update();
    assert_eq!(seen(&app, walker), Hidden);
    for (x, visibility) in [(6.0, Inherited), (11.0, Hidden), (7.9, Inherited), (1.5, Inherited), (30.0, Inherited)] {
        place(&mut app, walker, x);
        assert_eq!(seen(&app, walker), visibility, "{x}");
    }
    place(&mut app, walker, 11.0);
    place(&mut app, eye, EYES[1]);
    assert_eq!(seen(&app, walker), Inherited);
    // A door, a building that is gone, and one that is there again.
    app.world_mut().resource_mut::<Building>().set_open(PortalId(1), false).unwrap();
    app.update();
    assert_eq!(seen(&app, walker), Hidden);
    let building = app.world_mut().remove_resource::<Building>().unwrap();
    app.update();
    assert_eq!(seen(&app, walker), Inherited);
    app.insert_resource(building);
    app.update();
    assert_eq!(seen(&app, walker), Hidden);
    // Nowhere: shown.
    app.world_mut().get_mut::<Transform>(walker).unwrap().translation.x = f32::NAN;
    app.update();
    assert_eq!(seen(&app, walker), Inherited);
    place(&mut app, walker, 11.0);
    assert_eq!(seen(&app, walker), Hidden);
    // Another in its place.
    app.world_mut().despawn(walker);
    let second = app.world_mut().spawn(mesh(at(5.0))).id();
    app.update();
    assert_eq!(seen(&app, second), Inherited);
    place(&mut app, second, 10.0);
    assert_eq!(seen(&app, second), Hidden);
}

#[test]
fn the_buildings_meshes_and_those_that_say_so_are_no_movers() {
    let mut app = app();
    app.world_mut().spawn((PortalCamera::default(), at(EYES[0])));
    let world = app.world_mut();
    let (model, object) = (world.spawn(EnfiladeModel).id(), world.spawn(EnfiladeObject::new(ObjectId(0))).id());
    let within = [model, object].map(|root| world.spawn((mesh(at(EYES[2])), ChildOf(root))).id());
    let sky = world.spawn((mesh(at(EYES[2])), NoFrustumCulling)).id();
    // A light has no mesh: it is one if it says so.
    let light = world.spawn((EnfiladeMover { shown: Visible }, body(), at(EYES[2]))).id();
    let lamp = world.spawn((body(), at(EYES[2]), Visibility::default())).id();
    app.update();
    app.update();
    assert_eq!([within[0], within[1], sky, lamp].map(|e| seen(&app, e)), [Inherited; 4]);
    assert_eq!(seen(&app, light), Hidden);
    place(&mut app, light, EYES[1]);
    assert_eq!(seen(&app, light), Visible);
}

#[test]
fn what_carries_a_mover_that_is_seen_is_not_hidden() {
    let mut app = app();
    app.world_mut().spawn((PortalCamera::default(), at(EYES[0])));
    let carrier = app.world_mut().spawn(mesh(at(EYES[2]))).id();
    let arm = Transform::from_xyz(EYES[1] - EYES[2], 0.0, 0.0);
    let hand = app.world_mut().spawn((mesh(arm), ChildOf(carrier))).id();
    app.update();
    assert_eq!([carrier, hand].map(|e| seen(&app, e)), [Inherited; 2]);
    app.world_mut().get_mut::<Transform>(hand).unwrap().translation.x = 0.0;
    app.update();
    assert_eq!([carrier, hand].map(|e| seen(&app, e)), [Hidden; 2]);
    app.world_mut().entity_mut(carrier).remove::<EnfiladeMover>().insert(Inherited);
    app.update();
    assert_eq!([carrier, hand].map(|e| seen(&app, e)), [Inherited, Hidden]);
}

/// In each update, what the library says of the same boxes.
#[test]
fn movers_of_a_view_are_those_of_the_library() {
    let (_, file) = flat().0.finish();
    let culler = Culler::new(&file);
    for mode in [Mode::Frustum, Mode::Pvs, Mode::PortalsAndPvs] {
        let mut app = App::new();
        app.add_plugins((TransformPlugin, EnfiladePlugins)).insert_resource(Building::new(&file));
        let lens = PerspectiveProjection { fov: 1.1, aspect_ratio: 1.6, ..Default::default() };
        let eye = app.world_mut().spawn((PortalCamera::PerFrame(mode), Projection::Perspective(lens))).id();
        let bodies: Vec<Entity> = (0..12).map(|_| app.world_mut().spawn(mesh(Transform::default())).id()).collect();
        let (mut view, mut movers) = (View::new(&culler), Movers::new(&culler));
        let mut hidden = 0;
        for turn in 0..60 {
            let (sin, cos) = (f64::from(turn) * 0.4).sin_cos();
            let from = p(0.5 + f64::from(turn % 19) * 0.5, 1.6, 4.5 + sin);
            let to = from + DVec3::new(cos, 0.1, sin);
            *app.world_mut().get_mut(eye).unwrap() = Transform::from_translation(bevy(from)).looking_at(bevy(to), Vec3::Y);
            let mut ids = Vec::new();
            for (k, &body) in (0..).zip(&bodies) {
                // Off all planes.
                let middle =
                    p(f64::from((k * 7 + turn) % 100) * 0.1 + 0.0371, 1.0, f64::from((k * 5 + turn) % 60) * 0.1 + 0.0229);
                // A quarter turn, and twice as large: a box of 1 x 1 x 3.2 m, long along z.
                let turned = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
                *app.world_mut().get_mut(body).unwrap() =
                    Transform { rotation: turned, scale: Vec3::splat(2.0), ..Transform::from_translation(bevy(middle)) };
                let half = p(0.5, 0.5, 1.6);
                ids.push(movers.insert([middle - half, middle + half].map(|q| (q - file.origin).as_vec3())).unwrap());
            }
            app.update();
            let camera = enfilade::runtime::Camera::look_at(from - file.origin, to - file.origin, 1.1, 1.6);
            view.cull(&camera, mode);
            let set = view.movers(&movers).to_vec();
            for (id, &body) in ids.iter().zip(&bodies) {
                assert_eq!(seen(&app, body) == Inherited, set.contains(id), "{mode}, turn {turn}");
                hidden += usize::from(!set.contains(id));
                movers.remove(*id).unwrap();
            }
        }
        assert!(hidden > 60, "{mode}: {hidden}");
    }
}
