//! A gamepad: what its sticks and buttons mean. [`pads`] reads it.

pub mod pads;

use crate::args::Shown;
use crate::commands::Action;
use crate::culling::MODES;
use crate::settings::Preferences;
use crate::walker::MoveInput;
use glam::{DVec2, DVec3};

/// Radians a second that a stick at its edge turns by.
const TURN: f64 = 2.4;

/// How a gamepad is held: sticks from -1 to 1, to the right and up; triggers from 0 to 1.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Held {
    /// The left stick.
    pub left: DVec2,
    /// The right stick.
    pub right: DVec2,
    /// The left and the right trigger.
    pub triggers: [f64; 2],
    /// One of the shoulders.
    pub shoulder: bool,
}

/// A button that goes down.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[expect(missing_docs, reason = "where they lie")]
pub enum Button {
    South,
    East,
    West,
    North,
    PadLeft,
    PadRight,
    PadUp,
    PadDown,
    Start,
    Select,
}

/// Action of a button.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Does {
    Act(Action),
    /// The next mode (1) or the one before (-1).
    Mode(isize),
}

/// Actions of the buttons.
const BUTTONS: [(Button, Does); 10] = [
    (Button::South, Does::Act(Action::Door)),
    (Button::East, Does::Act(Action::Fly)),
    (Button::West, Does::Act(Action::Pick)),
    (Button::North, Does::Act(Action::Freeze)),
    (Button::PadLeft, Does::Mode(-1)),
    (Button::PadRight, Does::Mode(1)),
    (Button::PadUp, Does::Act(Action::Storey(true))),
    (Button::PadDown, Does::Act(Action::Storey(false))),
    (Button::Start, Does::Act(Action::Menu)),
    (Button::Select, Does::Act(Action::Layer(Shown::Plan))),
];

/// Help; buttons by their position.
pub const HELP: [(&str, &str); 5] = [
    ("Left stick, right stick", "walk; look"),
    ("Triggers, shoulders", "down and up, flying; faster"),
    ("South, East, West, North", "door; walk or fly; pick; freeze"),
    ("D-pad", "left and right: how to cull; up and down: storeys"),
    ("Start, Select", "buttons; plan"),
];

/// The action of a button, while frames are culled by the mode with this number in [`MODES`].
pub fn action(button: Button, mode: usize) -> Option<Action> {
    let (_, does) = BUTTONS.iter().find(|(of, _)| *of == button)?;
    Some(match *does {
        Does::Act(action) => action,
        Does::Mode(by) => Action::Mode((mode + MODES.len()).saturating_add_signed(by) % MODES.len()),
    })
}

/// Movement: the left stick walks, triggers go down and up, a shoulder hurries.
pub fn wants(held: &Held, preferences: &Preferences) -> MoveInput {
    let left = beyond_rest(held.left, preferences.dead_zone);
    let [down, up] = held.triggers.map(|trigger| beyond_rest(DVec2::new(trigger, 0.0), preferences.dead_zone).x.max(0.0));
    MoveInput { to: DVec3::new(left.x, up - down, left.y), hurry: held.shoulder }
}

/// Turning, radians a second, to the right and up: by the right stick, finer near its middle.
pub fn turn(held: &Held, preferences: &Preferences) -> DVec2 {
    let right = beyond_rest(held.right, preferences.dead_zone);
    let by = right * right.length() * TURN * preferences.stick;
    if preferences.inverted { DVec2::new(by.x, -by.y) } else { by }
}

/// A stick's way beyond its dead zone, 0 to 1 long; nothing for what is no number.
fn beyond_rest(stick: DVec2, dead_zone: f64) -> DVec2 {
    let far = stick.length();
    if !far.is_finite() || far <= dead_zone {
        return DVec2::ZERO;
    }
    stick / far * ((far - dead_zone) / (1.0 - dead_zone)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(dead_zone: f64, stick: f64, inverted: bool) -> Preferences {
        Preferences { dead_zone, stick, inverted, ..Preferences::default() }
    }

    #[test]
    fn sticks_rest_in_the_dead_zone_and_go_to_one_at_the_edge() {
        let walk = |x, y| wants(&Held { left: DVec2::new(x, y), ..Held::default() }, &with(0.2, 1.0, false)).to;
        assert_eq!([walk(0.0, 0.0), walk(0.2, 0.0), walk(-0.1, 0.15)], [DVec3::ZERO; 3]);
        assert!(walk(0.0, 1.0).distance(DVec3::Z) < 1e-12 && walk(-1.0, 0.0).distance(-DVec3::X) < 1e-12);
        // Half of the way beyond the dead zone.
        assert!(walk(0.6, 0.0).distance(DVec3::X * 0.5) < 1e-12);
        // A stick's corner goes no faster than its side, and what is no number goes nowhere.
        assert!((walk(1.0, 1.0).length() - 1.0).abs() < 1e-12);
        assert_eq!([walk(f64::NAN, 0.0), walk(f64::INFINITY, 0.0)], [DVec3::ZERO; 2]);
    }

    #[test]
    fn triggers_go_down_and_up_and_a_shoulder_hurries() {
        let of = |triggers, shoulder| wants(&Held { triggers, shoulder, ..Held::default() }, &with(0.0, 1.0, false));
        assert_eq!(of([0.0, 1.0], false), MoveInput { to: DVec3::Y, hurry: false });
        assert_eq!(of([0.5, 0.0], true), MoveInput { to: -DVec3::Y * 0.5, hurry: true });
        assert_eq!(of([1.0, 1.0], false).to, DVec3::ZERO);
        // Some triggers rest at -1.
        assert_eq!(of([-1.0, 0.0], false).to, DVec3::ZERO);
    }

    #[test]
    fn the_right_stick_turns_by_the_settings() {
        let look = |x, y, preferences| turn(&Held { right: DVec2::new(x, y), ..Held::default() }, &preferences);
        let usual = look(1.0, 0.0, with(0.1, 1.0, false));
        assert!(usual.x > 1.0 && usual.y == 0.0);
        assert!((look(1.0, 0.0, with(0.1, 3.0, false)).x - 3.0 * usual.x).abs() < 1e-9);
        assert!(look(0.0, 1.0, with(0.1, 1.0, false)).y > 1.0 && look(0.0, 1.0, with(0.1, 1.0, true)).y < -1.0);
        assert_eq!(look(0.05, 0.05, with(0.1, 1.0, false)), DVec2::ZERO);
        // Half of the way turns a quarter as fast.
        assert!((look(0.5, 0.0, with(0.0, 1.0, false)).x * 4.0 - look(1.0, 0.0, with(0.0, 1.0, false)).x).abs() < 1e-9);
    }

    #[test]
    fn buttons_do_what_keys_do_and_modes_go_round() {
        let last = MODES.len() - 1;
        assert_eq!(action(Button::South, 0), Some(Action::Door));
        assert_eq!(action(Button::West, 3), Some(Action::Pick));
        assert_eq!(action(Button::North, 3), Some(Action::Freeze));
        assert_eq!(action(Button::Select, 3), Some(Action::Layer(Shown::Plan)));
        assert_eq!(action(Button::PadRight, 2), Some(Action::Mode(3)));
        assert_eq!(action(Button::PadRight, last), Some(Action::Mode(0)));
        assert_eq!(action(Button::PadLeft, 0), Some(Action::Mode(last)));
        let keys = crate::keymap::KeyMap::default();
        for (button, _) in BUTTONS {
            let action = action(button, 0).unwrap();
            assert!(!keys.name_of(action).is_empty(), "{button:?}: {action:?} is in no table");
        }
    }
}
