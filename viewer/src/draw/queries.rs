//! Occlusion queries without waiting: boxes are drawn against the depth of the certain objects, answers are turned into
//! indirect draws on the device, in the same frame, and copied to where the processor reads them later.

use super::bind::{self, STORAGE, WRITABLE};
use super::draws::Draws;
use super::frame::FrameContext;
use super::mesh::Mesh;
use super::pass::depth_attachment;
use super::pipelines::{self, PipelineDesc, Pipelines, depth_state, shader};
use super::readback::ReadbackRing;
use super::smooth::SAMPLES;
use crate::culling::ByDevice;
use crate::delayed_queries::DelayedQueries;
use enfilade::gpu::Gpu;
use wgpu::{BufferUsages, QueryType, ShaderStages, TextureView};

/// Most questions of a frame: what a set of queries holds.
pub const MOST: usize = 4096;

/// Queries, and what is drawn by their answers.
pub struct Queries {
    /// For one sample a pixel, and for more.
    boxes: [wgpu::RenderPipeline; 2],
    decide: wgpu::ComputePipeline,
    queries: wgpu::QuerySet,
    corners: wgpu::Buffer,
    answers: wgpu::Buffer,
    slots: wgpu::Buffer,
    /// The draws: opaque objects, then the rest.
    pub draws: Draws,
    group: wgpu::BindGroup,
    read: ReadbackRing<Questions>,
    slots_of_frame: Slots,
    /// Those that are read, for the next frames.
    spare: Vec<Questions>,
}

/// Objects that wait for the answers of a frame.
#[derive(Default)]
struct Slots {
    /// Whether one sees through it, and the question, the first corner and the number of corners: of neighbours one.
    slots: Vec<(bool, [u32; 3])>,
    words: Vec<u32>,
    corners: Vec<f32>,
}

impl Slots {
    /// Those of a plan; adds to `asked`, which is empty.
    fn set(&mut self, delayed: &DelayedQueries, mesh: &Mesh, is_transparent: &[bool], asked: &mut Questions) {
        let slots = &mut self.slots;
        slots.clear();
        asked.nodes.extend(delayed.questions.iter().map(|q| q.node));
        asked.hanging.resize(delayed.questions.len(), ByDevice::default());
        for &(question, object) in &delayed.conditional {
            let range = mesh.drawn(object);
            slots.push((is_transparent[object.index()], [question, range.start, range.end - range.start]));
            let hanging = &mut asked.hanging[question as usize];
            hanging.objects += 1;
            hanging.triangles += u64::from(range.end - range.start) / 3;
        }
        slots.sort_unstable();
        slots.dedup_by(|next, last| {
            let goes_on = next.0 == last.0 && next.1[0] == last.1[0] && next.1[1] == last.1[1] + last.1[2];
            last.1[2] += if goes_on { next.1[2] } else { 0 };
            goes_on
        });
        self.words.clear();
        self.words.extend(slots.iter().flat_map(|slot| slot.1));
        self.corners.clear();
        self.corners.extend(delayed.questions.iter().flat_map(|q| [q.least, q.most]).flat_map(|p| p.to_array()));
    }
}

/// Questions of a frame.
#[derive(Default)]
struct Questions {
    /// Nodes that were asked about.
    nodes: Vec<u32>,
    /// Objects and triangles by question.
    hanging: Vec<ByDevice>,
}

