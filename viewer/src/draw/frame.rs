//! A frame, from top to bottom: [`Stage::frame`].

use super::alarm::{Alarm, Missed};
use super::caps::Caps;
use super::culled::Culled;
use super::draws::Draws;
use super::full::Full;
use super::ground::{Look, Terrain};
use super::hidden::Hidden;
use super::hiz::Hiz;
use super::leaves::{Drawn, Leaves};
use super::lines::{Lines, Overlay};
use super::marks::{Marked, Marking, Marks, Picked};
use super::mesh::{Mesh, Runs};
use super::mirror::Mirrors;
use super::pipelines::{Eye, NEAR, Pipelines};
use super::queries::Queries;
use super::slice::Section;
use super::targets::Targets;
use super::timer::Timer;
use super::tubes::Pipes;
use crate::building::Building;
use crate::culling::{Asks, ByDevice, Culling, Oracle};
use crate::doors::Doors;
use crate::ground::{Land, Shown};
use crate::looks::Detail;
use crate::mode::ViewMode;
use enfilade::gpu::{Gpu, GpuError};
use enfilade::runtime::Camera;
use enfilade::{CellId, ObjectId};
use glam::DVec3;
use wgpu::{BufferUsages, LoadOp, Operations, StoreOp, TextureFormat, TextureView};

/// Where nothing is.
const SKY: wgpu::Color = wgpu::Color { r: 0.80, g: 0.87, b: 0.94, a: 1.0 };

/// What a frame is asked to be.
pub struct Wish<'w> {
    /// Draws.
    pub camera: Camera,
    /// Culls; `None` leaves what was decided last as it is.
    pub culled_by: Option<Camera>,
    /// How to cull.
    pub mode: ViewMode,
    /// Compare with a picture of everything.
    pub alarm: bool,
    /// Time the device; the times come later.
    pub timed: bool,
    /// What is drawn over the scene.
    pub overlay: &'w Overlay,
    /// What it shows in mirrors, if there are any.
    pub mirrors: Option<&'w mut Mirrors>,
}

/// What paints the interface, last of all.
pub trait Painter {
    /// Uploads; before any pass.
    fn prepare(&mut self, gpu: &Gpu, commands: &mut wgpu::CommandEncoder);
    /// Draws, in a pass without depth.
    fn paint(&mut self, pass: wgpu::RenderPass<'static>);
}

/// What is heard of frames, the last one or those before it.
#[derive(Clone, Debug, Default)]
pub struct Heard {
    /// The device's milliseconds.
    pub device_ms: Option<f64>,
    /// What the device drew of what it decides.
    pub conditional: ByDevice,
    /// What was missed, while the alarm is on.
    pub missed: Option<Missed>,
    /// Which triangles are seen and which are drawn, while they are told apart.
    pub marked: Option<Marked>,
}

/// Another way to cull the frames of a stage, with all that it keeps: see [`Stage::swap`].
pub struct Side<'b> {
    /// Who decides.
    pub culling: Culling<'b>,
    /// News of its frames.
    pub heard: Heard,
    queries: Queries,
    hiz: Option<Hiz>,
    marks: Option<Marks>,
    shown: Shown,
}

