//! The window: opens a building in the background, shows how far that is, then hands what is pressed to a [`Session`].

use crate::args::Args;
use crate::building::Building;
use crate::culling::Oracle;
use crate::draw::frame::Stage;
use crate::screen::Screen;
use crate::session::Session;
use crate::settings::Settings;
use crate::ui::keys;
use crate::walker::Wants;
use enfilade::runtime::FrameMode;
use glam::{DVec2, DVec3};
use std::collections::HashSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::event::{DeviceEvent, DeviceId, ElementState, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{CursorGrabMode, Window, WindowId};

/// Radians of a pixel that the mouse is moved by, and of a second that an arrow key is held.
const MOUSE: f64 = 0.003;
const ARROW: f64 = 1.6;
/// A button that goes up within so many pixels of where it went down has clicked.
const CLICK: f64 = 4.0;
/// Pictures a second while something is opened.
const WAITING: Duration = Duration::from_millis(50);

/// What the thread that opens a building tells.
#[derive(Default)]
struct Opening {
    building: OnceLock<Result<Building, String>>,
    /// The stage, and how much of it is done.
    progress: Mutex<(String, f64)>,
    stop: AtomicBool,
}

/// Opens the window, and returns when it is shut.
///
/// # Errors
///
/// No window can be opened, or what was to be shown failed; that was on the screen, too.
pub fn run(args: &Args) -> Result<(), String> {
    let event_loop = EventLoop::new().map_err(|e| format!("no window can be opened: {e}; --shot and --bench need none"))?;
    let opening = Opening::default();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let tell = |stage: &str, done: f64| {
                *opening.progress.lock().unwrap_or_else(PoisonError::into_inner) = (stage.to_owned(), done);
            };
            // Nobody else sets it.
            let _ = opening.building.set(Building::open(&args.file, args.model.as_deref(), &tell, &opening.stop));
        });
        let mut app = App::new(args, &opening);
        let result = event_loop.run_app(&mut app).map_err(|e| e.to_string());
        opening.stop.store(true, Ordering::Relaxed);
        app.keep_settings();
        app.failure.map_or(result, Err)
    })
}

struct App<'a> {
    args: &'a Args,
    opening: &'a Opening,
    settings: Settings,
    window: Option<Arc<Window>>,
    screen: Option<Screen>,
    session: Option<Session<'a>>,
    winit: Option<egui_winit::State>,
    failure: Option<String>,
    held: HashSet<KeyCode>,
    /// Where the pointer is, and where a button went down; pixels.
    pointer: DVec2,
    pressed: Option<DVec2>,
    drags: bool,
    grabbed: bool,
    started: Instant,
    last: Instant,
    drawn: bool,
}

impl<'a> App<'a> {
    fn new(args: &'a Args, opening: &'a Opening) -> Self {
        let now = Instant::now();
        Self {
            args,
            opening,
            settings: Settings::load(),
            window: None,
            screen: None,
            session: None,
            winit: None,
            failure: None,
            held: HashSet::new(),
            pointer: DVec2::ZERO,
            pressed: None,
            drags: false,
            grabbed: false,
            started: now,
            last: now,
            drawn: false,
        }
    }

    /// A frame, in order: what came, what a person does, what is drawn.
    fn frame(&mut self, event_loop: &ActiveEventLoop) -> Result<(), String> {
        let Some(window) = self.window.clone() else { return Ok(()) };
        // 1. A building that has come.
        if let (None, None, Some(opened)) = (&self.session, &self.failure, self.opening.building.get()) {
            match opened {
                Ok(building) => self.begin(building)?,
                Err(line) => self.fail(line.clone()),
            }
        }
        let Some(screen) = &mut self.screen else { return Ok(()) };
        let seconds = self.last.elapsed().as_secs_f64();
        self.last = Instant::now();
        let Some(texture) = screen.acquire(window.inner_size().into())? else { return Ok(()) };
        let view = texture.texture.create_view(&Default::default());
        let Some(session) = &mut self.session else {
            // 2. Until then, how far it is; or why it won't come.
            let name = self.args.file.display().to_string();
            let (stage, done) = self.opening.progress.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let message = self.failure.clone();
            screen.say(&view, |ui| match &message {
                Some(text) => crate::ui::hud::message(ui, "This can't be shown", text),
                None => crate::ui::hud::progress(ui, &name, &stage, done as f32),
            })?;
            screen.present(texture, None);
            event_loop.set_control_flow(ControlFlow::WaitUntil(Instant::now() + WAITING));
            return Ok(());
        };
        // 3. What a person does.
        if session.size() != screen.size() {
            session.resize(screen.size());
        }
        let turn = |left, right| f64::from(self.held.contains(&right)) - f64::from(self.held.contains(&left));
        session.walker.turn(
            ARROW * seconds * turn(KeyCode::ArrowLeft, KeyCode::ArrowRight),
            ARROW * seconds * turn(KeyCode::ArrowDown, KeyCode::ArrowUp),
        );
        let to = DVec3::new(
            turn(KeyCode::KeyA, KeyCode::KeyD),
            turn(KeyCode::ControlLeft, KeyCode::Space),
            turn(KeyCode::KeyS, KeyCode::KeyW),
        );
        session.go(seconds, &Wants { to, hurry: self.held.contains(&KeyCode::ShiftLeft) });
        // 4. The picture.
        let input = self.winit.as_mut().map(|winit| winit.take_egui_input(&window)).unwrap_or_default();
        let output = session.draw(&view, input, seconds)?;
        if let Some(winit) = &mut self.winit {
            winit.handle_platform_output(&window, output);
        }
        screen.present(texture, Some(&session.stage.gpu));
        if !std::mem::replace(&mut self.drawn, true) {
            eprintln!("first frame after {:.2} s, on {}", self.started.elapsed().as_secs_f64(), session.stage.gpu.name);
        }
        event_loop.set_control_flow(ControlFlow::Poll);
        Ok(())
    }

