//! A thousand walkers: `O` may be seen by the camera at `@` and is shown, `o` is hidden.
//!
//! `cargo run -p bevy_enfilade --example many_movers -- office.pvs`

mod terminal;

use bevy_app::{PostUpdate, Startup, Update};
use bevy_camera::primitives::Aabb;
use bevy_camera::visibility::Visibility;
use bevy_ecs::prelude::*;
use bevy_enfilade::EnfiladeSystems;
use bevy_enfilade::prelude::*;
use bevy_math::Vec3;
use bevy_transform::components::Transform;
use terminal::{Frame, Level, Plan, app, count, walk};

const WALKERS: usize = 1000;

/// How far ahead of the camera it walks, frames.
#[derive(Component)]
struct Walker(usize);

fn main() -> Result<(), String> {
    let mut app = app(PortalCamera::PerFrame(Mode::PortalsAndPvs))?;
    app.add_systems(Startup, spawn).add_systems(Update, (walk, go_on).chain());
    app.add_systems(PostUpdate, draw.after(EnfiladeSystems::Show)).run();
    Ok(())
}

/// In a game, meshes are movers by themselves. These have none.
fn spawn(level: Res<Level>, mut commands: Commands) {
    let body = Aabb::from_min_max(Vec3::new(-0.3, -1.6, -0.3), Vec3::new(0.3, 0.2, 0.3));
    let ahead = |k: usize| Walker(k * level.way.len() / WALKERS);
    let walkers = (0..WALKERS).map(move |k| (ahead(k), EnfiladeMover::default(), body, Transform::default()));
    commands.spawn_batch(walkers.collect::<Vec<_>>());
}

fn go_on(level: Res<Level>, frame: Res<Frame>, mut walkers: Query<(&Walker, &mut Transform)>) {
    for (walker, mut transform) in &mut walkers {
        transform.translation = level.way[(walker.0 + frame.0) % level.way.len()];
    }
}

fn draw(
    level: Res<Level>,
    camera: Single<&Transform, With<PortalCamera>>,
    objects: Query<(&EnfiladeObject, &Visibility)>,
    walkers: Query<(&Transform, &Visibility), With<Walker>>,
) {
    let mut plan = Plan::new(&level, camera.translation, &objects);
    let mut seen = 0;
    for is_drawn in [false, true] {
        let those = walkers.iter().filter(|(_, visibility)| (**visibility != Visibility::Hidden) == is_drawn);
        for (transform, _) in those {
            seen += usize::from(is_drawn);
            plan.put(transform.translation, if is_drawn { 'O' } else { 'o' });
        }
    }
    plan.put(camera.translation, '@');
    plan.print(&format!("{}, and {seen} of {WALKERS} walkers", count(&objects)));
}