/// A device with a building on it.
pub struct Stage<'b> {
    /// The device.
    pub gpu: Gpu,
    /// Who decides what is drawn.
    pub culling: Culling<'b>,
    /// Doors. [`Self::doors_changed`] says that they were opened, shut or moved.
    pub doors: Doors,
    /// By object: whether it is drawn as a screen that is seen through: glass.
    pub is_ghost: Vec<bool>,
    /// News of frames.
    pub heard: Heard,
    /// Counts frames, from 1.
    pub frame: u64,
    /// Ways to draw.
    pub pipelines: Pipelines,
    /// Corners.
    pub mesh: Mesh,
    /// What is drawn of a frame.
    pub targets: Targets,
    /// Ground, if there is one.
    pub terrain: Option<Terrain>,
    /// Tubes, if there are any.
    pub pipes: Option<Pipes>,
    building: &'b Building,
    format: TextureFormat,
    /// Made when it is first asked for.
    full: Option<Full>,
    detail: Detail,
    /// Who answers where pixels have one sample.
    oracle: Oracle,
    marking: Marking,
    /// Made when it is first asked for.
    marks: Option<Marks>,
    /// What was culled is shown.
    pub shows_culled: bool,
    culled: Culled,
    eye: Eye,
    alarm: Alarm,
    lines: Lines,
    queries: Queries,
    /// Made when it is first asked for.
    hiz: Option<Hiz>,
    timer: Option<Timer>,
    leaves: Leaves,
    /// Doors that are drawn in this frame, and their leaves.
    seen: (Vec<usize>, Drawn),
    /// The cells that this frame reaches, in order.
    reached: Vec<CellId>,
    runs: Runs,
    /// The runs of this frame.
    draws: Draws,
    everything: Runs,
    all_leaves: Drawn,
    hidden: Hidden,
    section: Option<Section>,
    /// Made when they are first wanted.
    caps: Option<Caps>,
    /// Whether caps are those of what is drawn now.
    is_capped: bool,
    all: Vec<ObjectId>,
    /// The frame that the device is timed for.
    timing: Option<u64>,
}

