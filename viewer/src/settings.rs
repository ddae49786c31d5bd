//! What is remembered from one run to the next, as JSON in the folder where the system keeps settings.

use crate::colours::Tints;
use crate::looks::Detail;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

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
