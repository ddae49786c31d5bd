//! What an eye sees now and will see soon, in order: for an eye whose cells have more in their rows than fits into memory.
//!
//! First what is on the screen now, and where the screen will be if the eye goes on as it does, a bit wider; then what an eye
//! that turns would see, from here and from there.

use super::super::culler::Culler;
use super::super::motion::Motion;
use super::super::scratch::Scratch;
use super::super::{Camera, Mode};
use crate::ObjectId;
use glam::Vec3;

/// When the camera is looked at, seconds from now. Farther: more is loaded that is never seen. Less far: loads come late.
const TIMES: [f64; 4] = [0.0, 0.5, 1.0, 2.0];
/// Of these, from where the eye looks all around.
const AROUND: [usize; 2] = [0, 2];
/// Screens are so much wider and higher than the client's: for what the eye turns on the way, and for what comes in at the sides.
const WIDER: f32 = 1.5;

/// Looks with a culler.
#[derive(Clone, Debug)]
pub(super) struct Sight {
    scratch: Scratch,
}

impl Sight {
    pub fn new(culler: &Culler) -> Self {
        Self { scratch: Scratch::for_culler(culler) }
    }

    /// Tells what is seen, the most urgent first; an object may be told more than once. Ends where `tell` says false.
    pub fn each(&mut self, culler: &Culler, motion: &Motion, tell: &mut impl FnMut(ObjectId) -> bool) {
        let cameras = TIMES.map(|time| motion.ahead(time));
        let screens = cameras.iter().flatten().map(wider);
        let around = AROUND.iter().filter_map(|&time| cameras[time]).flat_map(|camera| all_around(&camera));
        for camera in screens.chain(around) {
            let visible = culler.cull(&camera, Mode::PortalsAndPvs, &mut self.scratch);
            if !visible.objects.iter().all(|&object| tell(object)) {
                return;
            }
        }
    }
}

fn wider(camera: &Camera) -> Camera {
    Camera { x: camera.x / WIDER, y: camera.y / WIDER, ..*camera }
}

/// Six square screens that meet at their edges, the way it looks first and what is behind last.
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
