//! Rays against a scene's triangles.
//!
//! [`RayScene`] keeps two hierarchies (obvhs): opaque triangles, which stop a ray, and see-through ones, which it passes and
//! reports. Hits are found in `f32` and settled in `f64` on the original triangles.

use super::Scene;
use crate::ObjectId;
use glam::DVec3;

/// Where a ray ends.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hit {
    /// Distance along the ray in units of its direction's length.
    pub t: f64,
    /// Index into [`Scene::triangles`].
    pub triangle: u32,
    /// The triangle's object.
    pub object: ObjectId,
}

/// A scene made ready for rays.
pub struct RayScene<'s> {
    scene: &'s Scene,
}

impl<'s> RayScene<'s> {
    /// Builds the hierarchies; the same scene gives the same answers.
    pub fn new(scene: &'s Scene) -> Self {
        Self { scene }
    }

    /// The scene.
    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    /// First opaque triangle that `origin + t * direction` meets for `0 < t <= limit`, from either side.
    pub fn first_opaque(&self, _origin: DVec3, _direction: DVec3, _limit: f64) -> Option<Hit> {
        todo!()
    }

    /// Every see-through object that the ray meets for `0 < t <= limit`, each once, nearest first, appended to `out`.
    pub fn see_through(&self, _origin: DVec3, _direction: DVec3, _limit: f64, _out: &mut Vec<Hit>) {
        todo!()
    }

    /// True where the open segment from `a` to `b` keeps `clearance` metres from every opaque triangle, not counting the
    /// triangles of `target` and not counting what comes nearer than that only within `clearance` of either end. This is what
    /// makes a segment a witness: no ray through a crack between two triangles of a closed wall passes.
    pub fn is_clear(
        &self,
        _a: DVec3,
        _b: DVec3,
        _clearance: f64,
        _target: Option<ObjectId>,
    ) -> bool {
        todo!()
    }
}
