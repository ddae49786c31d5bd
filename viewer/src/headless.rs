//! Frames without a window: the same renderer, drawn on a picture.

use crate::args::{Args, Shown};
use crate::building::Building;
use crate::culling::Oracle;
use crate::draw::alarm::Missed;
use crate::draw::frame::FrameRequest;
use crate::draw::renderer::Renderer;
use crate::draw::targets::{Canvas, PICTURE};
use crate::ground::{self, Land};
use crate::looks::Detail;
use crate::mode::ViewMode;
use crate::session::Session;
use enfilade::file::PvsFile;
use enfilade::gpu::Gpu;
use enfilade::runtime::Camera;
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_measure::walkthrough::picture::Picture;
use enfilade_measure::walkthrough::tour::tour;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use wgpu::{DownlevelFlags, Features};

/// How long a picture waits for tiles of the ground: a slow disk reads those of a view in that time.
const PATIENCE: Duration = Duration::from_secs(20);
/// Size of pictures, where none is given.
const SIZE: [u32; 2] = [1280, 720];
/// Features that an adapter must have, with their names.
pub const NEEDS: [(DownlevelFlags, &str); 3] = [
    (DownlevelFlags::INDIRECT_EXECUTION, "indirect draws"),
    (DownlevelFlags::COMPUTE_SHADERS, "compute shaders"),
    (DownlevelFlags::FRAGMENT_WRITABLE_STORAGE, "storage that fragments write"),
];
/// Features that are used if an adapter has them.
pub const WISHES: Features = Features::TIMESTAMP_QUERY;

/// A building, opened without a window.
pub struct Headless {
    /// It.
    pub building: Building,
    path: CameraPath,
    land: Option<Land>,
}

/// A walk along a path, on pictures.
pub struct Walk<'w, 'b> {
    /// The frames.
    pub path: &'w CameraPath,
    /// Draws them.
    pub renderer: Renderer<'b>,
    canvas: Canvas,
    aspect: f64,
    building: &'b Building,
}

impl Headless {
    /// Opens what the command line names; bakes where needed.
    pub fn open(args: &Args) -> Result<Self, String> {
        let told = std::sync::Mutex::new(String::new());
        let progress = |stage: &str, _: f64| {
            let mut told = told.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            if *told != stage {
                eprintln!("{stage}");
                stage.clone_into(&mut told);
            }
        };
        let land = ground::open(args)?;
        let file = args.file.as_deref().unwrap_or(Path::new(""));
        let building = Building::open(file, args.model.as_deref(), &progress, &AtomicBool::new(false), None)?;
        let path = match &args.path {
            Some(path) => CameraPath::load(path).map_err(|e| format!("{}: {e}", path.display()))?,
            None => tour(&building.file, 0),
        };
        Ok(Self { building, path, land })
    }

    /// Runs something with a renderer of `size` pixels.
    pub fn with_renderer<T>(
        &mut self,
        args: &Args,
        size: [u32; 2],
        run: impl FnOnce(&mut Walk<'_, '_>) -> T,
    ) -> Result<T, String> {
        let mut walk = Walk::new(&self.building, &self.path, args.oracle.map(Oracle::from), size)?;
        walk.renderer.set_detail(args.detail.unwrap_or(Detail::Plain))?;
        walk.renderer.tubes.iter_mut().for_each(|tubes| tubes.set(args.tube_pixels, args.thin_tubes));
        walk.renderer.culling.set_min_pixels(args.min_pixels);
        self.land.take().map_or(Ok(()), |land| walk.renderer.set_ground(land))?;
        Ok(run(&mut walk))
    }
}

/// Opens a device for pictures.
pub fn device() -> Result<Gpu, String> {
    let instance = Gpu::instance().map_err(|e| e.to_string())?;
    Gpu::open_on(&instance, None, &NEEDS, WISHES).map_err(|e| e.to_string())
}

impl<'w, 'b> Walk<'w, 'b> {
    /// Along a path, on pictures of `size` pixels.
    pub fn new(
        building: &'b Building,
        path: &'w CameraPath,
        oracle: Option<Oracle>,
        size: [u32; 2],
    ) -> Result<Self, String> {
        let gpu = device()?;
        let oracle = oracle.unwrap_or(Oracle::best(&gpu));
        let canvas = Canvas::new(&gpu, size);
        let mut renderer = Renderer::new(gpu, building, oracle, size, PICTURE)?;
        // Paths lead through doors, and rows take them as open.
        renderer.doors.set_all(true);
        renderer.doors_changed();
        renderer.paint(crate::colours::colours(&building.scene, &building.file, Default::default()));
        Ok(Self { path, renderer, canvas, aspect: f64::from(size[0]) / f64::from(size[1]), building })
    }

