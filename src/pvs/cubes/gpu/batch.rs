//! Faces drawn together: their textures, the commands that fill them, and what is read back.

use super::NEAR;
use super::scene::{FACE, GpuScene};
use crate::gpu::{GpuError, two};
use crate::pvs::cubes::CubeView;
use std::ops::Range;
use wgpu::{BufferUsages, TextureUsages, TextureViewDimension};

/// Bytes of ids in one batch, unless one face takes more: what a few views of the usual size take.
const BUDGET: u64 = 16 << 20;
/// Rows of a texture are copied at multiples of this many bytes.
const ROW: u64 = 256;
/// Hits that there is room for at first, as a fraction of the pixels.
const HITS: f64 = 0.125;
/// Bytes of a hit.
const HIT: u64 = 12;

/// Textures and buffers for faces of one size.
pub(super) struct Batch {
    pub size: u32,
    pub layers: u32,
    /// No more layers fit.
    pub is_full: bool,
    ids: wgpu::Texture,
    id_views: Vec<wgpu::TextureView>,
    all_ids: wgpu::TextureView,
    depth_views: Vec<wgpu::TextureView>,
    faces: wgpu::Buffer,
    /// Bytes from one face to the next.
    stride: u64,
    group: wgpu::BindGroup,
    ids_here: wgpu::Buffer,
    hits: Hits,
    weights: Option<wgpu::Buffer>,
}

/// Where hits of see-through triangles go.
struct Hits {
    capacity: u32,
    there: wgpu::Buffer,
    here: wgpu::Buffer,
    groups: Vec<wgpu::BindGroup>,
}

/// A face to be drawn.
pub(super) struct Face<'v> {
    /// Which of the views it is of.
    pub index: usize,
    pub view: &'v CubeView,
    pub face: usize,
    pub opaque: Vec<Range<u32>>,
    pub see_through: Vec<Range<u32>>,
}