impl<'b> Stage<'b> {
    /// Puts a building on a device; pictures are of `size` pixels and `format`.
    ///
    /// # Errors
    ///
    /// One line: it doesn't fit.
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
        doors.tell(&mut culling.culler);
        let (mesh, triangles) = Mesh::new(scene, &doors.is_leaf)?;
        let pipelines = Pipelines::new(&gpu, &triangles, scene, format).map_err(|e| e.to_string())?;
        let is_ghost: Vec<bool> = scene.objects.iter().map(|o| o.glass).collect();
        let leaves = Leaves::new(&gpu, &pipelines, &doors, &mesh);
        let all: Vec<ObjectId> = (0..scene.objects.len() as u32).map(ObjectId).collect();
        let (mut everything, mut all_leaves) = (Runs::default(), Drawn::default());
        everything.set(&mesh, &all, &is_ghost, None);
        leaves.list(&(0..doors.doors.len()).collect::<Vec<_>>(), &mut all_leaves);
        let stage = Self {
            pipes: Pipes::new(&gpu, &pipelines, building, format).map_err(|e| e.to_string())?,
            culling,
            doors,
            is_ghost,
            heard: Heard::default(),
            frame: 0,
            targets: Targets::new(&gpu, size),
            eye: pipelines.eye(&gpu),
            alarm: Alarm::new(&gpu, scene.objects.len(), format),
            lines: Lines::new(&gpu, &pipelines, format),
            queries: Queries::new(&gpu, &pipelines, scene.objects.len()),
            hiz: None,
            timer: Timer::new(&gpu),
            leaves,
            seen: Default::default(),
            reached: Vec::new(),
            runs: Runs::default(),
            draws: Draws::new(&gpu, scene.objects.len(), BufferUsages::COPY_DST),
            everything,
            all_leaves,
            hidden: Hidden::default(),
            section: None,
            caps: None,
            is_capped: false,
            all,
            timing: None,
            terrain: None,
            building,
            format,
            full: None,
            detail: Detail::Plain,
            oracle,
            marking: Marking::Off,
            marks: None,
            shows_culled: false,
            culled: Culled::new(&gpu, format),
            mesh,
            pipelines,
            gpu,
        };
        stage.gpu.check().map_err(|e| e.to_string())?;
        Ok(stage)
    }

    /// Pictures are of another size from now on.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.targets = Targets::new(&self.gpu, size);
        self.culling.resize(size);
    }

    /// As if no frame had been drawn yet.
    pub fn restart(&mut self) {
        self.culling.restart();
        self.hiz.iter_mut().for_each(Hiz::restart);
        self.heard = Heard::default();
        self.timing = None;
    }

    /// Puts the building on a ground.
    ///
    /// # Errors
    ///
    /// One line: it doesn't fit on the device.
    pub fn set_ground(&mut self, mut land: Land) -> Result<(), String> {
        land.enter(&self.building.file);
        // After the objects and what was made.
        let item = self.all.len() as u32 + 2;
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
    /// One line: what it takes doesn't fit; the detail stays as it was.
    pub fn set_detail(&mut self, detail: Detail) -> Result<(), String> {
        if detail != Detail::Plain && self.full.is_none() {
            let (mesh, is_leaf) = ((&self.mesh, self.pipes.as_ref()), &self.doors.is_leaf);
            let full = Full::new(&self.gpu, &self.pipelines, mesh, self.building, is_leaf, self.format);
            self.full = Some(full.map_err(|e| e.to_string())?);
        }
        if let Some(full) = &mut self.full {
            full.set_cut(&self.gpu, &self.pipelines, self.section.is_some());
        }
        self.detail = detail;
        Ok(())
    }

    /// Tells triangles apart by their kind from now on, or no longer.
    ///
    /// # Errors
    ///
    /// One line: what it takes doesn't fit; nothing changes.
    pub fn set_marking(&mut self, marking: Marking) -> Result<(), String> {
        if marking == Marking::Off {
            (self.marks, self.heard.marked) = (None, None);
        } else if self.marks.is_none() {
            let marks = Marks::new(&self.gpu, &self.pipelines, &self.mesh, self.format);
            self.marks = Some(marks.map_err(|e| e.to_string())?);
        }
        self.marking = marking;
        Ok(())
    }

    /// Whether triangles are told apart.
    pub fn marking(&self) -> Marking {
        self.marking
    }

    /// Another way to cull, from now on.
    pub fn side(&self) -> Side<'b> {
        let mut culling = Culling::new(self.building, self.culling.oracle, self.targets.size);
        self.doors.tell(&mut culling.culler);
        let queries = Queries::new(&self.gpu, &self.pipelines, self.building.scene.objects.len());
        Side { culling, heard: Heard::default(), queries, hiz: None, marks: None, shown: Shown::default() }
    }

    /// Changes the way to cull for another one, which keeps this one meanwhile.
    pub fn swap(&mut self, side: &mut Side<'b>) {
        std::mem::swap(&mut self.culling, &mut side.culling);
        std::mem::swap(&mut self.heard, &mut side.heard);
        std::mem::swap(&mut self.queries, &mut side.queries);
        std::mem::swap(&mut self.hiz, &mut side.hiz);
        std::mem::swap(&mut self.marks, &mut side.marks);
        if let Some(terrain) = &mut self.terrain {
            std::mem::swap(&mut terrain.shown, &mut side.shown);
        }
    }

    /// How many triangles of the last frame that was told apart are of each kind, in the order of [`super::marks::KINDS`].
    pub fn kinds(&self) -> Option<[u64; 3]> {
        self.heard.marked.as_ref().map(|marked| self.kinds_of(marked))
    }

    /// The same of any frame.
    pub fn kinds_of(&self, marked: &Marked) -> [u64; 3] {
        let Runs { solid, ghosts, .. } = if self.hidden.is_any { &self.hidden.shown } else { &self.everything };
        let kinds = solid.iter().chain(ghosts).map(|run| marked.triangles(run));
        kinds.fold([0; 3], |sum, kinds| [0, 1, 2].map(|kind| sum[kind] + kinds[kind]))
    }

    /// Draws only what is before a plane from now on, with caps on what it cuts; `None`: all. Culling knows nothing of it.
    pub fn set_section(&mut self, section: Option<Section>) {
        if section == self.section {
            return;
        }
        (self.section, self.is_capped) = (section, false);
        self.pipelines.set_cut(&self.gpu, section.is_some());
        if let Some(full) = &mut self.full {
            full.set_cut(&self.gpu, &self.pipelines, section.is_some());
        }
    }

    /// Whether a point is cut away.
    pub fn is_cut_away(&self, p: DVec3) -> bool {
        self.section.is_some_and(|section| section.before(p) < 0.0)
    }

    /// Works caps out, if they are seen and something has changed.
    fn cap(&mut self, eye: DVec3) {
        let Some(section) = self.section.filter(|section| section.before(eye) < 0.0 && !self.is_capped) else { return };
        self.is_capped = true;
        let caps = self.caps.get_or_insert_with(|| Caps::new(&self.gpu, &self.pipelines, self.format));
        let leaves = &self.leaves;
        let is_hidden = |door: usize| leaves.is_hidden.get(door).is_some_and(|&hidden| hidden);
        caps.cut(&self.gpu, &section, &self.building.scene, &self.mesh, (&self.doors, &is_hidden));
    }

    /// Leaves out the objects for which `is_hidden`, and leaves that were made where `and_made`. Culling and walking know nothing of it.
    pub fn hide(&mut self, is_hidden: Vec<bool>, and_made: bool) {
        let (mesh, leaves) = (&mut self.mesh, &mut self.leaves);
        self.is_capped = false;
        self.hidden = Hidden::new(mesh, leaves, &self.doors, &self.is_ghost, is_hidden, and_made);
        // What isn't drawn casts no shadow.
        self.full.iter_mut().for_each(Full::doors_moved);
        self.marks.iter_mut().for_each(Marks::forget);
    }

    /// Whether an object is left out.
    pub fn is_hidden(&self, object: ObjectId) -> bool {
        self.mesh.is_hidden(object)
    }

    /// Whether the leaves of a door are left out.
    pub fn is_door_hidden(&self, door: usize) -> bool {
        self.leaves.is_hidden.get(door).is_some_and(|&hidden| hidden)
    }

    /// [`Self::doors`] were opened, shut or moved.
    pub fn doors_changed(&mut self) {
        self.is_capped = false;
        self.full.iter_mut().for_each(Full::doors_moved);
        self.doors.tell(&mut self.culling.culler);
    }

    /// Draws a frame on `picture`, which has the size and format of the stage.
    ///
    /// # Errors
    ///
    /// The device has failed.
    #[expect(clippy::too_many_lines, reason = "to be a list of passes, a file each")]
    pub fn frame(
        &mut self,
        mut wish: Wish<'_>,
        picture: &TextureView,
        painter: Option<&mut dyn Painter>,
    ) -> Result<(), GpuError> {
        self.frame += 1;
        let gpu = &self.gpu;
        gpu.check()?;

        // 1. What has come of earlier frames: answers, times, counts. Nothing is waited for.
        gpu.device.poll(wgpu::PollType::Poll).map_err(|e| gpu.fail(&e.to_string()))?;
        self.hear();
        self.cap(wish.camera.eye.as_dvec3());
        let gpu = &self.gpu;

        // 2. What is worth drawing.
        let is_new = wish.culled_by.is_some();
        if let Some(camera) = &wish.culled_by {
            // A depth buffer knows the middles of pixels, and the device the samples.
            self.culling.oracle = if self.detail == Detail::Smooth { Oracle::Device } else { self.oracle };
            self.culling.decide(self.frame, camera, f64::from(NEAR), wish.mode);
        }
        if let (true, Some(terrain), Some(decision)) = (is_new, &mut self.terrain, &mut self.culling.last) {
            terrain.select(decision, &self.building.file, self.targets.size);
        }
        if let (true, Some(decision)) = (is_new, self.culling.last.as_mut().filter(|d| d.asks == Asks::Pyramid)) {
            let hiz = match &mut self.hiz {
                Some(hiz) => hiz,
                None => self.hiz.insert(Hiz::new(gpu, self.building)?),
            };
            decision.leave_to_device(&self.building.file, |object| hiz.asks_about(object));
        }
        let Some(decision) = &self.culling.last else { return Ok(()) };
        let mut hiz = self.hiz.as_mut().filter(|_| decision.asks == Asks::Pyramid);
        let certain = match &mut hiz {
            Some(hiz) => hiz.list(gpu, (&self.mesh, &self.is_ghost), decision, wish.camera.eye),
            None => &decision.objects,
        };
        let is_all = decision.objects.len() == self.all.len();
        let is_ordered = certain.len() == self.all.len();
        if !is_ordered {
            self.runs.set(&self.mesh, certain, &self.is_ghost, Some(wish.camera.eye));
        }
        // What is all is in order already.
        let everything = if self.hidden.is_any { &self.hidden.shown } else { &self.everything };
        let runs = if is_ordered { everything } else { &self.runs };
        self.draws.set(&self.gpu, &runs.solid, &runs.ghosts);
        self.doors.seen(decision, &mut self.reached, &mut self.seen.0);
        self.leaves.list(&self.seen.0, &mut self.seen.1);
        let asks = is_new && decision.asks == Asks::Queries && !self.culling.late.questions.is_empty();
        if let Some(pipes) = &mut self.pipes {
            // What the device is asked about is drawn: its answers can't choose bands.
            let asked = if asks { &self.culling.late.conditional[..] } else { &[] };
            let objects = decision.objects.iter().copied().chain(asked.iter().map(|(_, object)| *object));
            let is_shown = |o: ObjectId| !self.mesh.is_hidden(o);
            let at = (&wish.camera, self.targets.size);
            let all: Option<&dyn Fn(ObjectId) -> bool> = if wish.alarm { Some(&is_shown) } else { None };
            pipes.select(gpu, &self.building.scene, at, objects.filter(|o| is_shown(*o)), all);
            if self.shows_culled && !is_all {
                pipes.select_culled(gpu, &self.building.scene, at, &decision.objects);
            }
        }

        // 3. What needs no pass: cameras, uploads, pictures in mirrors.
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        self.eye.set(gpu, &wish.camera, self.section.map(|section| (section.n.as_vec3(), section.d as f32)));
        self.leaves.update(gpu, self.building, &mut self.doors);
        let mut painter = painter;
        if let Some(painter) = &mut painter {
            painter.prepare(gpu, &mut commands);
        }
        let mut full = self.full.as_mut().filter(|_| self.detail != Detail::Plain);
        if let Some(full) = &mut full {
            // What the alarm compares, and what caps cover, is one sample a pixel.
            let is_smooth = self.detail == Detail::Smooth && !wish.alarm && self.section.is_none();
            full.set_smooth(gpu, &self.pipelines, self.targets.size, is_smooth);
            let asked = if asks { &self.culling.late.conditional[..] } else { &[] };
            let objects = decision.objects.iter().copied().chain(asked.iter().map(|(_, object)| *object));
            let seen_through = objects.filter(|o| self.is_ghost[o.index()]);
            let all_leaves = if self.hidden.is_any { &self.hidden.shown_leaves } else { &self.all_leaves };
            let leaves = (&self.leaves, all_leaves);
            full.prepare(
                gpu,
                &self.pipelines,
                (&self.mesh, &self.building.scene, self.pipes.as_ref()),
                &self.is_ghost,
                leaves,
                seen_through,
                wish.camera.eye,
                &mut commands,
            );
        }
        if let Some(mirrors) = wish.mirrors.as_mut().filter(|mirrors| !mirrors.is_empty()) {
            full.iter_mut().for_each(|full| full.make_cut(gpu, &self.pipelines));
            let (leaves, size) = ((&self.leaves, &self.doors), self.targets.size);
            let tubes = self.pipes.as_ref().map(|pipes| (pipes, &*self.building.scene));
            let scene = (&self.mesh, full.as_deref(), tubes);
            mirrors.record(gpu, &self.pipelines, scene, &self.is_ghost, leaves, size, &mut commands);
        }
        if let Some(terrain) = &mut self.terrain {
            let look = if full.is_some() { Look::Full } else { Look::Plain };
            terrain.prepare(gpu, &wish.camera, look, self.targets.size, wish.alarm);
        }
        let timing = if wish.timed && self.timing.is_none() {
            self.timer.as_mut().and_then(|timer| timer.start(self.frame))
        } else {
            None
        };
        let has_overlay = !wish.overlay.is_empty() || wish.mirrors.as_ref().is_some_and(|m| !m.is_empty());
        let decides = asks || hiz.is_some() && is_new;
        let last = if has_overlay { 2 } else { usize::from(decides) };
        let stamps = |pass: usize| {
            let (timer, slot) = (self.timer.as_ref()?, timing?);
            match (pass == 0, pass == last) {
                (true, true) => Some(timer.both(slot)),
                (true, false) => Some(timer.writes(slot, false)),
                (false, true) => Some(timer.writes(slot, true)),
                (false, false) => None,
            }
        };

        // 4. What is certain, and what showed in the frame before.
        if let Some(hiz) = &mut hiz {
            hiz.choose(gpu, &wish.camera, self.targets.size, !is_new, &mut commands);
        }
        let target = || (picture, &self.targets);
        let mut pass = begin_on(full.as_deref(), &mut commands, target(), Some(SKY), stamps(0));
        match &full {
            Some(full) => full.draw(&mut pass, &self.eye, &self.draws, (&self.leaves, &self.seen.1)),
            None => {
                self.pipelines.bind(&mut pass, &self.eye);
                self.pipelines.colours.draw_listed(&mut pass, &self.draws);
                self.leaves.draw(&mut pass, &self.eye, &self.pipelines.colours, &self.seen.1);
            }
        }
        if let Some(hiz) = &hiz {
            draw_decided(&mut pass, full.as_deref(), (&self.pipelines, &self.eye), &hiz.passes[0]);
        }
        if let Some(terrain) = &self.terrain {
            terrain.draw(&mut pass, full.as_ref().and_then(|full| full.smooth()).is_some());
        }
        // Thin ones are blended: after all that is behind them.
        if hiz.is_none() || !is_new {
            draw_tubes(&mut pass, full.as_deref(), self.pipes.as_ref(), &self.eye);
        }
        drop(pass);

        // 5. What the device decides: questions about the rest, or a pyramid; and what the answers say.
        let (mut answers, mut drawn) = (None, None);
        if decides {
            let (late, mesh) = (&self.culling.late, &self.mesh);
            let smooth = full.as_ref().and_then(|full| full.smooth());
            let depth = smooth.map_or((&self.targets.depth, false), |smooth| (&smooth.depth, true));
            match &mut hiz {
                Some(hiz) => drawn = hiz.choose_rest(gpu, depth, &mut commands),
                None => answers = self.queries.record(gpu, late, mesh, &self.is_ghost, &self.eye, depth, &mut commands),
            }
            let draws = hiz.as_ref().map_or(&self.queries.draws, |hiz| &hiz.passes[1]);
            let mut pass = begin_on(full.as_deref(), &mut commands, target(), None, stamps(1));
            draw_decided(&mut pass, full.as_deref(), (&self.pipelines, &self.eye), draws);
            if hiz.is_some() {
                draw_tubes(&mut pass, full.as_deref(), self.pipes.as_ref(), &self.eye);
            }
        }

        // 6. Caps, where the eye is on the side that is cut away.
        let is_capped = self.section.is_some_and(|section| section.before(wish.camera.eye.as_dvec3()) < 0.0);
        if let Some(caps) = self.caps.as_mut().filter(|_| is_capped) {
            caps.record(gpu, &self.eye, &self.targets, picture, &mut commands);
        }

        // 7. How it looks, by its depth: sky, shade and edges; then glass.
        if let Some(full) = full {
            let leaves = (&self.leaves, &self.seen.1, self.pipes.as_ref().map(|pipes| &pipes.drawn));
            full.finish(gpu, &self.eye, &wish, leaves, &self.targets, picture, &mut commands);
        }

        // 8. Which of its triangles are seen, and what was culled.
        let mut marked = None;
        if let Some(marks) = self.marks.as_mut().filter(|_| self.marking != Marking::Off) {
            let decided = hiz.as_ref().map_or((&self.queries.draws, asks), |hiz| (&hiz.both, true));
            let leaves = (&self.leaves, &self.seen.1);
            let tubes = self.pipes.as_ref();
            let picked = Picked { runs, draws: &self.draws, everything, leaves, tubes, decided };
            let (pipelines, targets, camera) = (&self.pipelines, &self.targets, &decision.camera);
            marked = marks.record(gpu, pipelines, decision.frame, camera, &picked, targets, picture, &mut commands);
            if self.marking == Marking::Coloured {
                marks.tint(gpu, pipelines, &self.eye, &picked, targets, picture, &mut commands);
            }
        }
        if self.shows_culled && !is_all {
            let mesh = (&self.mesh, self.pipes.as_ref());
            let (pipelines, eye, targets) = (&self.pipelines, &self.eye, &self.targets);
            self.culled.record(gpu, pipelines, eye, mesh, &decision.objects, targets, picture, &mut commands);
        }

        // 9. What there is, held against it.
        let mut counts = None;
        if wish.alarm {
            if self.hidden.is_any {
                self.hidden.stand_in(&self.pipelines, &self.eye, &self.targets, &self.leaves, &mut commands);
            }
            if let Some(pipes) = &self.pipes {
                pipes.stand_in(&self.eye, &self.targets, &mut commands);
            }
            let everything = [&self.everything.solid[..], &self.everything.ghosts];
            let (pipelines, eye, targets) = (&self.pipelines, &self.eye, &self.targets);
            let (terrain, pipes) = (self.terrain.as_ref(), self.pipes.as_ref());
            let (leaves, frame) = ((&self.leaves, &self.all_leaves, terrain, pipes), self.frame);
            counts = self.alarm.record(gpu, pipelines, eye, targets, picture, everything, leaves, frame, &mut commands);
        }

        // 10. Over it: mirrors, portals, frusta; then the interface.
        if has_overlay {
            let mut pass = begin(&mut commands, picture, &self.targets.depth, None, stamps(2));
            if let Some(mirrors) = &wish.mirrors {
                mirrors.draw(&mut pass, &self.eye);
            }
            self.lines.draw(gpu, &mut pass, &self.eye, wish.overlay);
        }
        if let Some(painter) = painter {
            let pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[colour(picture, None)],
                ..Default::default()
            });
            painter.paint(pass.forget_lifetime());
        }

        // 11. Off it goes; what is read back is asked for, to be heard some frames later.
        if let (Some(timer), Some(slot)) = (&self.timer, timing) {
            timer.resolve(slot, &mut commands);
        }
        gpu.queue.submit([commands.finish()]);
        answers.into_iter().for_each(|slot| self.queries.ask(slot));
        hiz.iter().zip(drawn).for_each(|(hiz, slot)| hiz.ask(slot));
        counts.into_iter().for_each(|slot| self.alarm.ask(slot));
        if let (Some(marks), Some(slot)) = (&self.marks, marked) {
            marks.ask(slot);
        }
        if let (Some(timer), Some(slot)) = (&self.timer, timing) {
            timer.ask(slot);
            self.timing = Some(self.frame);
        }
        if !wish.alarm {
            self.heard.missed = None;
        }

        // 12. Tiles for the next frame; a frozen one keeps those that it has.
        if let Some(terrain) = self.terrain.as_mut().filter(|_| is_new) {
            terrain.load(&self.gpu, self.targets.size);
        }
        Ok(())
    }

    /// Waits for the device, and hears of everything.
    ///
    /// # Errors
    ///
    /// The device has failed.
    pub fn settle(&mut self) -> Result<(), GpuError> {
        let idle = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
        idle.map_err(|e| self.gpu.fail(&e.to_string()))?;
        self.hear();
        self.gpu.check()
    }

    /// Triangles of the last frame, as far as is known.
    pub fn triangles(&self) -> u64 {
        self.drawn().triangles
    }

    /// What the last frame drew, as far as is known.
    pub fn drawn(&self) -> ByDevice {
        self.culling.last.as_ref().map_or(ByDevice::default(), |d| d.drawn(self.heard.conditional))
    }

    fn hear(&mut self) {
        let by_queries = self.queries.heard(&mut self.culling.late);
        let by_pyramid = self.hiz.as_mut().and_then(Hiz::heard);
        self.heard.conditional = by_queries.or(by_pyramid).unwrap_or(self.heard.conditional);
        while let Some(missed) = self.alarm.heard() {
            self.heard.missed = Some(missed);
        }
        while let Some(marked) = self.marks.as_mut().and_then(Marks::heard) {
            self.heard.marked = Some(marked);
        }
        let Some(timer) = &mut self.timer else { return };
        timer.heard(|frame, ms| {
            self.heard.device_ms = Some(ms);
            self.timing.take_if(|timed| *timed == frame);
        });
    }
}

