//! What commands do.

use super::Session;
use crate::args::Shown;
use crate::colours::Tints;
use crate::commands::{Action, Command, entry_of};
use crate::culling::MODES;
use crate::keymap::KeyMap;
use glam::DVec2;
use winit::keyboard::KeyCode;

/// Whether a panel is open.
type IsOpen = fn(&Session<'_>) -> bool;

/// Panels that Escape closes, the first that is open first: whether it is open, and the command that closes it.
const CLOSABLE: [(IsOpen, Command); 7] = [
    (|s| s.view.question, Command::Stay),
    (|s| s.view.keys, Command::Act(Action::Layer(Shown::Keys))),
    (|s| s.panels.find.is_open, Command::Act(Action::Find)),
    (|s| s.view.preferences, Command::Act(Action::Preferences)),
    (|s| s.insight.shows_profile, Command::Act(Action::Profile)),
    (|s| s.selection.why.is_some(), Command::CloseWhy),
    (|s| s.measure.is_on, Command::Act(Action::Measure)),
];

impl Session<'_> {
    /// Does what a command says.
    pub fn execute(&mut self, command: Command) {
        match command {
            Command::Act(action) => self.act(action),
            Command::GoToPlan(storey, at) => self.go_to_plan(storey, at),
            Command::SavePlan(storey) => self.save_plan(storey),
            Command::GoTo(target) => self.go_to_found(target),
            Command::Why(pair) => self.ask_pair(pair),
            Command::CloseWhy => {
                self.selection.close_why();
                self.motion.flight = None;
            }
            Command::FlyAlongSight => self.fly_along_sight(),
            Command::SetSection(is_upright) => self.set_section(is_upright),
            Command::MoveSection(offset) => self.section.move_to(offset),
            Command::ProfileAgain => self.start_profile(),
            Command::ProfileFrame(frame) => self.go_to_frame(frame),
            Command::SaveProfile => self.save_profile(),
            Command::SaveAndQuit => {
                self.view.question = false;
                self.window.quit = self.save_recording();
            }
            Command::Quit => (self.view.question, self.window.quit) = (false, true),
            Command::Stay => self.view.question = false,
            Command::SetPreferences(preferences) => self.user.preferences = preferences,
            Command::SetFieldOfView(fov_y) => self.view.fov_y = fov_y,
            Command::SetDetail(detail) => self.view.detail = detail,
            Command::WaitForKey(bound) => self.panels.rebind.wait_for(bound),
            Command::UsualKeys => {
                self.user.keys = KeyMap::default();
                self.panels.rebind.stop();
            }
            Command::SetGroundLimit(limit) => self.renderer.terrain.iter_mut().for_each(|t| t.land.limit = limit),
            Command::SetTubeLook(look) => self.renderer.tubes.iter_mut().for_each(|tubes| tubes.look = look),
        }
    }

    /// Does what a key does.
    pub fn act(&mut self, action: Action) {
        let view = &mut self.view;
        match action {
            Action::Mode(mode) => {
                view.mode = MODES[mode].into();
                self.insight.culls_again = true;
            }
            Action::OtherMode(mode) => self.set_other_mode(MODES[mode].into()),
            Action::Split => self.split_or_join(),
            Action::Culled => view.culled ^= true,
            Action::Waste => self.tint(Tints::Waste),
            Action::Profile => self.profile_or_hide(),
            Action::Heat => self.turn_heat(),
            Action::Freeze => self.freeze_or_go_on(),
            Action::Cells => self.tint(Tints::Cells),
            Action::Detail => view.toggle_detail(),
            Action::Layer(shown) => view.layer(shown).into_iter().for_each(|layer| *layer ^= true),
            Action::Alarm => view.layers.alarm ^= true,
            Action::Hud => view.hud ^= true,
            Action::Fly => self.motion.walker.flies ^= true,
            Action::Door => drop(self.use_door(DVec2::ZERO)),
            Action::Mirror => self.hang_mirror(),
            Action::Pick => self.pick(DVec2::ZERO),
            Action::Menu => view.menu ^= true,
            Action::Preferences => {
                view.preferences ^= true;
                self.panels.rebind.stop();
            }
            Action::Screenshot => self.save_screenshot(),
            Action::Record => self.record_or_stop(),
            Action::Play => self.play_or_stop(),
            Action::FullScreen => self.window.full_screen = true,
            Action::Storey(up) => self.turn_storey(up),
            Action::Find => self.panels.find.toggle(),
            Action::Hide => self.hide(false),
            Action::Isolate => self.hide(true),
            Action::ShowAll => self.show_all(),
            Action::SavePlan => self.save_shown_plan(),
            Action::Section => self.toggle_section(),
            Action::TurnSection => self.turn_section(),
            Action::Measure => self.toggle_measuring(),
            Action::Open => self.window.open = true,
            Action::People => view.people ^= true,
            Action::Ground => self.toggle_ground(),
            Action::Tubes => self.toggle_tubes(),
        }
    }

    /// Whether an action is on.
    pub fn is_on(&self, action: Action) -> bool {
        entry_of(action).is_some_and(|entry| (entry.is_on)(self))
    }

    /// Whether frames are culled by the mode with this number in [`MODES`].
    pub fn has_mode(&self, mode: usize) -> bool {
        self.view.mode == MODES[mode].into()
    }

    /// Shows something that the command line names.
    pub fn show_this(&mut self, shown: Shown) {
        match shown {
            Shown::Cells => self.act(Action::Cells),
            Shown::Mirror => self.hang_mirror(),
            Shown::Waste => self.act(Action::Waste),
            Shown::Split => self.act(Action::Split),
            Shown::Profile => self.insight.shows_profile = true,
            Shown::Heat => self.turn_heat(),
            Shown::Section => self.set_section(false),
            Shown::People => self.view.people = true,
            Shown::Ground => self.toggle_ground(),
            Shown::Tubes => self.toggle_tubes(),
            Shown::Why => self.ask_ahead(),
            layer => self.view.layer(layer).into_iter().for_each(|layer| *layer = true),
        }
    }

    /// A click on a point of the screen (normalised device coordinates): a point to measure, a door, or something to pick.
    pub fn click(&mut self, at: DVec2) {
        if self.measure.is_on {
            self.measure_at(at);
        } else if !self.use_door(at) {
            self.pick(at);
        }
    }

    /// A key went down. Returns whether an action took it as its new key.
    pub fn takes_key(&mut self, code: KeyCode) -> bool {
        self.panels.rebind.take(&mut self.user.keys, code)
    }

    /// Does what Escape does: releases the mouse, closes a panel, or quits. Returns true if the window is to release the mouse.
    pub fn escape(&mut self, grabbed: bool) -> bool {
        if grabbed {
            return true;
        }
        match CLOSABLE.iter().find(|(is_open, _)| is_open(self)) {
            Some((_, close)) => self.execute(*close),
            None => self.close(),
        }
        false
    }

    /// Quits, or asks first if something would be lost.
    pub fn close(&mut self) {
        self.view.question = self.motion.paths.is_unsaved();
        self.window.quit = !self.view.question;
    }
}
