//! The triangles that each mode is expected to draw, from a baked file alone: culls a tour through every cell without drawing.

use super::tour::tour;
use enfilade::file::PvsFile;
use enfilade::runtime::{Culler, Mode, View};
pub use enfilade::types::expected::ExpectedDraw;

/// Width over height of the screen.
const ASPECT: f64 = 16.0 / 9.0;

/// The expected draw of a file; the same on every machine. `None` without objects or a place to stand.
pub fn expected_draw(file: &PvsFile) -> Option<ExpectedDraw> {
    if file.objects.is_empty() {
        return None;
    }
    let path = tour(file, 0);
    if path.frames.is_empty() {
        return None;
    }
    let mut view = View::new(&Culler::new(file));
    let mut triangles = [0u64; 4];
    for frame in 0..path.frames.len() {
        let camera = path.camera(frame, file.origin, ASPECT);
        for (sum, mode) in triangles.iter_mut().zip([Mode::Frustum, Mode::Portals, Mode::Pvs, Mode::PortalsAndPvs]) {
            *sum += view.cull(&camera, mode).stats.triangles;
        }
    }
    let [frustum, portals, pvs, both] = triangles.map(|sum| sum as f64);
    let share = |of_mode: f64| if frustum > 0.0 { of_mode / frustum } else { 1.0 };
    Some(ExpectedDraw {
        frames: path.frames.len(),
        frustum_triangles: frustum / path.frames.len() as f64,
        portals: share(portals),
        pvs: share(pvs),
        both: share(both),
    })
}
