//! A scene on the device, and which of its objects a face may see.

use crate::geom::Aabb;
use crate::gpu::{DepthPipeline, Gpu, GpuError, pipeline_layout, shader_module, words};
use crate::pvs::cubes::CubeView;
use crate::scene::Scene;
use glam::DVec3;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use wgpu::{BufferUsages, DownlevelFlags, ShaderStages};

/// Boxes grow by this fraction of their distance: more than rounding takes on the device, and than edges may be off.
const PAD: f64 = 1e-6;
/// Where no more triangles than this lie between two ranges that may be seen, one draw takes both.
const GAP: u32 = 64;
/// Bytes of a corner and of a triangle.
const CORNER: u64 = 24;
const TRIANGLE: u64 = 16;
/// What the adapter must have.
const NEEDS: [(DownlevelFlags, &str); 4] = [
    (DownlevelFlags::VERTEX_STORAGE, "buffers that vertex shaders read"),
    (DownlevelFlags::FRAGMENT_WRITABLE_STORAGE, "buffers that fragment shaders write"),
    (DownlevelFlags::READ_ONLY_DEPTH_STENCIL, "depth buffers that shaders read"),
    (DownlevelFlags::COMPUTE_SHADERS, "compute shaders"),
];
/// Bytes of what the shaders know of a face.
pub(super) const FACE: u64 = 80;

const IDS: &str = concat!(include_str!("../../../gpu/points.wgsl"), include_str!("ids.wgsl"));

/// A scene made ready for cubes by a graphics processor; threads share it.
pub struct GpuScene {
    pub(super) gpu: Gpu,
    /// What is opaque, and what isn't, in the order of triangles on the device.
    opaque: Vec<Part>,
    see_through: Vec<Part>,
    /// The object of each triangle.
    pub(super) owners: Vec<u32>,
    pub(super) objects: usize,
    pub(super) positions: wgpu::Buffer,
    pub(super) triangles: wgpu::Buffer,
    pub(super) owners_there: wgpu::Buffer,
    pub(super) pipelines: Pipelines,
    /// Cubes that another engine had to make.
    missed: AtomicU64,
    why: std::sync::OnceLock<GpuError>,
}

/// An object on the device.
struct Part {
    bounds: Aabb,
    triangles: Range<u32>,
}

/// What is the same for every scene.
pub(super) struct Pipelines {
    pub faces_layout: wgpu::BindGroupLayout,
    pub hits_layout: wgpu::BindGroupLayout,
    pub count_layout: wgpu::BindGroupLayout,
    pub nearest: wgpu::RenderPipeline,
    pub before: wgpu::RenderPipeline,
    pub count: wgpu::ComputePipeline,
}

impl GpuScene {
    /// Opens the device that there is and puts the scene there.
    pub fn new(scene: &Scene) -> Result<Self, GpuError> {
        let gpu = Gpu::open(&NEEDS)?;
        fits(&gpu, scene)?;
        let (mut opaque, mut see_through) = (Vec::new(), Vec::new());
        let mut owners = vec![0; scene.triangles.len()];
        let mut triangles: Vec<u32> = Vec::with_capacity(scene.triangles.len() * 4);
        for (parts, is_opaque) in [(&mut opaque, true), (&mut see_through, false)] {
            for (index, object) in (0u32..).zip(&scene.objects).filter(|(_, o)| o.opaque == is_opaque) {
                let start = (triangles.len() / 4) as u32;
                for t in object.triangles.clone() {
                    owners[t as usize] = index;
                    let [a, b, c] = scene.triangles[t as usize];
                    triangles.extend([a, b, c, t]);
                }
                parts.push(Part { bounds: object.bounds, triangles: start..(triangles.len() / 4) as u32 });
            }
        }
        let pipelines = Pipelines::new(&gpu.device);
        let scene = Self {
            opaque,
            see_through,
            objects: scene.objects.len(),
            positions: gpu.filled(&words(&scene.positions), BufferUsages::STORAGE),
            triangles: gpu.filled(&triangles, BufferUsages::STORAGE),
            owners_there: gpu.filled(&owners, BufferUsages::STORAGE),
            owners,
            pipelines,
            missed: AtomicU64::new(0),
            why: std::sync::OnceLock::new(),
            gpu,
        };
        scene.gpu.check()?;
        Ok(scene)
    }

    /// Whether there is a device that the scene fits on; its name.
    pub fn check(scene: &Scene) -> Result<String, GpuError> {
        let gpu = Gpu::open(&NEEDS)?;
        fits(&gpu, scene).map(|()| gpu.name)
    }

    /// The adapter, its driver, and how it is spoken to.
    pub fn adapter(&self) -> &str {
        &self.gpu.name
    }

    /// Gives the device up: whatever is asked of it from now on fails.
    pub fn close(&self) {
        self.gpu.close();
    }

