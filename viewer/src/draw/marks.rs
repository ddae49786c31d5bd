//! Which triangles of a frame are drawn and seen, which are drawn in vain, and which are culled; and how many pixels each kind fills.
//!
//! What the culling decided is drawn once more, by its own camera, as numbers of triangles; what has a pixel there is seen.

use super::draws::Draws;
use super::frame::{begin, colour};
use super::leaves::{Drawn, Leaves};
use super::mesh::{Mesh, Runs};
use super::pipelines::{Eye, ITEMS, Pipelines, Recipe, compute, depth_state, shader};
use super::readback::Readback;
use super::targets::Targets;
use super::tubes::Pipes;
use enfilade::gpu::{Gpu, GpuError};
use std::ops::Range;
use wgpu::{BufferBindingType, BufferUsages, CompareFunction, ShaderStages, TextureFormat, TextureView};

/// Words before the bits, as the shader has them.
const HEAD: usize = 4;
/// Pixels that a workgroup looks at, a side; and draws.
const PIXELS: u32 = 8;
const DRAWS: u32 = 64;

/// The kinds that triangles of a frame are of: drawn, and with a pixel; drawn, and hidden or between pixels; not drawn.
pub const KINDS: [&str; 3] = ["seen", "in vain", "culled"];

/// Whether a frame's triangles are told apart.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Marking {
    /// No.
    #[default]
    Off,
    /// They are counted.
    Counted,
    /// And the frame shows it: green for what is seen, orange for what is drawn in vain.
    Coloured,
}

/// Which kinds a frame's triangles are of. Leaves of doors are not counted.
#[derive(Clone, Debug, Default)]
pub struct Marked {
    /// The frame that decided what is drawn.
    pub frame: u64,
    /// Pixels that triangles of each kind fill, in the order of [`KINDS`], whatever lies before them.
    pub pixels: [u64; 3],
    drawn: Vec<u32>,
    seen: Vec<u32>,
}

impl Marked {
    /// How many triangles of some corners (three a triangle) are of each kind, in the order of [`KINDS`].
    pub fn triangles(&self, corners: &Range<u32>) -> [u64; 3] {
        let [start, end] = [corners.start / 3, corners.end / 3];
        let [seen, drawn] = [&self.seen, &self.drawn].map(|bits| u64::from(ones(bits, start..end)));
        // A triangle that the device decided about is marked as drawn by it.
        [seen, drawn.saturating_sub(seen), u64::from(end - start) - drawn.max(seen)]
    }
}

/// Bits that are set in a range.
fn ones(words: &[u32], range: Range<u32>) -> u32 {
    let masked = |word: u32| {
        let [from, to] = [range.start.max(32 * word), range.end.min(32 * word + 32)].map(|bit| u64::from(bit - 32 * word));
        (((1u64 << to) - 1) & !((1u64 << from) - 1)) as u32
    };
    let words_of = range.start / 32..range.end.div_ceil(32);
    words_of.filter(|_| !range.is_empty()).map(|word| (words[word as usize] & masked(word)).count_ones()).sum()
}

/// Tells them apart.
pub struct Marks {
    layout: wgpu::BindGroupLayout,
    numbers: [wgpu::RenderPipeline; 2],
    no_number: wgpu::RenderPipeline,
    see: wgpu::ComputePipeline,
    spread: wgpu::ComputePipeline,
    fill: wgpu::RenderPipeline,
    tinted: [wgpu::RenderPipeline; 2],
    marks: wgpu::Buffer,
    eye: Eye,
    /// The first words: whatever was marked before is gone with them.
    words: Vec<u32>,
    read: Readback<u64>,
    /// The frame whose decision is marked.
    of: Option<u64>,
}

/// What is drawn of a frame.
pub struct Picked<'p> {
    /// What is certain.
    pub runs: &'p Runs,
    /// The same, in a buffer.
    pub draws: &'p Draws,
    /// All there is.
    pub everything: &'p Runs,
    /// Leaves that are drawn.
    pub leaves: (&'p Leaves, &'p Drawn),
    /// Tubes that are drawn: they hide what is behind them, and are not counted.
    pub tubes: Option<&'p Pipes>,
    /// What the device decides, and whether it decides anything in this frame.
    pub decided: (&'p Draws, bool),
}

