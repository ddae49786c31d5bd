//! Paths that a person walks: recorded as the library reads them, and played.

use enfilade_measure::walkthrough::path::{CameraPath, MOST_FRAMES, PathFrame};

/// Frames of a path in a second.
const FRAMES_A_SECOND: f64 = 10.0;

/// A path that is being recorded.
pub struct Recording {
    path: CameraPath,
    /// Where the walker was last, and the part of the next frame's time that has passed by then.
    last: PathFrame,
    part: f64,
}

impl Recording {
    /// From this place on; the angle and the near plane are the path's.
    pub fn new(name: &str, fov_y_degrees: f64, near: f64, at: PathFrame) -> Self {
        Self { path: CameraPath { name: name.to_owned(), fov_y_degrees, near, frames: vec![at] }, last: at, part: 0.0 }
    }

    /// The walker is there, `seconds` after it was where it was. Returns false where the path can't have more frames.
    pub fn step(&mut self, seconds: f64, at: PathFrame) -> bool {
        let frames = seconds * FRAMES_A_SECOND;
        // A picture that took long has several of the path's frames: on the way.
        let mut due = 1.0 - self.part;
        while due <= frames && self.path.frames.len() < MOST_FRAMES {
            self.path.frames.push(between(self.last, at, due / frames));
            due += 1.0;
        }
        self.part = 1.0 - (due - frames);
        self.last = at;
        self.path.frames.len() < MOST_FRAMES
    }

    /// Seconds so far.
    pub fn seconds(&self) -> f64 {
        (self.path.frames.len() - 1) as f64 / FRAMES_A_SECOND
    }

    /// The recorded path.
    pub fn end(self) -> CameraPath {
        self.path
    }
}

/// The place on a path after some seconds; `None` after its end.
pub fn at(path: &CameraPath, seconds: f64) -> Option<PathFrame> {
    let frame = seconds * FRAMES_A_SECOND;
    let last = path.frames.len().checked_sub(1)?;
    if frame > last as f64 {
        return None;
    }
    let first = frame as usize;
    Some(between(path.frames[first], path.frames[(first + 1).min(last)], frame.fract()))
}

fn between(a: PathFrame, b: PathFrame, part: f64) -> PathFrame {
    let eye = a.eye.lerp(b.eye, part);
    // Of opposite directions there is none between.
    let along = (a.target - a.eye).normalize_or_zero().lerp((b.target - b.eye).normalize_or_zero(), part);
    PathFrame { eye, target: eye + along.try_normalize().unwrap_or(b.target - b.eye) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn place(x: f64) -> PathFrame {
        PathFrame { eye: DVec3::new(x, 1.6, 0.0), target: DVec3::new(x, 1.6, -1.0) }
    }

    /// Two metres a second to the right, in pictures of these seconds.
    fn record(pictures: &[f64]) -> CameraPath {
        let mut recording = Recording::new("walk", 65.0, 0.001, place(0.0));
        let mut now = 0.0;
        for seconds in pictures {
            now += seconds;
            assert!(recording.step(*seconds, place(2.0 * now)));
        }
        recording.end()
    }

    #[test]
    fn a_recording_reads_back_with_ten_frames_a_second_where_the_walker_was() {
        // Of 60 pictures a second, 4 a second, and both.
        for pictures in [vec![1.0 / 60.0; 123], vec![0.25; 8], vec![0.01, 0.9, 0.03, 0.3, 0.02, 0.55, 0.25]] {
            let path = record(&pictures);
            let read = CameraPath::from_json(&serde_json::to_string(&path).unwrap()).unwrap();
            assert_eq!(read.frames.len(), 21, "{pictures:?}");
            for (frame, at) in read.frames.iter().enumerate() {
                let wanted = place(0.2 * frame as f64);
                assert!(at.eye.distance(wanted.eye) < 1e-9 && at.target.distance(wanted.target) < 1e-9, "{frame}: {at:?}");
            }
        }
    }

    #[test]
    fn a_path_ends_with_the_most_frames_that_the_library_reads() {
        let mut recording = Recording::new("walk", 65.0, 0.001, place(0.0));
        assert!(recording.step(5000.0, place(1.0)));
        assert!(!recording.step(9000.0, place(2.0)));
        assert!(!recording.step(9000.0, place(3.0)));
        let path = recording.end();
        assert_eq!(path.frames.len(), MOST_FRAMES);
        path.validate().unwrap();
    }

    #[test]
    fn playing_goes_where_the_path_does_and_ends() {
        let path = record(&[0.1; 11]);
        let x = |seconds: f64| at(&path, seconds).map(|frame| frame.eye.x);
        assert!((x(0.55).unwrap() - 1.1).abs() < 1e-9 && x(0.0) == Some(0.0) && x(1.2).is_none());
    }
}
