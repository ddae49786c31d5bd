//! The window: opens a building in the background, shows how far that is, then hands what is pressed to a [`Session`].

mod input;
mod moving;
mod waiting;

use crate::args::Args;
use crate::building::{Building, EARLY};
use crate::culling::Oracle;
use crate::dialog::Dialog;
use crate::draw::renderer::Renderer;
use crate::gamepad::pads::Pads;
use crate::ground::{self, Land};
use crate::keymap::KeyMap;
use crate::mode::ViewMode;
use crate::opening::Opening;
use crate::output_files::OutputFiles;
use crate::screen::Screen;
use crate::session::Session;
use crate::settings::{LastPlace, Settings};
use crate::ui::welcome::Welcome;
use crate::walker::Walker;
use enfilade_measure::walkthrough::path::CameraPath;
use glam::{DVec2, DVec3};
use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;
use winit::application::ApplicationHandler;
use winit::event::{DeviceEvent, DeviceId, ElementState, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::KeyCode;
use winit::platform::run_on_demand::EventLoopExtRunOnDemand;
use winit::window::{Fullscreen, Window, WindowId};

/// The steps of opening a building, in words.
const THERE: [&str; EARLY + 1] = ["the model", "cells and portals", "everything"];

/// Opens the window, and returns when it is shut.
///
/// # Errors
///
/// No window can be opened, or what was to be shown failed; that was on the screen, too.
pub fn run(args: &Args) -> Result<(), String> {
    let path = args.path.as_deref().map(|path| CameraPath::load(path).map_err(|e| format!("{}: {e}", path.display())));
    let mut path = path.transpose()?;
    let mut event_loop =
        EventLoop::new().map_err(|e| format!("no window can be opened: {e}; --shot and --bench need none"))?;
    let mut args = args.clone();
    // Errors of the ground come before a window opens.
    let mut land = ground::open(&args)?;
    while let Some(file) = visit(&mut event_loop, &args, path.take(), land.take())? {
        // Arguments that belong to the last file end with it.
        (args.file, args.model, args.path) = (Some(file), None, None);
        (args.ground, args.place) = (None, None);
    }
    Ok(())
}

/// A window until it is shut, or until another file is dropped on it: that one.
fn visit(
    event_loop: &mut EventLoop<()>,
    args: &Args,
    path: Option<CameraPath>,
    land: Option<Land>,
) -> Result<Option<PathBuf>, String> {
    let opening = Opening::default();
    std::thread::scope(|scope| {
        scope.spawn(|| opening.run(args));
        let mut app = App::new(args, path, &opening);
        app.land = land;
        let result = event_loop.run_app_on_demand(&mut app).map_err(|e| e.to_string());
        opening.stop();
        app.keep_settings();
        match (app.dropped, app.failure) {
            (Some(file), _) => Ok(Some(file)),
            (None, Some(line)) => Err(line),
            (None, None) => result.map(|()| None),
        }
    })
}

struct App<'a> {
    args: &'a Args,
    /// Played from its beginning when the building is there.
    path: Option<CameraPath>,
    opening: &'a Opening,
    /// Ground, for the first renderer; it goes from renderer to renderer.
    land: Option<Land>,
    settings: Settings,
    window: Option<Arc<Window>>,
    screen: Option<Screen>,
    session: Option<Session<'a>>,
    winit: Option<egui_winit::State>,
    failure: Option<String>,
    /// A file to show next.
    dropped: Option<PathBuf>,
    /// The start screen.
    welcome: Welcome,
    dialog: Option<Dialog>,
    /// Which of what opening gives is shown; see [`Opening::best`].
    shown: Option<usize>,
    /// Where the last visit ended, and where this one began.
    last_place: Option<LastPlace>,
    begun: Walker,
    held: HashSet<KeyCode>,
    pads: Pads,
    /// Where the pointer is, and where a button went down; pixels.
    pointer: DVec2,
    pressed: Option<DVec2>,
    drags: bool,
    grabbed: bool,
    started: Instant,
    last: Instant,
    /// With `--steps`, seconds that have passed since the last frame.
    stepped: f64,
    drawn: bool,
}

impl<'a> App<'a> {
    fn new(args: &'a Args, path: Option<CameraPath>, opening: &'a Opening) -> Self {
        let (now, settings) = (Instant::now(), Settings::load());
        settings.keys.ignored().iter().for_each(|line| eprintln!("enfilade-viewer: {line}"));
        Self {
            args,
            path,
            opening,
            land: None,
            welcome: Welcome::new(&settings.recent),
            settings,
            window: None,
            screen: None,
            session: None,
            winit: None,
            failure: None,
            dropped: None,
            dialog: None,
            shown: None,
            last_place: None,
            begun: Walker::new(DVec3::ZERO, DVec3::NEG_Z, false),
            held: HashSet::new(),
            pads: Pads::open(),
            pointer: DVec2::ZERO,
            pressed: None,
            drags: false,
            grabbed: false,
            started: now,
            last: now,
            stepped: 0.0,
            drawn: false,
        }
    }

