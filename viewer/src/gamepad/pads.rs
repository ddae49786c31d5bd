//! Gamepads that are plugged in, with the feature `gamepad`; without it there is none.

use super::{Button, Held};

/// All of them.
pub struct Pads {
    #[cfg(feature = "gamepad")]
    gilrs: Option<gilrs::Gilrs>,
}

#[cfg(not(feature = "gamepad"))]
impl Pads {
    /// None.
    pub fn open() -> Self {
        Self {}
    }

    /// Nothing.
    pub fn read(&mut self) -> (Held, Vec<Button>) {
        (Held::default(), Vec::new())
    }
}

#[cfg(feature = "gamepad")]
impl Pads {
    /// Opens them; where the system has none to offer, there is a line in the terminal.
    pub fn open() -> Self {
        // The dead zone is that of the settings.
        let gilrs = gilrs::GilrsBuilder::new().with_default_filters(false).build();
        Self { gilrs: gilrs.inspect_err(|e| eprintln!("enfilade-viewer: no gamepads: {e}")).ok() }
    }

    /// How the first one is held, and which buttons of any went down since the last time.
    pub fn read(&mut self) -> (Held, Vec<Button>) {
        use gilrs::ev::filter::{Filter, axis_dpad_to_button};
        use gilrs::{Axis, EventType};
        let Some(gilrs) = &mut self.gilrs else { return (Held::default(), Vec::new()) };
        let mut pressed = Vec::new();
        while let Some(event) = gilrs.next_event().filter_ev(&axis_dpad_to_button, gilrs) {
            gilrs.update(&event);
            if let EventType::ButtonPressed(of, _) = event.event {
                pressed.extend(button(of));
            }
        }
        let held = gilrs.gamepads().next().map(|(_, pad)| {
            let stick = |x, y| glam::DVec2::new(pad.value(x).into(), pad.value(y).into());
            let trigger = |of| pad.button_data(of).map_or(0.0, |data| data.value().into());
            Held {
                left: stick(Axis::LeftStickX, Axis::LeftStickY),
                right: stick(Axis::RightStickX, Axis::RightStickY),
                triggers: [gilrs::Button::LeftTrigger2, gilrs::Button::RightTrigger2].map(trigger),
                shoulder: [gilrs::Button::LeftTrigger, gilrs::Button::RightTrigger].into_iter().any(|b| pad.is_pressed(b)),
            }
        });
        (held.unwrap_or_default(), pressed)
    }
}

/// A button by what it is called here; `None` for one that does nothing.
#[cfg(feature = "gamepad")]
fn button(of: gilrs::Button) -> Option<Button> {
    Some(match of {
        gilrs::Button::South => Button::South,
        gilrs::Button::East => Button::East,
        gilrs::Button::West => Button::West,
        gilrs::Button::North => Button::North,
        gilrs::Button::DPadLeft => Button::PadLeft,
        gilrs::Button::DPadRight => Button::PadRight,
        gilrs::Button::DPadUp => Button::PadUp,
        gilrs::Button::DPadDown => Button::PadDown,
        gilrs::Button::Start => Button::Start,
        gilrs::Button::Select => Button::Select,
        _ => return None,
    })
}
