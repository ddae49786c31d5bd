//! Which triangles of a frame are drawn and seen, which are drawn in vain, and which are culled; and how many pixels each kind fills.
//!
//! The drawn set is drawn once more, by the camera that culled, as numbers of triangles; triangles with a pixel are seen.

use super::bind::{self, ITEM_TEXTURE, STORAGE, WRITABLE, view};
use super::draws::Draws;
use super::frame::{FrameContext, Passes};
use super::mesh::Mesh;
use super::pass::{begin, begin_flat};
use super::pipelines::{CameraBinding, ITEMS, PipelineDesc, Pipelines, compute, depth_state, shader};
use super::readback::ReadbackRing;
use super::targets::Targets;
use enfilade::gpu::{Gpu, GpuError};
use std::ops::Range;
use wgpu::{BufferUsages, CommandEncoder, CompareFunction, ShaderStages, TextureFormat};

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
    /// Pixels that triangles of each kind fill, hidden ones included, in the order of [`KINDS`].
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
    eye: CameraBinding,
    /// Words that clear the marks.
    words: Vec<u32>,
    read: ReadbackRing<u64>,
    /// The frame whose decision is marked.
    of: Option<u64>,
}

/// Records kinds of triangles, if they are told apart, and colours the picture by them.
pub fn draw(frame: &FrameContext<'_>, passes: &mut Passes, commands: &mut CommandEncoder) {
    if frame.marking == Marking::Off {
        return;
    }
    let Passes { marks: Some(marks), hiz, queries, .. } = passes else { return };
    let hiz = hiz.as_ref().filter(|_| frame.is_by_pyramid());
    let decided = match hiz {
        Some(hiz) => (&hiz.both, true),
        None => (&queries.draws, frame.has_queries()),
    };
    marks.record(frame, decided, commands);
    if frame.marking == Marking::Coloured {
        marks.tint(frame, decided, commands);
    }
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
        let stages = ShaderStages::FRAGMENT | ShaderStages::COMPUTE;
        let bind = bind::layout(gpu, stages, &[WRITABLE, ITEM_TEXTURE, STORAGE]);
        let module =
            shader(gpu, concat!(include_str!("geometry.wgsl"), include_str!("scene.wgsl"), include_str!("marks.wgsl")));
        let geometry = Some(&pipelines.geometry_layout);
        let groups = [Some(&pipelines.layout), Some(&bind), geometry];
        let render = |fragment, target: wgpu::ColorTargetState, groups: &[_], depth| {
            let pixel = Some((fragment, target));
            PipelineDesc { groups, depth, pixel, ..PipelineDesc::new(&module, "numbered") }.pipeline(gpu)
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
            read: ReadbackRing::new(gpu, 4 * words as u64),
            of: None,
            layout: bind,
        })
    }

    /// Records the marks of a decision, if they are not recorded yet. `decided`: what the device decides, and whether it decides anything.
    fn record(&mut self, frame: &FrameContext<'_>, decided: (&Draws, bool), commands: &mut CommandEncoder) {
        let of = frame.decision.frame;
        if self.of == Some(of) {
            return;
        }
        self.of = Some(of);
        let FrameContext { gpu, pipelines, targets, leaves, .. } = frame;
        let (draws, asks) = decided;
        // 1. What is certain to be drawn.
        self.words.fill(0);
        self.words[HEAD - 1] = if asks { draws.lists[1].end } else { 0 };
        let certain = frame.certain();
        for run in certain.solid.iter().chain(&certain.transparent) {
            mark(&mut self.words[HEAD..], run.start / 3..run.end / 3);
        }
        gpu.queue.write_buffer(&self.marks, 0, bytemuck::cast_slice(&self.words));
        self.eye.set(gpu, &frame.decision.camera, None);
        // 2. Numbers of what shows.
        let mut pass = begin(commands, &targets.items, &targets.whole, Some(wgpu::Color::TRANSPARENT), None);
        self.draw(&mut pass, frame, &self.eye, &self.numbers, decided);
        leaves.bind(&mut pass, &self.eye);
        pass.set_pipeline(&self.no_number);
        frame.lists.leaves.solid.iter().for_each(|run| pass.draw(run.clone(), 0..1));
        // Tubes hide what is behind them, and are not counted.
        frame.tubes.iter().for_each(|tubes| tubes.draw_no_items(&mut pass, &self.eye, &tubes.drawn));
        drop(pass);
        // 3. They are marked.
        let group = self.group(gpu, targets, draws);
        let mut pass = commands.begin_compute_pass(&Default::default());
        pass.set_bind_group(1, &group, &[]);
        if asks {
            pass.set_pipeline(&self.spread);
            pass.dispatch_workgroups(draws.lists[1].end.div_ceil(DRAWS), 1, 1);
        }
        pass.set_pipeline(&self.see);
        let [columns, rows] = targets.size.map(|side| side.div_ceil(PIXELS));
        pass.dispatch_workgroups(columns, rows, 1);
        drop(pass);
        // 4. What all fill.
        let mut pass = begin_flat(commands, frame.picture, None);
        pipelines.bind(&mut pass, &self.eye);
        pass.set_bind_group(1, &group, &[]);
        pass.set_pipeline(&self.fill);
        let all = frame.shown();
        all.solid.iter().chain(&all.transparent).for_each(|run| pass.draw(run.clone(), 0..1));
        drop(pass);
        if !self.read.copy(&self.marks, self.marks.size(), of, commands) {
            // Too many frames are in flight: the next one is marked.
            self.of = None;
        }
    }

    /// The drawn set has changed: the next frame is marked anew.
    pub fn forget(&mut self) {
        self.of = None;
    }

    /// Colours what is drawn, over the picture and its depth.
    fn tint(&self, frame: &FrameContext<'_>, decided: (&Draws, bool), commands: &mut CommandEncoder) {
        let group = self.group(frame.gpu, frame.targets, decided.0);
        let mut pass = begin(commands, frame.picture, &frame.targets.depth, None, None);
        pass.set_bind_group(1, &group, &[]);
        self.draw(&mut pass, frame, frame.eye, &self.tinted, decided);
    }

    /// Maps the marks, once the commands are submitted.
    pub fn map(&mut self) {
        self.read.map();
    }

    /// The next frame that has been read.
    pub fn receive(&mut self) -> Option<Marked> {
        self.read
            .receive(|frame, view| {
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
        frame: &FrameContext<'_>,
        eye: &CameraBinding,
        [solid, screen]: &[wgpu::RenderPipeline; 2],
        (decided, asks): (&Draws, bool),
    ) {
        frame.pipelines.bind(pass, eye);
        for draws in [Some(&frame.lists.draws), asks.then_some(decided)].into_iter().flatten() {
            draws.first(pass, solid);
            draws.second(pass, screen);
        }
    }

    fn group(&self, gpu: &Gpu, targets: &Targets, decided: &Draws) -> wgpu::BindGroup {
        let resources = [self.marks.as_entire_binding(), view(&targets.items), decided.buffer.as_entire_binding()];
        bind::group(gpu, &self.layout, resources)
    }
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
