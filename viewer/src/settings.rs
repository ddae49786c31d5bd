//! What is remembered from one run to the next, as JSON in the folder where the system keeps settings.

use crate::colours::Tints;
use crate::looks::Detail;
use crate::walker::Walker;
use enfilade::geom::Aabb;
use glam::DVec3;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;
use std::path::PathBuf;

/// Models whose last place is remembered; beyond, the oldest is forgotten.
const MODELS: usize = 64;

/// What is remembered. A file that can't be read is as none: settings are never in the way.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// A mode's name, as on the command line.
    pub mode: String,
    /// How the scene is drawn.
    pub detail: Detail,
    /// Colours of objects.
    pub tints: Tints,
    /// What is shown over the picture.
    #[serde(flatten)]
    pub layers: Layers,
    /// Without weight.
    pub flies: bool,
    /// Width and height of the window, pixels.
    pub size: [u32; 2],
    /// Vertical opening angle, degrees.
    pub fov_y_degrees: f64,
    /// Where somebody was last, by model; the latest last.
    #[serde(deserialize_with = "whole_places")]
    pub places: Vec<LastPlace>,
}

/// Where somebody was when a model was left.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct LastPlace {
    /// [`enfilade::file::PvsFile::model_hash`], hexadecimal.
    pub model: String,
    /// The eye, metres relative to the model's origin.
    pub eye: [f64; 3],
    /// Radians from -Z to the right.
    pub yaw: f64,
    /// Radians up.
    pub pitch: f64,
}

impl LastPlace {
    /// Somebody there; `None` where it isn't within a model's bounds or a number means nothing.
    pub fn walker(&self, bounds: &Aabb) -> Option<Walker> {
        let eye = DVec3::from(self.eye);
        if !bounds.contains(eye) || !self.yaw.is_finite() || !self.pitch.is_finite() {
            return None;
        }
        let mut walker = Walker::new(eye, DVec3::NEG_Z, false);
        walker.turn(self.yaw, self.pitch);
        Some(walker)
    }
}

/// Places that can't be read are as none, and take nothing else with them.
fn whole_places<'d, D: Deserializer<'d>>(from: D) -> Result<Vec<LastPlace>, D::Error> {
    let places = Value::deserialize(from)?;
    let places = places.as_array().into_iter().flatten();
    Ok(places.filter_map(|place| serde_json::from_value(place.clone()).ok()).collect())
}

/// What may lie over the picture: shown or not.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Layers {
    /// Outlines of portals.
    pub portals: bool,
    /// Rectangles on the screen that portals narrow the view to.
    pub rectangles: bool,
    /// The plan of the storey.
    pub plan: bool,
    /// The visibility matrix.
    pub matrix: bool,
    /// Graphs of what frames cost.
    pub graphs: bool,
    /// What a comparison with a picture of everything finds missed.
    pub alarm: bool,
}

impl Layers {
    /// The bare picture.
    pub const NONE: Self =
        Self { portals: false, rectangles: false, plan: false, matrix: false, graphs: false, alarm: false };
}

impl Default for Layers {
    fn default() -> Self {
        Self { plan: true, ..Self::NONE }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            mode: "auto".into(),
            detail: Detail::Full,
            tints: Tints::Roles,
            layers: Layers::default(),
            flies: false,
            size: [1280, 720],
            fov_y_degrees: 65.0,
            places: Vec::new(),
        }
    }
}

impl Settings {
    /// Where they are kept; `None` where the system doesn't say.
    pub fn path() -> Option<PathBuf> {
        let from = |variable: &str| std::env::var_os(variable).filter(|v| !v.is_empty()).map(PathBuf::from);
        let folder = if cfg!(windows) {
            from("APPDATA")?
        } else if cfg!(target_os = "macos") {
            from("HOME")?.join("Library/Application Support")
        } else {
            from("XDG_CONFIG_HOME").or_else(|| Some(from("HOME")?.join(".config")))?
        };
        Some(folder.join("enfilade").join("viewer.json"))
    }

