//! Who decides what a frame draws: a mode, with what it keeps from frame to frame.

use crate::building::Building;
use crate::delayed_queries::Late;
use crate::draw::queries;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::runtime::{Auto, Camera, CrossedPortal, Culler, FrameStats, Method, Mode, OnlineCuller, Scratch};
use enfilade::walkthrough::walkers::WalkMode;
use enfilade::{CellId, ObjectId};
use std::time::Instant;

/// So many pixels cost about as much as a triangle, as far as `auto` looks ahead: on a software driver, where pixels are what frames
/// cost, and there only roughly. Fewer: what draws more triangles is tried more often. More: it isn't, where it would be as good.
const PIXELS: u64 = 10;

/// Frames that drivers compile in, which say nothing about what frames cost.
const WARM_UP: u64 = 3;

/// Who answers occlusion queries.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Oracle {
    /// The device that draws: answers are used there in the same frame, and read later.
    Device,
    /// The processor, by a depth buffer of its own.
    Software,
}

impl Oracle {
    /// Who answers soonest: a device that draws on the processor is slower at boxes than a depth buffer that is made for them.
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
pub const MODES: [WalkMode; 7] = [
    WalkMode::Fixed(Method::Plain(Mode::None)),
    WalkMode::Fixed(Method::Plain(Mode::Frustum)),
    WalkMode::Fixed(Method::Plain(Mode::Portals)),
    WalkMode::Fixed(Method::Plain(Mode::Pvs)),
    WalkMode::Fixed(Method::Plain(Mode::Both)),
    WalkMode::Fixed(Method::Chc),
    WalkMode::Auto,
];

/// What `auto` chooses from.
const AUTO: [Method; 6] = [
    Method::Plain(Mode::None),
    Method::Plain(Mode::Frustum),
    Method::Plain(Mode::Portals),
    Method::Plain(Mode::Pvs),
    Method::Plain(Mode::Both),
    Method::ChcPlus,
];

/// What was decided for a frame.
#[derive(Clone, Debug)]
pub struct Decision {
    /// How.
    pub method: Method,
    /// To draw, whatever the device says; of a method that asks it, what is certain.
    pub objects: Vec<ObjectId>,
    /// The device decides about more: the plan of [`Culling::late`].
    pub asks_device: bool,
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

/// Decides.
pub struct Culling<'b> {
    /// Whose doors open and shut.
    pub culler: Culler,
    /// What the device is asked.
    pub late: Late,
    /// Who is asked.
    pub oracle: Oracle,
    /// The last decision.
    pub last: Option<Decision>,
    building: &'b Building,
    size: [u32; 2],
    scratch: Scratch,
    online: OnlineCuller,
    depth: Option<DepthBuffer<'b>>,
    auto: Auto,
    /// The frame whose cost `auto` waits for, and its triangles.
    judged: Option<u64>,
}

impl<'b> Culling<'b> {
    /// For pictures of `size` pixels.
    pub fn new(building: &'b Building, oracle: Oracle, size: [u32; 2]) -> Self {
        let culler = Culler::new(&building.file);
        Self {
            late: Late::new(&building.file),
            oracle,
            last: None,
            building,
            size,
            scratch: Scratch::for_culler(&culler),
            online: OnlineCuller::new(&culler),
            // Made before it is asked: it looks at every triangle of the scene.
            depth: (oracle == Oracle::Software).then(|| depth(building, size)),
            auto: Auto::new(culler.cell_count(), &AUTO),
            judged: None,
            culler,
        }
    }

    /// Pictures have another size from now on.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.size = size;
        self.depth = None;
    }

    /// The cell that a point is in, metres relative to the origin.
    pub fn cell_of(&mut self, point: glam::Vec3) -> Option<CellId> {
        self.culler.cell_of(point, &mut self.scratch)
    }

    /// Decides a frame, with a near plane at `near` metres.
    pub fn decide(&mut self, frame: u64, camera: &Camera, near: f64, mode: WalkMode) -> &Decision {
        let start = Instant::now();
        // 1. How.
        let method = match mode {
            WalkMode::Fixed(method) => method,
            WalkMode::Auto => self.choose(frame, camera),
        };
        // 2. What.
        let asks_device = method.asks() && self.oracle == Oracle::Device;
        let visible = match method {
            Method::Plain(mode) => self.culler.cull(camera, mode, &mut self.scratch),
            _ if asks_device => self.culler.cull(camera, Mode::Both, &mut self.scratch),
            method => {
                let depth = self.depth.get_or_insert_with(|| depth(self.building, self.size));
                depth.begin(&camera.view(near));
                self.online.cull(&self.culler, camera, near, method, depth)
            }
        };
        let mut decision = Decision {
            method,
            objects: visible.objects.to_vec(),
            asks_device,
            camera: *camera,
            cells: visible.cells.to_vec(),
            portals: visible.portals.to_vec(),
            home: visible.home,
            stats: visible.stats,
            ms: 0.0,
        };
        // 3. What to ask the device.
        if asks_device {
            self.late.plan(camera, &decision.objects, queries::MOST);
            decision.objects.clone_from(&self.late.sure);
            let triangles = decision.objects.iter().map(|&o| u64::from(self.culler.triangles(o))).sum();
            let (objects, queries) = (decision.objects.len() as u64, self.late.questions.len() as u64);
            decision.stats = FrameStats { objects, triangles, queries, ..decision.stats };
        }
        decision.ms = start.elapsed().as_secs_f64() * 1e3;
        self.last.insert(decision)
    }

    /// What a frame cost, milliseconds, and how many triangles it drew: for `auto`, which learns from the frames that it waits for.
    pub fn learn(&mut self, frame: u64, ms: f64, triangles: u64) {
        if self.judged == Some(frame) {
            self.auto.learn(ms, triangles + self.pixels());
            self.judged = None;
        }
    }

    /// A frame's cost may come some frames late; until it does, the method stays.
    fn choose(&mut self, frame: u64, camera: &Camera) -> Method {
        if let (Some(_), Some(last)) = (self.judged, &self.last) {
            return last.method;
        }
        if frame <= WARM_UP {
            return Method::Plain(Mode::Both);
        }
        let home = self.culler.cell_of(camera.eye, &mut self.scratch);
        let pixels = self.pixels();
        let (culler, scratch) = (&self.culler, &mut self.scratch);
        self.judged = Some(frame);
        self.auto.choose(home, |mode| culler.cull(camera, mode, scratch).stats.triangles + pixels)
    }

    /// What the pixels of a frame cost, in triangles.
    fn pixels(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1]) / PIXELS
    }

    /// As if no frame had been drawn yet.
    pub fn restart(&mut self) {
        self.last = None;
        self.judged = None;
        self.online = OnlineCuller::new(&self.culler);
        self.late = Late::new(&self.building.file);
        self.auto = Auto::new(self.culler.cell_count(), &AUTO);
    }
}

fn depth(building: &Building, [width, height]: [u32; 2]) -> DepthBuffer<'_> {
    DepthBuffer::new(&building.scene, width as usize, height as usize)
}
