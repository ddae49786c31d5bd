//! Lines and faces over the scene: portals, frusta, boxes, what was picked; and bodies in it.

use super::frame::{FrameContext, Passes, Timed};
use super::pass::begin;
use super::pipelines::{CameraBinding, PipelineDesc, Pipelines, depth_state, shader};
use enfilade::gpu::Gpu;
use glam::Vec3;
use wgpu::{BufferUsages, CompareFunction, PrimitiveTopology, TextureFormat};

/// Red, green, blue and how much of what is behind is covered.
pub type Tint = [u8; 4];

/// Pieces of a ribbon.
const PIECES: usize = 16;

/// Lines and faces over the scene: corners by `Kind`.
#[derive(Default)]
pub struct Overlay([Vec<[u32; 4]>; 5]);

/// Kinds of lines and faces, in the order in which they are drawn.
#[derive(Clone, Copy)]
enum Kind {
    /// Faces that hide what is behind them.
    Solid,
    Faces,
    Lines,
    /// Lines that show through walls.
    LinesThrough,
    /// Faces that show through walls.
    FacesThrough,
}

fn corner(p: Vec3, tint: Tint) -> [u32; 4] {
    let [x, y, z] = p.to_array().map(f32::to_bits);
    [x, y, z, u32::from_le_bytes(tint)]
}

impl Overlay {
    /// Nothing.
    pub const fn new() -> Self {
        Self([const { Vec::new() }; 5])
    }

    /// Nothing from now on.
    pub fn clear(&mut self) {
        self.0.iter_mut().for_each(Vec::clear);
    }

    /// A line, metres relative to the origin.
    pub fn line(&mut self, a: Vec3, b: Vec3, tint: Tint) {
        self.0[Kind::Lines as usize].extend([corner(a, tint), corner(b, tint)]);
    }

    /// A line that shows through walls.
    pub fn line_through(&mut self, a: Vec3, b: Vec3, tint: Tint) {
        self.0[Kind::LinesThrough as usize].extend([corner(a, tint), corner(b, tint)]);
    }

    /// A line that shows through walls and is as wide as `width` times its distance from the eye.
    pub fn ribbon(&mut self, a: Vec3, b: Vec3, eye: Vec3, width: f32, tint: Tint) {
        // In pieces, since distance changes along it.
        let at = |i: usize| a.lerp(b, i as f32 / PIECES as f32);
        let side = |p: Vec3| (b - a).cross(p - eye).normalize_or_zero() * (0.5 * width * p.distance(eye));
        for [p, q] in (0..PIECES).map(|i| [at(i), at(i + 1)]) {
            let (s, t) = (side(p), side(q));
            self.0[Kind::FacesThrough as usize].extend([p - s, p + s, q + t, p - s, q + t, q - t].map(|p| corner(p, tint)));
        }
    }

    /// The outline of a polygon.
    pub fn outline(&mut self, corners: &[Vec3], tint: Tint) {
        for (i, &a) in corners.iter().enumerate() {
            self.line(a, corners[(i + 1) % corners.len()], tint);
        }
    }

    /// A convex polygon.
    pub fn face(&mut self, corners: &[Vec3], tint: Tint) {
        self.polygon(Kind::Faces, corners, tint);
    }

    /// A convex polygon that hides what is behind it.
    pub fn solid(&mut self, corners: &[Vec3], tint: Tint) {
        self.polygon(Kind::Solid, corners, tint);
    }

    fn polygon(&mut self, kind: Kind, corners: &[Vec3], tint: Tint) {
        for pair in corners.get(1..).unwrap_or_default().windows(2) {
            self.0[kind as usize].extend([corners[0], pair[0], pair[1]].map(|p| corner(p, tint)));
        }
    }

