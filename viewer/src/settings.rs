//! Settings that are kept from one run to the next, as JSON in the system's folder for settings.

use crate::colours::Tints;
use crate::draw::tubes::Thin;
use crate::keymap::KeyMap;
use crate::looks::Detail;
use crate::units::Units;
use crate::walker::Walker;
use enfilade::math::geom::Aabb;
use glam::DVec3;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Models whose last place is remembered; beyond, the oldest is forgotten.
const MODELS: usize = 64;
/// Files that were opened; beyond, the oldest is forgotten.
const RECENT: usize = 12;

/// Range of a setting.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// No less.
    pub least: f64,
    /// The default.
    pub usual: f64,
    /// No more.
    pub most: f64,
    /// Twice as much is as far as half of it.
    pub is_factor: bool,
}

/// Vertical opening angle, degrees: less is a telescope, more shows nothing but edges.
pub const FIELD_OF_VIEW: Range = Range { least: 20.0, usual: 65.0, most: 110.0, is_factor: false };
/// Speed, times the usual: slower is standing, faster crosses a house in a frame.
pub const SPEED: Range = Range { least: 0.1, usual: 1.0, most: 10.0, is_factor: true };
/// How far the mouse turns, times the usual: a person can't aim beyond.
pub const SENSITIVITY: Range = Range { least: 0.1, usual: 1.0, most: 10.0, is_factor: true };
/// How far a gamepad's stick turns, times the usual.
pub const STICK: Range = Range { least: 0.1, usual: 1.0, most: 10.0, is_factor: true };
/// A gamepad's stick that is nearer to its middle is at rest: of its way to the edge.
pub const DEAD_ZONE: Range = Range { least: 0.0, usual: 0.15, most: 0.9, is_factor: false };
/// Pixels that a tube may be off: less is finer than a picture, more shows corners.
pub const TUBE_PIXELS: Range = Range { least: 0.1, usual: 0.5, most: 4.0, is_factor: true };
/// Size of text, times the usual: smaller can't be read, and larger panels are larger than the window.
pub const TEXT: Range = Range { least: 0.5, usual: 1.0, most: 2.5, is_factor: true };

/// Speed grows by this with a notch of the wheel, and the opening angle shrinks by these degrees.
const FASTER: f64 = 1.15;
const CLOSER: f64 = 3.0;

impl Range {
    /// The nearest number that may be; the usual one in place of what is none.
    pub fn clamp(&self, number: f64) -> f64 {
        if number.is_nan() { self.usual } else { number.clamp(self.least, self.most) }
    }
}

/// The speed after some notches of the wheel.
pub fn faster(speed: f64, notches: f64) -> f64 {
    SPEED.clamp(speed * FASTER.powf(notches))
}

/// The opening angle, degrees, after some notches of the wheel.
pub fn closer(fov_y_degrees: f64, notches: f64) -> f64 {
    FIELD_OF_VIEW.clamp(fov_y_degrees - CLOSER * notches)
}

/// How a person likes to walk and to read.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Preferences {
    /// See [`SENSITIVITY`].
    pub sensitivity: f64,
    /// The mouse looks down where it goes up.
    pub inverted: bool,
    /// See [`SPEED`].
    pub speed: f64,
    /// See [`TEXT`].
    pub text: f64,
    /// Units of lengths and areas.
    pub units: Units,
    /// See [`STICK`].
    pub stick: f64,
    /// See [`DEAD_ZONE`].
    pub dead_zone: f64,
}

impl Default for Preferences {
    fn default() -> Self {
        Self {
            sensitivity: SENSITIVITY.usual,
            inverted: false,
            speed: SPEED.usual,
            text: TEXT.usual,
            units: Units::Metres,
            stick: STICK.usual,
            dead_zone: DEAD_ZONE.usual,
        }
    }
}

/// Settings. A file that cannot be read counts as none.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// A mode's name, as on the command line.
    pub mode: String,
    /// How the scene is drawn; `None`: as suits the device.
    pub detail: Option<Detail>,
    /// Colours of objects.
    pub tints: Tints,
    /// Layers over the picture.
    #[serde(flatten)]
    pub layers: Layers,
    /// Without weight.
    pub flies: bool,
    /// Width and height of the window, pixels.
    pub size: [u32; 2],
    /// Vertical opening angle, degrees.
    pub fov_y_degrees: f64,
    /// How a person likes it.
    #[serde(flatten)]
    pub preferences: Preferences,
    /// How tubes are drawn.
    #[serde(flatten)]
    pub tubes: OfTubes,
    /// The last place in each model; the latest last.
    #[serde(deserialize_with = "whole_places")]
    pub places: Vec<LastPlace>,
    /// Files that were opened, the latest first.
    #[serde(deserialize_with = "whole_names")]
    pub recent: Vec<String>,
    /// Which key does what.
    pub keys: KeyMap,
}

