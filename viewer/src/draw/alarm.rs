//! The missed-pixel alarm: all of the scene is drawn once more, as items, and where that is nearer than what was drawn, something that
//! shows was left out. It is held against the depth of the very frame that is shown, so whatever decided what to draw is tested, on the
//! processor or on the device. Ground is held against that of the whole screen, which is other tiles: it is missed where none is drawn, nor
//! within the pixels that both may be wrong. Glass and open doors are screens of pixels, so that they are tested and so is what is behind them.

use super::bind::{self, DEPTH_TEXTURE, ITEM_TEXTURE, UNIFORM, WRITABLE, view};
use super::frame::{FrameContext, Passes};
use super::pass::{begin, begin_flat};
use super::pipelines::{PipelineDesc, shader};
use super::readback::ReadbackRing;
use enfilade::ObjectId;
use enfilade::gpu::Gpu;
use wgpu::{BufferUsages, CommandEncoder, ShaderStages, TextureFormat};

/// Missed pixels of a frame.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Missed {
    /// Which frame.
    pub frame: u64,
    /// Pixels that show something that wasn't drawn.
    pub pixels: u32,
    /// Of which objects, most pixels first.
    pub objects: Vec<(ObjectId, u32)>,
}

/// Greatest distance, pixels, between ground that is drawn and ground that is compared. More: missed ground would not be found.
const FARTHEST: f32 = 8.0;

/// Records a comparison of the frame with a picture of everything: missed pixels are magenta.
pub fn compare(frame: &FrameContext<'_>, passes: &mut Passes, commands: &mut CommandEncoder) {
    if !frame.alarm {
        return;
    }
    if frame.hidden.is_any {
        frame.hidden.stand_in(frame, commands);
    }
    if let Some(tubes) = frame.tubes {
        tubes.stand_in(frame.eye, frame.targets, commands);
    }
    passes.alarm.record(frame, commands);
}

/// Compares.
pub struct Alarm {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    counts: wgpu::Buffer,
    zeros: wgpu::Buffer,
    near: wgpu::Buffer,
    /// The counts, with the frame that they are of.
    read: ReadbackRing<u64>,
}

impl Alarm {
    /// For a number of objects, leaves that the viewer made, and ground; pictures are of `format`.
    pub fn new(gpu: &Gpu, objects: usize, format: TextureFormat) -> Self {
        let kinds = [DEPTH_TEXTURE, DEPTH_TEXTURE, ITEM_TEXTURE, WRITABLE, UNIFORM];
        let layout = bind::layout(gpu, ShaderStages::FRAGMENT, &kinds);
        let module = shader(gpu, include_str!("alarm.wgsl"));
        let pipeline = PipelineDesc {
            groups: &[Some(&layout)],
            pixel: Some(("pixel", format.into())),
            ..PipelineDesc::new(&module, "corner")
        }
        .pipeline(gpu);
        let bytes = 4 * (objects as u64 + 3);
        Self {
            pipeline,
            layout,
            counts: gpu.buffer(bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST),
            zeros: gpu.filled(&vec![0; objects + 3], BufferUsages::COPY_SRC),
            near: gpu.buffer(16, BufferUsages::UNIFORM | BufferUsages::COPY_DST),
            read: ReadbackRing::new(gpu, bytes),
        }
    }

    fn record(&mut self, frame: &FrameContext<'_>, commands: &mut CommandEncoder) {
        let FrameContext { gpu, targets, leaves, lists, .. } = frame;
        // 1. Everything, as items.
        let clear = Some(wgpu::Color::TRANSPARENT);
        let mut pass = begin(commands, &targets.items, &targets.whole, clear, None);
        frame.pipelines.bind(&mut pass, frame.eye);
        frame.pipelines.items.draw(&mut pass, &lists.everything.solid, &lists.everything.transparent);
        leaves.draw(&mut pass, frame.eye, &frame.pipelines.items, &lists.all_leaves);
        frame.terrain.iter().for_each(|terrain| terrain.draw_items(&mut pass));
        frame.tubes.iter().for_each(|tubes| tubes.draw_items(&mut pass, frame.eye, &tubes.all));
        drop(pass);
        // 2. Compared with what was drawn.
        let far = frame.terrain.map_or(0.0, |terrain| terrain.tolerance().ceil().clamp(1.0, FARTHEST));
        // Ground is the last item.
        let item = (self.counts.size() / 4) as u32 - 1;
        gpu.queue.write_buffer(&self.near, 0, bytemuck::cast_slice(&[item, far as u32]));
        commands.copy_buffer_to_buffer(&self.zeros, 0, &self.counts, 0, self.counts.size());
        let textures = [&targets.depth, &targets.whole, &targets.items].map(view);
        let buffers = [&self.counts, &self.near].map(wgpu::Buffer::as_entire_binding);
        let group = bind::group(gpu, &self.layout, textures.into_iter().chain(buffers));
        let mut pass = begin_flat(commands, frame.picture, None);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        self.read.copy(&self.counts, self.counts.size(), frame.number, commands);
    }

    /// Maps the counts, once the commands are submitted.
    pub fn map(&mut self) {
        self.read.map();
    }

    /// The next frame that has been read.
    pub fn receive(&mut self) -> Option<Missed> {
        self.read
            .receive(|frame, view| {
                let counts: &[u32] = bytemuck::cast_slice(view);
                let of_objects = (0u32..).map(ObjectId).zip(counts[1..].iter().copied()).filter(|(_, n)| *n > 0);
                let mut objects: Vec<(ObjectId, u32)> = of_objects.collect();
                objects.sort_by_key(|&(o, n)| (std::cmp::Reverse(n), o));
                Missed { frame, pixels: counts[0], objects }
            })
            .flatten()
    }
}
