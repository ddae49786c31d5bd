//! Materials of triangles, and the materials and pictures on the device.

use super::bind::{self, DEPTH_TEXTURE, STORAGE, UNIFORM, view};
use super::mesh::Mesh;
use super::sun::Sun;
use crate::looks::Looks;
use enfilade::ObjectId;
use enfilade::gpu::Gpu;
use enfilade::scene::Scene;
use glam::DVec3;
use half::f16;
use image::RgbaImage;
use image::imageops::{FilterType, resize};
use wgpu::{BindingType, BufferUsages, SamplerBindingType, ShaderStages, TextureSampleType, TextureViewDimension};

/// Materials of triangles, as [`super::geometry::Geometry`] has them.
pub struct Surfaces {
    /// By triangle: the material in the lower half of a word, and the face's normal in the upper one.
    pub of_triangles: Vec<u32>,
    /// By corner: texture coordinates as two `f16`, of those objects whose material has a picture.
    pub coordinates: Vec<u32>,
    /// By object, and of what was made: what to add to a corner's number to find its coordinates, going round at the end of numbers.
    pub first: Vec<u32>,
}

/// Where nothing has coordinates.
const NO_COORDINATES: u32 = u32::MAX;

impl Surfaces {
    /// Of a scene; triangles that are leaves are not among them.
    pub fn new(scene: &Scene, mesh: &Mesh, looks: &Looks, is_leaf: &[bool]) -> Self {
        let mut of_triangles = vec![0; mesh.triangles as usize];
        let (mut coordinates, mut first) = (Vec::new(), vec![NO_COORDINATES; scene.objects.len() + 1]);
        for (id, object) in (0..).map(ObjectId).zip(&scene.objects) {
            let range = mesh.ranges[id.index()].clone();
            let has_picture = looks.surfaces[looks.of_objects[id.index()] as usize].has_picture();
            if has_picture {
                first[id.index()] = (coordinates.len() as u32).wrapping_sub(range.start);
            }
            let drawn = object.triangles.clone().filter(|&t| !is_leaf[t as usize]);
            let words = &mut of_triangles[range.start as usize / 3..range.end as usize / 3];
            for (triangle, word) in drawn.zip(words) {
                let (made_of, at) = of_triangle(scene, looks, Some((id, triangle)), scene.corners(triangle as usize));
                *word = made_of;
                if has_picture {
                    coordinates.extend(at);
                }
            }
        }
        Self { of_triangles, coordinates, first }
    }
}

/// Material and texture coordinates of a triangle of an object, wherever it has been moved to; of no object: of a door.
pub fn of_triangle(scene: &Scene, looks: &Looks, of: Option<(ObjectId, u32)>, [a, b, c]: [DVec3; 3]) -> (u32, [u32; 3]) {
    let material = of.map_or(Some(looks.made), |(object, _)| looks.of_objects.get(object.index()).copied());
    let word = u32::from(material.unwrap_or_default()) | packed((b - a).cross(c - a)) << 16;
    let coordinates = of.zip(scene.trace.as_ref()).and_then(|((object, triangle), trace)| {
        let look = &trace.looks[trace.meshes[object.index()] as usize];
        look.texture_coordinates.get(trace.triangles[triangle as usize] as usize).copied()
    });
    let half = |x: f32| u32::from(f16::from_f32(x).to_bits());
    (word, near_zero(coordinates.unwrap_or_default()).map(|[u, v]| half(u) | half(v) << 16))
}

/// Pictures repeat: whole numbers are taken off, so that few digits are enough.
fn near_zero(corners: [[f32; 2]; 3]) -> [[f32; 2]; 3] {
    let least = |k: usize| corners.iter().map(|c| c[k]).fold(f32::MAX, f32::min).floor();
    let base = [least(0), least(1)];
    corners.map(|c| [0, 1].map(|k| if c[k].is_finite() { c[k] - base[k] } else { 0.0 }))
}

/// A normal as two bytes, on an octahedron.
fn packed(n: DVec3) -> u32 {
    let n = n.normalize_or(DVec3::Y).as_vec3();
    let p = n / (n.x.abs() + n.y.abs() + n.z.abs());
    let folded = |a: f32, b: f32| if p.z < 0.0 { (1.0 - b.abs()) * 1f32.copysign(a) } else { a };
    let byte = |x: f32| u32::from((x * 127.0).round() as i8 as u8);
    byte(folded(p.x, p.y)) | byte(folded(p.y, p.x)) << 8
}