impl Marks {
    /// For a scene; pictures are of `format`.
    ///
    /// # Errors
    ///
    /// Where it doesn't fit.
    pub fn new(gpu: &Gpu, pipelines: &Pipelines, mesh: &Mesh, format: TextureFormat) -> Result<Self, GpuError> {
        let words = HEAD + 2 * (mesh.triangles as usize).div_ceil(32).max(1);
        gpu.fits("marks", 4 * words as u64)?;
        let bind = group_layout(gpu);
        let module =
            shader(gpu, concat!(include_str!("geometry.wgsl"), include_str!("scene.wgsl"), include_str!("marks.wgsl")));
        let geometry = Some(&pipelines.geometry_layout);
        let groups = [Some(&pipelines.layout), Some(&bind), geometry];
        let render = |fragment, target: wgpu::ColorTargetState, groups: &[_], depth| {
            let pixel = Some((fragment, target));
            Recipe { groups, depth, pixel, ..Recipe::new(&module, "numbered") }.pipeline(gpu)
        };
        let compute = |entry| compute(gpu, &module, entry, &[None, Some(&bind)]);
        let nearest = Some(depth_state(true, CompareFunction::Greater));
        let number = |fragment| render(fragment, ITEMS.into(), &[groups[0], None, geometry], nearest.clone());
        let same = Some(depth_state(false, CompareFunction::Equal));
        let tinted = |fragment| render(fragment, format.into(), &groups, same.clone());
        let nothing = wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::empty() };
        let usages = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        Ok(Self {
            numbers: ["number", "number_of_screen"].map(number),
            no_number: number("no_number"),
            see: compute("see"),
            spread: compute("spread"),
            fill: render("fill", nothing, &groups, None),
            tinted: ["tinted", "tinted_screen"].map(tinted),
            marks: gpu.buffer(4 * words as u64, usages),
            eye: pipelines.eye(gpu),
            words: vec![0; words],
            read: Readback::new(gpu, 4 * words as u64),
            of: None,
            layout: bind,
        })
    }

    /// Records the marks of what was decided in the frame `of`. Returns where they will be, for [`Self::ask`]; `None` where they are there already.
    #[expect(clippy::too_many_arguments, reason = "a stage of the frame takes what the frame has")]
    pub fn record(
        &mut self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        of: u64,
        camera: &enfilade::runtime::Camera,
        picked: &Picked<'_>,
        targets: &Targets,
        picture: &TextureView,
        commands: &mut wgpu::CommandEncoder,
    ) -> Option<usize> {
        if self.of == Some(of) {
            return None;
        }
        self.of = Some(of);
        let (decided, asks) = picked.decided;
        // 1. What is certain to be drawn.
        self.words.fill(0);
        self.words[HEAD - 1] = if asks { decided.lists[1].end } else { 0 };
        for run in picked.runs.solid.iter().chain(&picked.runs.ghosts) {
            mark(&mut self.words[HEAD..], run.start / 3..run.end / 3);
        }
        gpu.queue.write_buffer(&self.marks, 0, bytemuck::cast_slice(&self.words));
        self.eye.set(gpu, camera, None);
        // 2. Numbers of what shows.
        let clear = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
        let view = &targets.items;
        let numbers = wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops: clear };
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(numbers)],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.whole,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        self.draw(&mut pass, pipelines, &self.eye, &self.numbers, picked);
        picked.leaves.0.bind(&mut pass, &self.eye);
        pass.set_pipeline(&self.no_number);
        picked.leaves.1.solid.iter().for_each(|run| pass.draw(run.clone(), 0..1));
        picked.tubes.into_iter().for_each(|pipes| pipes.draw_no_items(&mut pass, &self.eye, &pipes.drawn));
        drop(pass);
        // 3. They are marked.
        let group = self.group(gpu, targets, decided);
        let mut pass = commands.begin_compute_pass(&Default::default());
        pass.set_bind_group(1, &group, &[]);
        if asks {
            pass.set_pipeline(&self.spread);
            pass.dispatch_workgroups(decided.lists[1].end.div_ceil(DRAWS), 1, 1);
        }
        pass.set_pipeline(&self.see);
        let [columns, rows] = targets.size.map(|side| side.div_ceil(PIXELS));
        pass.dispatch_workgroups(columns, rows, 1);
        drop(pass);
        // 4. What all fill.
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[colour(picture, None)],
            ..Default::default()
        });
        pipelines.bind(&mut pass, &self.eye);
        pass.set_bind_group(1, &group, &[]);
        pass.set_pipeline(&self.fill);
        let Runs { solid, ghosts, .. } = picked.everything;
        solid.iter().chain(ghosts).for_each(|run| pass.draw(run.clone(), 0..1));
        drop(pass);
        let slot = self.read.copy(&self.marks, self.marks.size(), of, commands);
        if slot.is_none() {
            // Too many frames are under way: the next one is marked.
            self.of = None;
        }
        slot
    }

    /// What is drawn has changed: the next frame is marked anew.
    pub fn forget(&mut self) {
        self.of = None;
    }

    /// Colours what is drawn, over the picture and the depth that it has, after [`Self::record`].
    #[expect(clippy::too_many_arguments, reason = "a stage of the frame takes what the frame has")]
    pub fn tint(
        &self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        eye: &Eye,
        picked: &Picked<'_>,
        targets: &Targets,
        picture: &TextureView,
        commands: &mut wgpu::CommandEncoder,
    ) {
        let group = self.group(gpu, targets, picked.decided.0);
        let mut pass = begin(commands, picture, &targets.depth, None, None);
        pass.set_bind_group(1, &group, &[]);
        self.draw(&mut pass, pipelines, eye, &self.tinted, picked);
    }

    /// Asks for the marks, once the commands are submitted.
    pub fn ask(&self, slot: usize) {
        self.read.ask(slot);
    }

    /// What has come, one frame after the other.
    pub fn heard(&mut self) -> Option<Marked> {
        self.read
            .heard(|frame, view| {
                let words: &[u32] = bytemuck::cast_slice(view);
                let (head, bits) = words.split_at(HEAD);
                let (drawn, seen) = bits.split_at(bits.len() / 2);
                let pixels = [head[0], head[1], head[2]].map(u64::from);
                Marked { frame, pixels, drawn: drawn.to_vec(), seen: seen.to_vec() }
            })
            .flatten()
    }

    fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipelines: &Pipelines,
        eye: &Eye,
        [solid, screen]: &[wgpu::RenderPipeline; 2],
        picked: &Picked<'_>,
    ) {
        pipelines.bind(pass, eye);
        let (decided, asks) = picked.decided;
        for draws in [Some(picked.draws), asks.then_some(decided)].into_iter().flatten() {
            draws.first(pass, solid);
            draws.second(pass, screen);
        }
    }

    fn group(&self, gpu: &Gpu, targets: &Targets, decided: &Draws) -> wgpu::BindGroup {
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &[
                entry(0, self.marks.as_entire_binding()),
                entry(1, wgpu::BindingResource::TextureView(&targets.items)),
                entry(2, decided.buffer.as_entire_binding()),
            ],
        })
    }
}

