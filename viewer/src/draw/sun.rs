//! The sun: where it stands, and the depth that it sees, which shadows are looked up in.
//!
//! Based on: Williams 1978.

use super::bind::{self, UNIFORM};
use super::full::FULL;
use super::leaves::{Drawn, Leaves};
use super::pass::depth_attachment;
use super::pipelines::{DEPTH, PipelineDesc, Pipelines, depth_state, shader};
use super::targets::view_of;
use super::tubes::{At, Look};
use super::tubes_full::TubesInSun;
use enfilade::gpu::Gpu;
use enfilade::runtime::Camera;
use enfilade::scene::Scene;
use glam::{Mat4, Vec3, Vec4};
use std::ops::Range;
use wgpu::{BufferUsages, CompareFunction, ShaderStages, TextureView};

/// Where it stands, about a unit vector: high, and square to no wall.
pub(super) const TOWARDS: Vec3 = Vec3::new(0.42, 0.78, 0.46);
/// Side of the depth, texels. A building of 40 m has 2 cm a texel. More: software drivers take long. Fewer: windows cast no shapes.
const SIDE: u32 = 2048;
/// Shadows are looked up this many texels before the face. More: shadows leave the foot of what casts them. Fewer: faces shade themselves.
const BEFORE: f32 = 1.8;
/// Tubes are chosen for an eye that is this far away, times the scene's radius: nearer, and what is near to the sun has more sides.
const AWAY: f32 = 100.0;

/// See [`self`].
pub struct Sun {
    /// Its matrix and direction.
    pub uniform: wgpu::Buffer,
    /// Its depth: less is nearer to it.
    pub shadows: TextureView,
    /// Whether that is to be drawn.
    pub is_new: bool,
    /// Layout of its own group.
    pub layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    ball: (Vec3, f32),
}

impl Sun {
    /// Over a scene, whose triangles are bound by `geometry`.
    pub fn new(gpu: &Gpu, geometry: &wgpu::BindGroupLayout, scene: &Scene) -> Self {
        let bounds = scene.bounds();
        let (middle, radius) = (bounds.centre().as_vec3(), (bounds.diagonal() * 0.5).max(1e-3) as f32);
        let towards = TOWARDS.normalize();
        // A ball around the scene becomes the cube that is drawn.
        let right = Vec3::Y.cross(towards).normalize();
        let row = |axis: Vec3, add: f32| axis.extend(add - axis.dot(middle));
        let rows = [row(right / radius, 0.0), row(towards.cross(right) / radius, 0.0), row(-towards / (2.0 * radius), 0.5)];
        let clip = Mat4::from_cols(rows[0], rows[1], rows[2], Vec4::W).transpose();
        let mut words = clip.to_cols_array().to_vec();
        words.extend(towards.extend(BEFORE * 2.0 * radius / SIDE as f32).to_array());
        let uniform = gpu.filled(bytemuck::cast_slice(&words), BufferUsages::UNIFORM);
        let layout = bind::layout(gpu, ShaderStages::VERTEX, &[UNIFORM]);
        Self {
            shadows: view_of(gpu, [SIDE; 2], DEPTH),
            is_new: true,
            pipeline: PipelineDesc {
                groups: &[None, Some(&layout), Some(geometry)],
                depth: Some(depth_state(true, CompareFunction::Less)),
                ..PipelineDesc::new(&shader(gpu, FULL), "shadow")
            }
            .pipeline(gpu),
            group: bind::group(gpu, &layout, [uniform.as_entire_binding()]),
            uniform,
            layout,
            ball: (middle, radius),
        }
    }

    /// Where tubes are looked at from to cast shadows, a texel off at most.
    pub fn at(&self) -> At {
        let (middle, radius) = self.ball;
        let towards = TOWARDS.normalize();
        let right = Vec3::Y.cross(towards).normalize();
        let [x, y] = [right, towards.cross(right)].map(|axis| axis * AWAY);
        let camera = Camera { eye: middle + towards * (AWAY + 1.0) * radius, x, y, w: -towards };
        At::new(&camera, [SIDE; 2], Look { limit: 1.0, ..Look::default() })
    }

    /// Draws its depth, if something has changed: of the scene those corners that are in `casting`, leaves of doors, and tubes.
    pub fn cast<'r>(
        &mut self,
        pipelines: &Pipelines,
        casting: impl Iterator<Item = &'r Range<u32>>,
        (leaves, drawn): (&Leaves, &Drawn),
        tubes: Option<&TubesInSun>,
        commands: &mut wgpu::CommandEncoder,
    ) {
        if !std::mem::replace(&mut self.is_new, false) {
            return;
        }
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            depth_stencil_attachment: Some(depth_attachment(&self.shadows, Some(1.0))),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.group, &[]);
        pipelines.bind_triangles(&mut pass);
        casting.for_each(|run| pass.draw(run.clone(), 0..1));
        leaves.bind_triangles(&mut pass);
        drawn.solid.iter().for_each(|run| pass.draw(run.clone(), 0..1));
        tubes.into_iter().for_each(|tubes| tubes.cast(&mut pass));
    }
}
