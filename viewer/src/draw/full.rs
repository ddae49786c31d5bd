//! The scene as it looks, in place of flat colours: materials, pictures, the sun and its shadows, shade in corners, edges, glass.
//!
//! What is drawn of a pixel depends on what is seen there and on nothing that culling decides: shadows are cast by everything, shade and
//! edges come from the depth of the picture, and glass is sorted by where it is. So pictures are the same in every mode.

use super::draws::Draws;
use super::frame::{FrameContext, Passes};
use super::geometry::Geometry;
use super::leaves::{Drawn, Leaves};
use super::mesh::Mesh;
use super::pass::begin;
use super::pipelines::{CameraBinding, PipelineDesc, Pipelines, depth_state, shader};
use super::shade::Shade;
use super::smooth::{SAMPLES, Smooth};
use super::sun::Sun;
use super::surfaces::{self, Surfaces};
use super::tubes::{List, TubeRenderer};
use super::tubes_full::TubesInSun;
use crate::building::Building;
use crate::looks::{SKY, Surface};
use enfilade::ObjectId;
use enfilade::gpu::{Gpu, GpuError};
use glam::Vec3;
use std::ops::Range;
use wgpu::{BlendState, BufferUsages, CommandEncoder, CompareFunction, TextureFormat};

/// How objects that may be seen through are drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    /// As a picture with holes.
    Masked,
    /// Blended.
    Glass,
}

/// Pipelines for what the scene is made of.
struct MaterialPipelines {
    /// Depth of solid things, so that each pixel is shaded once.
    depth: wgpu::RenderPipeline,
    solid: wgpu::RenderPipeline,
    masked: wgpu::RenderPipeline,
    glass: wgpu::RenderPipeline,
    screen_depth: wgpu::RenderPipeline,
}

/// The shader.
pub(super) const FULL: &str = concat!(include_str!("geometry.wgsl"), include_str!("full.wgsl"));
/// Entry points of what nothing cuts.
const NAMES: [&str; 6] = ["lit", "nothing", "solid", "masked", "glass", "screen_depth"];

/// Pipelines and targets for several samples a pixel.
struct Many {
    materials: MaterialPipelines,
    sky: wgpu::RenderPipeline,
    smooth: Smooth,
}

/// Draws a scene with materials and light.
pub struct Full {
    materials: MaterialPipelines,
    /// Pipelines that cut at a plane: for sections and mirrors. Made when they are first needed.
    cut: Option<MaterialPipelines>,
    is_cut: bool,
    /// Made when it is first wanted.
    many: Option<Many>,
    /// Whether this frame has several samples a pixel.
    is_smooth: bool,
    sky: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    format: TextureFormat,
    group: wgpu::BindGroup,
    /// The scene's, with what they are made of.
    triangles: wgpu::BindGroup,
    sun: Sun,
    tubes: Option<TubesInSun>,
    shade: Shade,
    kinds: Vec<Kind>,
    /// By object: whether the sky is seen through it. That casts no shadow.
    is_sky: Vec<bool>,
    middles: Vec<Vec3>,
    sorted: Sorted,
    /// Pictures with holes, and glass.
    seen_through: Draws,
}

/// Transparent objects of a frame, by how they are drawn.
#[derive(Default)]
struct Sorted {
    masked: Vec<Range<u32>>,
    /// Far ones first.
    glass: Vec<Range<u32>>,
    keys: Vec<(f32, ObjectId)>,
}

impl MaterialPipelines {
    /// Entry points: of corners, then of pixels in the order of the fields.
    fn new(
        gpu: &Gpu,
        groups: &[Option<&wgpu::BindGroupLayout>],
        module: &wgpu::ShaderModule,
        (format, samples): (TextureFormat, u32),
        [corner, depth, solid, masked, glass, screen_depth]: [&str; 6],
    ) -> Self {
        let pipeline = |fragment, target: wgpu::ColorTargetState, writes, compare| {
            PipelineDesc {
                groups,
                depth: Some(depth_state(writes, compare)),
                samples,
                pixel: Some((fragment, target)),
                ..PipelineDesc::new(module, corner)
            }
            .pipeline(gpu)
        };
        let plain = || wgpu::ColorTargetState::from(format);
        let blended =
            wgpu::ColorTargetState { format, blend: Some(BlendState::ALPHA_BLENDING), write_mask: wgpu::ColorWrites::COLOR };
        let nothing = || wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::empty() };
        Self {
            depth: pipeline(depth, nothing(), true, CompareFunction::Greater),
            solid: pipeline(solid, plain(), false, CompareFunction::Equal),
            masked: pipeline(masked, plain(), true, CompareFunction::Greater),
            glass: pipeline(glass, blended, false, CompareFunction::Greater),
            screen_depth: pipeline(screen_depth, nothing(), true, CompareFunction::Greater),
        }
    }
}

