//! A path, frame by frame: what each frame costs, what it misses, and how often each object is seen or drawn in vain.

use crate::draw::frame::FrameRequest;
use crate::draw::marks::Marking;
use crate::draw::renderer::{CullState, Renderer};
use crate::draw::targets::texture;
use crate::mode::ViewMode;
use enfilade::ObjectId;
use enfilade_measure::walkthrough::path::CameraPath;
use glam::DVec3;
use std::time::Instant;
use wgpu::{TextureFormat, TextureUsages, TextureView};

/// First frames that drivers compile in: they are drawn, and not counted.
const WARM_UP: usize = 2;

/// The cost of a frame of the path.
#[derive(Clone, Copy, PartialEq, Debug, Default, serde::Serialize)]
pub struct Cost {
    /// Milliseconds of all of it: culling, drawing, and waiting for the device.
    pub ms: f64,
    /// Milliseconds of culling.
    pub cull_ms: f64,
    /// Triangles drawn.
    pub triangles: u64,
    /// Triangles that have a pixel.
    pub seen: u64,
    /// Pixels that lack something.
    pub missed_pixels: u32,
}

/// A path that is measured.
pub struct Profile<'b> {
    /// It.
    pub path: CameraPath,
    /// How it is culled.
    pub mode: ViewMode,
    /// Its frames so far.
    pub costs: Vec<Cost>,
    /// By object: frames in which it has a pixel.
    pub seen: Vec<u32>,
    /// By object: triangles drawn in vain, over all frames.
    pub in_vain: Vec<u64>,
    side: CullState<'b>,
    warm_up: usize,
    picture: ([u32; 2], TextureView),
    format: TextureFormat,
}

impl<'b> Profile<'b> {
    /// Of a path, with pictures of `format`.
    pub fn new(renderer: &Renderer<'b>, path: CameraPath, mode: ViewMode, format: TextureFormat) -> Self {
        let objects = renderer.mesh.ranges.len();
        Self {
            costs: Vec::with_capacity(path.frames.len()),
            path,
            mode,
            seen: vec![0; objects],
            in_vain: vec![0; objects],
            side: renderer.cull_state(),
            warm_up: WARM_UP,
            picture: picture(renderer, format),
            format,
        }
    }

    /// Whether all frames are measured.
    pub fn is_done(&self) -> bool {
        self.costs.len() >= self.path.frames.len()
    }

    /// Measures the next frame; `origin`: that of the file. The renderer culls as before afterwards.
    ///
    /// # Errors
    ///
    /// One line: the device has failed.
    pub fn step(&mut self, renderer: &mut Renderer<'b>, origin: DVec3) -> Result<(), String> {
        if self.is_done() {
            return Ok(());
        }
        if self.picture.0 != renderer.targets.size {
            self.picture = picture(renderer, self.format);
            self.side.culling.resize(renderer.targets.size);
        }
        renderer.swap(&mut self.side);
        let measured = self.measure(renderer, origin);
        renderer.swap(&mut self.side);
        let cost = measured?;
        match self.warm_up.checked_sub(1) {
            Some(left) => self.warm_up = left,
            None => self.costs.push(cost),
        }
        Ok(())
    }

    fn measure(&mut self, renderer: &mut Renderer<'b>, origin: DVec3) -> Result<Cost, String> {
        let [width, height] = self.picture.0.map(f64::from);
        let camera = self.path.camera(self.costs.len(), origin, width / height);
        let request = |alarm| FrameRequest { alarm, ..FrameRequest::new(camera, self.mode) };
        // 1. As it is, and how long that takes.
        let marking = renderer.marking();
        // The grey glass of a frozen view is not timed.
        renderer.shows_culled = false;
        renderer.set_marking(Marking::Off)?;
        let start = Instant::now();
        renderer.frame(request(false), &self.picture.1, None).map_err(|e| e.to_string())?;
        renderer.settle().map_err(|e| e.to_string())?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let triangles = renderer.triangles();
        let cull_ms = renderer.culling.last.as_ref().map_or(0.0, |last| last.ms);
        // 2. Once more, with all that is to be known of it.
        renderer.set_marking(Marking::Counted)?;
        renderer.frame(request(true), &self.picture.1, None).map_err(|e| e.to_string())?;
        renderer.settle().map_err(|e| e.to_string())?;
        let missed_pixels = renderer.readback.missed.as_ref().map_or(0, |missed| missed.pixels);
        let seen = renderer.kinds().map_or(0, |kinds| kinds[0]);
        if let Some(marked) = renderer.readback.marked.as_ref().filter(|_| self.warm_up == 0) {
            let objects = (0..).map(ObjectId).zip(self.seen.iter_mut().zip(&mut self.in_vain));
            for (object, (frames, in_vain)) in objects {
                let [seen, vain, _] = marked.triangles(&renderer.mesh.ranges[object.index()]);
                *frames += u32::from(seen > 0);
                *in_vain += vain;
            }
        }
        renderer.set_marking(marking)?;
        Ok(Cost { ms, cull_ms, triangles, seen, missed_pixels })
    }
}

fn picture(renderer: &Renderer<'_>, format: TextureFormat) -> ([u32; 2], TextureView) {
    let size = renderer.targets.size;
    (size, texture(&renderer.gpu, size, format, TextureUsages::RENDER_ATTACHMENT).create_view(&Default::default()))
}
