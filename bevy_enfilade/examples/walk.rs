//! A walk through all rooms, on a plan in the terminal: `#` is shown, `.` is hidden, `@` is the camera.
//!
//! `cargo run -p bevy_enfilade --example walk -- office.pvs`

mod terminal;

use bevy_app::{PostUpdate, Update};
use bevy_camera::visibility::Visibility;
use bevy_ecs::prelude::*;
use bevy_enfilade::EnfiladeSystems;
use bevy_enfilade::prelude::*;
use bevy_transform::components::Transform;
use terminal::{Level, Plan, app, count, walk};

fn main() -> Result<(), String> {
    let mut app = app(PortalCamera::default())?;
    app.add_systems(Update, walk).add_systems(PostUpdate, draw.after(EnfiladeSystems::Show)).run();
    Ok(())
}

fn draw(level: Res<Level>, camera: Single<&Transform, With<PortalCamera>>, objects: Query<(&EnfiladeObject, &Visibility)>) {
    let mut plan = Plan::new(&level, camera.translation, &objects);
    plan.put(camera.translation, '@');
    plan.print(&count(&objects));
}
