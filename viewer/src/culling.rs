//! Culling of the viewer: a mode, and its state from frame to frame.

use crate::building::Building;
use crate::delayed_queries::DelayedQueries;
use crate::draw::queries;
use crate::mode::ViewMode;
use enfilade::file::PvsFile;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::runtime::{Camera, CrossedPortal, Culler, FrameStats, MinPixels, Mode, MoverId, Movers, View};
use enfilade::{CellId, ObjectId};
use std::sync::Arc;
use std::time::Instant;

/// The engine for occlusion queries.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Oracle {
    /// The device that draws: answers are used there in the same frame, and read later.
    Device,
    /// The processor, by a depth buffer of its own.
    Software,
}

impl Oracle {
    /// The faster engine: a software driver is slower at boxes than the library's depth buffer.
    pub fn best(gpu: &enfilade::gpu::Gpu) -> Self {
        if gpu.is_software { Self::Software } else { Self::Device }
    }

    /// On the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Device => "device",
            Self::Software => "software",
        }
    }
}

/// Of all modes those that have a number key here, 1 first.
pub const MODES: [Mode; 7] =
    [Mode::None, Mode::Frustum, Mode::Portals, Mode::Pvs, Mode::PortalsAndPvs, Mode::Chc, Mode::Auto];

/// The part of a frame that the device decides.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Asks {
    /// Nothing.
    Nothing,
    /// Occlusion queries: the plan of [`Culling::delayed`].
    Queries,
    /// Objects before a pyramid of depth: see [`crate::draw::hiz`].
    Pyramid,
}

/// Objects and triangles that the device decided to draw.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ByDevice {
    /// Objects.
    pub objects: u64,
    /// Their triangles.
    pub triangles: u64,
}

impl ByDevice {
    /// Both.
    pub fn with(self, more: Self) -> Self {
        Self { objects: self.objects + more.objects, triangles: self.triangles + more.triangles }
    }
}

/// The decision for a frame.
#[derive(Clone, Debug)]
pub struct Decision {
    /// The frame that it was made in.
    pub frame: u64,
    /// How.
    pub method: Mode,
    /// Objects to draw: all; with queries, the certain ones; with a pyramid, those in the frustum.
    pub objects: Vec<ObjectId>,
    /// Objects that the device decides about.
    pub asks: Asks,
    /// The camera that it is for.
    pub camera: Camera,
    /// Cells reached, the eye's own first.
    pub cells: Vec<CellId>,
    /// Portals seen through.
    pub portals: Vec<CrossedPortal>,
    /// The eye's cell.
    pub home: Option<CellId>,
    /// Counters; of a method that asks the device, of what is certain.
    pub stats: FrameStats,
    /// Milliseconds of the processor.
    pub ms: f64,
}

impl Decision {
    /// Of no frame yet.
    fn new(camera: &Camera) -> Self {
        Self {
            frame: 0,
            method: Mode::None,
            objects: Vec::new(),
            asks: Asks::Nothing,
            camera: *camera,
            cells: Vec::new(),
            portals: Vec::new(),
            home: None,
            stats: FrameStats::default(),
            ms: 0.0,
        }
    }

    /// Objects and triangles drawn, with the answers of the device.
    pub fn drawn(&self, by_device: ByDevice) -> ByDevice {
        let certain = ByDevice { objects: self.stats.objects, triangles: self.stats.triangles };
        if self.asks == Asks::Nothing { certain } else { certain.with(by_device) }
    }

    /// Leaves to the device what `is_asked` of what is in the frustum: it is counted no longer.
    pub fn leave_to_device(&mut self, file: &PvsFile, is_asked: impl Fn(ObjectId) -> bool) {
        for &object in self.objects.iter().filter(|o| is_asked(**o)) {
            self.stats.objects -= 1;
            self.stats.triangles -= u64::from(file.objects[object.index()].triangles);
            self.stats.queries += 1;
        }
    }

    /// Leaves objects out, and counts them no longer. Gives how many.
    pub fn leave_out(&mut self, file: &PvsFile, is_hidden: impl Fn(ObjectId) -> bool) -> usize {
        let before = self.objects.len();
        let stats = &mut self.stats;
        self.objects.retain(|&object| {
            let is_kept = !is_hidden(object);
            if !is_kept {
                stats.objects -= 1;
                stats.triangles -= u64::from(file.objects[object.index()].triangles);
            }
            is_kept
        });
        before - self.objects.len()
    }
}

/// Decides.
pub struct Culling<'b> {
    /// Of the file.
    pub culler: Arc<Culler>,
    /// Culls, with doors that open and shut.
    pub view: View,
    /// Queries of the device.
    pub delayed: DelayedQueries,
    /// The engine.
    pub oracle: Oracle,
    /// The last decision.
    pub last: Option<Decision>,
    building: &'b Building,
    size: [u32; 2],
    /// Objects with fewer are left out; 0 leaves none out.
    min_pixels: u32,
    depth: Option<DepthBuffer<'b>>,
}

