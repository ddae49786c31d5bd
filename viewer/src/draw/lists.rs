//! Before the passes of a frame: culling, then lists of objects, leaves and tubes, then uploads.

use super::draws::Draws;
use super::frame::{FrameContext, FrameRequest, Passes, candidates};
use super::ground::Look;
use super::hiz::Hiz;
use super::leaves::{Drawn, Leaves};
use super::mesh::{Mesh, Runs};
use super::pipelines::NEAR;
use super::renderer::Renderer;
use crate::culling::{Asks, Oracle};
use crate::looks::Detail;
use enfilade::gpu::{Gpu, GpuError};
use enfilade::{CellId, ObjectId};
use wgpu::{BufferUsages, TextureView};

/// Lists of a frame, and of everything.
pub struct DrawLists {
    /// Runs of what is certain to be drawn, unless that is everything.
    pub certain: Runs,
    /// Everything is certain to be drawn.
    pub is_whole: bool,
    /// Culling left no object out.
    pub has_all: bool,
    /// The runs in a buffer.
    pub draws: Draws,
    /// Leaves of the doors that the frame shows.
    pub leaves: Drawn,
    doors: Vec<usize>,
    /// Cells that the frame reaches, in order.
    reached: Vec<CellId>,
    /// Runs of all objects.
    pub everything: Runs,
    /// Leaves of all doors.
    pub all_leaves: Drawn,
    /// How many objects there are.
    pub objects: usize,
}

impl DrawLists {
    /// For a scene and its doors.
    pub fn new(gpu: &Gpu, mesh: &Mesh, is_transparent: &[bool], leaves: &Leaves, doors: usize) -> Self {
        let objects = is_transparent.len();
        let all: Vec<ObjectId> = (0..objects as u32).map(ObjectId).collect();
        let (mut everything, mut all_leaves) = (Runs::default(), Drawn::default());
        everything.set(mesh, &all, is_transparent, None);
        leaves.list(&(0..doors).collect::<Vec<_>>(), &mut all_leaves);
        Self {
            certain: Runs::default(),
            is_whole: false,
            has_all: false,
            draws: Draws::new(gpu, objects, BufferUsages::COPY_DST),
            leaves: Drawn::default(),
            doors: Vec::new(),
            reached: Vec::new(),
            everything,
            all_leaves,
            objects,
        }
    }
}

impl<'b> Renderer<'b> {
    /// Decides what to draw, if the request has a camera that culls.
    pub(super) fn cull(&mut self, request: &FrameRequest<'_>) -> Result<(), GpuError> {
        let Some(camera) = &request.culled_by else { return Ok(()) };
        // The software depth buffer knows the middles of pixels only, and the device their samples.
        self.culling.oracle = if self.detail == Detail::Smooth { Oracle::Device } else { self.oracle };
        self.culling.decide(self.frame, camera, f64::from(NEAR), request.mode);
        let Some(decision) = &mut self.culling.last else { return Ok(()) };
        if let Some(terrain) = &mut self.terrain {
            terrain.select(decision, &self.building.file, self.targets.size);
        }
        if decision.asks == Asks::Pyramid {
            let hiz = match &mut self.passes.hiz {
                Some(hiz) => hiz,
                None => self.passes.hiz.insert(Hiz::new(&self.gpu, self.building)?),
            };
            decision.leave_to_device(&self.building.file, |object| hiz.asks_about(object));
        }
        Ok(())
    }