/// Layout of the group of the sun, materials and pictures.
pub fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let layers = BindingType::Texture {
        sample_type: TextureSampleType::Float { filterable: true },
        view_dimension: TextureViewDimension::D2Array,
        multisampled: false,
    };
    let [filtering, comparing] = [SamplerBindingType::Filtering, SamplerBindingType::Comparison].map(BindingType::Sampler);
    let kinds = [UNIFORM, STORAGE, layers, filtering, DEPTH_TEXTURE, comparing, layers];
    bind::layout(gpu, ShaderStages::VERTEX_FRAGMENT, &kinds)
}

/// The sun, materials and pictures.
pub fn group(gpu: &Gpu, layout: &wgpu::BindGroupLayout, looks: &Looks, sun: &Sun) -> wgpu::BindGroup {
    let materials = gpu.filled(bytemuck::cast_slice(&looks.surfaces), BufferUsages::STORAGE);
    let [pictures, numbers] = pictures(gpu, &looks.pictures);
    let repeating = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: wgpu::AddressMode::Repeat,
        address_mode_v: wgpu::AddressMode::Repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    });
    let comparing = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        compare: Some(wgpu::CompareFunction::LessEqual),
        ..Default::default()
    });
    let resources = [
        sun.uniform.as_entire_binding(),
        materials.as_entire_binding(),
        view(&pictures),
        wgpu::BindingResource::Sampler(&repeating),
        view(&sun.shadows),
        wgpu::BindingResource::Sampler(&comparing),
        view(&numbers),
    ];
    bind::group(gpu, layout, resources)
}

/// Pictures as layers, with smaller and smaller ones of each: as colours, and as numbers.
fn pictures(gpu: &Gpu, pictures: &[RgbaImage]) -> [wgpu::TextureView; 2] {
    let side = pictures.first().map_or(1, RgbaImage::width);
    let layers = (pictures.len() as u32).clamp(1, gpu.limits.max_texture_array_layers);
    let levels = side.ilog2() + 1;
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: layers },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[wgpu::TextureFormat::Rgba8Unorm],
    });
    for (layer, picture) in (0..layers).zip(pictures) {
        let mut smaller = picture.clone();
        for mip_level in 0..levels {
            let width = side >> mip_level;
            if smaller.width() != width {
                smaller = resize(&smaller, width, width, FilterType::Triangle);
            }
            let origin = wgpu::Origin3d { x: 0, y: 0, z: layer };
            let to = wgpu::TexelCopyTextureInfo { texture: &texture, mip_level, origin, aspect: wgpu::TextureAspect::All };
            let rows =
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: Some(width) };
            let extent = wgpu::Extent3d { width, height: width, depth_or_array_layers: 1 };
            gpu.queue.write_texture(to, &smaller, rows, extent);
        }
    }
    [wgpu::TextureFormat::Rgba8UnormSrgb, wgpu::TextureFormat::Rgba8Unorm].map(|format| {
        let (dimension, format) = (Some(TextureViewDimension::D2Array), Some(format));
        texture.create_view(&wgpu::TextureViewDescriptor { dimension, format, ..Default::default() })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// The shader's way back.
    fn unpacked(word: u32) -> Vec3 {
        let [x, y] = [word, word >> 8].map(|b| f32::from(b as u8 as i8) / 127.0);
        let z = 1.0 - x.abs() - y.abs();
        let t = (-z).max(0.0);
        Vec3::new(x - t.copysign(x), y - t.copysign(y), z).normalize()
    }

    #[test]
    fn normals_come_back_and_walls_exactly() {
        for n in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z] {
            assert!(unpacked(packed(n)).distance(n.as_vec3()) < 1e-6, "{n}");
        }
        for i in 0..1000 {
            let (z, angle) = (f64::from(i) / 500.0 - 1.0, f64::from(i) * 2.4);
            let r = (1.0 - z * z).max(0.0).sqrt();
            let n = DVec3::new(r * angle.cos(), r * angle.sin(), z).normalize();
            assert!(unpacked(packed(n)).dot(n.as_vec3()) > 0.999, "{n}");
        }
    }

    #[test]
    fn pictures_that_repeat_lose_whole_numbers_only() {
        let near = near_zero([[100.25, -7.5], [101.75, -7.0], [100.5, -6.0]]);
        assert_eq!(near, [[0.25, 0.5], [1.75, 1.0], [0.5, 2.0]]);
        assert_eq!(near_zero([[f32::NAN, 0.0]; 3]), [[0.0; 2]; 3]);
    }
}