/// How tubes are drawn.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct OfTubes {
    /// Pixels that their surface may be off.
    pub tube_pixels: f64,
    /// Those that are thinner than a pixel; `None`: as suits the model.
    pub thin_tubes: Option<Thin>,
}

impl Default for OfTubes {
    fn default() -> Self {
        Self { tube_pixels: TUBE_PIXELS.usual, thin_tubes: None }
    }
}

/// The last place in a model.
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
    /// A walker there; `None` outside of a model's bounds, or for numbers that are not finite.
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

/// Names that can't be read are as none; more than are kept are none, too.
fn whole_names<'d, D: Deserializer<'d>>(from: D) -> Result<Vec<String>, D::Error> {
    let names = Value::deserialize(from)?;
    let names = names.as_array().into_iter().flatten().filter_map(|name| Some(name.as_str()?.to_owned()));
    Ok(names.filter(|name| !name.is_empty()).take(RECENT).collect())
}

/// Layers over the picture: shown or not.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Layers {
    /// Outlines of portals.
    pub portals: bool,
    /// Screen rectangles of portals.
    pub rectangles: bool,
    /// The plan of the storey.
    pub plan: bool,
    /// The visibility matrix.
    pub matrix: bool,
    /// Graphs of frame costs.
    pub graphs: bool,
    /// The missed-pixel alarm.
    pub alarm: bool,
    /// Names of rooms in the scene.
    pub names: bool,
}

