//! Bind groups: the kinds of resources that shaders of the viewer take, and groups numbered from 0.

use enfilade::gpu::Gpu;
use wgpu::{
    BindGroup, BindGroupEntry, BindGroupLayout, BindGroupLayoutEntry, BindingResource, BindingType, BufferBindingType,
    ShaderStages, TextureSampleType, TextureView, TextureViewDimension,
};

/// A uniform buffer.
pub const UNIFORM: BindingType = buffer(BufferBindingType::Uniform);
/// A storage buffer that is read.
pub const STORAGE: BindingType = buffer(BufferBindingType::Storage { read_only: true });
/// A storage buffer that is written.
pub const WRITABLE: BindingType = buffer(BufferBindingType::Storage { read_only: false });
/// A depth texture.
pub const DEPTH_TEXTURE: BindingType = texture(TextureSampleType::Depth);
/// A depth texture with several samples a texel.
pub const SAMPLES_TEXTURE: BindingType = BindingType::Texture {
    sample_type: TextureSampleType::Depth,
    view_dimension: TextureViewDimension::D2,
    multisampled: true,
};
/// A texture of colours or numbers that is not filtered.
pub const COLOUR_TEXTURE: BindingType = texture(TextureSampleType::Float { filterable: false });
/// A texture of whole numbers.
pub const ITEM_TEXTURE: BindingType = texture(TextureSampleType::Uint);

const fn buffer(ty: BufferBindingType) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

const fn texture(sample_type: TextureSampleType) -> BindingType {
    BindingType::Texture { sample_type, view_dimension: TextureViewDimension::D2, multisampled: false }
}

/// The layout of a group with bindings from 0 on.
pub fn layout(gpu: &Gpu, visibility: ShaderStages, kinds: &[BindingType]) -> BindGroupLayout {
    let kinds: Vec<_> = (0..).zip(kinds.iter().copied()).collect();
    layout_at(gpu, visibility, &kinds)
}

/// The layout of a group with these bindings.
pub fn layout_at(gpu: &Gpu, visibility: ShaderStages, kinds: &[(u32, BindingType)]) -> BindGroupLayout {
    let entry = |&(binding, ty)| BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let entries: Vec<_> = kinds.iter().map(entry).collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

/// A group with bindings from 0 on.
pub fn group<'r>(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    resources: impl IntoIterator<Item = BindingResource<'r>>,
) -> BindGroup {
    let resources: Vec<_> = (0..).zip(resources).collect();
    group_at(gpu, layout, resources)
}

/// A group with these bindings.
pub fn group_at<'r>(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    resources: impl IntoIterator<Item = (u32, BindingResource<'r>)>,
) -> BindGroup {
    let entry = |(binding, resource)| BindGroupEntry { binding, resource };
    let entries: Vec<_> = resources.into_iter().map(entry).collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// A texture as a resource.
pub fn view(texture: &TextureView) -> BindingResource<'_> {
    BindingResource::TextureView(texture)
}
