//! Keys and the mouse.

use super::{App, full_screen};
use crate::commands::Action;
use glam::DVec2;
use winit::event::{ElementState, KeyEvent, MouseScrollDelta};
use winit::event_loop::ActiveEventLoop;
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::CursorGrabMode;

/// Pixels of a notch of the wheel, for touchpads, which tell pixels.
const NOTCH: f64 = 50.0;
/// A button that goes up within this many pixels of where it went down has clicked.
const CLICK: f64 = 4.0;
impl App<'_> {
    pub(super) fn grab(&mut self, grab: bool) {
        let Some(window) = &self.window else { return };
        let locked = |mode| window.set_cursor_grab(mode).is_ok();
        if grab {
            self.grabbed = locked(CursorGrabMode::Locked) || locked(CursorGrabMode::Confined);
        } else {
            self.grabbed = false;
            locked(CursorGrabMode::None);
        }
        window.set_cursor_visible(!self.grabbed);
    }

    fn key(&mut self, event_loop: &ActiveEventLoop, code: KeyCode) {
        match code {
            KeyCode::Escape => match &mut self.session {
                Some(session) => {
                    if session.escape(self.grabbed) {
                        self.grab(false);
                    }
                }
                None => event_loop.exit(),
            },
            KeyCode::Tab => self.grab(!self.grabbed),
            code => {
                let is_held = |keys: [KeyCode; 2]| keys.iter().any(|key| self.held.contains(key));
                let ctrl = is_held([KeyCode::ControlLeft, KeyCode::ControlRight]);
                let action = self.keys().action(code, [ctrl, is_held([KeyCode::ShiftLeft, KeyCode::ShiftRight])]);
                match (&mut self.session, &self.window, action) {
                    (Some(session), _, Some(action)) => session.act(action),
                    (None, Some(window), Some(Action::FullScreen)) => full_screen(window),
                    (None, _, Some(Action::Open)) => self.ask_for_file(),
                    _ => {}
                }
            }
        }
    }

    /// Whether a field of the interface takes the keys.
    fn is_typed(&self) -> bool {
        self.session.as_ref().is_some_and(|session| session.interface.context.text_edit_focused())
    }

    pub(super) fn button(&mut self, is_down: bool) {
        if is_down {
            (self.pressed, self.drags) = (Some(self.pointer), false);
            return;
        }
        let (Some(_), Some(session), Some(window)) = (self.pressed.take(), &mut self.session, &self.window) else { return };
        if !self.drags {
            let size = window.inner_size();
            let at = self.pointer / DVec2::new(f64::from(size.width.max(1)), f64::from(size.height.max(1)));
            let at = DVec2::new(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y);
            session.click(if self.grabbed { DVec2::ZERO } else { at });
        }
    }

    pub(super) fn moved(&mut self, to: DVec2) {
        if let (Some(from), Some(session)) = (self.pressed, &mut self.session) {
            self.drags |= from.distance(to) > CLICK;
            if self.drags && !self.grabbed {
                session.look(to - self.pointer);
            }
        }
        self.pointer = to;
    }

    /// A key goes down or up; `taken`: panels have it already.
    pub(super) fn keyboard(&mut self, event_loop: &ActiveEventLoop, event: &KeyEvent, taken: bool) {
        let PhysicalKey::Code(code) = event.physical_key else { return };
        match event.state {
            ElementState::Released => drop(self.held.remove(&code)),
            ElementState::Pressed if event.repeat => {}
            ElementState::Pressed if self.session.as_mut().is_some_and(|session| session.takes_key(code)) => {}
            // A key that a field or a panel takes does nothing else.
            ElementState::Pressed if code != KeyCode::Escape && (taken || self.is_typed()) => {}
            ElementState::Pressed => {
                self.held.insert(code);
                self.key(event_loop, code);
                self.step();
            }
        }
    }

    pub(super) fn wheel(&mut self, delta: MouseScrollDelta) {
        let [across, notches] = match delta {
            MouseScrollDelta::LineDelta(across, lines) => [across, lines].map(f64::from),
            MouseScrollDelta::PixelDelta(pixels) => [pixels.x, pixels.y].map(|pixels| pixels / NOTCH),
        };
        let is_held = |keys: [KeyCode; 2]| keys.iter().any(|key| self.held.contains(key));
        let zooms = is_held([KeyCode::ControlLeft, KeyCode::ControlRight]);
        let shifts = is_held([KeyCode::ShiftLeft, KeyCode::ShiftRight]);
        if let Some(session) = &mut self.session
            // With Shift held, some systems turn it sideways.
            && !(shifts && session.move_section(notches + across))
        {
            session.wheel(notches, zooms);
        }
    }
}