impl<'b> Culling<'b> {
    /// For pictures of `size` pixels.
    pub fn new(building: &'b Building, oracle: Oracle, size: [u32; 2]) -> Self {
        Self::of(building, &Culler::new(&building.file), oracle, size)
    }

    /// Another one of the same culler.
    pub fn another(&self, size: [u32; 2]) -> Self {
        Self::of(self.building, &self.culler, self.oracle, size)
    }

    fn of(building: &'b Building, culler: &Arc<Culler>, oracle: Oracle, size: [u32; 2]) -> Self {
        let mut view = View::new(culler);
        let scene = &*building.scene;
        if scene.tubes.tubes.is_empty() {
            view.prepare_queries(Some(Hierarchy::build(scene, &HierarchyOptions::default()).with_parts(scene)));
        } else {
            // The scene's meshes are within tubes, and only the file's boxes hold what is drawn.
            view.prepare_queries(None);
        }
        Self {
            culler: culler.clone(),
            view,
            delayed: DelayedQueries::new(&building.file),
            oracle,
            last: None,
            building,
            size,
            min_pixels: 0,
            // Made before it is asked: it looks at every triangle of the scene.
            depth: (oracle == Oracle::Software).then(|| depth(building, size)),
        }
    }

    /// Pictures have another size from now on.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.size = size;
        self.depth = None;
        self.set_min_pixels(self.min_pixels);
    }

    /// Objects with fewer pixels are left out from now on, as far as their boxes tell; 0 leaves none out.
    pub fn set_min_pixels(&mut self, pixels: u32) {
        self.min_pixels = pixels;
        self.view.set_min_pixels(MinPixels { pixels, picture: self.size });
    }

    /// Decides a frame, with a near plane at `near` metres. Lists keep their memory from frame to frame.
    pub fn decide(&mut self, frame: u64, camera: &Camera, near: f64, mode: impl Into<ViewMode>) -> &Decision {
        let start = Instant::now();
        let mode = mode.into();
        // 1. How. Answers of a device come a frame delayed, and then asking costs more than it saves.
        let method = match (mode.of_library(), self.oracle) {
            (Mode::Auto, Oracle::Device) => Mode::PortalsAndPvs,
            (mode, _) => self.view.choose(camera, mode),
        };
        // 2. What.
        let asks = match mode {
            ViewMode::Hiz => Asks::Pyramid,
            ViewMode::Culled(_) if method.has_queries() && self.oracle == Oracle::Device => Asks::Queries,
            ViewMode::Culled(_) => Asks::Nothing,
        };
        let by_software = method.has_queries() && self.oracle == Oracle::Software;
        let min_pixels = self.min_pixels;
        let visible = if by_software {
            let depth = self.depth.get_or_insert_with(|| depth(self.building, self.size));
            depth.set_min_pixels(min_pixels);
            self.view.cull_with(camera, method, near, depth)
        } else {
            self.view.cull(camera, method)
        };
        let decision = self.last.get_or_insert_with(|| Decision::new(camera));
        refill(&mut decision.objects, visible.objects);
        refill(&mut decision.cells, visible.cells);
        refill(&mut decision.portals, visible.portals);
        (decision.frame, decision.method, decision.asks) = (frame, method, asks);
        (decision.camera, decision.home, decision.stats) = (*camera, visible.homes.first().copied(), visible.stats);
        // 3. What to ask the device.
        if asks == Asks::Queries {
            self.delayed.plan(camera, &decision.objects, queries::MOST);
            refill(&mut decision.objects, &self.delayed.sure);
            let triangles = decision.objects.iter().map(|&o| u64::from(self.culler.triangles(o))).sum();
            let (objects, queries) = (decision.objects.len() as u64, self.delayed.questions.len() as u64);
            decision.stats = FrameStats { objects, triangles, queries, ..decision.stats };
        }
        decision.ms = start.elapsed().as_secs_f64() * 1e3;
        decision
    }

    /// The movers that the last frame may show.
    pub fn movers(&mut self, movers: &Movers) -> &[MoverId] {
        match self.depth.as_mut().filter(|_| self.oracle == Oracle::Software) {
            Some(depth) => self.view.movers_with(movers, depth),
            None => self.view.movers(movers),
        }
    }

    /// As if no frame had been drawn yet.
    pub fn restart(&mut self) {
        self.last = None;
        self.view.restart();
        self.delayed = DelayedQueries::new(&self.building.file);
    }
}

/// Other items in the same memory.
fn refill<T: Copy>(list: &mut Vec<T>, items: &[T]) {
    list.clear();
    list.extend_from_slice(items);
}

fn depth(building: &Building, [width, height]: [u32; 2]) -> DepthBuffer<'_> {
    DepthBuffer::new(&*building.scene, width as usize, height as usize)
}