fn group_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let storage = |read_only| wgpu::BindingType::Buffer {
        ty: BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let numbers = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Uint,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let visibility = ShaderStages::FRAGMENT | ShaderStages::COMPUTE;
    let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let entries: Vec<_> = (0..).zip([storage(false), numbers, storage(true)]).map(entry).collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

/// Sets the bits of a range in the first half of the words.
fn mark(words: &mut [u32], range: Range<u32>) {
    for word in range.start / 32..range.end.div_ceil(32) {
        let [from, to] = [range.start.max(32 * word), range.end.min(32 * word + 32)].map(|bit| u64::from(bit - 32 * word));
        words[word as usize] |= (((1u64 << to) - 1) & !((1u64 << from) - 1)) as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_ranges_are_set_and_counted_one_by_one() {
        for range in [0..0, 5..5, 0..1, 31..33, 3..70, 32..64, 64..96, 0..96] {
            let mut words = [0; 3];
            mark(&mut words, range.clone());
            let set: Vec<u32> = (0..96).filter(|bit| words[*bit as usize / 32] >> (bit % 32) & 1 == 1).collect();
            assert_eq!(set, range.clone().collect::<Vec<_>>(), "{range:?}");
            for part in [0..96, 2..40, 33..33, 30..64, 95..96] {
                let expected = part.clone().filter(|bit| range.contains(bit)).count();
                assert_eq!(ones(&words, part.clone()) as usize, expected, "{range:?} {part:?}");
            }
        }
    }

    #[test]
    fn kinds_of_triangles_add_up() {
        let marked = Marked { frame: 1, pixels: [0; 3], drawn: vec![0b1111, 0], seen: vec![0b0110, 0] };
        assert_eq!(marked.triangles(&(0..3 * 40)), [2, 2, 36]);
        assert_eq!(marked.triangles(&(3..9)), [2, 0, 0]);
        assert_eq!(marked.triangles(&(12..12)), [0; 3]);
    }
}
