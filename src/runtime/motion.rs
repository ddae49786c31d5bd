//! Extrapolates a camera's motion: constant velocity and rotation from the last two frames.

use super::Camera;
use glam::{DMat3, DQuat};

/// The motion of a camera.
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    last: Option<(Camera, f64)>,
    /// Velocity, metres per second.
    velocity: glam::DVec3,
    /// Angular velocity, radians per second, about an axis.
    turn: glam::DVec3,
}

/// Shortest time between two cameras, seconds.
const SHORTEST: f64 = 1e-6;

impl Motion {
    /// Adds a camera at a time (seconds, from any origin).
    pub fn see(&mut self, camera: &Camera, time: f64) {
        if let Some((before, then)) = self.last {
            let passed = time - then;
            if passed < SHORTEST {
                return;
            }
            self.velocity = (camera.eye.as_dvec3() - before.eye.as_dvec3()) / passed;
            let turned = frame(camera) * frame(&before).transpose();
            self.turn = DQuat::from_mat3(&turned).normalize().to_scaled_axis() / passed;
        }
        self.last = Some((*camera, time));
    }

    /// The camera extrapolated by `seconds`. `None` before the first one.
    pub fn ahead(&self, seconds: f64) -> Option<Camera> {
        let (camera, _) = self.last?;
        let turn = DQuat::from_scaled_axis(self.turn * seconds);
        let [x, y, w] = [camera.x, camera.y, camera.w].map(|row| (turn * row.as_dvec3()).as_vec3());
        let eye = camera.eye.as_dvec3() + self.velocity * seconds;
        let ahead = Camera { eye: eye.as_vec3(), x, y, w };
        // After a jump, or with a degenerate camera, there is no extrapolation.
        let finite = [ahead.eye, x, y, w].iter().all(|v| v.is_finite());
        Some(if finite { ahead } else { camera })
    }
}

/// Right, up and back of a camera, orthonormal.
fn frame(camera: &Camera) -> DMat3 {
    let forward = camera.w.as_dvec3().normalize_or(glam::DVec3::NEG_Z);
    let up = camera.y.as_dvec3();
    let up = (up - forward * forward.dot(up)).normalize_or(glam::DVec3::Y);
    DMat3::from_cols(forward.cross(up), up, -forward)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_camera_that_walks_and_turns_is_where_it_will_be() {
        let at = |t: f64| {
            let eye = DVec3::new(3.0 * t, 1.0, -2.0 * t);
            Camera::look_at(eye, eye + DVec3::new(t.cos(), 0.3, t.sin()), 1.0, 1.6)
        };
        let mut motion = Motion::default();
        motion.see(&at(1.0), 1.0);
        motion.see(&at(1.01), 1.01);
        let (found, want) = (motion.ahead(0.5).unwrap(), at(1.51));
        assert!((found.eye - want.eye).length() < 1e-3, "{} for {}", found.eye, want.eye);
        for (found, want) in [(found.x, want.x), (found.y, want.y), (found.w, want.w)] {
            assert!((found - want).length() < 1e-2, "{found} for {want}");
        }
    }
}
