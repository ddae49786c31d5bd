//! Objects that the exact judge sees and a mode leaves out, found without drawing.
//!
//! An object is lost if the judge has a witness of it that keeps the clearance of the rows: a ray that meets the object and stays
//! away from everything else. An eye on a surface may see through it, depending on rounding, so nothing is lost from there.

use super::missed::stands_on_a_surface;
use super::raster::View;
use crate::exact::{ExactScene, Judge, MOST_SPLITS};
use enfilade::ObjectId;
use enfilade::scene::rays::RayScene;
use glam::{DVec3, Vec3};

/// Judges frames.
pub(super) struct Witnesses<'s> {
    judge: Judge<'s>,
    rays: RayScene<'s>,
    clearance: f64,
    /// For a frame: objects with such a witness, ascending.
    objects: Vec<ObjectId>,
}

impl<'s> Witnesses<'s> {
    /// `clearance`: that of the rows, metres.
    pub fn new(ready: &'s ExactScene, rays: RayScene<'s>, clearance: f64) -> Self {
        Self { judge: Judge::new(ready), rays, clearance, objects: Vec::new() }
    }

    /// Judges the next frame.
    pub fn look(&mut self, view: &View) {
        let camera = &view.camera;
        let eye = camera.eye.as_dvec3();
        let seen = self.judge.through(eye, [camera.x, camera.y, camera.w].map(Vec3::as_dvec3), MOST_SPLITS);
        self.objects.clear();
        for witness in &seen.visible {
            let object = self.rays.scene().object_of(witness.triangle as usize);
            if self.objects.last() != Some(&object) && self.is_clear(eye, witness.direction, witness.triangle, object) {
                self.objects.push(object);
            }
        }
    }

    /// How many objects of the frame are not in `kept`, the set of a mode.
    pub fn lost(&self, kept: &[ObjectId]) -> u64 {
        let mut kept = kept.to_vec();
        kept.sort_unstable();
        self.objects.iter().filter(|o| kept.binary_search(o).is_err()).count() as u64
    }

    fn is_clear(&self, eye: DVec3, along: DVec3, triangle: u32, object: ObjectId) -> bool {
        let hit = self.rays.meets(eye, along, triangle);
        hit.is_some_and(|hit| self.rays.is_clear(eye, eye + along * hit.t, self.clearance, Some(object)))
            && !stands_on_a_surface(&self.rays, eye, along)
    }
}
