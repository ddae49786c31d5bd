//! Several files of one model in the same views: each view is drawn once, and culled by every file.

use super::missed::with_holes;
use super::path::CameraPath;
use super::raster::View;
use super::walk::Truth;
use crate::file::PvsFile;
use crate::parallel;
use crate::runtime::{Culler, Mode, Scratch};
use crate::scene::Scene;
use crate::scene::rays::RayScene;
pub use crate::types::drawn::{Compared, Drawn, DrawnOfFile};

/// Modes of [`DrawnOfFile`], in its order.
const MODES: [Mode; 2] = [Mode::Pvs, Mode::Both];

/// Counts of one mode in one view.
#[derive(Clone, Copy, Default)]
struct Counts {
    triangles: u64,
    missed: u64,
    cracks: u64,
}

/// Counts for each file what [`walk`](super::walk::walk) counts with `verify_pixels` in the modes `pvs` and `both`, all doors
/// open. Holes that the first file takes for opaque are so for all. Pictures are `width` x `height` pixels, each 1 to 16384. The same for
/// any number of threads.
pub fn compare(scene: &Scene, files: &[PvsFile], path: &CameraPath, [width, height]: [usize; 2]) -> Compared {
    let cullers: Vec<Culler> = files.iter().map(Culler::new).collect();
    let rays = files.first().map_or_else(|| RayScene::new(scene), |file| with_holes(scene, file));
    let scratches = || cullers.iter().map(Scratch::for_culler).collect::<Vec<_>>();
    let look = |scratches: &mut Vec<Scratch>, frame: usize| {
        let camera = path.camera(frame, scene.origin, width as f64 / height as f64);
        let truth = Truth::new(&rays, &View { camera, near: path.near, width, height });
        let by_mode = |(culler, scratch): (&Culler, &mut Scratch)| {
            MODES.map(|mode| {
                let visible = culler.cull(&camera, mode, scratch);
                let missed = truth.missed(visible.objects);
                Counts { triangles: visible.stats.triangles, missed: missed.pixels.len() as u64, cracks: missed.cracks }
            })
        };
        let counts: Vec<[Counts; 2]> = cullers.iter().zip(scratches.iter_mut()).map(by_mode).collect();
        (files.first().map_or(0, |file| truth.triangles(file)), counts)
    };
    let seen = parallel::map_init(path.frames.len(), scratches, look);
    let mean = |sum: u64| sum as f64 / seen.len().max(1) as f64;
    let drawn = |file: usize, mode: usize| {
        let sum = |of: fn(&Counts) -> u64| seen.iter().map(|(_, counts)| of(&counts[file][mode])).sum::<u64>();
        Drawn {
            triangles_mean: mean(sum(|c| c.triangles)),
            missed_pixels: sum(|c| c.missed),
            crack_pixels: sum(|c| c.cracks),
        }
    };
    Compared {
        views: seen.len(),
        exact_triangles_mean: mean(seen.iter().map(|(exact, _)| exact).sum()),
        files: (0..files.len()).map(|file| DrawnOfFile { pvs: drawn(file, 0), both: drawn(file, 1) }).collect(),
    }
}
