//! A section: a plane beyond which nothing is drawn, level or upright.

use super::Session;
use crate::draw::slice::Section;
use crate::mode::ViewMode;
use enfilade::runtime::Mode;
use glam::DVec3;

/// A level section is so far above the eye at first, metres: below the heads of doors for a standing person.
const ABOVE: f64 = 0.3;
/// An upright one is so far ahead, metres.
const AHEAD: f64 = 1.0;
/// A notch of the wheel moves it so far, metres.
const NOTCH: f64 = 0.1;
/// A view direction closer to an axis than this, as the cosine between them (20 degrees), is taken for the axis: walls lie along axes.
const ALONG: f64 = 0.94;

/// A section and where it was last.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Whether it cuts.
    pub is_on: bool,
    /// Upright, facing the person who set it; or level, open from above.
    pub is_upright: bool,
    /// Where it is.
    pub plane: Section,
}

impl Default for Cut {
    fn default() -> Self {
        Self { is_on: false, is_upright: false, plane: Section { n: DVec3::NEG_Y, d: 0.0 } }
    }
}

impl Cut {
    /// Where it is along its axis, metres relative to the origin.
    pub fn offset(&self) -> f64 {
        if self.is_upright { self.plane.d } else { -self.plane.d }
    }

    pub(super) fn move_to(&mut self, offset: f64) {
        self.plane.d = if self.is_upright { offset } else { -offset };
    }
}

impl Session<'_> {
    /// The section.
    pub fn section(&self) -> Option<Section> {
        self.section.is_on.then_some(self.section.plane)
    }

    /// Begins a section, or ends it.
    pub(super) fn toggle_section(&mut self) {
        match self.section.is_on {
            true => self.section.is_on = false,
            false => self.set_section(self.section.is_upright),
        }
    }

    /// A level section instead of an upright one, or the reverse.
    pub(super) fn turn_section(&mut self) {
        self.set_section(self.section.is_on && !self.section.is_upright);
    }

    /// Sets a section: level, a little above the eye; or upright before it. From above the building it cuts the highest storey.
    pub fn set_section(&mut self, is_upright: bool) {
        let eye = self.motion.walker.eye;
        let plane = if is_upright {
            let look = self.motion.walker.forward().with_y(0.0).normalize_or(DVec3::NEG_Z);
            let axis = if look.x.abs() > look.z.abs() { DVec3::X * look.x.signum() } else { DVec3::Z * look.z.signum() };
            let n = if look.dot(axis) > ALONG { axis } else { look };
            Section { n, d: n.dot(eye) + AHEAD }
        } else {
            let above = eye.y + ABOVE;
            let is_within = above < self.document.building.scene.bounds().max.y;
            let storey = &self.panels.plan.storeys[self.panels.plan.here(eye.y)];
            Section { n: DVec3::NEG_Y, d: -if is_within { above } else { storey.floor + storey.cut } }
        };
        self.section = Cut { is_on: true, is_upright, plane };
    }

    /// Moves a section by notches of the wheel, up or away; false where there is none.
    pub fn move_section(&mut self, notches: f64) -> bool {
        if self.section.is_on {
            self.section.move_to(self.section.offset() + NOTCH * notches);
        }
        self.section.is_on
    }

    /// The mode of culling. With a section, any cell may be seen through the cut: only the frustum culls.
    pub(super) fn mode(&self) -> ViewMode {
        match (self.section.is_on, self.view.mode) {
            (true, ViewMode::Culled(Mode::None)) | (false, _) => self.view.mode,
            (true, _) => Mode::Frustum.into(),
        }
    }
}
