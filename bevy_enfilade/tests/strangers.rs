//! Ids that the building doesn't have: in a binary of its own, since a log is the process's.

use bevy_app::App;
use bevy_camera::visibility::Visibility;
use bevy_enfilade::{Building, EnfiladeObject, EnfiladePlugin, PortalCamera};
use bevy_transform::components::Transform;
use enfilade::ObjectId;
use std::sync::Mutex;
use testing::boxes;

/// The lines of the log.
static LINES: Mutex<Vec<String>> = Mutex::new(Vec::new());

struct Lines;

impl log::Log for Lines {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.target().starts_with("bevy_enfilade")
    }

    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata()) {
            LINES.lock().unwrap().push(record.args().to_string());
        }
    }

    fn flush(&self) {}
}

#[test]
fn unknown_objects_are_shown_and_told_of_once() {
    log::set_logger(&Lines).unwrap();
    log::set_max_level(log::LevelFilter::Trace);
    let (_, file) = boxes::flat().0.finish();
    let objects = file.objects.len() as u32;
    let mut app = App::new();
    app.add_plugins(EnfiladePlugin).insert_resource(Building::new(&file));
    let world = app.world_mut();
    let camera = world.spawn((PortalCamera::default(), Transform::from_xyz(2.0, 1.6, 2.0))).id();
    world.spawn(EnfiladeObject::new(ObjectId(0)));
    let backwards = EnfiladeObject { first: ObjectId(2), last: ObjectId(1), ..EnfiladeObject::new(ObjectId(0)) };
    let strangers = [EnfiladeObject::new(ObjectId(objects)), EnfiladeObject::new(ObjectId(u32::MAX)), backwards];
    let strangers = strangers.map(|object| world.spawn((object, Visibility::Hidden)).id());
    for x in [2.0, 8.0, 50.0] {
        app.world_mut().get_mut::<Transform>(camera).unwrap().translation.x = x;
        app.update();
        assert!(strangers.iter().all(|&e| app.world().get::<Visibility>(e) == Some(&Visibility::Inherited)));
    }
    let mut lines = std::mem::take(&mut *LINES.lock().unwrap());
    let first =
        format!("3 entities are always shown: {} has object {objects}, and the building has {objects}", strangers[0]);
    assert_eq!(lines, [first]);
    // One fewer: told again.
    app.world_mut().despawn(strangers[0]);
    app.world_mut().spawn(EnfiladeObject::new(ObjectId(1)));
    app.update();
    lines = std::mem::take(&mut *LINES.lock().unwrap());
    assert!(lines.len() == 1 && lines[0].starts_with("2 entities are always shown: "), "{lines:?}");
}
