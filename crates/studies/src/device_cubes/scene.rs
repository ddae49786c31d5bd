//! A scene on the device.

use enfilade::gpu::{Gpu, GpuError, pipeline_layout, shader_module, words};
use enfilade::scene::Scene;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use wgpu::{BufferBindingType, BufferUsages, DownlevelFlags, ShaderStages};

/// Bytes of a corner and of a triangle.
const CORNER: u64 = 24;
const TRIANGLE: u64 = 16;
/// What the adapter must have.
const NEEDS: [(DownlevelFlags, &str); 1] = [(DownlevelFlags::COMPUTE_SHADERS, "compute shaders")];

const IDS: &str = concat!(include_str!("../../../../src/gpu/points.wgsl"), include_str!("ids.wgsl"));

/// A scene made ready for cubes by a graphics processor; threads share it.
pub struct GpuScene {
    pub(super) gpu: Gpu,
    /// How many triangles are opaque: the first on the device, before those that are see-through.
    opaque: u32,
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

/// What is the same for every scene.
pub(super) struct Pipelines {
    pub ids_layout: wgpu::BindGroupLayout,
    pub count_layout: wgpu::BindGroupLayout,
    pub triangles: wgpu::ComputePipeline,
    pub blocks: wgpu::ComputePipeline,
    pub tiles: wgpu::ComputePipeline,
    pub count: wgpu::ComputePipeline,
}

impl GpuScene {
    /// Opens the device that there is and puts the scene there.
    pub fn new(scene: &Scene) -> Result<Self, GpuError> {
        let gpu = Gpu::open(&NEEDS)?;
        fits(&gpu, scene)?;
        let mut owners = vec![0; scene.triangles.len()];
        let mut triangles: Vec<u32> = Vec::with_capacity(scene.triangles.len() * 4);
        let mut opaque = 0;
        for is_opaque in [true, false] {
            for (index, object) in (0u32..).zip(&scene.objects).filter(|(_, o)| o.opaque == is_opaque) {
                for t in object.triangles.clone() {
                    owners[t as usize] = index;
                    let [a, b, c] = scene.triangles[t as usize];
                    triangles.extend([a, b, c, t]);
                }
            }
            if is_opaque {
                opaque = (triangles.len() / 4) as u32;
            }
        }
        let pipelines = Pipelines::new(&gpu.device);
        let scene = Self {
            opaque,
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

    /// Which triangles on the device are opaque.
    pub(super) fn opaque(&self) -> Range<u32> {
        0..self.opaque
    }

    /// And which aren't.
    pub(super) fn see_through(&self) -> Range<u32> {
        self.opaque..self.owners.len() as u32
    }
}

/// An error where the scene is too large.
fn fits(gpu: &Gpu, scene: &Scene) -> Result<(), GpuError> {
    gpu.fits("corners", scene.positions.len() as u64 * CORNER)?;
    gpu.fits("triangles", scene.triangles.len() as u64 * TRIANGLE)
}

impl Pipelines {
    fn new(device: &wgpu::Device) -> Self {
        let layout = |kinds: &[(wgpu::BufferBindingType, bool)]| {
            let entry = |(binding, &(ty, has_dynamic_offset)): (u32, &_)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None },
                count: None,
            };
            let entries: Vec<_> = (0u32..).zip(kinds).map(entry).collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
        };
        let read = (BufferBindingType::Storage { read_only: true }, false);
        let write = (BufferBindingType::Storage { read_only: false }, false);
        let [uniform, stage] = [false, true].map(|is_dynamic| (BufferBindingType::Uniform, is_dynamic));
        let ids_layout = layout(&[read, read, read, stage, write, write, write, write, write]);
        let count_layout = layout(&[read, read, read, write, uniform]);
        let pipeline = |module, layout, entry| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: None,
                layout: Some(&pipeline_layout(device, &[Some(layout)])),
                module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        let ids = shader_module(device, IDS);
        Self {
            triangles: pipeline(&ids, &ids_layout, "triangles_of_views"),
            blocks: pipeline(&ids, &ids_layout, "queued_blocks"),
            tiles: pipeline(&ids, &ids_layout, "tiles"),
            count: pipeline(&shader_module(device, include_str!("count.wgsl")), &count_layout, "count"),
            ids_layout,
            count_layout,
        }
    }
}
