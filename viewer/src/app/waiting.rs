//! A window without a building: the start screen, and how far opening is. And the dialog for another file, which comes at any time.

use super::App;
use crate::dialog::{Dialog, kinds};
use crate::ui::hud;
use crate::ui::welcome::{Chosen, Welcome};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use winit::event_loop::{ActiveEventLoop, ControlFlow};

/// From one picture to the next while something is opened.
pub(super) const WAITING: Duration = Duration::from_millis(50);

impl App<'_> {
    /// Draws the start screen, or how far a building is.
    pub(super) fn wait(&mut self, event_loop: &ActiveEventLoop, texture: wgpu::SurfaceTexture) -> Result<(), String> {
        let (Some(window), Some(screen)) = (self.window.clone(), &mut self.screen) else { return Ok(()) };
        if self.winit.is_none() {
            self.winit = Some(super::listen(screen.context(), &window, None));
        }
        let input = self.winit.as_mut().map(|winit| winit.take_egui_input(&window)).unwrap_or_default();
        let view = texture.texture.create_view(&Default::default());
        let (share, mut chosen) = (self.opening.share(), None);
        let opened = self.args.file.as_ref().filter(|_| self.failure.is_none());
        let (welcome, kinds) = (&self.welcome, kinds().collect::<Vec<_>>());
        screen.context().set_zoom_factor(self.settings.preferences.text as f32);
        let output = screen.say(&view, input, |ui| match opened {
            Some(file) => hud::progress(ui, &file.display().to_string(), share.as_ref()),
            None => chosen = chosen.take().or(welcome.show(ui, &kinds)),
        })?;
        if let Some(winit) = &mut self.winit {
            winit.handle_platform_output(&window, output);
        }
        screen.present(texture, None);
        match chosen {
            Some(Chosen::File(file)) => self.go_to_file(event_loop, file),
            Some(Chosen::Dialog) => self.ask_for_file(),
            None => {}
        }
        event_loop.set_control_flow(ControlFlow::WaitUntil(Instant::now() + WAITING));
        Ok(())
    }

    /// The start screen, with a line that says why.
    pub(super) fn welcome_with(&mut self, line: String) {
        self.welcome = Welcome { line: Some(line), ..Welcome::new(&self.settings.recent) };
    }

    /// Opens the dialog for another file, if it isn't open.
    pub(super) fn ask_for_file(&mut self) {
        self.dialog.get_or_insert_with(Dialog::open);
    }

    /// Hears what came of the dialog.
    pub(super) fn hear_dialog(&mut self, event_loop: &ActiveEventLoop) {
        let Some(answer) = self.dialog.as_ref().and_then(Dialog::answer) else { return };
        self.dialog = None;
        match (answer, &mut self.session) {
            (Ok(Some(file)), _) => self.go_to_file(event_loop, file),
            (Ok(None), _) => {}
            (Err(line), Some(session)) => session.tell(line),
            (Err(line), None) => self.welcome_with(line),
        }
    }

    /// Another file is opened next. A recorded path that can't be saved is told, and not lost for it.
    pub(super) fn go_to_file(&mut self, event_loop: &ActiveEventLoop, file: PathBuf) {
        if self.session.as_mut().is_none_or(|session| session.save_recording()) {
            self.dropped = Some(file);
            event_loop.exit();
        }
    }
}