    /// As they were left; the usual ones where there are none.
    pub fn load() -> Self {
        let text = Self::path().and_then(|path| std::fs::read_to_string(path).ok());
        let mut settings: Self = text.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default();
        settings.fov_y_degrees =
            if settings.fov_y_degrees.is_finite() { settings.fov_y_degrees.clamp(20.0, 120.0) } else { 65.0 };
        settings.size = settings.size.map(|side| side.clamp(160, 8192));
        settings
    }

    /// Where somebody was last in a model.
    pub fn place(&self, model: u128) -> Option<&LastPlace> {
        let model = key(model);
        self.places.iter().rev().find(|place| place.model == model)
    }

    /// Remembers where somebody is in a model.
    pub fn leave(&mut self, model: u128, eye: [f64; 3], yaw: f64, pitch: f64) {
        let model = key(model);
        self.places.retain(|place| place.model != model);
        self.places.push(LastPlace { model, eye, yaw, pitch });
        self.places.drain(..self.places.len().saturating_sub(MODELS));
    }

    /// Keeps them.
    pub fn save(&self) {
        let Some(path) = Self::path() else { return };
        let kept = serde_json::to_string_pretty(self).map_err(std::io::Error::other).and_then(|text| {
            path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
            std::fs::write(&path, text)
        });
        if let Err(e) = kept {
            eprintln!("{}: settings not kept: {e}", path.display());
        }
    }
}

fn key(model: u128) -> String {
    format!("{model:032x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_model_has_its_last_place_and_the_oldest_model_is_forgotten() {
        let mut settings = Settings::default();
        for model in 0..70 {
            settings.leave(model, [model as f64, 1.6, 0.0], 0.5, 0.0);
        }
        settings.leave(10, [-3.0, 1.6, 2.0], 1.0, -0.25);
        let read: Settings = serde_json::from_str(&serde_json::to_string(&settings).unwrap()).unwrap();
        assert_eq!(read.places.len(), 64);
        assert!(read.place(5).is_none() && read.place(6).is_some() && read.place(69).is_some());
        let place = read.place(10).unwrap();
        assert_eq!((place.eye, place.yaw, place.pitch), ([-3.0, 1.6, 2.0], 1.0, -0.25));
        // It is the latest now: the next one that goes is another.
        (100..163).for_each(|model| settings.leave(model, [0.0; 3], 0.0, 0.0));
        assert!(settings.place(10).is_some() && settings.place(69).is_none());
    }

    #[test]
    fn a_place_that_is_not_in_the_model_is_none() {
        let bounds = Aabb { min: DVec3::splat(-5.0), max: DVec3::splat(5.0) };
        let at = |eye, yaw| LastPlace { model: key(1), eye, yaw, pitch: -0.25 }.walker(&bounds);
        let walker = at([1.0, -2.0, 3.0], 0.5).expect("within");
        assert_eq!((walker.eye, walker.yaw, walker.pitch), (DVec3::new(1.0, -2.0, 3.0), 0.5, -0.25));
        assert!(at([6.0, 0.0, 0.0], 0.0).is_none() && at([0.0, f64::NAN, 0.0], 0.0).is_none());
        assert!(at([0.0; 3], f64::INFINITY).is_none());
    }

    #[test]
    fn a_bad_place_is_as_none_and_the_rest_is_kept() {
        let text = r#"{"mode": "pvs", "places": [
            {"model": "00000000000000000000000000000001", "eye": [null, 0, 0], "yaw": 0, "pitch": 0},
            {"model": "00000000000000000000000000000002", "eye": [1, 2], "yaw": 0, "pitch": 0},
            7,
            {"model": "00000000000000000000000000000003", "eye": [1, 2, 3], "yaw": 0.5, "pitch": 0}]}"#;
        let settings: Settings = serde_json::from_str(text).unwrap();
        assert_eq!((settings.mode.as_str(), settings.places.len()), ("pvs", 1));
        assert_eq!(settings.place(3).unwrap().eye, [1.0, 2.0, 3.0]);
        let settings: Settings = serde_json::from_str(r#"{"mode": "pvs", "places": "none"}"#).unwrap();
        assert_eq!((settings.mode.as_str(), settings.places.len()), ("pvs", 0));
        // As it was before there were any.
        let settings: Settings = serde_json::from_str(r#"{"mode": "pvs"}"#).unwrap();
        assert_eq!((settings.mode.as_str(), settings.places.len()), ("pvs", 0));
    }
}