/// Draws what the device decided to draw.
fn draw_decided(pass: &mut wgpu::RenderPass<'_>, full: Option<&Full>, (pipelines, eye): (&Pipelines, &Eye), draws: &Draws) {
    match full {
        Some(full) => full.draw_decided(pass, eye, draws),
        None => {
            pipelines.bind(pass, eye);
            pipelines.colours.draw_listed(pass, draws);
        }
    }
}

fn draw_tubes(pass: &mut wgpu::RenderPass<'_>, full: Option<&Full>, pipes: Option<&Pipes>, eye: &Eye) {
    match (pipes, full) {
        (Some(pipes), Some(full)) => full.draw_tubes(pass, eye, &pipes.drawn, full.smooth().is_some()),
        (Some(pipes), None) => pipes.draw(pass, eye, &pipes.drawn),
        (None, _) => {}
    }
}

/// A pass over the scene, with the samples that it has as it looks.
fn begin_on<'e>(
    full: Option<&Full>,
    commands: &'e mut wgpu::CommandEncoder,
    (picture, targets): (&TextureView, &Targets),
    clear: Option<wgpu::Color>,
    stamps: Option<wgpu::RenderPassTimestampWrites<'_>>,
) -> wgpu::RenderPass<'e> {
    match full.and_then(Full::smooth) {
        Some(smooth) => smooth.begin(commands, clear, None, stamps),
        None => begin(commands, picture, &targets.depth, clear, stamps),
    }
}

/// A pass over the scene; `clear`: it is the first.
pub(super) fn begin<'e>(
    commands: &'e mut wgpu::CommandEncoder,
    picture: &TextureView,
    depth: &TextureView,
    clear: Option<wgpu::Color>,
    stamps: Option<wgpu::RenderPassTimestampWrites<'_>>,
) -> wgpu::RenderPass<'e> {
    let load = if clear.is_some() { LoadOp::Clear(0.0) } else { LoadOp::Load };
    commands.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[colour(picture, clear)],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(Operations { load, store: StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes: stamps,
        ..Default::default()
    })
}

/// What is drawn on; `clear`: for the first time.
pub fn colour(view: &TextureView, clear: Option<wgpu::Color>) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    let load = clear.map_or(LoadOp::Load, LoadOp::Clear);
    let ops = Operations { load, store: StoreOp::Store };
    Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
}