    /// A building is there.
    fn begin(&mut self, building: &'a Building) -> Result<(), String> {
        let (Some(window), Some(screen)) = (&self.window, &mut self.screen) else { return Ok(()) };
        let Some(gpu) = screen.take_gpu() else { return Ok(()) };
        let oracle = self.args.oracle.map_or(Oracle::best(&gpu), Oracle::from);
        let (format, size) = (screen.format(), screen.size());
        let stage = Stage::new(gpu, building, oracle, size, format)?;
        let mut session = Session::new(building, stage, format, size)?;
        session.model = Some(self.args.model.clone().unwrap_or_else(|| self.args.file.clone()));
        let settings = &self.settings;
        let mode = self.args.mode.or(settings.mode.parse::<FrameMode>().ok());
        session.begin(settings.place(building.file.model_hash));
        session.apply(settings);
        session.show.mode = mode.unwrap_or(session.show.mode);
        session.show.detail = self.args.detail.unwrap_or(session.show.detail);
        session.show.layers.alarm |= self.args.alarm;
        let context = session.egui.context.clone();
        let side = session.stage.gpu.limits.max_texture_dimension_2d as usize;
        let scale = Some(window.scale_factor() as f32);
        self.winit =
            Some(egui_winit::State::new(context, egui::ViewportId::ROOT, window, scale, window.theme(), Some(side)));
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
            if self.session.take().is_some() || self.screen.is_none() {
                self.screen = None;
                self.winit = None;
                self.screen = Screen::open(window).ok();
            }
        }
        self.failure = Some(line);
    }

    fn keep_settings(&self) {
        if let Some(session) = &self.session {
            // Another window may have been shut since.
            let mut settings = Settings { places: Settings::load().places, ..self.settings.clone() };
            session.remember(&mut settings);
            settings.save();
        }
    }

    fn grab(&mut self, grab: bool) {
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
            KeyCode::Escape if self.grabbed => self.grab(false),
            KeyCode::Escape => match &mut self.session {
                Some(session) if session.find.is_open => session.find.toggle(),
                _ => event_loop.exit(),
            },
            KeyCode::Tab => self.grab(!self.grabbed),
            code => {
                let is_held = |keys: [KeyCode; 2]| keys.iter().any(|key| self.held.contains(key));
                let ctrl = is_held([KeyCode::ControlLeft, KeyCode::ControlRight]);
                let action = keys::action(code, [ctrl, is_held([KeyCode::ShiftLeft, KeyCode::ShiftRight])]);
                if let (Some(session), Some(action)) = (&mut self.session, action) {
                    session.act(action);
                }
            }
        }
    }

    /// Whether a field of the interface takes the keys.
    fn is_typed(&self) -> bool {
        self.session.as_ref().is_some_and(|session| session.egui.context.text_edit_focused())
    }

    fn button(&mut self, is_down: bool) {
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

    fn moved(&mut self, to: DVec2) {
        if let (Some(from), Some(session)) = (self.pressed, &mut self.session) {
            self.drags |= from.distance(to) > CLICK;
            if self.drags && !self.grabbed {
                let by = (to - self.pointer) * MOUSE;
                session.walker.turn(by.x, -by.y);
            }
        }
        self.pointer = to;
    }
}

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_some() {
            return;
        }
        let [width, height] = self.args.size.unwrap_or(self.settings.size);
        let attributes = Window::default_attributes()
            .with_title(format!("{} - Enfilade", self.args.file.display()))
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
        // Tab is for the mouse here: it moves on to no button, which the next key would press.
        let is_tab = matches!(&event, WindowEvent::KeyboardInput { event, .. } if event.physical_key == KeyCode::Tab);
        let taken = match (&mut self.winit, &self.window) {
            (Some(winit), Some(window)) if !is_tab => winit.on_window_event(window, &event).consumed,
            _ => false,
        };
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::RedrawRequested => {
                if let Err(line) = self.frame(event_loop) {
                    self.fail(line);
                }
            }
            WindowEvent::Focused(false) => self.held.clear(),
            WindowEvent::KeyboardInput { event, .. } => {
                let PhysicalKey::Code(code) = event.physical_key else { return };
                match event.state {
                    ElementState::Released => drop(self.held.remove(&code)),
                    ElementState::Pressed if event.repeat => {}
                    // What is typed into a field does nothing else.
                    ElementState::Pressed if code != KeyCode::Escape && self.is_typed() => {}
                    ElementState::Pressed => {
                        self.held.insert(code);
                        self.key(event_loop, code);
                    }
                }
            }
            WindowEvent::CursorMoved { position, .. } => self.moved(DVec2::new(position.x, position.y)),
            WindowEvent::MouseInput { state, button: MouseButton::Left | MouseButton::Right, .. }
                if !taken || state == ElementState::Released =>
            {
                self.button(state == ElementState::Pressed);
            }
            _ => {}
        }
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        if let (DeviceEvent::MouseMotion { delta: (x, y) }, true, Some(session)) = (event, self.grabbed, &mut self.session) {
            session.walker.turn(x * MOUSE, -y * MOUSE);
        }
    }

    fn about_to_wait(&mut self, _: &ActiveEventLoop) {
        if let Some(window) = &self.window {
            window.request_redraw();
        }
    }
}