impl Queries {
    /// For a number of objects.
    pub fn new(gpu: &Gpu, pipelines: &Pipelines, objects: usize) -> Self {
        let device = &gpu.device;
        let module = shader(gpu, include_str!("boxes.wgsl"));
        let boxes = |samples| {
            PipelineDesc {
                samples,
                groups: &[Some(&pipelines.layout)],
                corners: Some(wgpu::VertexBufferLayout {
                    array_stride: 24,
                    step_mode: wgpu::VertexStepMode::Instance,
                    attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3],
                }),
                depth: Some(depth_state(false, wgpu::CompareFunction::GreaterEqual)),
                ..PipelineDesc::new(&module, "corner")
            }
            .pipeline(gpu)
        };
        let layout = bind::layout(gpu, ShaderStages::COMPUTE, &[STORAGE, STORAGE, WRITABLE]);
        let decide = pipelines::compute(gpu, &shader(gpu, include_str!("decide.wgsl")), "decide", &[Some(&layout)]);
        let most = objects.max(1) as u64;
        let resolve = BufferUsages::QUERY_RESOLVE | BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let answers = gpu.buffer(8 * MOST as u64, resolve);
        let slots = gpu.buffer(12 * most, BufferUsages::STORAGE | BufferUsages::COPY_DST);
        let draws = Draws::new(gpu, objects, BufferUsages::STORAGE);
        let group = bind::group(gpu, &layout, [&answers, &slots, &draws.buffer].map(wgpu::Buffer::as_entire_binding));
        Self {
            boxes: [1, SAMPLES].map(boxes),
            decide,
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: QueryType::Occlusion,
                count: MOST as u32,
            }),
            corners: gpu.buffer(24 * MOST as u64, BufferUsages::VERTEX | BufferUsages::COPY_DST),
            answers,
            slots,
            draws,
            group,
            read: ReadbackRing::new(gpu, 8 * MOST as u64),
            slots_of_frame: Slots::default(),
            spare: Vec::new(),
        }
    }

    /// Records the questions of a frame, [`MOST`] at most, against a depth with one sample a pixel or, if it `is_smooth`, more; and the
    /// draws that the device makes of the answers.
    pub fn record(
        &mut self,
        frame: &FrameContext<'_>,
        (depth, is_smooth): (&TextureView, bool),
        commands: &mut wgpu::CommandEncoder,
    ) {
        let FrameContext { gpu, mesh, is_transparent, delayed, .. } = frame;
        // 1. What hangs on each question.
        let mut questions = self.spare.pop().unwrap_or_default();
        self.slots_of_frame.set(delayed, mesh, is_transparent, &mut questions);
        let Slots { slots, words, corners } = &self.slots_of_frame;
        let count = slots.len() as u32;
        self.draws.split(slots.partition_point(|slot| !slot.0) as u32, count);
        gpu.queue.write_buffer(&self.slots, 0, bytemuck::cast_slice(words));
        gpu.queue.write_buffer(&self.corners, 0, bytemuck::cast_slice(corners));
        // 2. Questions: boxes drawn into nothing.
        let asked = delayed.questions.len() as u32;
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            depth_stencil_attachment: Some(depth_attachment(depth, None)),
            occlusion_query_set: Some(&self.queries),
            ..Default::default()
        });
        pass.set_pipeline(&self.boxes[usize::from(is_smooth)]);
        pass.set_bind_group(0, &frame.eye.group, &[]);
        pass.set_vertex_buffer(0, self.corners.slice(..));
        for question in 0..asked {
            pass.begin_occlusion_query(question);
            pass.draw(0..36, question..question + 1);
            pass.end_occlusion_query();
        }
        drop(pass);
        commands.resolve_query_set(&self.queries, 0..asked, &self.answers, 0);
        // 3. Answers become draws.
        let mut pass = commands.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.decide);
        pass.set_bind_group(0, &self.group, &[]);
        pass.dispatch_workgroups(count.div_ceil(64), 1, 1);
        drop(pass);
        // 4. And go to where they can be read.
        self.read.copy(&self.answers, 8 * u64::from(asked), questions, commands);
    }

    /// Maps the answers, once the commands are submitted.
    pub fn map(&mut self) {
        self.read.map();
    }

    /// Teaches what has come. Returns what the device drew by the answers, of the last frame that is heard of.
    pub fn receive(&mut self, delayed: &mut DelayedQueries) -> Option<ByDevice> {
        let mut drawn = None;
        let spare = &mut self.spare;
        while let Some(last) = self.read.receive(|mut asked, view| {
            let Questions { nodes, hanging } = &asked;
            let shows = |i: usize| view[8 * i..8 * i + 8].iter().any(|b| *b != 0);
            delayed.learn(nodes.iter().enumerate().map(|(i, &node)| (node, shows(i))));
            let shown = hanging.iter().enumerate().filter(|(i, _)| shows(*i));
            let drawn = shown.fold(ByDevice::default(), |sum, (_, more)| sum.with(*more));
            asked.nodes.clear();
            asked.hanging.clear();
            spare.push(asked);
            drawn
        }) {
            drawn = last.or(drawn);
        }
        drawn
    }
}