/// The sky, wherever nothing is drawn.
fn sky_pipeline(
    gpu: &Gpu,
    groups: &[Option<&wgpu::BindGroupLayout>],
    module: &wgpu::ShaderModule,
    format: TextureFormat,
    samples: u32,
) -> wgpu::RenderPipeline {
    PipelineDesc {
        groups,
        depth: Some(depth_state(false, CompareFunction::Equal)),
        samples,
        pixel: Some(("sky_pixel", format.into())),
        ..PipelineDesc::new(module, "everywhere")
    }
    .pipeline(gpu)
}

/// Records shadows if they have changed, and sorts what is transparent.
pub fn prepare(frame: &FrameContext<'_>, passes: &mut Passes, commands: &mut CommandEncoder) {
    let Some(full) = passes.full.as_mut().filter(|_| frame.is_full) else { return };
    full.set_smooth(frame);
    full.cast_shadows(frame, commands);
    let transparent = frame.candidates().filter(|o| frame.is_transparent[o.index()]);
    let mut sorted = std::mem::take(&mut full.sorted);
    full.sort(frame.mesh, transparent, frame.camera.eye, &mut sorted);
    full.seen_through.set(frame.gpu, &sorted.masked, &sorted.glass);
    full.sorted = sorted;
    if frame.has_mirrors {
        full.make_cut(frame.gpu, frame.pipelines);
    }
}

/// Records what follows once everything opaque is drawn: sky, shade and edges, thin tubes, glass.
pub fn finish(frame: &FrameContext<'_>, passes: &mut Passes, commands: &mut CommandEncoder) {
    if let Some(full) = passes.full.as_mut().filter(|_| frame.is_full) {
        full.finish(frame, commands);
    }
}

impl Full {
    /// Puts looks on a device that has the scene.
    ///
    /// # Errors
    ///
    /// Where they don't fit.
    pub fn new(
        gpu: &Gpu,
        pipelines: &Pipelines,
        (mesh, tubes): (&Mesh, Option<&TubeRenderer>),
        building: &Building,
        is_leaf: &[bool],
        format: TextureFormat,
    ) -> Result<Self, GpuError> {
        let Building { scene, looks, .. } = building;
        let sun = Sun::new(gpu, &pipelines.geometry_layout, scene);
        let layout = surfaces::layout(gpu);
        let module = shader(gpu, FULL);
        let groups = [Some(&pipelines.layout), Some(&layout), Some(&pipelines.geometry_layout)];
        let surface = |object: usize| -> &Surface { &looks.surfaces[looks.of_objects[object] as usize] };
        let kind = |object: usize| if surface(object).cutoff > 0.0 { Kind::Masked } else { Kind::Glass };
        let Surfaces { of_triangles, coordinates, first } = Surfaces::new(scene, mesh, looks, is_leaf);
        gpu.fits("texture coordinates", 4 * coordinates.len() as u64)?;
        let filled = |words: &[u32]| gpu.filled(words, BufferUsages::STORAGE);
        let geometry = Geometry {
            made_of: filled(&of_triangles),
            coordinates: filled(&coordinates),
            first_coordinates: filled(&first),
            ..pipelines.geometry.clone()
        };
        let of_tubes = |tubes| TubesInSun::new(gpu, pipelines, tubes, [&layout, &sun.layout], format);
        Ok(Self {
            tubes: tubes.map(of_tubes),
            materials: MaterialPipelines::new(gpu, &groups, &module, (format, 1), NAMES),
            cut: None,
            is_cut: false,
            many: None,
            is_smooth: false,
            format,
            sky: sky_pipeline(gpu, &groups[..2], &module, format, 1),
            group: surfaces::group(gpu, &layout, looks, &sun),
            layout,
            triangles: geometry.group(gpu, &pipelines.geometry_layout),
            sun,
            shade: Shade::new(gpu, scene, format),
            kinds: (0..scene.objects.len()).map(kind).collect(),
            is_sky: (0..scene.objects.len()).map(|o| surface(o).kind == SKY).collect(),
            middles: scene.objects.iter().map(|o| o.bounds.centre().as_vec3()).collect(),
            sorted: Sorted::default(),
            seen_through: Draws::new(gpu, scene.objects.len(), BufferUsages::COPY_DST),
        })
    }

    /// From now on a section cuts what is drawn, or none does. Shadows are those of the whole building.
    pub fn set_cut(&mut self, gpu: &Gpu, pipelines: &Pipelines, is_cut: bool) {
        self.is_cut = is_cut;
        if is_cut {
            self.make_cut(gpu, pipelines);
        }
    }

