//! Levels as assets: loaded, marked, and loaded again when their file changes.

mod rooms;

use bevy_app::{App, TaskPoolPlugin};
use bevy_asset::{AssetPlugin, AssetServer, LoadState};
use bevy_camera::visibility::Visibility::{self, Hidden, Inherited};
use bevy_ecs::prelude::*;
use bevy_enfilade::prelude::*;
use bevy_reflect::Reflect;
use bevy_transform::TransformPlugin;
use enfilade::file::PvsFile;
use rooms::{EYES, THINGS, at, rooms_with, three_rooms};
use std::fs;
use std::path::PathBuf;

/// What Bevy's loader puts beside a node.
#[derive(Component, Reflect, Default)]
#[reflect(Component)]
struct GltfExtras {
    value: String,
}

/// A folder for the assets of a test.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// An app with a model's root and a node for each thing, a level below it, as a loader spawns them.
fn app(folder: &std::path::Path) -> (App, [Entity; 3]) {
    let mut app = App::new();
    let assets = AssetPlugin { file_path: folder.display().to_string(), ..Default::default() };
    app.add_plugins((TaskPoolPlugin::default(), assets, TransformPlugin, EnfiladePlugins));
    app.register_type::<GltfExtras>();
    let root = app.world_mut().spawn(EnfiladeModel).id();
    let group = app.world_mut().spawn((Name::new("group"), Visibility::default(), ChildOf(root))).id();
    let nodes = THINGS.map(|name| app.world_mut().spawn((Name::new(name), Visibility::default(), ChildOf(group))).id());
    // Of the same name, and not of the model.
    app.world_mut().spawn((Name::new("bath"), Visibility::default()));
    app.world_mut().spawn((PortalCamera::default(), at(EYES[0])));
    (app, nodes)
}

fn write(folder: &std::path::Path, file: &PvsFile) {
    fs::write(folder.join("level.pvs"), file.write()).unwrap();
}

/// Updates until something is so; loading is done by other threads.
fn update_until(app: &mut App, is_so: impl Fn(&World) -> bool) {
    for _ in 0..20_000 {
        app.update();
        if is_so(app.world()) {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    panic!("it never came so");
}

fn visibility(app: &App, nodes: [Entity; 3]) -> [Visibility; 3] {
    nodes.map(|node| *app.world().get(node).unwrap())
}

fn objects(app: &App, nodes: [Entity; 3]) -> [Option<u32>; 3] {
    nodes.map(|node| app.world().get::<EnfiladeObject>(node).map(|object| object.first.0))
}

#[test]
fn a_level_is_loaded_marks_its_model_and_is_loaded_again_with_its_doors_as_they_are() {
    let folder = folder("level");
    write(&folder, &three_rooms());
    let (mut app, nodes) = app(&folder);
    app.update();
    assert_eq!((visibility(&app, nodes), objects(&app, nodes)), ([Inherited; 3], [None; 3]), "nothing is loaded yet");
    let handle = app.world().resource::<AssetServer>().load("level.pvs");
    app.insert_resource(LevelHandle(handle));
    update_until(&mut app, |world| world.contains_resource::<Building>());
    app.update();
    assert_eq!(objects(&app, nodes), [Some(0), Some(1), Some(2)]);
    assert_eq!(visibility(&app, nodes), [Inherited, Inherited, Hidden]);
    assert_eq!(app.world_mut().query::<&EnfiladeObject>().iter(app.world()).count(), 3, "only the model's");
    // A late one, and one that has its own.
    let group = app.world().get::<ChildOf>(nodes[0]).unwrap().parent();
    let late = app.world_mut().spawn((Name::new("bath"), Visibility::default(), ChildOf(group))).id();
    let own = (Name::new("bath"), EnfiladeObject::new(ObjectId(0)), ChildOf(group));
    let own = app.world_mut().spawn(own).id();
    app.update();
    app.update();
    assert_eq!([late, own].map(|e| *app.world().get::<Visibility>(e).unwrap()), [Hidden, Inherited]);
    // The first door shuts; the file is written anew with its objects in another order, and without a bed.
    app.world_mut().resource_mut::<Building>().set_open(PortalId(0), false).unwrap();
    app.world_mut().get_mut::<EnfiladeObject>(nodes[1]).unwrap().shown = Visibility::Visible;
    app.update();
    assert_eq!(visibility(&app, nodes), [Inherited, Hidden, Hidden]);
    let mut other = rooms_with([2, 0, 1]);
    other.objects[1].node = "couch".into();
    write(&folder, &other);
    app.world().resource::<AssetServer>().reload("level.pvs");
    let table = nodes[1];
    update_until(&mut app, |world| world.get::<EnfiladeObject>(table).unwrap().first == ObjectId(2));
    assert_eq!(objects(&app, nodes), [None, Some(2), Some(0)]);
    assert_eq!(visibility(&app, nodes), [Inherited, Hidden, Hidden], "the door is still shut");
    assert_eq!(app.world().get::<EnfiladeObject>(own).unwrap().first, ObjectId(0), "left alone");
    app.world_mut().resource_mut::<Building>().set_open(PortalId(0), true).unwrap();
    app.update();
    assert_eq!(visibility(&app, nodes), [Inherited, Visibility::Visible, Hidden]);
}

#[test]
fn extras_go_before_names_and_need_no_loader() {
    let folder = folder("extras");
    let (mut app, nodes) = app(&folder);
    app.insert_resource(Building::new(&three_rooms()));
    // What is named bed is the object of the bath.
    let extras = GltfExtras { value: r#"{"enfilade":{"object":2,"cells":[]}}"#.into() };
    app.world_mut().entity_mut(nodes[0]).insert(extras);
    app.world_mut().entity_mut(nodes[1]).insert(GltfExtras { value: r#"{"artist":"A"}"#.into() });
    app.update();
    app.update();
    assert_eq!(objects(&app, nodes), [Some(2), Some(1), Some(2)]);
    assert_eq!(visibility(&app, nodes), [Hidden, Inherited, Hidden]);
}

#[test]
fn a_file_that_is_no_level_fails_to_load_and_hides_nothing() {
    let folder = folder("broken");
    let whole = three_rooms().write();
    fs::write(folder.join("level.pvs"), &whole[..whole.len() / 2]).unwrap();
    let (mut app, nodes) = app(&folder);
    let handle = app.world().resource::<AssetServer>().load("level.pvs");
    app.insert_resource(LevelHandle(handle.clone()));
    update_until(&mut app, |world| {
        matches!(world.resource::<AssetServer>().get_load_state(handle.id()), Some(LoadState::Failed(_)))
    });
    app.update();
    assert!(!app.world().contains_resource::<Building>());
    assert_eq!(visibility(&app, nodes), [Inherited; 3]);
}