    /// How many cubes another engine had to make, and the first reason why; `None` where there were none.
    pub fn missed(&self) -> Option<(u64, &GpuError)> {
        self.why.get().map(|why| (self.missed.load(Ordering::Relaxed), why))
    }

    /// Another engine has to make a cube.
    pub(super) fn miss(&self, why: GpuError) {
        self.missed.fetch_add(1, Ordering::Relaxed);
        self.why.get_or_init(|| why);
    }

    /// For each face of a view, ranges of triangles on the device that may be seen: opaque ones, and see-through ones.
    pub(super) fn seen(&self, view: &CubeView) -> [[Vec<Range<u32>>; 2]; 6] {
        let mut seen: [[Vec<Range<u32>>; 2]; 6] = Default::default();
        for (kind, parts) in [&self.opaque, &self.see_through].into_iter().enumerate() {
            for part in parts {
                let bits = faces(part.bounds, view);
                for (_, ranges) in seen.iter_mut().enumerate().filter(|(face, _)| bits >> face & 1 == 1) {
                    match ranges[kind].last_mut() {
                        Some(last) if part.triangles.start - last.end <= GAP => last.end = part.triangles.end,
                        _ => ranges[kind].push(part.triangles.clone()),
                    }
                }
            }
        }
        seen
    }
}

/// An error where the scene is too large.
fn fits(gpu: &Gpu, scene: &Scene) -> Result<(), GpuError> {
    gpu.fits("corners", scene.positions.len() as u64 * CORNER)?;
    gpu.fits("triangles", scene.triangles.len() as u64 * TRIANGLE)
}

/// The faces that a box may be seen on, as bits.
fn faces(bounds: Aabb, view: &CubeView) -> u8 {
    let (middle, half) = (bounds.centre() - view.eye, bounds.size() * 0.5);
    let pad = (middle.abs() + half).element_sum() * PAD;
    let span = |axis: DVec3| {
        let (at, reach) = (axis.dot(middle), axis.abs().dot(half) + pad);
        [at - reach, at + reach]
    };
    let spans = [0, 1, 2].map(|k| span(view.frame.col(k)));
    let mut bits = 0;
    for face in 0..6 {
        let k = face / 2;
        let [x, y] = [spans[(k + 1) % 3], spans[(k + 2) % 3]];
        let farthest = if face % 2 == 0 { spans[k][1] } else { -spans[k][0] };
        // On the face, |x| and |y| are at most w.
        let aside = x[0].max(-x[1]).max(y[0]).max(-y[1]);
        bits |= u8::from(farthest > 0.0 && aside <= farthest) << face;
    }
    bits
}

impl Pipelines {
    fn new(device: &wgpu::Device) -> Self {
        let buffer = |binding, visibility, ty, has_dynamic_offset| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None },
            count: None,
        };
        let texture = |sample_type, view_dimension, visibility| wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility,
            ty: wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false },
            count: None,
        };
        let read = wgpu::BufferBindingType::Storage { read_only: true };
        let write = wgpu::BufferBindingType::Storage { read_only: false };
        let uniform = wgpu::BufferBindingType::Uniform;
        let layout = |entries: &[wgpu::BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries })
        };
        let (corner, pixel, count) = (ShaderStages::VERTEX, ShaderStages::FRAGMENT, ShaderStages::COMPUTE);
        let faces_layout = layout(&[
            buffer(0, corner, read, false),
            buffer(1, corner, read, false),
            buffer(2, corner | pixel, uniform, true),
        ]);
        let hits_layout = layout(&[
            texture(wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2, pixel),
            buffer(1, pixel, write, false),
        ]);
        let count_layout = layout(&[
            texture(wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2Array, count),
            buffer(1, count, read, false),
            buffer(2, count, read, false),
            buffer(3, count, write, false),
            buffer(4, count, uniform, false),
        ]);
        let module = shader_module(device, IDS);
        let draw = |pixels, groups: &[_], targets: &[_], writes_depth, compare| {
            let shaders = ["corner", pixels];
            DepthPipeline { module: &module, shaders, groups, targets, writes_depth, compare }.on(device)
        };
        // Of equal depths the one drawn first stays: the lesser index.
        let color = [Some(wgpu::TextureFormat::R32Uint.into())];
        let nearest = draw("nearest", &[Some(&faces_layout)], &color, true, wgpu::CompareFunction::Greater);
        let groups = [Some(&faces_layout), Some(&hits_layout)];
        let before = draw("before", &groups, &[], false, wgpu::CompareFunction::Always);
        let count = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&pipeline_layout(device, &[Some(&count_layout)])),
            module: &shader_module(device, include_str!("count.wgsl")),
            entry_point: Some("count"),
            compilation_options: Default::default(),
            cache: None,
        });
        Self { faces_layout, hits_layout, count_layout, nearest, before, count }
    }
}
