//! A frame: [`Renderer::frame`] culls, lists and uploads, then records `PASSES` over one `FrameContext`.

use super::alarm::Alarm;
use super::caps::Caps;
use super::culled::Culled;
use super::full::Full;
use super::hidden::Hidden;
use super::hiz::Hiz;
use super::leaves::Leaves;
use super::lines::{Lines, Overlay};
use super::lists::DrawLists;
use super::marks::{Marking, Marks};
use super::mesh::{Mesh, Runs};
use super::mirror::Mirrors;
use super::pass::begin_flat;
use super::pipelines::{CameraBinding, Pipelines};
use super::queries::Queries;
use super::renderer::Renderer;
use super::slice::Section;
use super::targets::Targets;
use super::timer::Timer;
use super::tubes::TubeRenderer;
use super::{alarm, caps, certain, culled, decided, full, lines, marks, mirror};
use crate::building::Building;
use crate::culling::{Asks, Decision};
use crate::delayed_queries::DelayedQueries;
use crate::doors::Doors;
use crate::draw::ground::Terrain;
use crate::mode::ViewMode;
use enfilade::ObjectId;
use enfilade::gpu::{Gpu, GpuError};
use enfilade::runtime::Camera;
use wgpu::{CommandEncoder, TextureView};

/// A frame to draw.
pub struct FrameRequest<'w> {
    /// The camera that draws.
    pub camera: Camera,
    /// The camera that culls; `None` keeps the last decision.
    pub culled_by: Option<Camera>,
    /// How to cull.
    pub mode: ViewMode,
    /// Compare with a picture of everything.
    pub alarm: bool,
    /// Measure the device's time.
    pub timed: bool,
    /// Lines and faces over the scene.
    pub overlay: &'w Overlay,
    /// Draw the mirrors.
    pub mirrors: bool,
}

/// Nothing over the scene.
static NO_OVERLAY: Overlay = Overlay::new();

impl FrameRequest<'_> {
    /// A frame that is culled and drawn by one camera, with nothing over the scene.
    pub fn new(camera: Camera, mode: impl Into<ViewMode>) -> Self {
        Self {
            camera,
            culled_by: Some(camera),
            mode: mode.into(),
            alarm: false,
            timed: false,
            overlay: &NO_OVERLAY,
            mirrors: false,
        }
    }
}

/// Paints the interface, last of all.
pub trait Painter {
    /// Uploads, before any pass.
    fn prepare(&mut self, gpu: &Gpu, commands: &mut CommandEncoder);
    /// Draws, in a pass without depth.
    fn paint(&mut self, pass: wgpu::RenderPass<'static>);
}

/// The state that all passes of a frame read.
pub struct FrameContext<'f> {
    /// The device.
    pub gpu: &'f Gpu,
    /// The building.
    pub building: &'f Building,
    /// Pipelines of flat colours and items.
    pub pipelines: &'f Pipelines,
    /// Ranges of corners by object.
    pub mesh: &'f Mesh,
    /// By object: whether it is drawn as a screen: glass.
    pub is_transparent: &'f [bool],
    /// Render targets.
    pub targets: &'f Targets,
    /// The picture.
    pub picture: &'f TextureView,
    /// The camera that draws.
    pub camera: Camera,
    /// The same on the device.
    pub eye: &'f CameraBinding,
    /// The decision of the culling.
    pub decision: &'f Decision,
    /// Queries of the device.
    pub delayed: &'f DelayedQueries,
    /// Doors.
    pub doors: &'f Doors,
    /// Leaves of doors.
    pub leaves: &'f Leaves,
    /// The lists of the frame.
    pub lists: &'f DrawLists,
    /// Objects hidden by hand.
    pub hidden: &'f Hidden,
    /// Ground.
    pub terrain: Option<&'f Terrain>,
    /// Tubes.
    pub tubes: Option<&'f TubeRenderer>,
    /// Lines and faces over the scene.
    pub overlay: &'f Overlay,
    /// Bodies of people.
    pub bodies: Option<&'f Overlay>,
    /// The plane that cuts.
    pub section: Option<Section>,
    /// How triangles are told apart.
    pub marking: Marking,
    /// The scene is drawn with materials and light.
    pub is_full: bool,
    /// The scene has several samples a pixel.
    pub is_smooth: bool,
    /// The alarm is on.
    pub alarm: bool,
    /// Show culled objects.
    pub shows_culled: bool,
    /// Mirrors are drawn.
    pub has_mirrors: bool,
    /// The frame was culled anew.
    pub is_new: bool,
    /// The frame's number.
    pub number: u64,
}

impl FrameContext<'_> {
    /// Whether occlusion queries of the device decide a part of this frame.
    pub fn has_queries(&self) -> bool {
        self.is_new && self.decision.asks == Asks::Queries && !self.delayed.questions.is_empty()
    }

    /// Whether the frame is culled by a depth pyramid on the device.
    pub fn is_by_pyramid(&self) -> bool {
        self.decision.asks == Asks::Pyramid
    }

    /// Whether the device decides a part of this frame.
    pub fn is_decided_by_device(&self) -> bool {
        self.has_queries() || self.is_new && self.is_by_pyramid()
    }

    /// Objects that may be drawn: those that are certain, and those that queries decide about.
    pub fn candidates(&self) -> impl Iterator<Item = ObjectId> + Clone {
        candidates(self.decision, self.delayed, self.has_queries())
    }

    /// Runs of all objects that are not hidden by hand.
    pub fn shown(&self) -> &Runs {
        if self.hidden.is_any { &self.hidden.shown } else { &self.lists.everything }
    }

    /// Runs of what is certain to be drawn.
    pub fn certain(&self) -> &Runs {
        // All objects are in order already.
        if self.lists.is_whole { self.shown() } else { &self.lists.certain }
    }

    /// Whether lines or mirrors are drawn over the scene.
    pub fn has_overlay(&self) -> bool {
        self.has_mirrors || !self.overlay.is_empty() || self.bodies.is_some()
    }
}

