//! A section: a plane beyond which nothing is drawn, level or upright.

use super::Session;
use crate::draw::slice::Section;
use crate::mode::ViewMode;
use enfilade::runtime::FrameMode;
use glam::DVec3;

/// A level section is so far above the eye at first, metres: below the heads of doors for who stands.
const ABOVE: f64 = 0.3;
/// An upright one is so far ahead, metres.
const AHEAD: f64 = 1.0;
/// A notch of the wheel moves it so far, metres.
const NOTCH: f64 = 0.1;
/// Where its panel is, points from the middle of the right side: below the plan.
const PANEL: [f32; 2] = [-8.0, 60.0];
/// Who looks nearer to an axis than this, as the cosine between them (20 degrees), means the axis: walls lie along those.
const ALONG: f64 = 0.94;

/// A section and where it was last.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Whether it cuts.
    pub is_on: bool,
    /// Upright, and facing who set it; or level, which shows what is below.
    pub is_upright: bool,
    /// Where it is.
    pub plane: Section,
}

impl Default for Cut {
    fn default() -> Self {
        Self { is_on: false, is_upright: false, plane: Section { n: DVec3::NEG_Y, d: 0.0 } }
    }
}

/// What the panel of a section asks for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Ask {
    /// A level section (false) or an upright one, where it is the usual place.
    Set(bool),
    /// To be so far along its axis, metres relative to the origin: higher, or farther ahead.
    Move(f64),
    /// None.
    End,
}

impl Cut {
    /// Where it is along its axis, metres relative to the origin.
    fn offset(&self) -> f64 {
        if self.is_upright { self.plane.d } else { -self.plane.d }
    }

    fn move_to(&mut self, offset: f64) {
        self.plane.d = if self.is_upright { offset } else { -offset };
    }

    /// Its panel. `origin`: the height of the model's origin, metres.
    pub fn show(&self, ui: &mut egui::Ui, origin: f64) -> Option<Ask> {
        let mut asked = None;
        let window = egui::Window::new("Section").id(egui::Id::unique("section")).anchor(egui::Align2::RIGHT_CENTER, PANEL);
        window.collapsible(false).auto_sized().show(ui.ctx(), |ui| {
            ui.horizontal(|ui| {
                for (is_upright, name) in [(false, "Level"), (true, "Facing")] {
                    if ui.selectable_label(self.is_upright == is_upright, name).clicked() {
                        asked = Some(Ask::Set(is_upright));
                    }
                }
                if ui.button("Off").clicked() {
                    asked = Some(Ask::End);
                }
            });
            let add = if self.is_upright { 0.0 } else { origin };
            let mut offset = self.offset() + add;
            ui.horizontal(|ui| {
                ui.label(if self.is_upright { "At" } else { "Height" });
                let drag = egui::DragValue::new(&mut offset).speed(0.02).fixed_decimals(2).suffix(" m");
                let is_new = ui.add(drag).changed();
                if is_new && offset.is_finite() {
                    asked = Some(Ask::Move(offset - add));
                }
            });
            ui.small("Shift and the wheel move it. Shift+Z turns it.");
        });
        asked
    }
}

impl Session<'_> {
    /// The section.
    pub fn section(&self) -> Option<Section> {
        self.cut.is_on.then_some(self.cut.plane)
    }

    /// Begins a section, or ends it.
    pub(super) fn toggle_section(&mut self) {
        match self.cut.is_on {
            true => self.cut.is_on = false,
            false => self.set_section(self.cut.is_upright),
        }
    }

    /// A level section instead of an upright one, or the reverse.
    pub(super) fn turn_section(&mut self) {
        self.set_section(self.cut.is_on && !self.cut.is_upright);
    }

    /// Sets a section: level, a little above the eye; or upright before it. Who is above the building cuts its highest storey.
    pub fn set_section(&mut self, is_upright: bool) {
        let eye = self.walker.eye;
        let plane = if is_upright {
            let look = self.walker.forward().with_y(0.0).normalize_or(DVec3::NEG_Z);
            let axis = if look.x.abs() > look.z.abs() { DVec3::X * look.x.signum() } else { DVec3::Z * look.z.signum() };
            let n = if look.dot(axis) > ALONG { axis } else { look };
            Section { n, d: n.dot(eye) + AHEAD }
        } else {
            let above = eye.y + ABOVE;
            let is_within = above < self.building.scene.bounds().max.y;
            let storey = &self.plan.storeys[self.plan.here(eye.y)];
            Section { n: DVec3::NEG_Y, d: -if is_within { above } else { storey.floor + storey.cut } }
        };
        self.cut = Cut { is_on: true, is_upright, plane };
    }

    /// Moves a section by notches of the wheel, up or away; false where there is none.
    pub fn move_section(&mut self, notches: f64) -> bool {
        if self.cut.is_on {
            self.cut.move_to(self.cut.offset() + NOTCH * notches);
        }
        self.cut.is_on
    }

    pub(super) fn do_section(&mut self, asked: Ask) {
        match asked {
            Ask::Set(is_upright) => self.set_section(is_upright),
            Ask::Move(offset) => self.cut.move_to(offset),
            Ask::End => self.cut.is_on = false,
        }
    }

    /// How frames are culled: cells know nothing of a section, through which one looks into any of them.
    pub(super) fn mode(&self) -> ViewMode {
        match (self.cut.is_on, self.show.mode) {
            (true, ViewMode::Culled(FrameMode::None)) | (false, _) => self.show.mode,
            (true, _) => FrameMode::Frustum.into(),
        }
    }
}
