//! Buttons for everything that a key does, made from the table of keys.

use super::keys::{Action, KEYS};
use crate::keymap::KeyMap;

/// The widest that the buttons are, points: about a third of the table in a row.
const WIDEST: f32 = 620.0;
/// Room between the buttons and the window's sides, points.
const MARGIN: f32 = 16.0;

/// Shows the button that opens the buttons. Returns what was clicked.
pub fn closed(ui: &mut egui::Ui, keys: &KeyMap) -> Option<Action> {
    let mut clicked = None;
    let area = egui::Area::new(egui::Id::unique("menu")).anchor(egui::Align2::CENTER_TOP, [0.0, 8.0]);
    area.show(ui.ctx(), |ui| {
        if let Some((_, _, action, label, words)) = KEYS.iter().find(|key| key.2 == Action::Menu) {
            clicked =
                ui.button(*label).on_hover_text(format!("{}: {words}", keys.name_of(*action))).clicked().then_some(*action);
        }
    });
    clicked
}

/// Shows all buttons; those that `is_on` are pressed in. Returns what was clicked.
pub fn open(ui: &mut egui::Ui, keys: &KeyMap, is_on: &dyn Fn(Action) -> bool) -> Option<Action> {
    let mut clicked = None;
    let width = (ui.ctx().content_rect().width() - 2.0 * MARGIN).min(WIDEST);
    let area = egui::Area::new(egui::Id::unique("buttons")).anchor(egui::Align2::CENTER_TOP, [0.0, 8.0]);
    area.show(ui.ctx(), |ui| {
        egui::Frame::window(ui.style()).show(ui, |ui| {
            ui.set_width(width);
            ui.horizontal_wrapped(|ui| {
                for (_, _, action, label, words) in KEYS {
                    let button = ui.add(egui::Button::selectable(is_on(action), label));
                    if button.on_hover_text(format!("{}: {words}", keys.name_of(action))).clicked() {
                        clicked = Some(action);
                    }
                }
            });
        });
    });
    clicked
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape};

    const SCREEN: Rect = Rect { min: Pos2::ZERO, max: Pos2::new(640.0, 360.0) };

    /// Where a text is on the screen.
    fn middle_of(shapes: &[egui::epaint::ClippedShape], label: &str) -> Option<Pos2> {
        shapes.iter().find_map(|clipped| match &clipped.shape {
            Shape::Text(text) if text.galley.text() == label => Some(text.visual_bounding_rect().center()),
            _ => None,
        })
    }

    #[test]
    fn every_action_has_a_button_that_does_it() {
        let context = egui::Context::default();
        let frame = |events: Vec<Event>| {
            let mut clicked = None;
            let input = RawInput { screen_rect: Some(SCREEN), events, ..Default::default() };
            let output = context.run_ui(input, |ui| clicked = clicked.or(open(ui, &KeyMap::default(), &|_| false)));
            (output.shapes, clicked)
        };
        // Areas take a frame for their size.
        (0..3).for_each(|_| drop(frame(Vec::new())));
        for (_, _, action, label, _) in KEYS {
            let (shapes, _) = frame(Vec::new());
            let pos = middle_of(&shapes, label).unwrap_or_else(|| panic!("no button {label:?}"));
            assert!(SCREEN.contains(pos), "{label}: {pos}");
            let press =
                |pressed| Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE };
            frame(vec![Event::PointerMoved(pos)]);
            let down = frame(vec![press(true)]).1;
            assert_eq!(down.or(frame(vec![press(false)]).1), Some(action), "{label}");
        }
    }

    #[test]
    fn the_menu_opens_by_a_button() {
        let context = egui::Context::default();
        let input = || RawInput { screen_rect: Some(SCREEN), ..Default::default() };
        let show = |ui: &mut egui::Ui| assert_eq!(closed(ui, &KeyMap::default()), None);
        drop(context.run_ui(input(), show));
        assert!(middle_of(&context.run_ui(input(), show).shapes, "Menu").is_some());
    }
}