    /// Objects.
    pub fn scene(&self) -> &'b enfilade::scene::Scene {
        &self.building.scene
    }

    /// Cells and portals.
    pub fn file(&self) -> &'b PvsFile {
        &self.building.file
    }

    /// That of a frame of the path.
    pub fn camera(&self, frame: usize) -> Camera {
        self.path.camera(frame, self.building.file.origin, self.aspect)
    }

    /// Draws a frame without waiting for it.
    pub fn draw(&mut self, request: FrameRequest<'_>) -> Result<(), String> {
        self.renderer.frame(request, &self.canvas.view, None).map_err(|e| e.to_string())
    }

    /// Missed pixels of a frame.
    pub fn missed(&mut self, camera: Camera, mode: impl Into<ViewMode>) -> Result<Option<Missed>, String> {
        self.draw(FrameRequest { alarm: true, ..FrameRequest::new(camera, mode) })?;
        self.renderer.settle().map_err(|e| e.to_string())?;
        let number = self.renderer.frame;
        Ok(self.renderer.readback.missed.clone().filter(|missed| missed.frame == number))
    }

    /// The picture as it is.
    pub fn picture(&self) -> Result<Picture, String> {
        self.canvas.read(&self.renderer.gpu).map_err(|e| e.to_string())
    }
}

/// Draws on until the tiles that are wanted are there.
fn wait_for_ground(session: &mut Session<'_>, canvas: &Canvas) -> Result<(), String> {
    let start = Instant::now();
    let is_whole = |session: &Session<'_>| session.renderer.terrain.as_ref().is_none_or(|terrain| terrain.shown.is_whole());
    while !session.is_frozen() && !is_whole(session) && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(2));
        session.draw(&canvas.view, egui::RawInput::default(), 0.0)?;
        session.renderer.settle().map_err(|e| e.to_string())?;
    }
    Ok(())
}

/// Draws one frame as the window would; false where pixels were missed.
///
/// # Errors
///
/// One line.
pub fn shot(args: &Args, to: &Path) -> Result<bool, String> {
    let mut held = Headless::open(args)?;
    let frames = held.path.frames.len();
    for frame in [Some(args.frame), args.freeze].into_iter().flatten() {
        if frame >= frames {
            return Err(format!("no frame {frame}: the path has 0 to {}", frames - 1));
        }
    }
    let size = args.size.unwrap_or(SIZE);
    let gpu = device()?;
    let canvas = Canvas::new(&gpu, size);
    let oracle = args.oracle.map_or(Oracle::best(&gpu), Oracle::from);
    let mut renderer = Renderer::new(gpu, &held.building, oracle, size, PICTURE)?;
    held.land.take().map_or(Ok(()), |land| renderer.set_ground(land))?;
    renderer.tubes.iter_mut().for_each(|tubes| tubes.set(args.tube_pixels, args.thin_tubes));
    renderer.culling.set_min_pixels(args.min_pixels);
    let mut session = Session::new(&held.building, renderer);
    session.view.mode = args.mode.unwrap_or(session.view.mode);
    session.view.detail = args.detail.unwrap_or_default();
    session.view.layers.alarm = args.alarm;
    session.view.hud = !args.show.is_empty();
    // The walk up to here, so that graphs and the walked path are those of a walk.
    let first = if args.show.is_empty() { args.frame } else { 0 };
    for frame in (first..=args.frame).filter(|&f| args.freeze.is_none_or(|freeze| f <= freeze || f == args.frame)) {
        if args.freeze.is_some_and(|freeze| frame > freeze) && !session.is_frozen() {
            session.freeze();
        }
        if args.start {
            session.begin(None);
        } else {
            session.stand(&held.path, frame);
        }
        if frame == args.frame {
            if args.show.iter().any(|shown| matches!(shown, Shown::Profile | Shown::Heat)) {
                session.profile(held.path.clone())?;
            }
            args.show.iter().for_each(|&shown| session.show_this(shown));
        }
        session.draw(&canvas.view, egui::RawInput::default(), 1.0 / 60.0)?;
        session.renderer.settle().map_err(|e| e.to_string())?;
        wait_for_ground(&mut session, &canvas)?;
    }
    // Again, with what was heard of the last frame; then with panels at their size.
    let again = if args.show.is_empty() { usize::from(args.alarm) } else { 2 };
    for _ in 0..again {
        session.draw(&canvas.view, egui::RawInput::default(), 1.0 / 60.0)?;
        session.renderer.settle().map_err(|e| e.to_string())?;
    }
    let picture = canvas.read(&session.renderer.gpu).map_err(|e| e.to_string())?;
    picture.save(to).map_err(|e| format!("{}: {e}", to.display()))?;
    let Some(missed) = session.renderer.readback.missed.as_ref().filter(|_| args.alarm) else { return Ok(true) };
    eprintln!("{}", session.say_missed(missed));
    Ok(missed.pixels == 0)
}
