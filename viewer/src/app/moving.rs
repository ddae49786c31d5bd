//! Movement by held keys and by a gamepad.

use super::App;
use crate::commands::Hold;
use crate::culling::MODES;
use crate::gamepad::{action, turn, wants};
use crate::mode::ViewMode;
use crate::walker::MoveInput;
use glam::DVec3;

/// Radians of a second that an arrow key is held.
const ARROW: f64 = 1.6;
/// With `--steps`, time passes only after a key or a button goes down: a number of steps, and the seconds of a step.
const STEPS: (u32, f64) = (5, 0.1);

impl App<'_> {
    /// A key or a button went down: with `--steps`, time passes.
    pub(super) fn step(&mut self) {
        if self.args.steps {
            (0..STEPS.0).for_each(|_| self.walk(STEPS.1));
            self.stepped += f64::from(STEPS.0) * STEPS.1;
        }
    }

    /// Does what buttons of a gamepad say, turns and walks for `seconds`.
    pub(super) fn walk(&mut self, seconds: f64) {
        let (pad, pressed) = self.pads.read();
        let Some(session) = &mut self.session else { return };
        for button in pressed {
            let mode = MODES.iter().position(|mode| ViewMode::from(*mode) == session.view.mode).unwrap_or(0);
            action(button, mode).into_iter().for_each(|action| session.act(action));
        }
        let is = |hold| f64::from(session.user.keys.is_held(hold, |code| self.held.contains(&code)));
        let [right, up] = [is(Hold::TurnRight) - is(Hold::TurnLeft), is(Hold::LookUp) - is(Hold::LookDown)];
        let to =
            DVec3::new(is(Hold::Right) - is(Hold::Left), is(Hold::Up) - is(Hold::Down), is(Hold::Forward) - is(Hold::Back));
        let hurry = session.user.keys.is_held(Hold::Faster, |code| self.held.contains(&code));
        let (by, of_pad) = (turn(&pad, &session.user.preferences), wants(&pad, &session.user.preferences));
        session.motion.walker.turn((ARROW * right + by.x) * seconds, (ARROW * up + by.y) * seconds);
        let to = (to + of_pad.to).clamp(DVec3::NEG_ONE, DVec3::ONE);
        session.go(seconds, &MoveInput { to, hurry: hurry || of_pad.hurry });
    }
}