/// See [`FrameContext::candidates`].
pub(super) fn candidates<'d>(
    decision: &'d Decision,
    delayed: &'d DelayedQueries,
    has_queries: bool,
) -> impl Iterator<Item = ObjectId> + Clone + use<'d> {
    let asked = if has_queries { &delayed.conditional[..] } else { &[] };
    decision.objects.iter().copied().chain(asked.iter().map(|(_, object)| *object))
}

/// State of the passes.
pub struct Passes {
    /// Materials and light; made when they are first drawn.
    pub full: Option<Full>,
    /// Kinds of triangles; made when they are first told apart.
    pub marks: Option<Marks>,
    /// The missed-pixel alarm.
    pub alarm: Alarm,
    /// Caps of sections; made when they are first seen.
    pub caps: Option<Caps>,
    /// Culled objects.
    pub culled: Culled,
    /// Lines and faces over the scene.
    pub lines: Lines,
    /// Mirrors.
    pub mirrors: Mirrors,
    /// Occlusion queries.
    pub queries: Queries,
    /// The depth pyramid; made when a frame is first culled by it.
    pub hiz: Option<Hiz>,
    /// Device time.
    pub timer: Option<Timer>,
}

/// Passes whose begin or end may be timed, in order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Timed {
    /// Objects that are certain to be drawn.
    Certain,
    /// Objects that the device decides about.
    Decided,
    /// Over the scene.
    Overlay,
}

impl Passes {
    /// Time stamps of a pass: a frame is timed from its first pass to its last.
    pub fn stamps(&self, frame: &FrameContext<'_>, pass: Timed) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let last = match (frame.has_overlay(), frame.is_decided_by_device()) {
            (true, _) => Timed::Overlay,
            (false, true) => Timed::Decided,
            (false, false) => Timed::Certain,
        };
        self.timer.as_ref()?.stamps(pass == Timed::Certain, pass == last)
    }

    /// Materials and light, if this frame has them.
    pub fn full(&self, frame: &FrameContext<'_>) -> Option<&Full> {
        self.full.as_ref().filter(|_| frame.is_full)
    }

    /// The depth pyramid, if it decides this frame.
    pub fn hiz(&self, frame: &FrameContext<'_>) -> Option<&Hiz> {
        self.hiz.as_ref().filter(|_| frame.is_by_pyramid())
    }

    fn map(&mut self) {
        self.queries.map();
        self.alarm.map();
        self.hiz.iter_mut().for_each(Hiz::map);
        self.marks.iter_mut().for_each(Marks::map);
        self.timer.iter_mut().for_each(Timer::map);
    }
}

/// Records a part of a frame.
type Pass = fn(&FrameContext<'_>, &mut Passes, &mut CommandEncoder);

/// The passes of a frame, in order. Each returns at once in a frame that does not need it.
const PASSES: [Pass; 10] = [
    full::prepare,
    mirror::reflect,
    certain::draw,
    decided::draw,
    caps::draw,
    full::finish,
    marks::draw,
    culled::draw,
    alarm::compare,
    lines::draw,
];

impl Renderer<'_> {
    /// Draws a frame on `picture`, which has the size and format of the renderer.
    ///
    /// # Errors
    ///
    /// The device has failed.
    pub fn frame(
        &mut self,
        request: FrameRequest<'_>,
        picture: &TextureView,
        mut painter: Option<&mut dyn Painter>,
    ) -> Result<(), GpuError> {
        self.frame += 1;
        self.gpu.check()?;
        // 1. Answers, times and counts of earlier frames, without waiting.
        self.gpu.device.poll(wgpu::PollType::Poll).map_err(|e| self.gpu.fail(&e.to_string()))?;
        self.collect();
        // 2. Culling, and lists of what is drawn.
        let is_new = request.culled_by.is_some();
        self.cull(&request)?;
        if self.culling.last.is_none() {
            return Ok(());
        }
        self.list(&request);
        if let Some(people) = &mut self.people {
            people.see(&mut self.culling);
        }
        self.upload(&request);
        // 3. Passes.
        let mut commands = self.gpu.device.create_command_encoder(&Default::default());
        if let Some(painter) = &mut painter {
            painter.prepare(&self.gpu, &mut commands);
        }
        let Some((frame, passes)) = self.context(&request, picture) else { return Ok(()) };
        PASSES.iter().for_each(|pass| pass(&frame, passes, &mut commands));
        if let Some(painter) = painter {
            painter.paint(begin_flat(&mut commands, picture, None).forget_lifetime());
        }
        passes.timer.iter_mut().for_each(|timer| timer.resolve(&mut commands));
        frame.gpu.queue.submit([commands.finish()]);
        passes.map();
        if !request.alarm {
            self.readback.missed = None;
        }
        // 4. Tiles of the ground for the next frame; a frozen frame keeps its tiles.
        if let Some(terrain) = self.terrain.as_mut().filter(|_| is_new) {
            terrain.load(&self.gpu, self.targets.size);
        }
        Ok(())
    }
}