    /// Lists what was decided.
    pub(super) fn list(&mut self, request: &FrameRequest<'_>) {
        let Self { gpu, mesh, is_transparent, lists, culling, passes, hidden, .. } = self;
        let Some(decision) = &culling.last else { return };
        // 1. Objects.
        let certain = match &mut passes.hiz {
            Some(hiz) if decision.asks == Asks::Pyramid => {
                hiz.list(gpu, (mesh, is_transparent), decision, request.camera.eye)
            }
            _ => &decision.objects,
        };
        lists.has_all = decision.objects.len() == lists.objects;
        lists.is_whole = certain.len() == lists.objects;
        if !lists.is_whole {
            lists.certain.set(mesh, certain, is_transparent, Some(request.camera.eye));
        }
        let everything = if hidden.is_any { &hidden.shown } else { &lists.everything };
        let runs = if lists.is_whole { everything } else { &lists.certain };
        lists.draws.set(gpu, &runs.solid, &runs.transparent);
        // 2. Leaves of doors.
        self.doors.seen(decision, &mut lists.reached, &mut lists.doors);
        self.leaves.list(&lists.doors, &mut lists.leaves);
        // 3. Tubes. All that queries decide about is drawn: their answers cannot choose bands.
        let Some(tubes) = &mut self.tubes else { return };
        let has_queries = request.culled_by.is_some() && decision.asks == Asks::Queries;
        let is_shown = |o: ObjectId| !mesh.is_hidden(o);
        let objects = candidates(decision, &culling.delayed, has_queries).filter(|o| is_shown(*o));
        let at = (&request.camera, self.targets.size);
        let all: Option<&dyn Fn(ObjectId) -> bool> = if request.alarm { Some(&is_shown) } else { None };
        tubes.select(gpu, &self.building.scene, at, objects, all);
        if self.shows_culled && !lists.has_all {
            tubes.select_culled(gpu, &self.building.scene, at, &decision.objects);
        }
    }

    /// Writes cameras, leaves and ground to the device, and reflects the camera in the mirrors.
    pub(super) fn upload(&mut self, request: &FrameRequest<'_>) {
        let section = self.section.map(|section| (section.n.as_vec3(), section.d as f32));
        self.eye.set(&self.gpu, &request.camera, section);
        self.leaves.update(&self.gpu, self.building, &mut self.doors);
        if request.mirrors {
            self.passes.mirrors.look(self.culling.view.doors(), &request.camera);
        }
        if let Some(terrain) = &mut self.terrain {
            let look = if self.detail == Detail::Plain { Look::Plain } else { Look::Full };
            terrain.prepare(&self.gpu, &request.camera, look, self.targets.size, request.alarm);
        }
        let timed = request.timed;
        self.passes.timer.iter_mut().for_each(|timer| timer.start(timed));
        self.cap(request.camera.eye.as_dvec3());
    }

    /// The context and the passes; `None` before the first decision.
    pub(super) fn context<'f>(
        &'f mut self,
        request: &'f FrameRequest<'_>,
        picture: &'f TextureView,
    ) -> Option<(FrameContext<'f>, &'f mut Passes)> {
        let is_full = self.detail != Detail::Plain && self.passes.full.is_some();
        let has_mirrors = request.mirrors && !self.passes.mirrors.is_empty();
        let context = FrameContext {
            gpu: &self.gpu,
            building: self.building,
            pipelines: &self.pipelines,
            mesh: &self.mesh,
            is_transparent: &self.is_transparent,
            targets: &self.targets,
            picture,
            camera: request.camera,
            eye: &self.eye,
            decision: self.culling.last.as_ref()?,
            delayed: &self.culling.delayed,
            doors: &self.doors,
            leaves: &self.leaves,
            lists: &self.lists,
            hidden: &self.hidden,
            terrain: self.terrain.as_ref(),
            tubes: self.tubes.as_ref(),
            overlay: request.overlay,
            // A section would cut them, too.
            bodies: self.people.as_ref().filter(|_| self.section.is_none()).map(|people| &people.bodies),
            section: self.section,
            marking: self.marking,
            is_full,
            // The alarm compares one sample a pixel, and caps cover one.
            is_smooth: self.detail == Detail::Smooth && !request.alarm && self.section.is_none(),
            alarm: request.alarm,
            shows_culled: self.shows_culled,
            has_mirrors,
            is_new: request.culled_by.is_some(),
            number: self.frame,
        };
        Some((context, &mut self.passes))
    }
}