    /// A frame, in order: what came, what a person does, what is drawn.
    fn frame(&mut self, event_loop: &ActiveEventLoop) -> Result<(), String> {
        let Some(window) = self.window.clone() else { return Ok(()) };
        // 1. A building that has come, or more of it. Who looks at a frozen culling keeps it.
        let opening = self.opening;
        let is_frozen = self.session.as_ref().is_some_and(Session::is_frozen);
        if let (None, Some((number, opened))) = (&self.failure, opening.best())
            && self.shown.is_none_or(|shown| shown < number)
            && !is_frozen
        {
            match opened {
                Ok(building) => self.begin(number, building)?,
                Err(line) => self.fail(line.to_owned()),
            }
        }
        self.hear_dialog(event_loop);
        let seconds = self.passed();
        let Some(screen) = &mut self.screen else { return Ok(()) };
        let Some(texture) = screen.acquire(window.inner_size().into())? else { return Ok(()) };
        // 2. Until then, how far it is; or a start screen.
        let Some(session) = &mut self.session else { return self.wait(event_loop, texture) };
        let view = texture.texture.create_view(&Default::default());
        // 3. What a person does.
        if session.size() != screen.size() {
            session.resize(screen.size());
        }
        self.walk(seconds);
        let (Some(session), Some(screen)) = (&mut self.session, &mut self.screen) else { return Ok(()) };
        session.view.crosshair = self.grabbed || session.view.hud;
        // 4. The picture.
        session.opening = opening.share();
        let input = self.winit.as_mut().map(|winit| winit.take_egui_input(&window)).unwrap_or_default();
        let output = session.draw(&view, input, seconds + std::mem::take(&mut self.stepped))?;
        if let Some(winit) = &mut self.winit {
            winit.handle_platform_output(&window, output);
        }
        screen.present(texture, Some(&session.renderer.gpu));
        if !std::mem::replace(&mut self.drawn, true) {
            eprintln!("first frame after {:.2} s, on {}", self.started.elapsed().as_secs_f64(), session.renderer.gpu.name);
        }
        // 5. What buttons ask of the window.
        let asked = std::mem::take(&mut session.window);
        if asked.full_screen {
            full_screen(&window);
        }
        if asked.quit {
            event_loop.exit();
        }
        if asked.open {
            self.ask_for_file();
        }
        event_loop.set_control_flow(ControlFlow::Poll);
        Ok(())
    }

    /// Shows a building, or the same one with more known of it: a walker that has moved stays where it is.
    fn begin(&mut self, number: usize, building: &'a Building) -> Result<(), String> {
        let (Some(window), Some(screen)) = (self.window.clone(), &mut self.screen) else { return Ok(()) };
        let hash = building.file.model_hash;
        let mut before = self.session.take();
        match &before {
            Some(before) => before.remember(&mut self.settings),
            None => self.last_place = self.settings.place(hash).cloned(),
        }
        let gone = before.as_ref().map(|before| before.motion.walker).filter(|walker| walker.has_gone_from(&self.begun));
        let mode = before.as_ref().map(|before| before.view.mode);
        let ongoing = before.as_mut().map(Session::ongoing);
        let land = before.as_mut().and_then(|before| before.renderer.terrain.take()).map(|terrain| terrain.land);
        let land = land.or(self.land.take());
        let Some(gpu) = before.map(|before| before.renderer.gpu).or_else(|| screen.take_gpu()) else { return Ok(()) };
        let oracle = self.args.oracle.map_or(Oracle::best(&gpu), Oracle::from);
        let (format, size) = (screen.format(), screen.size());
        let mut renderer = Renderer::new(gpu, building, oracle, size, format)?;
        land.map_or(Ok(()), |land| renderer.set_ground(land))?;
        let mut session = Session::new(building, renderer);
        let settings = &self.settings;
        let mode = mode.or(self.args.mode).or(settings.mode.parse::<ViewMode>().ok());
        session.begin(self.last_place.as_ref());
        self.begun = session.motion.walker;
        session.motion.walker = gone.unwrap_or(session.motion.walker);
        session.apply(settings);
        session.view.mode = mode.unwrap_or(session.view.mode);
        if self.shown.is_none() {
            self.remember_file();
            session.view.detail = self.args.detail.unwrap_or(session.view.detail);
            session.view.layers.alarm |= self.args.alarm;
        }
        self.args
            .model
            .as_ref()
            .or(self.args.file.as_ref())
            .inspect(|file| session.document.output = OutputFiles::beside(file));
        if let Some(ongoing) = ongoing {
            session.go_on(ongoing);
        }
        if let Some(path) = self.path.take() {
            session.play_path(path);
        }
        self.shown = Some(number);
        eprintln!("{} after {:.2} s", THERE[number], self.started.elapsed().as_secs_f64());
        let side = session.renderer.gpu.limits.max_texture_dimension_2d as usize;
        self.winit = Some(listen(&session.interface.context, &window, Some(side)));
        window.set_title(&format!("{} - Enfilade", building.scene.name));
        self.session = Some(session);
        Ok(())
    }

