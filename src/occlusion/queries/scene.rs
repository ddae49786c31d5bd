//! A scene on the device for occlusion queries: triangles, depth texture, and pipelines.

use super::partners::partners;
use crate::gpu::{DepthPipeline, Gpu, GpuError, shader_module, words};
use crate::occlusion::geometry::Geometry;
use wgpu::{BufferUsages, DownlevelFlags, ShaderStages};

/// Required features of the adapter.
const NEEDS: [(DownlevelFlags, &str); 1] = [(DownlevelFlags::VERTEX_STORAGE, "buffers that vertex shaders read")];
/// Bytes of a position, of a triangle and of the camera.
const POSITION: u64 = 24;
const TRIANGLE: u64 = 32;
const CAMERA: u64 = 128;
const SHADERS: &str = concat!(include_str!("../../gpu/points.wgsl"), include_str!("hide.wgsl"));

/// Resources that persist between frames.
pub(super) struct GpuScene {
    pub gpu: Gpu,
    pub camera: wgpu::Buffer,
    pub boxes: wgpu::Buffer,
    pub depth: wgpu::TextureView,
    pub group: wgpu::BindGroup,
    /// Draws occluders.
    pub hides: wgpu::RenderPipeline,
    /// Draws queried boxes.
    pub asks: wgpu::RenderPipeline,
}

impl GpuScene {
    /// Opens the device; `boxes` is the size of its buffer for boxes, bytes.
    pub fn new(model: &Geometry<'_>, size: [usize; 2], boxes: u64) -> Result<Self, GpuError> {
        let gpu = Gpu::open(&NEEDS)?;
        fits(&gpu, model, size, boxes)?;
        let triangles: Vec<u32> = model
            .triangles
            .iter()
            .zip(partners(model))
            .flat_map(|([a, b, c], [ab, bc, ca])| [*a, *b, *c, 0, ab, bc, ca, 0])
            .collect();
        let positions = gpu.filled(&words(model.positions), BufferUsages::STORAGE);
        let triangles = gpu.filled(&triangles, BufferUsages::STORAGE);
        let camera = gpu.buffer(CAMERA, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        let boxes = gpu.buffer(boxes, BufferUsages::STORAGE | BufferUsages::COPY_DST);
        let depth = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: size[0] as u32, height: size[1] as u32, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Depth32Float,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let (layout, group) = bound(&gpu, [&positions, &triangles, &camera, &boxes]);
        let module = shader_module(&gpu.device, SHADERS);
        let pipeline = |shaders, writes_depth, compare| {
            let groups = &[Some(&layout)];
            DepthPipeline { module: &module, shaders, groups, writes_depth, compare }.on(&gpu.device)
        };
        let hides = pipeline(["corner", "hides"], true, wgpu::CompareFunction::Greater);
        let asks = pipeline(["rectangle", "asks"], false, wgpu::CompareFunction::GreaterEqual);
        gpu.check()?;
        Ok(Self { camera, boxes, depth: depth.create_view(&Default::default()), group, hides, asks, gpu })
    }
}

/// Fails if the scene, the picture or `boxes` bytes of boxes are too large.
fn fits(gpu: &Gpu, model: &Geometry<'_>, size: [usize; 2], boxes: u64) -> Result<(), GpuError> {
    gpu.fits("corners", model.positions.len() as u64 * POSITION)?;
    gpu.fits("triangles", model.triangles.len() as u64 * TRIANGLE)?;
    gpu.fits("boxes", boxes)?;
    let most = gpu.limits.max_texture_dimension_2d;
    let longest = size[0].max(size[1]);
    if longest > most as usize {
        let (what, bytes, limit) = ("a row's or a column's pixels", longest as u64 * 4, u64::from(most) * 4);
        return Err(GpuError::TooLarge { adapter: gpu.name.clone(), what, bytes, limit });
    }
    Ok(())
}

/// The bind group of the shaders: positions, triangles, camera and boxes.
fn bound(gpu: &Gpu, buffers: [&wgpu::Buffer; 4]) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
    let read = wgpu::BufferBindingType::Storage { read_only: true };
    let layout = [read, read, wgpu::BufferBindingType::Uniform, read];
    let layout: Vec<_> = (0..).zip(layout).map(|(binding, ty)| entry(binding, ty)).collect();
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &layout });
    let entries: Vec<_> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    let group = wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries };
    let group = gpu.device.create_bind_group(&group);
    (layout, group)
}

/// A buffer for both shaders.
fn entry(binding: u32, ty: wgpu::BufferBindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}
