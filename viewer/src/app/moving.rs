//! What is held down, on the keyboard and on a gamepad, as a walk.

use super::App;
use crate::culling::MODES;
use crate::gamepad::{action, turn, wants};
use crate::ui::keys::Hold;
use crate::walker::Wants;
use glam::DVec3;

/// Radians of a second that an arrow key is held.
const ARROW: f64 = 1.6;

impl App<'_> {
    /// Does what buttons of a gamepad say, turns and walks for `seconds`.
    pub(super) fn walk(&mut self, seconds: f64) {
        let (pad, pressed) = self.pads.read();
        let Some(session) = &mut self.session else { return };
        for button in pressed {
            let mode = MODES.iter().position(|mode| *mode == session.show.mode).unwrap_or(0);
            action(button, mode).into_iter().for_each(|action| session.act(action));
        }
        let is = |hold| f64::from(session.keys.is_held(hold, |code| self.held.contains(&code)));
        let [right, up] = [is(Hold::TurnRight) - is(Hold::TurnLeft), is(Hold::LookUp) - is(Hold::LookDown)];
        let to =
            DVec3::new(is(Hold::Right) - is(Hold::Left), is(Hold::Up) - is(Hold::Down), is(Hold::Forward) - is(Hold::Back));
        let hurry = session.keys.is_held(Hold::Faster, |code| self.held.contains(&code));
        let (by, of_pad) = (turn(&pad, &session.preferences), wants(&pad, &session.preferences));
        session.walker.turn((ARROW * right + by.x) * seconds, (ARROW * up + by.y) * seconds);
        let to = (to + of_pad.to).clamp(DVec3::NEG_ONE, DVec3::ONE);
        session.go(seconds, &Wants { to, hurry: hurry || of_pad.hurry });
    }
}