    /// On the screen, in the title and in the terminal.
    fn fail(&mut self, line: String) {
        eprintln!("enfilade-viewer: {line}");
        if let Some(window) = &self.window {
            window.set_title(&format!("Enfilade: {line}"));
            // A device that failed is given back; another one may still say why.
            self.session = None;
            if !self.screen.as_ref().is_some_and(Screen::has_gpu) {
                self.screen = None;
                self.winit = None;
                self.screen = Screen::open(window).ok();
            }
        }
        self.welcome_with(line.clone());
        self.failure = Some(line);
    }

    /// Seconds since the last frame.
    fn passed(&mut self) -> f64 {
        let seconds = std::mem::replace(&mut self.last, Instant::now()).elapsed().as_secs_f64();
        if self.args.steps { 0.0 } else { seconds }
    }

    /// The file that is shown is among the recent ones from now on.
    fn remember_file(&mut self) {
        let Some(file) = &self.args.file else { return };
        // Another window may have opened others.
        let mut settings = Settings::load();
        settings.opened(file);
        settings.save();
        self.settings.recent = settings.recent;
    }

    /// Which key does what.
    fn keys(&self) -> &KeyMap {
        self.session.as_ref().map_or(&self.settings.keys, |session| &session.user.keys)
    }

    fn keep_settings(&self) {
        if let Some(session) = &self.session {
            // Another window may have been shut since.
            let Settings { places, recent, .. } = Settings::load();
            let mut settings = Settings { places, recent, ..self.settings.clone() };
            session.remember(&mut settings);
            settings.save();
        }
    }
}

/// Events of a window for panels, whose textures have at most `side` texels a side.
fn listen(context: &egui::Context, window: &Window, side: Option<usize>) -> egui_winit::State {
    let scale = Some(window.scale_factor() as f32);
    egui_winit::State::new(context.clone(), egui::ViewportId::ROOT, window, scale, window.theme(), side)
}

/// Fills the screen that a window is on, or is a window again.
fn full_screen(window: &Window) {
    window.set_fullscreen(if window.fullscreen().is_none() { Some(Fullscreen::Borderless(None)) } else { None });
}

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_some() {
            return;
        }
        let [width, height] = self.args.size.unwrap_or(self.settings.size);
        let attributes = Window::default_attributes()
            .with_title(self.args.file.as_ref().map_or("Enfilade".into(), |file| format!("{} - Enfilade", file.display())))
            .with_inner_size(winit::dpi::PhysicalSize::new(width, height));
        match event_loop.create_window(attributes) {
            Ok(window) => {
                let window = Arc::new(window);
                self.window = Some(window.clone());
                match Screen::open(&window) {
                    Ok(screen) => self.screen = Some(screen),
                    Err(line) => self.fail(line),
                }
            }
            Err(e) => {
                self.failure = Some(format!("no window can be opened: {e}"));
                event_loop.exit();
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        // Tab grabs the mouse; to panels it would go from one button to the next.
        let is_tab = matches!(&event, WindowEvent::KeyboardInput { event, .. } if event.physical_key == KeyCode::Tab);
        let taken = match (&mut self.winit, &self.window) {
            (Some(winit), Some(window)) if !is_tab => {
                // Text of another size leaves the pointer where it is, and panels elsewhere below it.
                if let WindowEvent::MouseInput { device_id, .. } = event {
                    let position = winit::dpi::PhysicalPosition::new(self.pointer.x, self.pointer.y);
                    let _ = winit.on_window_event(window, &WindowEvent::CursorMoved { device_id, position });
                }
                winit.on_window_event(window, &event).consumed
            }
            _ => false,
        };
        match event {
            WindowEvent::CloseRequested => match &mut self.session {
                Some(session) => session.close(),
                None => event_loop.exit(),
            },
            WindowEvent::RedrawRequested => {
                if let Err(line) = self.frame(event_loop) {
                    self.fail(line);
                }
            }
            WindowEvent::DroppedFile(file) => self.go_to_file(event_loop, file),
            WindowEvent::Focused(false) => self.held.clear(),
            WindowEvent::KeyboardInput { event, .. } => self.keyboard(event_loop, &event, taken),
            WindowEvent::CursorMoved { position, .. } => self.moved(DVec2::new(position.x, position.y)),
            WindowEvent::MouseWheel { delta, .. } if !taken => self.wheel(delta),
            WindowEvent::MouseInput { state, button: MouseButton::Left | MouseButton::Right, .. }
                if !taken || state == ElementState::Released =>
            {
                self.button(state == ElementState::Pressed);
                self.step();
            }
            _ => {}
        }
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        if let (DeviceEvent::MouseMotion { delta: (x, y) }, true, Some(session)) = (event, self.grabbed, &mut self.session) {
            session.look(DVec2::new(x, y));
        }
    }

    fn about_to_wait(&mut self, _: &ActiveEventLoop) {
        // Without a building a few pictures a second are enough: a bake needs the processors.
        let is_due = self.session.is_some() || self.last.elapsed() >= waiting::WAITING;
        if let Some(window) = self.window.as_ref().filter(|_| is_due) {
            window.request_redraw();
        }
    }
}
