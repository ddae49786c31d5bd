//! The objects that an eye sees now and soon, in order: for cells whose rows exceed the memory budget.
//!
//! First the objects on the current screen and on extrapolated screens, slightly wider; then those that a turning eye would see, from the
//! current and an extrapolated position.

use super::super::culler::Culler;
use super::super::doors::Doors;
use super::super::motion::Motion;
use super::super::scratch::Scratch;
use super::super::{Camera, Mode};
use crate::ObjectId;
use glam::Vec3;

/// Times of the extrapolated cameras, seconds. Farther: more useless loads. Nearer: late loads.
const TIMES: [f64; 4] = [0.0, 0.5, 1.0, 2.0];
/// Indices of the times with views in all directions.
const AROUND: [usize; 2] = [0, 2];
/// Factor on the screen's width and height: for turns on the way, and for objects that enter at the sides.
const WIDER: f32 = 1.5;

/// View queries with a culler.
#[derive(Clone, Debug)]
pub(super) struct Sight {
    scratch: Scratch,
}

impl Sight {
    pub fn new(culler: &Culler) -> Self {
        Self { scratch: Scratch::for_culler(culler) }
    }

    pub fn set_doors(&mut self, doors: &Doors) {
        self.scratch.doors.assign(doors);
    }

    /// Calls `tell` for visible objects, most urgent first; an object may appear more than once. Ends if `tell` returns false.
    pub fn each(&mut self, culler: &Culler, motion: &Motion, tell: &mut impl FnMut(ObjectId) -> bool) {
        let cameras = TIMES.map(|time| motion.ahead(time));
        let screens = cameras.iter().flatten().map(wider);
        let around = AROUND.iter().filter_map(|&time| cameras[time]).flat_map(|camera| all_around(&camera));
        for camera in screens.chain(around) {
            culler.cull(&camera, Mode::PortalsAndPvs, &mut self.scratch);
            if !self.scratch.objects.iter().all(|&object| tell(object)) {
                return;
            }
        }
    }
}

fn wider(camera: &Camera) -> Camera {
    Camera { x: camera.x / WIDER, y: camera.y / WIDER, ..*camera }
}

/// The six square screens of a cube map, the view direction first and the opposite last.
fn all_around(camera: &Camera) -> [Camera; 6] {
    let ahead = camera.w.normalize_or(Vec3::NEG_Z);
    let right = (camera.x - ahead * ahead.dot(camera.x)).normalize_or(ahead.any_orthonormal_vector());
    let up = right.cross(ahead);
    [
        [right, up, ahead],
        [-ahead, up, right],
        [ahead, up, -right],
        [right, -ahead, up],
        [right, ahead, -up],
        [-right, up, -ahead],
    ]
    .map(|[x, y, w]| Camera { eye: camera.eye, x, y, w })
}
