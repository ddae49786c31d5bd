//! The missed-pixel alarm: all of the scene is drawn once more, as items, and where that is nearer than what was drawn, something that
//! shows was left out. It is held against the depth of the very frame that is shown, so whatever decided what to draw is tested, on the
//! processor or on the device. Ground is held against that of the whole screen, which is other tiles: it is missed where none is drawn, nor
//! within the pixels that both may be wrong. Glass and open doors are screens of pixels, so that they are tested and so is what is behind them.

use super::ground::Terrain;
use super::leaves::{Drawn, Leaves};
use super::pipelines::{Eye, Pipelines, Recipe, shader};
use super::readback::Readback;
use super::targets::Targets;
use super::tubes::Pipes;
use enfilade::ObjectId;
use enfilade::gpu::Gpu;
use std::ops::Range;
use wgpu::{BufferBindingType, BufferUsages, ShaderStages, TextureFormat};

/// What a frame missed.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Missed {
    /// Which frame.
    pub frame: u64,
    /// Pixels that show something that wasn't drawn.
    pub pixels: u32,
    /// Of which objects, most pixels first.
    pub objects: Vec<(ObjectId, u32)>,
}

/// Ground may be drawn so many pixels from where it is compared, at most: far more, and what is missed would go unseen.
const FARTHEST: f32 = 8.0;

/// Compares.
pub struct Alarm {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    counts: wgpu::Buffer,
    zeros: wgpu::Buffer,
    near: wgpu::Buffer,
    /// The counts, with the frame that they are of.
    read: Readback<u64>,
}

impl Alarm {
    /// For so many objects, what was made and ground; pictures are of `format`.
    pub fn new(gpu: &Gpu, objects: usize, format: TextureFormat) -> Self {
        let entry =
            |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: ShaderStages::FRAGMENT, ty, count: None };
        let texture = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let storage = wgpu::BindingType::Buffer {
            ty: BufferBindingType::Storage { read_only: false },
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let uniform =
            wgpu::BindingType::Buffer { ty: BufferBindingType::Uniform, has_dynamic_offset: false, min_binding_size: None };
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[
                entry(0, texture(wgpu::TextureSampleType::Depth)),
                entry(1, texture(wgpu::TextureSampleType::Depth)),
                entry(2, texture(wgpu::TextureSampleType::Uint)),
                entry(3, storage),
                entry(4, uniform),
            ],
        });
        let module = shader(gpu, include_str!("alarm.wgsl"));
        let pipeline =
            Recipe { groups: &[Some(&layout)], pixel: Some(("pixel", format.into())), ..Recipe::new(&module, "corner") }
                .pipeline(gpu);
        let bytes = 4 * (objects as u64 + 3);
        Self {
            pipeline,
            layout,
            counts: gpu.buffer(bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST),
            zeros: gpu.filled(&vec![0; objects + 3], BufferUsages::COPY_SRC),
            near: gpu.buffer(16, BufferUsages::UNIFORM | BufferUsages::COPY_DST),
            read: Readback::new(gpu, bytes),
        }
    }

    /// Records a comparison of what was drawn into `targets`, in magenta on `picture`. `everything`: runs of solid things and of ghosts,
    /// all leaves of doors, ground and tubes. Returns where the counts will be, for [`Self::ask`].
    #[expect(clippy::too_many_arguments, reason = "a stage of the frame takes what the frame has")]
    pub fn record(
        &mut self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        eye: &Eye,
        targets: &Targets,
        picture: &wgpu::TextureView,
        everything: [&[Range<u32>]; 2],
        leaves: (&Leaves, &Drawn, Option<&Terrain>, Option<&Pipes>),
        frame: u64,
        commands: &mut wgpu::CommandEncoder,
    ) -> Option<usize> {
        // 1. Everything, as items.
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &targets.items,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.whole,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pipelines.bind(&mut pass, eye);
        pipelines.items.draw(&mut pass, everything[0], everything[1]);
        leaves.0.draw(&mut pass, eye, &pipelines.items, leaves.1);
        leaves.2.into_iter().for_each(|terrain| terrain.draw_items(&mut pass));
        leaves.3.into_iter().for_each(|pipes| pipes.draw_items(&mut pass, eye, &pipes.all));
        drop(pass);
        // 2. Held against what was drawn.
        let far = leaves.2.map_or(0.0, |terrain| terrain.tolerance().ceil().clamp(1.0, FARTHEST));
        // Of what isn't an object, ground is last.
        let item = (self.counts.size() / 4) as u32 - 1;
        gpu.queue.write_buffer(&self.near, 0, bytemuck::cast_slice(&[item, far as u32]));
        commands.copy_buffer_to_buffer(&self.zeros, 0, &self.counts, 0, self.counts.size());
        let view = wgpu::BindingResource::TextureView;
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &[
                entry(0, view(&targets.depth)),
                entry(1, view(&targets.whole)),
                entry(2, view(&targets.items)),
                entry(3, self.counts.as_entire_binding()),
                entry(4, self.near.as_entire_binding()),
            ],
        });
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: picture,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        self.read.copy(&self.counts, self.counts.size(), frame, commands)
    }

    /// Asks for the counts, once the commands are submitted.
    pub fn ask(&self, slot: usize) {
        self.read.ask(slot);
    }

    /// What has come, one frame after the other.
    pub fn heard(&mut self) -> Option<Missed> {
        self.read
            .heard(|frame, view| {
                let counts: &[u32] = bytemuck::cast_slice(view);
                let of_objects = (0u32..).map(ObjectId).zip(counts[1..].iter().copied()).filter(|(_, n)| *n > 0);
                let mut objects: Vec<(ObjectId, u32)> = of_objects.collect();
                objects.sort_by_key(|&(o, n)| (std::cmp::Reverse(n), o));
                Missed { frame, pixels: counts[0], objects }
            })
            .flatten()
    }
}
