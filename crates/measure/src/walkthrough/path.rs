//! Camera paths of walks, as JSON in the model's own coordinates.
//!
//! ```json
//! {"name": "through the hall", "fov_y_degrees": 60, "near": 0.05,
//!  "frames": [{"eye": [0, 1.6, 0], "target": [1, 1.6, 0]}]}
//! ```

use enfilade::runtime::Camera;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The field of view is below this, degrees.
const HALF_TURN: f64 = 180.0;

/// Least distance of eye and target, metres.
const NEAREST: f64 = 1e-9;

/// Greatest coordinate of a camera, metres.
const FARTHEST: f64 = 1e12;

/// Maximum frames of a path.
pub const MOST_FRAMES: usize = 100_000;

/// A camera path.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPath {
    /// Its name.
    pub name: String,
    /// Vertical opening angle, degrees, in (0, 180).
    pub fov_y_degrees: f64,
    /// Distance of the near plane along the view direction, metres, above 0.
    pub near: f64,
    /// 1 to [`MOST_FRAMES`].
    pub frames: Vec<PathFrame>,
}

/// One frame of a path: metres in the model's own coordinates, +Y up.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathFrame {
    /// Where the camera is.
    pub eye: DVec3,
    /// The point that it looks at; not the eye.
    pub target: DVec3,
}

/// Why a camera path is invalid. The command line prefixes the file's path.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The file is not the JSON of a camera path.
    #[error("not a camera path: {0}")]
    Json(#[from] serde_json::Error),
    /// A number is out of its range.
    #[error("{what}")]
    Range {
        /// The key and its range.
        what: &'static str,
    },
    /// A frame is invalid.
    #[error("frame {frame}: {what}")]
    Frame {
        /// From 0.
        frame: usize,
        /// The reason.
        what: &'static str,
    },
}

impl CameraPath {
    /// Reads and checks a path.
    pub fn load(path: &Path) -> Result<Self, PathError> {
        Self::from_json(&std::fs::read_to_string(path)?)
    }

    /// Reads and checks a path.
    pub fn from_json(json: &str) -> Result<Self, PathError> {
        let path: Self = serde_json::from_str(json)?;
        path.validate()?;
        Ok(path)
    }

    /// Checks every number.
    pub fn validate(&self) -> Result<(), PathError> {
        let range = |what| Err(PathError::Range { what });
        // Written so that NaN fails.
        if !(self.fov_y_degrees > 0.0 && self.fov_y_degrees < HALF_TURN) {
            return range("fov_y_degrees must be above 0 and below 180");
        }
        if !(self.near > 0.0 && self.near.is_finite()) {
            return range("near must be above 0");
        }
        if self.frames.is_empty() || self.frames.len() > MOST_FRAMES {
            return range("frames must be 1 to 100000");
        }
        for (frame, f) in self.frames.iter().enumerate() {
            let wrong = |what| Err(PathError::Frame { frame, what });
            if !f.eye.is_finite() || f.eye.abs().max_element() > FARTHEST {
                return wrong("eye is not within 1e12 m");
            }
            if !f.target.is_finite() || f.target.abs().max_element() > FARTHEST {
                return wrong("target is not within 1e12 m");
            }
            if f.eye.distance(f.target) < NEAREST {
                return wrong("eye and target are the same point");
            }
        }
        Ok(())
    }

    /// The camera of a frame, for a model whose origin is `origin`; `aspect` is width over height.
    pub fn camera(&self, frame: usize, origin: DVec3, aspect: f64) -> Camera {
        let PathFrame { eye, target } = self.frames[frame];
        Camera::look_at(eye - origin, target - origin, self.fov_y_degrees.to_radians(), aspect)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn json(frame: &str, rest: &str) -> String {
        format!(r#"{{"name": "n", "near": 0.1, "frames": [{{"eye": [0,0,0], "target": [1,0,0]}}, {frame}]{rest}}}"#)
    }

    #[test]
    fn a_path_reads_back_as_written() {
        let path =
            CameraPath::from_json(&json(r#"{"eye": [0,1,0], "target": [1,0,0.5]}"#, r#", "fov_y_degrees": 60"#)).unwrap();
        assert_eq!(path.frames[1].target, DVec3::new(1.0, 0.0, 0.5));
        assert_eq!(CameraPath::from_json(&serde_json::to_string(&path).unwrap()).unwrap(), path);
    }

    #[test]
    fn errors_name_the_frame_and_the_key() {
        let fov = r#", "fov_y_degrees": 60"#;
        let cases = [
            (json(r#"{"eye": [0,1,0], "target": [0,1,0]}"#, fov), "frame 1: eye and target are the same point"),
            (json(r#"{"eye": [0,1,1e13], "target": [0,1,0]}"#, fov), "frame 1: eye is not within"),
            (json(r#"{"eye": [0,1,0]}"#, fov), "missing field `target`"),
            (json(r#"{"eye": [0,1,0], "target": [0,1], "x": 1}"#, fov), "not a camera path"),
            (json(r#"{"eye": [0,1,0], "target": [0,1,1e999]}"#, fov), "number out of range"),
            (json(r#"{"eye": [0,1,0], "target": [0,1,1]}"#, r#", "fov_y_degrees": 180"#), "fov_y_degrees must be"),
            (json(r#"{"eye": [0,1,0], "target": [0,1,1]}"#, ""), "missing field `fov_y_degrees`"),
            (json(r#"{"eye": [0,1,0], "target": [0,1,1]}"#, r#", "fov_y_degrees": 60, "far": 9"#), "unknown field `far`"),
            (r#"{"name":"n","near":-1,"fov_y_degrees":60,"frames":[]}"#.into(), "near must be"),
            (r#"{"name":"n","near":1,"fov_y_degrees":60,"frames":[]}"#.into(), "frames must be"),
        ];
        for (text, expected) in cases {
            let message = CameraPath::from_json(&text).unwrap_err().to_string();
            assert!(message.contains(expected), "{text}: {message}");
        }
    }
}