impl Layers {
    /// The bare picture.
    pub const NONE: Self =
        Self { portals: false, rectangles: false, plan: false, matrix: false, graphs: false, alarm: false, names: false };
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
            detail: None,
            tints: Tints::Roles,
            layers: Layers::default(),
            flies: false,
            size: [1280, 720],
            fov_y_degrees: FIELD_OF_VIEW.usual,
            preferences: Preferences::default(),
            tubes: OfTubes::default(),
            places: Vec::new(),
            recent: Vec::new(),
            keys: KeyMap::default(),
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
        text.map(|text| Self::read(&text)).unwrap_or_default()
    }

    /// Reads them. What can't be read is as if it were missing, and takes nothing else with it; numbers are as near as they may be.
    fn read(text: &str) -> Self {
        let Ok(Value::Object(kept)) = serde_json::from_str(text) else { return Self::default() };
        let alone = |key: &str, value: &Value| {
            serde_json::from_value::<Self>(Value::Object([(key.to_owned(), value.clone())].into_iter().collect()))
        };
        let kept = kept.into_iter().filter(|(key, value)| alone(key, value).is_ok()).collect();
        let mut settings: Self = serde_json::from_value(Value::Object(kept)).unwrap_or_default();
        settings.fov_y_degrees = FIELD_OF_VIEW.clamp(settings.fov_y_degrees);
        settings.tubes.tube_pixels = TUBE_PIXELS.clamp(settings.tubes.tube_pixels);
        settings.size = settings.size.map(|side| side.clamp(160, 8192));
        let Preferences { sensitivity, inverted, speed, text, units, stick, dead_zone } = settings.preferences;
        let (sensitivity, speed, text) = (SENSITIVITY.clamp(sensitivity), SPEED.clamp(speed), TEXT.clamp(text));
        let (stick, dead_zone) = (STICK.clamp(stick), DEAD_ZONE.clamp(dead_zone));
        settings.preferences = Preferences { sensitivity, inverted, speed, text, units, stick, dead_zone };
        settings
    }

    /// The last place in a model.
    pub fn place(&self, model: u128) -> Option<&LastPlace> {
        let model = key(model);
        self.places.iter().rev().find(|place| place.model == model)
    }

    /// Keeps the place in a model.
    pub fn leave(&mut self, model: u128, eye: [f64; 3], yaw: f64, pitch: f64) {
        let model = key(model);
        self.places.retain(|place| place.model != model);
        self.places.push(LastPlace { model, eye, yaw, pitch });
        self.places.drain(..self.places.len().saturating_sub(MODELS));
    }

    /// Remembers a file that was opened; one whose name isn't text can't be.
    pub fn opened(&mut self, file: &Path) {
        let whole = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        let Some(name) = whole.to_str() else { return };
        self.recent.retain(|other| other != name);
        self.recent.insert(0, name.to_owned());
        self.recent.truncate(RECENT);
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

    #[test]
    fn preferences_are_read_as_they_were_written() {
        let (usual, units) = (Preferences::default(), Units::Feet);
        let preferences =
            Preferences { sensitivity: 2.5, inverted: true, speed: 0.5, text: 1.5, units, stick: 3.0, ..usual };
        let settings = Settings { preferences, fov_y_degrees: 90.0, detail: Some(Detail::Plain), ..Settings::default() };
        assert_eq!(Settings::read(&serde_json::to_string(&settings).unwrap()), settings);
        // As it was before there were any.
        let settings = Settings::read(r#"{"mode": "pvs", "flies": true}"#);
        assert_eq!((settings.preferences, settings.fov_y_degrees), (Preferences::default(), 65.0));
        assert_eq!((settings.mode.as_str(), settings.flies), ("pvs", true));
    }

    #[test]
    fn bad_numbers_are_the_usual_ones_and_others_are_clamped() {
        let text = r#"{"mode": "pvs", "sensitivity": null, "speed": "fast", "text": [1], "inverted": 7, "size": [-1, 2],
            "fov_y_degrees": {}, "plan": "yes", "units": "cubits", "detail": "plain"}"#;
        let usual = Settings::default();
        assert_eq!(Settings::read(text), Settings { mode: "pvs".into(), detail: Some(Detail::Plain), ..usual.clone() });
        let text = r#"{"sensitivity": 1e300, "speed": -4, "text": 0, "fov_y_degrees": 179.9, "size": [1, 100000]}"#;
        let preferences = Preferences { sensitivity: 10.0, speed: 0.1, text: 0.5, ..Preferences::default() };
        assert_eq!(Settings::read(text), Settings { preferences, fov_y_degrees: 110.0, size: [160, 8192], ..usual.clone() });
        assert_eq!([Settings::read("7"), Settings::read("{"), Settings::read("")], [(); 3].map(|()| usual.clone()));
    }

    #[test]
    fn the_latest_files_are_kept_once_each_and_bad_names_are_none() {
        let mut settings = Settings::default();
        (0..20).for_each(|i| settings.opened(Path::new(&format!("/houses/{i}.glb"))));
        settings.opened(Path::new("/houses/12.glb"));
        assert_eq!(settings.recent.len(), 12);
        assert_eq!(settings.recent[..3], ["/houses/12.glb", "/houses/19.glb", "/houses/18.glb"]);
        settings.opened(Path::new("here.glb"));
        assert!(Path::new(&settings.recent[0]).is_absolute());
        assert_eq!(Settings::read(&serde_json::to_string(&settings).unwrap()), settings);
        let settings =
            Settings::read(r#"{"mode": "pvs", "recent": [7, "", "/a.glb", null], "keys": {"Fly": "F19", "Jump": 1}}"#);
        assert_eq!((settings.mode.as_str(), &settings.recent[..]), ("pvs", &["/a.glb".to_owned()][..]));
        assert!(!settings.keys.is_usual() && settings.keys.ignored().is_some());
        assert_eq!(Settings::read(r#"{"recent": 7, "keys": 7, "mode": "pvs"}"#).mode, "pvs");
    }

    #[test]
    fn the_wheel_ends_at_the_slowest_the_fastest_and_both_angles() {
        assert!(faster(1.0, 1.0) > 1.0 && faster(1.0, -1.0) < 1.0 && closer(65.0, 1.0) < 65.0 && closer(65.0, -1.0) > 65.0);
        assert!((faster(faster(1.0, 3.0), -3.0) - 1.0).abs() < 1e-12);
        for notches in [100.0, 1e9, f64::INFINITY] {
            assert_eq!((faster(1.0, notches), faster(1.0, -notches)), (10.0, 0.1));
            assert_eq!((closer(65.0, notches), closer(65.0, -notches)), (20.0, 110.0));
        }
        assert_eq!((faster(1.0, f64::NAN), closer(65.0, f64::NAN)), (1.0, 65.0));
    }
}