    /// Makes what mirrors and sections take.
    pub fn make_cut(&mut self, gpu: &Gpu, pipelines: &Pipelines) {
        let groups = [Some(&pipelines.layout), Some(&self.layout), Some(&pipelines.geometry_layout)];
        let format = self.format;
        self.cut.get_or_insert_with(|| {
            let module = shader(
                gpu,
                concat!(include_str!("geometry.wgsl"), include_str!("full.wgsl"), include_str!("full_section.wgsl")),
            );
            let names = ["lit_cut", "nothing_cut", "solid_cut", "masked_cut", "glass_cut", "screen_depth_cut"];
            MaterialPipelines::new(gpu, &groups, &module, (format, 1), names)
        });
    }

    /// Whether this frame has several samples a pixel.
    fn set_smooth(&mut self, frame: &FrameContext<'_>) {
        self.is_smooth = frame.is_smooth;
        let (gpu, size, format) = (frame.gpu, frame.targets.size, self.format);
        if !self.is_smooth || self.many.as_ref().is_some_and(|many| many.smooth.fits(size)) {
            return;
        }
        let smooth = Smooth::new(gpu, size, format);
        if let Some(many) = &mut self.many {
            many.smooth = smooth;
            return;
        }
        let groups = [Some(&frame.pipelines.layout), Some(&self.layout), Some(&frame.pipelines.geometry_layout)];
        let module = shader(gpu, FULL);
        let materials = MaterialPipelines::new(gpu, &groups, &module, (format, SAMPLES), NAMES);
        self.many = Some(Many { materials, sky: sky_pipeline(gpu, &groups[..2], &module, format, SAMPLES), smooth });
    }

    /// Several samples a pixel, if the frame has them.
    pub fn smooth(&self) -> Option<&Smooth> {
        self.many.as_ref().filter(|_| self.is_smooth).map(|many| &many.smooth)
    }

    fn materials(&self) -> &MaterialPipelines {
        match (&self.many, &self.cut) {
            (Some(many), _) if self.is_smooth => &many.materials,
            (_, Some(cut)) if self.is_cut => cut,
            _ => &self.materials,
        }
    }

    /// Objects that cast shadows have changed.
    pub fn doors_moved(&mut self) {
        self.sun.is_new = true;
    }

    /// Draws the depth that the sun sees, if it has changed.
    fn cast_shadows(&mut self, frame: &FrameContext<'_>, commands: &mut CommandEncoder) {
        let FrameContext { gpu, mesh, is_transparent, hidden, lists, .. } = frame;
        let casts = |o: &usize| !is_transparent[*o] && !self.is_sky[*o] && !mesh.is_hidden(ObjectId(*o as u32));
        let casting = (0..is_transparent.len()).filter(casts).map(|o| &mesh.ranges[o]);
        if let (Some(tubes), Some(source), true) = (&mut self.tubes, frame.tubes, self.sun.is_new) {
            let objects = source.objects().filter(|o| !mesh.is_hidden(*o));
            tubes.cast_by(gpu, &frame.building.scene, source, &self.sun.at(), objects);
        }
        let leaves = if hidden.is_any { &hidden.shown_leaves } else { &lists.all_leaves };
        self.sun.cast(frame.pipelines, casting, (frame.leaves, leaves), self.tubes.as_ref(), commands);
    }

    /// Sorts what is seen through, for an eye.
    fn sort(&self, mesh: &Mesh, seen_through: impl Iterator<Item = ObjectId>, eye: Vec3, sorted: &mut Sorted) {
        let Sorted { masked, glass, keys } = sorted;
        keys.clear();
        keys.extend(seen_through.map(|o| (self.middles[o.index()].distance_squared(eye), o)));
        // Far ones first; of those that are as far in the order of their numbers, in every mode.
        keys.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        [&mut *masked, &mut *glass].into_iter().for_each(Vec::clear);
        for &(_, object) in keys.iter() {
            let runs = match self.kinds[object.index()] {
                Kind::Masked => &mut *masked,
                Kind::Glass => &mut *glass,
            };
            runs.push(mesh.drawn(object));
        }
    }

