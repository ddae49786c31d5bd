//! Doors that open and shut by turns: `D` is shut, `/` is open. `#` is shown to the camera at `@`, `.` is hidden.
//!
//! `cargo run -p bevy_enfilade --example doors -- office.pvs`

mod terminal;

use bevy_app::{PostUpdate, Update};
use bevy_camera::visibility::Visibility;
use bevy_ecs::prelude::*;
use bevy_enfilade::EnfiladeSystems;
use bevy_enfilade::prelude::*;
use bevy_math::Vec3;
use bevy_transform::components::Transform;
use terminal::{Frame, Level, Plan, app, count, walk};

/// Frames that a door stays as it is.
const TURN: usize = 20;

fn main() -> Result<(), String> {
    let mut app = app(PortalCamera::default())?;
    app.add_systems(Update, (walk, turn.run_if(resource_exists::<Building>)).chain());
    app.add_systems(PostUpdate, draw.after(EnfiladeSystems::Show)).run();
    Ok(())
}

/// Every other door is open, then the others are.
fn turn(frame: Res<Frame>, mut building: ResMut<Building>) -> Result<(), BevyError> {
    if !frame.0.is_multiple_of(TURN) {
        return Ok(());
    }
    let portals = building.culler().portal_count();
    for p in 0..portals {
        building.set_open(PortalId(p as u32), (p + frame.0 / TURN).is_multiple_of(2))?;
    }
    Ok(())
}

fn draw(
    level: Res<Level>,
    building: Option<Res<Building>>,
    camera: Single<&Transform, With<PortalCamera>>,
    objects: Query<(&EnfiladeObject, &Visibility)>,
) {
    let mut plan = Plan::new(&level, camera.translation, &objects);
    let (file, eye) = (&level.file, camera.translation);
    for (id, portal) in (0..).map(PortalId).zip(&file.portals) {
        let middle = portal.winding.iter().sum::<enfilade::glam::Vec3>() / portal.winding.len() as f32;
        let middle = Vec3::from_array((middle.as_dvec3() + file.origin).as_vec3().to_array());
        let is_open = building.as_ref().is_none_or(|building| building.doors().is_open(id.directed(0)));
        if (middle.y - eye.y).abs() < 1.5 {
            plan.put(middle, if is_open { '/' } else { 'D' });
        }
    }
    plan.put(eye, '@');
    plan.print(&count(&objects));
}
