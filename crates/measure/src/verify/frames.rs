//! Random cameras as a path, so that no frame helps the next one.

use super::sample::Sampler;
use super::scales;
use crate::walkthrough::path::{CameraPath, PathFrame};
use enfilade::file::PvsFile;
use enfilade::math::parallel;
use enfilade::math::random::Prng;
use enfilade::scene::Scene;

/// A path of `count` random cameras: anywhere in a cell, near portals, near walls, outside; in any direction, towards portals or
/// objects. It is shorter if cells have no inside. The same arguments give the same path.
pub fn random_path(scene: &Scene, file: &PvsFile, count: u32, seed: u64) -> CameraPath {
    let (tracer, cells, tolerance) = scales(scene, file);
    let sampler = Sampler::new(scene, &tracer, &cells, tolerance);
    let frame = |number: usize| {
        let (_, eye, along) = sampler.ray(&mut Prng::new(seed, number as u64))?;
        let eye = eye + file.origin;
        Some(PathFrame { eye, target: eye + along })
    };
    let near = (scene.bounds().diagonal() * 1e-3).min(0.05);
    let frames = parallel::flat_map_range(0..count as usize, frame);
    CameraPath { name: format!("{count} random views {seed}"), fov_y_degrees: 65.0, near, frames }
}
