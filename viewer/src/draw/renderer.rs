//! A device with a building on it: what it draws, and how. [`super::frame`] draws a frame.

use super::alarm::{Alarm, Missed};
use super::caps::Caps;
use super::culled::Culled;
use super::frame::Passes;
use super::full::Full;
use super::ground::Terrain;
use super::hidden::Hidden;
use super::hiz::Hiz;
use super::leaves::Leaves;
use super::lines::Lines;
use super::lists::DrawLists;
use super::marks::{Marked, Marking, Marks};
use super::mesh::Mesh;
use super::mirror::Mirrors;
use super::pipelines::{CameraBinding, Pipelines};
use super::queries::Queries;
use super::slice::Section;
use super::targets::Targets;
use super::timer::Timer;
use super::tubes::TubeRenderer;
use crate::building::Building;
use crate::culling::{ByDevice, Culling, Oracle};
use crate::doors::Doors;
use crate::ground::{Land, Shown};
use crate::looks::Detail;
use crate::people::People;
use enfilade::ObjectId;
use enfilade::gpu::{Gpu, GpuError};
use glam::DVec3;
use wgpu::TextureFormat;

/// Answers of the device, of the last frame or of earlier ones.
#[derive(Clone, Debug, Default)]
pub struct Readback {
    /// The device's milliseconds.
    pub device_ms: Option<f64>,
    /// Objects and triangles that the device decided to draw.
    pub conditional: ByDevice,
    /// Missed pixels, while the alarm is on.
    pub missed: Option<Missed>,
    /// Kinds of triangles, while they are told apart.
    pub marked: Option<Marked>,
}

/// A second way to cull the frames of a renderer, with all that it keeps: see [`Renderer::swap`].
pub struct CullState<'b> {
    /// Decides.
    pub culling: Culling<'b>,
    /// Answers to its frames.
    pub readback: Readback,
    queries: Queries,
    hiz: Option<Hiz>,
    marks: Option<Marks>,
    shown: Shown,
}

/// A device with a building on it.
pub struct Renderer<'b> {
    /// The device.
    pub gpu: Gpu,
    /// Decides what is drawn.
    pub culling: Culling<'b>,
    /// Doors. Call [`Self::doors_changed`] after a change.
    pub doors: Doors,
    /// By object: whether it is drawn as a screen: glass.
    pub is_transparent: Vec<bool>,
    /// Answers of the device.
    pub readback: Readback,
    /// Counts frames, from 1.
    pub frame: u64,
    /// Pipelines of flat colours and items.
    pub pipelines: Pipelines,
    /// Ranges of corners by object.
    pub mesh: Mesh,
    /// Render targets.
    pub targets: Targets,
    /// Format of pictures.
    pub format: TextureFormat,
    /// Ground, if there is one.
    pub terrain: Option<Terrain>,
    /// Tubes, if there are any.
    pub tubes: Option<TubeRenderer>,
    /// People, if they are shown.
    pub people: Option<People>,
    /// Show culled objects.
    pub shows_culled: bool,
    pub(super) building: &'b Building,
    pub(super) passes: Passes,
    pub(super) lists: DrawLists,
    pub(super) leaves: Leaves,
    pub(super) hidden: Hidden,
    pub(super) eye: CameraBinding,
    pub(super) detail: Detail,
    /// Answers queries if pixels have one sample.
    pub(super) oracle: Oracle,
    pub(super) marking: Marking,
    pub(super) section: Option<Section>,
    /// Caps are those of what is drawn now.
    is_capped: bool,
}

impl<'b> Renderer<'b> {
    /// Puts a building on a device; pictures are of `size` pixels and `format`.
    ///
    /// # Errors
    ///
    /// One line: it does not fit.
    pub fn new(
        gpu: Gpu,
        building: &'b Building,
        oracle: Oracle,
        size: [u32; 2],
        format: TextureFormat,
    ) -> Result<Self, String> {
        let scene = &building.scene;
        let mut culling = Culling::new(building, oracle, size);
        let doors = Doors::new(building, &culling.culler);
        doors.tell(&mut culling.view);
        let (mesh, triangles) = Mesh::new(scene, &doors.is_leaf)?;
        let pipelines = Pipelines::new(&gpu, &triangles, scene, format).map_err(|e| e.to_string())?;
        let is_transparent: Vec<bool> = scene.objects.iter().map(|o| o.glass).collect();
        let leaves = Leaves::new(&gpu, &pipelines, &doors, &mesh);
        let passes = Passes {
            full: None,
            marks: None,
            alarm: Alarm::new(&gpu, scene.objects.len(), format),
            caps: None,
            culled: Culled::new(&gpu, format),
            lines: Lines::new(&gpu, &pipelines, format),
            mirrors: Mirrors::new(&gpu, &pipelines, &culling.culler, format),
            queries: Queries::new(&gpu, &pipelines, scene.objects.len()),
            hiz: None,
            timer: Timer::new(&gpu),
        };
        let renderer = Self {
            tubes: TubeRenderer::new(&gpu, &pipelines, building, format).map_err(|e| e.to_string())?,
            lists: DrawLists::new(&gpu, &mesh, &is_transparent, &leaves, doors.doors.len()),
            targets: Targets::new(&gpu, size),
            eye: pipelines.eye(&gpu),
            readback: Readback::default(),
            frame: 0,
            terrain: None,
            people: None,
            shows_culled: false,
            hidden: Hidden::default(),
            detail: Detail::Plain,
            marking: Marking::Off,
            section: None,
            is_capped: false,
            culling,
            doors,
            is_transparent,
            passes,
            leaves,
            building,
            format,
            oracle,
            mesh,
            pipelines,
            gpu,
        };
        renderer.gpu.check().map_err(|e| e.to_string())?;
        Ok(renderer)
    }

