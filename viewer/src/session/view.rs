//! View settings: mode, detail, colours, what lies over the picture, which panels are open.

use crate::args::Shown;
use crate::colours::Tints;
use crate::looks::Detail;
use crate::mode::ViewMode;
use crate::settings::{FIELD_OF_VIEW, Layers};
use enfilade::runtime::Mode;

/// View settings.
#[derive(Clone, Debug)]
pub struct ViewSettings {
    /// How frames are culled.
    pub mode: ViewMode,
    /// How the scene is drawn. Colours other than those of roles are always plain.
    pub detail: Detail,
    /// The detail before it was plain.
    looks: Detail,
    /// Colours.
    pub tints: Tints,
    /// Layers over the picture.
    pub layers: Layers,
    /// While the culling is frozen, show what was culled.
    pub culled: bool,
    /// People that walk about.
    pub people: bool,
    /// Counters.
    pub hud: bool,
    /// The list of keys.
    pub keys: bool,
    /// The buttons.
    pub menu: bool,
    /// The settings.
    pub preferences: bool,
    /// The question whether to quit.
    pub question: bool,
    /// A cross in the middle, where keys aim.
    pub crosshair: bool,
    /// Vertical opening angle, radians.
    pub fov_y: f64,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            mode: Mode::Auto.into(),
            detail: Detail::Plain,
            looks: Detail::Full,
            tints: Tints::default(),
            layers: Layers::NONE,
            culled: true,
            people: false,
            hud: true,
            keys: false,
            menu: false,
            preferences: false,
            question: false,
            crosshair: false,
            fov_y: FIELD_OF_VIEW.usual.to_radians(),
        }
    }
}

impl ViewSettings {
    /// Whether something lies over the picture; `None` for what has no switch.
    pub(super) fn layer(&mut self, shown: Shown) -> Option<&mut bool> {
        match shown {
            Shown::Portals => Some(&mut self.layers.portals),
            Shown::Rectangles => Some(&mut self.layers.rectangles),
            Shown::Plan => Some(&mut self.layers.plan),
            Shown::Matrix => Some(&mut self.layers.matrix),
            Shown::Graphs => Some(&mut self.layers.graphs),
            Shown::Names => Some(&mut self.layers.names),
            Shown::Keys => Some(&mut self.keys),
            _ => None,
        }
    }

    /// Plain, or as it looked before it was plain.
    pub(super) fn toggle_detail(&mut self) {
        self.detail = match self.detail {
            Detail::Plain => std::mem::take(&mut self.looks),
            detail => {
                self.looks = detail;
                Detail::Plain
            }
        };
    }
}