    /// Draws what a mirror shows, without shade and edges, after [`Self::make_cut`]: solid things, leaves of doors, tubes, the sky, then
    /// glass.
    pub fn draw_in_mirror(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        (mirrored, at): (&CameraBinding, Vec3),
        mesh: &Mesh,
        solid: &[Range<u32>],
        seen_through: impl Iterator<Item = ObjectId>,
        leaves: (&Leaves, &Drawn, Option<&List>),
    ) {
        let Some(cut) = &self.cut else { return };
        let mut sorted = Sorted::default();
        self.sort(mesh, seen_through, at, &mut sorted);
        for pipeline in [&cut.depth, &cut.solid] {
            self.bind(pass, mirrored);
            draw(pass, pipeline, solid);
            self.bind_leaves(pass, mirrored, leaves.0);
            draw(pass, pipeline, &leaves.1.solid);
        }
        self.bind(pass, mirrored);
        draw(pass, &cut.masked, &sorted.masked);
        leaves.2.into_iter().for_each(|list| self.draw_tubes(pass, mirrored, list, false));
        pass.set_pipeline(&self.sky);
        pass.draw(0..3, 0..1);
        self.draw_thin(pass, mirrored, leaves.2);
        self.bind(pass, mirrored);
        draw(pass, &cut.glass, &sorted.glass);
        self.bind_leaves(pass, mirrored, leaves.0);
        draw(pass, &cut.glass, &leaves.1.transparent);
    }

    /// Draws tubes that are thinner than a pixel, in a pass of one sample, over all that is solid and has shade.
    fn draw_thin(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, list: Option<&List>) {
        if let (Some(tubes), Some(list)) = (&self.tubes, list) {
            pass.set_bind_group(1, &self.group, &[]);
            tubes.draw_thin(pass, eye, list);
        }
    }

    /// Draws other tubes, in a pass of the frame or of a mirror.
    pub fn draw_tubes(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, list: &List, is_smooth: bool) {
        if let Some(tubes) = &self.tubes {
            pass.set_bind_group(1, &self.group, &[]);
            tubes.draw(pass, eye, list, is_smooth);
        }
    }

    /// Draws opaque objects and leaves of doors, then pictures with holes.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, draws: &Draws, leaves: (&Leaves, &Drawn)) {
        // Depth of all first: only what shows is shaded.
        let materials = self.materials();
        for pipeline in [&materials.depth, &materials.solid] {
            self.bind(pass, eye);
            draws.first(pass, pipeline);
            self.bind_leaves(pass, eye, leaves.0);
            draw(pass, pipeline, &leaves.1.solid);
        }
        self.bind(pass, eye);
        self.seen_through.first(pass, &materials.masked);
    }

    /// Draws the opaque objects that the device decided about.
    pub fn draw_decided(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, draws: &Draws) {
        self.bind(pass, eye);
        let materials = self.materials();
        for pipeline in [&materials.depth, &materials.solid] {
            draws.first(pass, pipeline);
        }
    }

    /// With the alarm on, also the depth of what is transparent, as screens.
    fn finish(&mut self, frame: &FrameContext<'_>, commands: &mut CommandEncoder) {
        let FrameContext { eye, targets, picture, leaves, .. } = *frame;
        let list = frame.tubes.map(|tubes| &tubes.drawn);
        let many = self.many.as_ref().filter(|_| self.is_smooth);
        let (mut pass, sky) = match many {
            Some(many) => (many.smooth.begin(commands, None, Some(picture), None), &many.sky),
            None => (begin(commands, picture, &targets.depth, None, None), &self.sky),
        };
        pass.set_bind_group(0, &eye.group, &[]);
        pass.set_bind_group(1, &self.group, &[]);
        pass.set_pipeline(sky);
        pass.draw(0..3, 0..1);
        drop(pass);
        let smooth = many.map(|many| &many.smooth);
        smooth.into_iter().for_each(|smooth| smooth.settle(targets, picture, commands));
        self.shade.record(frame, smooth, commands);
        let mut pass = begin(commands, picture, &targets.depth, None, None);
        self.draw_thin(&mut pass, eye, list);
        self.bind(&mut pass, eye);
        self.seen_through.second(&mut pass, &self.materials.glass);
        if frame.alarm {
            self.seen_through.second(&mut pass, &self.materials.screen_depth);
            self.seen_through.first(&mut pass, &self.materials.screen_depth);
        }
        self.bind_leaves(&mut pass, eye, leaves);
        draw(&mut pass, &self.materials.glass, &frame.lists.leaves.transparent);
        if frame.alarm {
            draw(&mut pass, &self.materials.screen_depth, &frame.lists.leaves.transparent);
        }
    }

    fn bind_leaves(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, leaves: &Leaves) {
        leaves.bind(pass, eye);
        pass.set_bind_group(1, &self.group, &[]);
    }

    fn bind(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding) {
        pass.set_bind_group(0, &eye.group, &[]);
        pass.set_bind_group(1, &self.group, &[]);
        pass.set_bind_group(2, &self.triangles, &[]);
    }
}

fn draw(pass: &mut wgpu::RenderPass<'_>, pipeline: &wgpu::RenderPipeline, runs: &[Range<u32>]) {
    if !runs.is_empty() {
        pass.set_pipeline(pipeline);
        runs.iter().for_each(|run| pass.draw(run.clone(), 0..1));
    }
}
