//! Other keys for actions, while the settings are shown.

use super::Session;
use winit::keyboard::KeyCode;

impl Session<'_> {
    /// Shows the settings, or no longer; no key is waited for.
    pub(super) fn turn_settings(&mut self) {
        self.show.preferences ^= true;
        self.rebind.stop();
    }

    /// A key went down. Returns whether it was taken as another key for an action.
    pub fn takes_key(&mut self, code: KeyCode) -> bool {
        self.rebind.take(&mut self.keys, code)
    }
}