    /// Pictures are of another size from now on.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.targets = Targets::new(&self.gpu, size);
        self.culling.resize(size);
    }

    /// Forgets all earlier frames.
    pub fn restart(&mut self) {
        self.culling.restart();
        self.passes.hiz.iter_mut().for_each(Hiz::restart);
        self.passes.timer.iter_mut().for_each(Timer::restart);
        self.readback = Readback::default();
    }

    /// Puts the building on a ground.
    ///
    /// # Errors
    ///
    /// One line: it does not fit on the device.
    pub fn set_ground(&mut self, mut land: Land) -> Result<(), String> {
        land.enter(&self.building.file);
        // Its item comes after those of objects and of leaves without an object.
        let item = self.lists.objects as u32 + 2;
        self.terrain = Some(Terrain::new(&self.gpu, land, self.format, item, self.building.file.origin)?);
        self.gpu.check().map_err(|e| e.to_string())
    }

    /// Gives objects their colours.
    pub fn paint(&self, colours: Vec<[u8; 3]>) {
        self.pipelines.paint(&self.gpu, &colours);
    }

    /// Draws in this detail from now on.
    ///
    /// # Errors
    ///
    /// One line: its buffers do not fit; the detail stays as it was.
    pub fn set_detail(&mut self, detail: Detail) -> Result<(), String> {
        if detail != Detail::Plain && self.passes.full.is_none() {
            let (mesh, is_leaf) = ((&self.mesh, self.tubes.as_ref()), &self.doors.is_leaf);
            let full = Full::new(&self.gpu, &self.pipelines, mesh, self.building, is_leaf, self.format);
            self.passes.full = Some(full.map_err(|e| e.to_string())?);
        }
        if let Some(full) = &mut self.passes.full {
            full.set_cut(&self.gpu, &self.pipelines, self.section.is_some());
        }
        self.detail = detail;
        Ok(())
    }

    /// Tells triangles apart by their kind from now on, or no longer.
    ///
    /// # Errors
    ///
    /// One line: its buffers do not fit; nothing changes.
    pub fn set_marking(&mut self, marking: Marking) -> Result<(), String> {
        if marking == Marking::Off {
            (self.passes.marks, self.readback.marked) = (None, None);
        } else if self.passes.marks.is_none() {
            let marks = Marks::new(&self.gpu, &self.pipelines, &self.mesh, self.format);
            self.passes.marks = Some(marks.map_err(|e| e.to_string())?);
        }
        self.marking = marking;
        Ok(())
    }

    /// Whether triangles are told apart.
    pub fn marking(&self) -> Marking {
        self.marking
    }

    /// A second way to cull.
    pub fn cull_state(&self) -> CullState<'b> {
        let mut culling = self.culling.another(self.targets.size);
        self.doors.tell(&mut culling.view);
        let queries = Queries::new(&self.gpu, &self.pipelines, self.building.scene.objects.len());
        CullState { culling, readback: Readback::default(), queries, hiz: None, marks: None, shown: Shown::default() }
    }

    /// Exchanges the way to cull with a second one.
    pub fn swap(&mut self, other: &mut CullState<'b>) {
        std::mem::swap(&mut self.culling, &mut other.culling);
        std::mem::swap(&mut self.readback, &mut other.readback);
        std::mem::swap(&mut self.passes.queries, &mut other.queries);
        std::mem::swap(&mut self.passes.hiz, &mut other.hiz);
        std::mem::swap(&mut self.passes.marks, &mut other.marks);
        if let Some(terrain) = &mut self.terrain {
            std::mem::swap(&mut terrain.shown, &mut other.shown);
        }
    }

    /// Triangles of the last frame that was told apart, by kind in the order of [`super::marks::KINDS`].
    pub fn kinds(&self) -> Option<[u64; 3]> {
        self.readback.marked.as_ref().map(|marked| self.kinds_of(marked))
    }

    /// The same of any frame.
    pub fn kinds_of(&self, marked: &Marked) -> [u64; 3] {
        let runs = if self.hidden.is_any { &self.hidden.shown } else { &self.lists.everything };
        let kinds = runs.solid.iter().chain(&runs.transparent).map(|run| marked.triangles(run));
        kinds.fold([0; 3], |sum, kinds| [0, 1, 2].map(|kind| sum[kind] + kinds[kind]))
    }

    /// Draws only one side of a plane from now on, with caps on the cut; `None`: everything. Culling ignores it.
    pub fn set_section(&mut self, section: Option<Section>) {
        if section == self.section {
            return;
        }
        (self.section, self.is_capped) = (section, false);
        self.pipelines.set_cut(&self.gpu, section.is_some());
        if let Some(full) = &mut self.passes.full {
            full.set_cut(&self.gpu, &self.pipelines, section.is_some());
        }
    }

    /// Shows people from now on, or no longer.
    pub fn set_people(&mut self, are_shown: bool) {
        if !are_shown {
            self.people = None;
        } else if self.people.is_none() {
            self.people = Some(People::new(&self.building.file, &self.culling.culler));
        }
    }

    /// Whether a point is cut away.
    pub fn is_cut_away(&self, p: DVec3) -> bool {
        self.section.is_some_and(|section| section.before(p) < 0.0)
    }

    /// Makes caps if they are seen and something has changed.
    pub(super) fn cap(&mut self, eye: DVec3) {
        let Some(section) = self.section.filter(|section| section.before(eye) < 0.0 && !self.is_capped) else { return };
        self.is_capped = true;
        let caps = self.passes.caps.get_or_insert_with(|| Caps::new(&self.gpu, &self.pipelines, self.format));
        let is_hidden = |door: usize| self.leaves.is_hidden.get(door).is_some_and(|&hidden| hidden);
        caps.cut(&self.gpu, &section, &self.building.scene, &self.mesh, (&self.doors, &is_hidden));
    }

    /// The mirrors.
    pub fn mirrors(&mut self) -> (&mut Mirrors, &Gpu, &Pipelines) {
        (&mut self.passes.mirrors, &self.gpu, &self.pipelines)
    }

    /// Hides the objects for which `is_hidden`, and leaves that no object of the model has if `and_made`. Culling and walking ignore it.
    pub fn hide(&mut self, is_hidden: Vec<bool>, and_made: bool) {
        let (mesh, leaves) = (&mut self.mesh, &mut self.leaves);
        self.is_capped = false;
        self.hidden = Hidden::new(mesh, leaves, &self.doors, &self.is_transparent, is_hidden, and_made);
        // Hidden objects cast no shadow.
        self.passes.full.iter_mut().for_each(Full::doors_moved);
        self.passes.marks.iter_mut().for_each(Marks::forget);
    }

    /// Whether an object is hidden.
    pub fn is_hidden(&self, object: ObjectId) -> bool {
        self.mesh.is_hidden(object)
    }

    /// Whether the leaves of a door are hidden.
    pub fn is_door_hidden(&self, door: usize) -> bool {
        self.leaves.is_hidden.get(door).is_some_and(|&hidden| hidden)
    }

    /// [`Self::doors`] were opened, shut or moved.
    pub fn doors_changed(&mut self) {
        self.is_capped = false;
        self.passes.full.iter_mut().for_each(Full::doors_moved);
        self.doors.tell(&mut self.culling.view);
    }

    /// Waits for the device and reads all answers.
    ///
    /// # Errors
    ///
    /// The device has failed.
    pub fn settle(&mut self) -> Result<(), GpuError> {
        let idle = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
        idle.map_err(|e| self.gpu.fail(&e.to_string()))?;
        self.collect();
        self.gpu.check()
    }

    /// Triangles of the last frame, as far as is known.
    pub fn triangles(&self) -> u64 {
        self.drawn().triangles
    }

    /// Objects and triangles of the last frame, as far as is known.
    pub fn drawn(&self) -> ByDevice {
        self.culling.last.as_ref().map_or(ByDevice::default(), |d| d.drawn(self.readback.conditional))
    }

    /// Reads the answers that have arrived.
    pub(super) fn collect(&mut self) {
        let Passes { queries, hiz, alarm, marks, timer, .. } = &mut self.passes;
        let by_queries = queries.receive(&mut self.culling.delayed);
        let by_pyramid = hiz.as_mut().and_then(Hiz::receive);
        self.readback.conditional = by_queries.or(by_pyramid).unwrap_or(self.readback.conditional);
        while let Some(missed) = alarm.receive() {
            self.readback.missed = Some(missed);
        }
        while let Some(marked) = marks.as_mut().and_then(Marks::receive) {
            self.readback.marked = Some(marked);
        }
        while let Some(ms) = timer.as_mut().and_then(Timer::receive) {
            self.readback.device_ms = Some(ms);
        }
    }
}
