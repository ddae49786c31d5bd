//! Tubes, shown: a panel with what they cost and how fine they are, sides as colours, lines at sections.

use super::Session;
use crate::draw::tubes::{Pipes, THIN};
use crate::settings::{OfTubes, Range, Settings, TUBE_PIXELS};
use crate::ui::graphs::number;

/// How much wider than they are thin tubes may be drawn: 1 is not at all, and no pipe is so far away that it takes more than the most.
const WIDER: Range = Range { least: 1.0, usual: 1e3, most: 1e3, is_factor: true };
/// Where the panel is, points from the middle of the left side.
const PANEL: [f32; 2] = [8.0, 90.0];
/// Bytes of a megabyte.
const MEGA: f64 = 1e6;

impl Session<'_> {
    /// Shows sides of tubes, or no longer.
    pub(super) fn toggle_tubes(&mut self) {
        match &mut self.stage.pipes {
            Some(pipes) => pipes.look.shows_sides ^= true,
            None => self.tell(
                "no tubes: they come with pipes of IFC, and with lines of GeoJSON, OBJ or glTF that have a radius"
                    .to_owned(),
            ),
        }
    }

    /// Draws tubes as they were drawn last.
    pub(super) fn apply_tubes(&mut self, kept: OfTubes) {
        self.stage.pipes.iter_mut().for_each(|pipes| pipes.set(Some(kept.tube_pixels), kept.thin_tubes));
    }

    /// How tubes are drawn, to be kept; where there are none, as it was.
    pub(super) fn kept_tubes(&self, settings: &Settings) -> OfTubes {
        self.stage.pipes.as_ref().map_or(settings.tubes, |pipes| {
            let look = pipes.look;
            OfTubes { tube_pixels: look.limit, thin_tubes: (look.thin != pipes.usual).then_some(look.thin) }
        })
    }

    /// Whether sides are shown.
    pub(super) fn shows_sides(&self) -> bool {
        self.stage.pipes.as_ref().is_some_and(|pipes| pipes.look.shows_sides)
    }

    /// Tubes, in a line of the counters.
    pub(super) fn say_tubes(&self) -> Option<String> {
        self.stage.pipes.as_ref().map(drawn)
    }
}

/// What the frame draws of them.
fn drawn(pipes: &Pipes) -> String {
    let chosen = pipes.drawn.chosen();
    let [segments, triangles] = [chosen.segments, chosen.triangles].map(|n| number(n as f64));
    format!("tubes: {segments} segments, {triangles} triangles")
}

/// The panel. `sections`: how many there are.
pub(super) fn show(ui: &mut egui::Ui, pipes: &mut Pipes, sections: usize) {
    let window = egui::Window::new("Tubes").id(egui::Id::unique("tubes")).anchor(egui::Align2::LEFT_CENTER, PANEL);
    window.collapsible(false).auto_sized().show(ui.ctx(), |ui| {
        let slider = |ui: &mut egui::Ui, value: &mut f64, range: &Range, text: &str| {
            ui.add(egui::Slider::new(value, range.least..=range.most).logarithmic(true).max_decimals(2).text(text));
        };
        slider(ui, &mut pipes.look.limit, &TUBE_PIXELS, "pixels off at most");
        ui.label("Thinner than a pixel:");
        ui.horizontal(|ui| THIN.map(|(thin, name)| ui.selectable_value(&mut pipes.look.thin, thin, name)));
        slider(ui, &mut pipes.look.most, &WIDER, "times wider at most");
        ui.label(drawn(pipes));
        let over = pipes.drawn.chosen().over;
        if over > 0 {
            ui.label(format!("{over} chords are farther off: they can be no finer"));
        }
        let [bytes, of_mesh] = [pipes.bytes, pipes.bytes_of_mesh].map(|bytes| bytes as f64 / MEGA);
        ui.label(format!("{} sections, {bytes:.2} MB; as a mesh {of_mesh:.2} MB", number(sections as f64)));
        ui.small("Blue to red: 4, 8, 16, 32, and 64 sides or more. Lines: rings that are drawn.");
    });
}
