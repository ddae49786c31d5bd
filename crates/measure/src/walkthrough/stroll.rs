//! A path at a constant speed, frame by frame.

use super::path::{CameraPath, PathFrame};
use super::tour::even_tour;
use enfilade::file::PvsFile;
use enfilade::runtime::Camera;
use glam::DVec3;

/// Two frames of a path farther apart than this, metres, are a jump. More: a straight line between rooms, through walls, counts
/// as a walk. Less: a path with a frame a second falls apart.
const JUMP: f64 = 3.0;
/// Vertical opening angle of the walk through every cell, degrees; as in [`super::tour::tour`].
const FOV_Y: f64 = 65.0;

/// See the [module](self).
#[derive(Clone, PartialEq, Debug)]
pub struct Stroll {
    /// Vertical opening angle, degrees.
    pub fov_y_degrees: f64,
    /// Frames a step apart, in legs that begin with a jump.
    pub legs: Vec<Vec<PathFrame>>,
}

impl Stroll {
    /// Follows a path in straight lines; `step` metres a frame, above 0. A path of one place has one frame.
    pub fn along(path: &CameraPath, step: f64) -> Self {
        let legs = path.frames.chunk_by(|a, b| a.eye.distance(b.eye) <= JUMP);
        Self { fov_y_degrees: path.fov_y_degrees, legs: legs.map(|leg| even(leg, step)).collect() }
    }

    /// Visits every cell of a file, as [`super::tour::tour`]; `step` metres a frame, above 0.
    pub fn through(file: &PvsFile, seed: u64, step: f64) -> Self {
        Self { fov_y_degrees: FOV_Y, legs: even_tour(file, seed, step) }
    }

    /// Number of frames in all legs.
    pub fn frames(&self) -> usize {
        self.legs.iter().map(Vec::len).sum()
    }

    /// The camera of a frame, for a model whose origin is `origin`; `aspect` is width over height.
    pub fn camera(&self, frame: &PathFrame, origin: DVec3, aspect: f64) -> Camera {
        Camera::look_at(frame.eye - origin, frame.target - origin, self.fov_y_degrees.to_radians(), aspect)
    }
}

/// Frames of one leg, a step apart.
fn even(leg: &[PathFrame], step: f64) -> Vec<PathFrame> {
    let mut out = vec![leg[0]];
    // Metres from the last frame to the start of the current segment.
    let mut walked = 0.0;
    for pair in leg.windows(2) {
        let length = pair[0].eye.distance(pair[1].eye);
        let mut at = step - walked;
        while at <= length {
            out.push(between(pair[0], pair[1], at / length));
            at += step;
        }
        walked = length - (at - step);
    }
    out
}

/// Interpolates eye and direction of two frames.
fn between(a: PathFrame, b: PathFrame, t: f64) -> PathFrame {
    let eye = a.eye.lerp(b.eye, t);
    let [from, to] = [a, b].map(|frame| (frame.target - frame.eye).normalize_or(DVec3::X));
    // The mean of opposite directions is zero.
    PathFrame { eye, target: eye + from.lerp(to, t).normalize_or(to) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(x: f64, z: f64, looks: DVec3) -> PathFrame {
        let eye = DVec3::new(x, 1.6, z);
        PathFrame { eye, target: eye + looks }
    }

    #[test]
    fn frames_are_a_step_apart_and_jumps_begin_legs() {
        let frames = vec![
            frame(0.0, 0.0, DVec3::X),
            frame(1.0, 0.0, DVec3::Z),
            frame(1.0, 1.05, DVec3::Z),
            frame(9.0, 0.0, DVec3::X),
            frame(9.0, 0.0, DVec3::Z),
            frame(9.0, 0.25, -DVec3::Z),
        ];
        let path = CameraPath { name: String::new(), fov_y_degrees: 60.0, near: 0.1, frames };
        let stroll = Stroll::along(&path, 0.1);
        let places: Vec<Vec<[f64; 2]>> =
            stroll.legs.iter().map(|leg| leg.iter().map(|f| [f.eye.x, f.eye.z]).collect()).collect();
        assert_eq!(places.iter().map(Vec::len).collect::<Vec<_>>(), [21, 3]);
        for (k, [x, z]) in places[0].iter().enumerate() {
            let s = 0.1 * k as f64;
            assert!((x - s.min(1.0)).abs() < 1e-9 && (z - (s - 1.0).max(0.0)).abs() < 1e-9, "{k}: {x}, {z}");
        }
        let looks = |k: usize| stroll.legs[0][k].target - stroll.legs[0][k].eye;
        assert!((looks(5) - (DVec3::X + DVec3::Z).normalize()).length() < 1e-9);
        assert!((looks(15) - DVec3::Z).length() < 1e-9);
        assert_eq!(stroll.frames(), 24);
    }
}
