//! Flat caps of what a section cuts. The lines in which a plane cuts a thing bound its cap if they close; a fan of triangles over them
//! covers each point as often as they go round it. So counts, summed by blending, tell what is inside, whatever its shape.

use super::bind::{self, COLOUR_TEXTURE, view};
use super::frame::{FrameContext, Passes};
use super::mesh::Mesh;
use super::pass::{begin, begin_flat};
use super::pipelines::{PipelineDesc, Pipelines, depth_state, shader};
use super::slice::{Section, Slice};
use super::targets::view_of;
use crate::doors::Doors;
use enfilade::ObjectId;
use enfilade::gpu::Gpu;
use enfilade::scene::Scene;
use glam::DVec3;
use std::collections::BTreeMap;
use wgpu::{BlendComponent, BlendFactor, BlendState, BufferUsages, CommandEncoder, TextureFormat, TextureView};

/// How often a pixel is inside of something: blended, and exact to 2048.
const COUNTS: TextureFormat = TextureFormat::R16Float;

/// Records caps, if the eye is on the side that is cut away.
pub fn draw(frame: &FrameContext<'_>, passes: &mut Passes, commands: &mut CommandEncoder) {
    let is_seen = frame.section.is_some_and(|section| section.before(frame.camera.eye.as_dvec3()) < 0.0);
    if let Some(caps) = passes.caps.as_mut().filter(|_| is_seen) {
        caps.record(frame, commands);
    }
}

/// Draws caps.
pub struct Caps {
    count: wgpu::RenderPipeline,
    cover: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    counts: Option<([u32; 2], TextureView, wgpu::BindGroup)>,
    /// Corners of fans, then of a rectangle around them.
    corners: Option<wgpu::Buffer>,
    fans: u32,
}

impl Caps {
    /// On pictures of `format`.
    pub fn new(gpu: &Gpu, pipelines: &Pipelines, format: TextureFormat) -> Self {
        let layout = bind::layout(gpu, wgpu::ShaderStages::FRAGMENT, &[COLOUR_TEXTURE]);
        let module = shader(gpu, include_str!("caps.wgsl"));
        let corners = || {
            Some(wgpu::VertexBufferLayout {
                array_stride: 12,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3],
            })
        };
        let sum = BlendComponent {
            src_factor: BlendFactor::One,
            dst_factor: BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let summed = wgpu::ColorTargetState {
            format: COUNTS,
            blend: Some(BlendState { color: sum, alpha: sum }),
            write_mask: wgpu::ColorWrites::RED,
        };
        let count = PipelineDesc {
            groups: &[Some(&pipelines.layout)],
            corners: corners(),
            pixel: Some(("count", summed)),
            ..PipelineDesc::new(&module, "corner")
        }
        .pipeline(gpu);
        let cover = PipelineDesc {
            groups: &[Some(&pipelines.layout), Some(&layout)],
            corners: corners(),
            depth: Some(depth_state(true, wgpu::CompareFunction::Greater)),
            pixel: Some(("cap", format.into())),
            ..PipelineDesc::new(&module, "corner")
        }
        .pipeline(gpu);
        Self { count, cover, layout, counts: None, corners: None, fans: 0 }
    }

    /// Caps of what is drawn of a scene and its doors: not of glass, nor of what is open.
    pub fn cut(
        &mut self,
        gpu: &Gpu,
        section: &Section,
        scene: &Scene,
        mesh: &Mesh,
        doors: (&Doors, &dyn Fn(usize) -> bool),
    ) {
        let fans = fans(section, scene, mesh, doors);
        self.fans = 3 * fans.len() as u32;
        self.corners = None;
        let corners = fans.iter().flatten().copied().chain(around(section, &fans));
        let words: Vec<u32> = corners.flat_map(|p| p.as_vec3().to_array().map(f32::to_bits)).collect();
        if !fans.is_empty() && 4 * words.len() as u64 <= gpu.limits.max_buffer_size {
            self.corners = Some(gpu.filled(&words, BufferUsages::VERTEX));
        }
    }

    fn record(&mut self, frame: &FrameContext<'_>, commands: &mut CommandEncoder) {
        let FrameContext { gpu, eye, targets, .. } = frame;
        let Some(corners) = &self.corners else { return };
        if self.counts.as_ref().is_none_or(|counts| counts.0 != targets.size) {
            let counts = view_of(gpu, targets.size, COUNTS);
            let group = bind::group(gpu, &self.layout, [view(&counts)]);
            self.counts = Some((targets.size, counts, group));
        }
        let Some((_, counts, group)) = &self.counts else { return };
        let mut pass = begin_flat(commands, counts, Some(wgpu::Color::TRANSPARENT));
        pass.set_pipeline(&self.count);
        pass.set_bind_group(0, &eye.group, &[]);
        pass.set_vertex_buffer(0, corners.slice(..));
        pass.draw(0..self.fans, 0..1);
        drop(pass);
        let mut pass = begin(commands, frame.picture, &targets.depth, None, None);
        pass.set_pipeline(&self.cover);
        pass.set_bind_group(0, &eye.group, &[]);
        pass.set_bind_group(1, group, &[]);
        pass.set_vertex_buffer(0, corners.slice(..));
        pass.draw(self.fans..self.fans + 6, 0..1);
    }
}

/// Fans over the caps of everything.
fn fans(
    section: &Section,
    scene: &Scene,
    mesh: &Mesh,
    (doors, is_hidden): (&Doors, &dyn Fn(usize) -> bool),
) -> Vec<[DVec3; 3]> {
    let mut fans = Vec::new();
    let mut parts: BTreeMap<&str, Slice> = BTreeMap::new();
    for (i, object) in (0u32..).zip(&scene.objects).filter(|(_, object)| !object.glass) {
        let reach = [object.bounds.min, object.bounds.max].map(|p| section.n * p);
        let least = reach[0].min(reach[1]).element_sum();
        let most = reach[0].max(reach[1]).element_sum();
        if mesh.is_hidden(ObjectId(i)) || least > section.d || most < section.d {
            continue;
        }
        let mut slice = Slice::default();
        for triangle in object.triangles.clone().filter(|&t| !doors.is_leaf[t as usize]) {
            slice.add(section, scene.corners(triangle as usize));
        }
        if !slice.fan(section.n, &mut fans) {
            // Large meshes are several objects.
            parts.entry(&object.node).or_default().append(slice);
        }
    }
    for slice in parts.values() {
        slice.fan(section.n, &mut fans);
    }
    for (_, door) in doors.doors.iter().enumerate().filter(|(i, _)| !is_hidden(*i)) {
        let mut slice = Slice::default();
        door.drawn()
            .filter(|(_, facet)| facet.is_some_and(|f| !f.glass))
            .for_each(|(corners, _)| slice.add(section, corners));
        slice.fan(section.n, &mut fans);
    }
    fans
}

/// A rectangle in the plane around all of some fans, as two triangles.
fn around(section: &Section, fans: &[[DVec3; 3]]) -> Vec<DVec3> {
    let (across, on) = (section.n.any_orthonormal_vector(), section.n * section.d);
    let up = section.n.cross(across);
    let reach = |axis: DVec3| {
        let at = fans.iter().flatten().map(|p| axis.dot(*p));
        at.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
    };
    let ([a, b], [c, d]) = (reach(across), reach(up));
    let corners = [(a, c), (b, c), (b, d), (a, d)].map(|(x, y)| on + across * x + up * y);
    [0, 1, 2, 0, 2, 3].map(|i: usize| corners[i]).to_vec()
}
