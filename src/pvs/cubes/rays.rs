//! Cubes by one ray per pixel, in `f64`: slow, the reference for the fast engines.

use super::{Cube, CubeEngine, CubeView, NONE, SeeThrough};
use crate::scene::rays::{Hit, RayScene};

/// Casts a ray for each pixel.
pub struct Rays<'r, 's> {
    scene: &'r RayScene<'s>,
    hits: Vec<Hit>,
}

impl<'r, 's> Rays<'r, 's> {
    /// For one thread.
    pub fn new(scene: &'r RayScene<'s>) -> Self {
        Self { scene, hits: Vec::new() }
    }
}

impl CubeEngine for Rays<'_, '_> {
    fn cube(&mut self, view: &CubeView, out: &mut Cube) {
        out.clear(view);
        for pixel in 0..view.pixels() {
            let direction = view.direction(pixel);
            let hit = self.scene.first_opaque(view.eye, direction, f64::INFINITY);
            out.triangles[pixel] = hit.map_or(NONE, |h| h.triangle);
            self.hits.clear();
            self.scene.see_through(view.eye, direction, hit.map_or(f64::INFINITY, |h| h.t), &mut self.hits);
            let pixel = pixel as u32;
            out.see_through.extend(self.hits.iter().map(|h| SeeThrough { pixel, triangle: h.triangle }));
        }
    }
}