impl Batch {
    /// For `wanted` faces at once, or as many as fit.
    pub fn new(scene: &GpuScene, size: u32, wanted: usize) -> Result<Self, GpuError> {
        let gpu = &scene.gpu;
        let pitch = (u64::from(size) * 4).next_multiple_of(ROW);
        let bytes = pitch * u64::from(size);
        gpu.fits("a face's pixels", bytes)?;
        if size > gpu.limits.max_texture_dimension_2d {
            let (what, limit) = ("a row's pixels", u64::from(gpu.limits.max_texture_dimension_2d) * 4);
            return Err(GpuError::TooLarge { adapter: gpu.name.clone(), what, bytes: u64::from(size) * 4, limit });
        }
        let most = (BUDGET / bytes).clamp(1, u64::from(gpu.limits.max_texture_array_layers));
        let layers = (wanted as u64).clamp(1, most) as u32;
        let texture = |format, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: size, height: size, depth_or_array_layers: layers },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let view = |texture: &wgpu::Texture, dimension, first, count| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(dimension),
                base_array_layer: first,
                array_layer_count: Some(count),
                ..wgpu::TextureViewDescriptor::default()
            })
        };
        let ids = texture(wgpu::TextureFormat::R32Uint, TextureUsages::COPY_SRC);
        let depth = texture(wgpu::TextureFormat::Depth32Float, TextureUsages::empty());
        let views = |texture: &wgpu::Texture| -> Vec<wgpu::TextureView> {
            (0..layers).map(|layer| view(texture, TextureViewDimension::D2, layer, 1)).collect()
        };
        let (id_views, depth_views) = (views(&ids), views(&depth));
        let stride = FACE.next_multiple_of(u64::from(gpu.limits.min_uniform_buffer_offset_alignment));
        let faces = gpu.buffer(stride * u64::from(layers), BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &scene.pipelines.faces_layout,
            entries: &[
                entry(0, scene.positions.as_entire_binding()),
                entry(1, scene.triangles.as_entire_binding()),
                entry(
                    2,
                    wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                        buffer: &faces,
                        offset: 0,
                        size: wgpu::BufferSize::new(FACE),
                    }),
                ),
            ],
        });
        let pixels = f64::from(size).powi(2) * f64::from(layers);
        Ok(Self {
            size,
            layers,
            is_full: u64::from(layers) == most,
            all_ids: view(&ids, TextureViewDimension::D2Array, 0, layers),
            id_views,
            faces,
            stride,
            group,
            ids_here: gpu.buffer(bytes * u64::from(layers), BufferUsages::MAP_READ | BufferUsages::COPY_DST),
            hits: Hits::new(scene, &depth_views, (pixels * HITS) as u32 + 64)?,
            depth_views,
            ids,
            weights: None,
        })
    }

    /// Draws up to [`Batch::layers`] faces; hands their ids row by row, padded to `pitch` words, and the hits to `read`.
    pub fn draw<T>(
        &mut self,
        scene: &GpuScene,
        faces: &[Face<'_>],
        mut read: impl FnMut(usize, &[u32], &[u32]) -> T,
    ) -> Result<T, GpuError> {
        let gpu = &scene.gpu;
        let pitch = (u64::from(self.size) * 4).next_multiple_of(ROW);
        let bytes = pitch * u64::from(self.size) * faces.len() as u64;
        let any_hits = faces.iter().any(|f| !f.see_through.is_empty());
        loop {
            gpu.check()?;
            let mut commands = gpu.device.create_command_encoder(&Default::default());
            self.opaque(scene, faces, &mut commands);
            if any_hits {
                self.see_through(scene, faces, &mut commands);
            }
            commands.copy_texture_to_buffer(
                self.ids.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: &self.ids_here,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(pitch as u32),
                        rows_per_image: Some(self.size),
                    },
                },
                wgpu::Extent3d { width: self.size, height: self.size, depth_or_array_layers: faces.len() as u32 },
            );
            let mut buffers = vec![(&self.ids_here, bytes)];
            if any_hits {
                buffers.push((&self.hits.here, self.hits.here.size()));
            }
            let capacity = self.hits.capacity;
            let result = gpu.run(commands.finish(), &buffers, |views| {
                let ids = bytemuck::cast_slice(&views[0]);
                let hits: &[u32] = views.get(1).map_or(&[0], |view| bytemuck::cast_slice(view));
                // The list again with more room, if it was cut short.
                if hits[0] > capacity {
                    Err(hits[0])
                } else {
                    Ok(read((pitch / 4) as usize, ids, &hits[1..][..3 * hits[0] as usize]))
                }
            })?;
            match result {
                Ok(result) => return Ok(result),
                Err(needed) => self.hits = Hits::new(scene, &self.depth_views, needed.saturating_add(needed / 4))?,
            }
        }
    }

    /// Draws faces, adds up for each view that they are of (six a view, the first may begin in its middle) what objects show, and hands
    /// the sums to `read`: three words an object.
    pub fn count<T>(
        &mut self,
        scene: &GpuScene,
        faces: &[Face<'_>],
        weights: impl FnOnce() -> Vec<u32>,
        read: impl FnOnce(&[u32]) -> T,
    ) -> Result<T, GpuError> {
        let gpu = &scene.gpu;
        let first_face = faces.first().map_or(0, |f| f.face) as u32;
        let views = (first_face as usize + faces.len()).div_ceil(6);
        let bytes = (views * scene.objects).max(1) as u64 * 12;
        gpu.fits("sums of objects", bytes)?;
        let weights = self.weights.get_or_insert_with(|| gpu.filled(&weights(), BufferUsages::STORAGE)).clone();
        let sums = gpu.buffer(bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let here = gpu.buffer(bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let batch = gpu.filled(&[self.size, first_face, scene.objects as u32, 0], BufferUsages::UNIFORM);
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &scene.pipelines.count_layout,
            entries: &[
                entry(0, wgpu::BindingResource::TextureView(&self.all_ids)),
                entry(1, scene.owners_there.as_entire_binding()),
                entry(2, weights.as_entire_binding()),
                entry(3, sums.as_entire_binding()),
                entry(4, batch.as_entire_binding()),
            ],
        });
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        self.opaque(scene, faces, &mut commands);
        let mut pass = commands.begin_compute_pass(&Default::default());
        pass.set_pipeline(&scene.pipelines.count);
        pass.set_bind_group(0, &group, &[]);
        // Eight by eight invocations, each of sixteen pixels of a row.
        pass.dispatch_workgroups(self.size.div_ceil(128), self.size.div_ceil(8), faces.len() as u32);
        drop(pass);
        commands.copy_buffer_to_buffer(&sums, 0, &here, 0, bytes);
        gpu.run(commands.finish(), &[(&here, bytes)], |views| read(bytemuck::cast_slice(&views[0])))
    }

    /// The nearest opaque triangles.
    fn opaque(&self, scene: &GpuScene, faces: &[Face<'_>], commands: &mut wgpu::CommandEncoder) {
        let mut words = vec![0u32; self.stride as usize / 4 * faces.len()];
        for (layer, (face, words)) in faces.iter().zip(words.chunks_mut(self.stride as usize / 4)).enumerate() {
            let [x, y, into] = face.view.axes(face.face).map(|a| a.to_array().map(|v| v as f32));
            let eye = face.view.eye.to_array().map(two);
            let (high, low) = (eye.map(|e| e[0]), eye.map(|e| e[1]));
            let first = layer as u32 * self.size * self.size;
            let fourth = [(self.size as f32).to_bits(), 0, first, self.hits.capacity, NEAR.to_bits()];
            let rows = [high, low, x, y, into].into_iter().zip(fourth);
            for ((row, fourth), words) in rows.zip(words.chunks_mut(4)) {
                words[..3].copy_from_slice(&row.map(f32::to_bits));
                words[3] = fourth;
            }
        }
        scene.gpu.queue.write_buffer(&self.faces, 0, bytemuck::cast_slice(&words));
        for (layer, face) in faces.iter().enumerate() {
            let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &self.id_views[layer],
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &self.depth_views[layer],
                    depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                    stencil_ops: None,
                }),
                ..wgpu::RenderPassDescriptor::default()
            });
            pass.set_pipeline(&scene.pipelines.nearest);
            pass.set_bind_group(0, &self.group, &[layer as u32 * self.stride as u32]);
            face.opaque.iter().for_each(|range| pass.draw(3 * range.start..3 * range.end, 0..1));
        }
    }

    /// What is see-through and no farther, as a list.
    fn see_through(&self, scene: &GpuScene, faces: &[Face<'_>], commands: &mut wgpu::CommandEncoder) {
        commands.clear_buffer(&self.hits.there, 0, Some(4));
        for (layer, face) in faces.iter().enumerate().filter(|(_, face)| !face.see_through.is_empty()) {
            let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &self.depth_views[layer],
                    depth_ops: None,
                    stencil_ops: None,
                }),
                ..wgpu::RenderPassDescriptor::default()
            });
            pass.set_pipeline(&scene.pipelines.before);
            pass.set_bind_group(0, &self.group, &[layer as u32 * self.stride as u32]);
            pass.set_bind_group(1, &self.hits.groups[layer], &[]);
            face.see_through.iter().for_each(|range| pass.draw(3 * range.start..3 * range.end, 0..1));
        }
        commands.copy_buffer_to_buffer(&self.hits.there, 0, &self.hits.here, 0, self.hits.there.size());
    }
}

impl Hits {
    fn new(scene: &GpuScene, depth: &[wgpu::TextureView], capacity: u32) -> Result<Self, GpuError> {
        let gpu = &scene.gpu;
        let bytes = 4 + u64::from(capacity) * HIT;
        gpu.fits("hits of see-through triangles", bytes)?;
        let there = gpu.buffer(bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST);
        let group = |view: &wgpu::TextureView| {
            let entries = [entry(0, wgpu::BindingResource::TextureView(view)), entry(1, there.as_entire_binding())];
            let layout = &scene.pipelines.hits_layout;
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
        };
        let groups = depth.iter().map(group).collect();
        let here = gpu.buffer(bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        Ok(Self { capacity, there, here, groups })
    }
}

fn entry(binding: u32, resource: wgpu::BindingResource<'_>) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource }
}