    /// The edges of a box.
    pub fn boxed(&mut self, [least, most]: [Vec3; 2], tint: Tint) {
        let at =
            |i: usize| Vec3::from_array([0, 1, 2].map(|axis| if i >> axis & 1 == 0 { least[axis] } else { most[axis] }));
        for a in 0..8usize {
            for axis in (0..3).filter(|axis| a >> axis & 1 == 0) {
                self.line(at(a), at(a | 1 << axis), tint);
            }
        }
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(Vec::is_empty)
    }
}

/// Records the mirrors, and lines and faces over the scene.
pub fn draw(frame: &FrameContext<'_>, passes: &mut Passes, commands: &mut wgpu::CommandEncoder) {
    if !frame.has_overlay() {
        return;
    }
    let mut pass = begin(commands, frame.picture, &frame.targets.depth, None, passes.stamps(frame, Timed::Overlay));
    if frame.has_mirrors {
        passes.mirrors.draw(&mut pass, frame.eye);
    }
    let overlays = frame.bodies.into_iter().chain([frame.overlay]);
    passes.lines.draw(frame.gpu, &mut pass, frame.eye, overlays);
}

/// Draws overlays.
pub struct Lines {
    /// By [`Kind`].
    pipelines: [wgpu::RenderPipeline; 5],
    buffer: Option<wgpu::Buffer>,
    /// Corners of a frame.
    all: Vec<[u32; 4]>,
}

impl Lines {
    /// On pictures of `format`.
    pub fn new(gpu: &Gpu, pipelines: &Pipelines, format: TextureFormat) -> Self {
        let module = shader(gpu, include_str!("overlay.wgsl"));
        let pipeline = |topology, compare, hides| {
            let blend = Some(wgpu::BlendState::ALPHA_BLENDING);
            PipelineDesc {
                groups: &[Some(&pipelines.layout)],
                corners: Some(wgpu::VertexBufferLayout {
                    array_stride: 16,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4],
                }),
                topology,
                depth: Some(depth_state(hides, compare)),
                pixel: Some(("pixel", wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::ALL })),
                ..PipelineDesc::new(&module, "corner")
            }
            .pipeline(gpu)
        };
        Self {
            pipelines: [
                pipeline(PrimitiveTopology::TriangleList, CompareFunction::GreaterEqual, true),
                pipeline(PrimitiveTopology::TriangleList, CompareFunction::GreaterEqual, false),
                pipeline(PrimitiveTopology::LineList, CompareFunction::GreaterEqual, false),
                pipeline(PrimitiveTopology::LineList, CompareFunction::Always, false),
                pipeline(PrimitiveTopology::TriangleList, CompareFunction::Always, false),
            ],
            buffer: None,
            all: Vec::new(),
        }
    }

    /// Draws some, one after the other, in a pass with depth.
    pub fn draw<'o>(
        &mut self,
        gpu: &Gpu,
        pass: &mut wgpu::RenderPass<'_>,
        eye: &CameraBinding,
        overlays: impl Iterator<Item = &'o Overlay> + Clone,
    ) {
        let all = &mut self.all;
        all.clear();
        all.extend(overlays.clone().flat_map(|overlay| overlay.0.iter().flatten()));
        let bytes = 16 * all.len() as u64;
        if all.is_empty() || bytes > gpu.limits.max_buffer_size {
            return;
        }
        if self.buffer.as_ref().is_none_or(|buffer| buffer.size() < bytes) {
            self.buffer =
                Some(gpu.buffer(bytes.next_power_of_two().max(1 << 16), BufferUsages::VERTEX | BufferUsages::COPY_DST));
        }
        let Some(buffer) = &self.buffer else { return };
        gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(all));
        pass.set_bind_group(0, &eye.group, &[]);
        pass.set_vertex_buffer(0, buffer.slice(..));
        let mut start = 0;
        for (pipeline, part) in overlays.flat_map(|overlay| self.pipelines.iter().zip(&overlay.0)) {
            let corners = start..start + part.len() as u32;
            start = corners.end;
            if !corners.is_empty() {
                pass.set_pipeline(pipeline);
                pass.draw(corners, 0..1);
            }
        }
    }
}
