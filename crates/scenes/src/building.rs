//! What a generator makes: a model, and what is known of it.

use super::facts::Facts;
use super::model::{Material, Model};
use super::path::CameraPath;
use super::plan::{Plan, PlanRoom, metres};
use super::solid::cuboid;
use enfilade::scene::Role;
use glam::DVec3;

/// What each generator hands back.
pub(super) struct Building {
    pub name: String,
    pub seed: u64,
    /// What the caller counted, and how many of each.
    pub counted: Vec<(&'static str, usize)>,
    pub model: Model,
    pub facts: Facts,
    pub path: CameraPath,
}

/// The ground around and under a plan, `margin` metres wider on every side, its top where the ground floor's slab stands.
pub(super) fn ground(model: &mut Model, plan: &Plan, margin: f64) {
    let ends = |pick: fn(&PlanRoom) -> [i32; 2]| {
        let (from, to) = plan.rooms.iter().map(pick).fold((i32::MAX, i32::MIN), |(a, b), r| (a.min(r[0]), b.max(r[1])));
        [metres(from) - margin, metres(to) + margin]
    };
    let (x, z, top) = (ends(|r| r.x), ends(|r| r.z), -metres(plan.style.slab));
    let solid = cuboid(DVec3::new(x[0], top - 0.2, z[0]), DVec3::new(x[1], top, z[1]));
    model.add("ground", Role::Structure, Material::Ground, solid);
}
