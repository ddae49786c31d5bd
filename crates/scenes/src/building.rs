//! The result of a generator: a model and the facts about it.

use super::facts::Facts;
use super::model::{Material, Model};
use super::path::CameraPath;
use super::plan::{Plan, PlanRoom, metres};
use super::solid::cuboid;
use enfilade::scene::Role;
use glam::DVec3;

/// The result of a generator.
pub(super) struct Building {
    pub name: String,
    pub seed: u64,
    /// Kinds that the generator counted, with their numbers.
    pub counted: Vec<(&'static str, usize)>,
    pub model: Model,
    pub facts: Facts,
    pub path: CameraPath,
}

/// The ground around and under a plan, `margin` metres wider on every side; its top is the underside of the ground floor's slab.
pub(super) fn ground(model: &mut Model, plan: &Plan, margin: f64) {
    let ends = |pick: fn(&PlanRoom) -> [i32; 2]| {
        let (from, to) = plan.rooms.iter().map(pick).fold((i32::MAX, i32::MIN), |(a, b), r| (a.min(r[0]), b.max(r[1])));
        [metres(from) - margin, metres(to) + margin]
    };
    let (x, z, top) = (ends(|r| r.x), ends(|r| r.z), -metres(plan.style.slab));
    let solid = cuboid(DVec3::new(x[0], top - 0.2, z[0]), DVec3::new(x[1], top, z[1]));
    model.add("ground", Role::Structure, Material::Ground, solid);
}
