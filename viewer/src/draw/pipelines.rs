//! The scene on the graphics processor, and the pipelines that draw it.

use super::bind::{self, STORAGE, UNIFORM};
use super::draws::Draws;
use super::geometry::{self, Geometry};
use super::mesh::Triangles;
use super::ranks::ranks;
use enfilade::gpu::{Gpu, GpuError};
use enfilade::runtime::Camera;
use enfilade::scene::Scene;
use glam::{Mat4, Vec3, Vec4};
use std::ops::Range;
use wgpu::{BufferUsages, ShaderStages, TextureFormat};

/// Distance of the near plane, metres. What is seen is seen from the eye: a wall that is nearer than this would be looked through.
pub const NEAR: f32 = 1e-3;
/// Of depth: 1 at the near plane, 0 far away.
pub const DEPTH: TextureFormat = TextureFormat::Depth32Float;
/// Of items.
pub const ITEMS: TextureFormat = TextureFormat::R32Uint;

/// The shader of flat colours and items.
pub(super) const SCENE: &str = concat!(include_str!("geometry.wgsl"), include_str!("scene.wgsl"));

/// How the scene is drawn: what is solid, and what is a screen door.
pub struct Pair {
    solid: wgpu::RenderPipeline,
    transparent: wgpu::RenderPipeline,
}

/// A camera on the graphics processor, with the colours of objects.
pub struct CameraBinding {
    camera: wgpu::Buffer,
    /// Bound for every pipeline here.
    pub group: wgpu::BindGroup,
}

/// The scene, and ways to draw it.
pub struct Pipelines {
    /// Colours of objects.
    pub colours: Pair,
    /// The same in a mirror: what is behind the mirror is cut off.
    pub mirrored: wgpu::RenderPipeline,
    /// Numbers of objects.
    pub items: Pair,
    /// Colours and items with a section if those above are without one, or the reverse; made when they are first wanted.
    others: Option<[Pair; 2]>,
    is_cut: bool,
    format: TextureFormat,
    /// Layout of a camera's group.
    pub layout: wgpu::BindGroupLayout,
    /// Layout of the triangles' group.
    pub geometry_layout: wgpu::BindGroupLayout,
    /// Those of the scene.
    pub geometry: Geometry,
    triangles: wgpu::BindGroup,
    palette: wgpu::Buffer,
    /// By object, and of what was made: see [`ranks`].
    ranks: Vec<u8>,
}

impl Pipelines {
    /// Puts the scene there; pictures are of `format`.
    ///
    /// # Errors
    ///
    /// Where it doesn't fit.
    pub fn new(gpu: &Gpu, triangles: &Triangles, scene: &Scene, format: TextureFormat) -> Result<Self, GpuError> {
        let Triangles { places, corners, words: of_triangles } = triangles;
        gpu.fits("triangles", (12 * places.len()).max(4 * corners.len()) as u64)?;
        gpu.fits("colours", 4 * (scene.objects.len() as u64 + 1))?;
        let layout = bind::layout(gpu, ShaderStages::VERTEX_FRAGMENT, &[UNIFORM, STORAGE]);
        let mut ranks = ranks(scene);
        ranks.push(0);
        let geometry_layout = geometry::layout(gpu);
        let geometry = Geometry::new(gpu, places, corners, of_triangles);
        let groups = [Some(&layout), None, Some(&geometry_layout)];
        let make = Maker { gpu, groups: &groups, module: shader(gpu, SCENE) };
        Ok(Self {
            colours: make.pair("seen", ["colour", "colour_of_screen"], format),
            mirrored: make.pipeline("seen_in_mirror", "colour_in_mirror", format),
            items: make.pair("item", ["object", "object_of_screen"], ITEMS),
            others: None,
            is_cut: false,
            format,
            triangles: geometry.group(gpu, &geometry_layout),
            geometry,
            palette: gpu.filled(&words(&[], &ranks), BufferUsages::STORAGE),
            ranks,
            layout,
            geometry_layout,
        })
    }

    /// From now on a section cuts what is drawn, or none does.
    pub fn set_cut(&mut self, gpu: &Gpu, is_cut: bool) {
        if is_cut == self.is_cut {
            return;
        }
        self.is_cut = is_cut;
        let [colours, items] = self.others.get_or_insert_with(|| {
            let source = concat!(include_str!("geometry.wgsl"), include_str!("scene.wgsl"), include_str!("section.wgsl"));
            let groups = [Some(&self.layout), None, Some(&self.geometry_layout)];
            let make = Maker { gpu, groups: &groups, module: shader(gpu, source) };
            [
                make.pair("seen_cut", ["colour_cut", "colour_of_screen_cut"], self.format),
                make.pair("item_cut", ["object_cut", "object_of_screen_cut"], ITEMS),
            ]
        });
        std::mem::swap(colours, &mut self.colours);
        std::mem::swap(items, &mut self.items);
    }

    /// A camera of its own.
    pub fn eye(&self, gpu: &Gpu) -> CameraBinding {
        let camera = gpu.buffer(96, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        let group = bind::group(gpu, &self.layout, [&camera, &self.palette].map(wgpu::Buffer::as_entire_binding));
        CameraBinding { camera, group }
    }

    /// Gives objects their colours: red, green and blue, by object, and then of what was made.
    pub fn paint(&self, gpu: &Gpu, colours: &[[u8; 3]]) {
        gpu.queue.write_buffer(&self.palette, 0, bytemuck::cast_slice(&words(colours, &self.ranks)));
    }

    /// Binds the scene's triangles.
    pub fn bind(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding) {
        pass.set_bind_group(0, &eye.group, &[]);
        self.bind_triangles(pass);
    }

    /// Binds them without a camera.
    pub fn bind_triangles(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(2, &self.triangles, &[]);
    }
}

impl Pair {
    /// Draws runs of corners, after [`Pipelines::bind`].
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, solid: &[Range<u32>], transparent: &[Range<u32>]) {
        for (pipeline, runs) in [(&self.solid, solid), (&self.transparent, transparent)] {
            if !runs.is_empty() {
                pass.set_pipeline(pipeline);
                runs.iter().for_each(|run| pass.draw(run.clone(), 0..1));
            }
        }
    }

    /// Draws what a buffer lists, first solid things, then screens.
    pub fn draw_listed(&self, pass: &mut wgpu::RenderPass<'_>, draws: &Draws) {
        draws.first(pass, &self.solid);
        draws.second(pass, &self.transparent);
    }
}

impl CameraBinding {
    /// Sets where it looks; `cut`: what isn't before this plane (n, d) isn't drawn, in mirrors and with a section.
    pub fn set(&self, gpu: &Gpu, camera: &Camera, cut: Option<(Vec3, f32)>) {
        let (n, d) = cut.unwrap_or((Vec3::ZERO, -1.0));
        let clip = clip(camera);
        let words = [clip.x_axis, clip.y_axis, clip.z_axis, clip.w_axis, n.extend(d), camera.eye.extend(1.0)]
            .map(|word| word.to_array());
        gpu.queue.write_buffer(&self.camera, 0, bytemuck::cast_slice(words.as_flattened()));
    }
}

/// From metres relative to the origin to clip space: no far plane, depth 1 at the near plane and 0 far away.
pub fn clip(camera: &Camera) -> Mat4 {
    let row = |v: Vec3| v.extend(-v.dot(camera.eye));
    Mat4::from_cols(row(camera.x), row(camera.y), Vec4::W * NEAR, row(camera.w)).transpose()
}

/// Colours, white where there are none, with ranks in the highest bytes.
fn words(colours: &[[u8; 3]], ranks: &[u8]) -> Vec<u32> {
    let colours = colours.iter().chain(std::iter::repeat(&[255; 3]));
    ranks.iter().zip(colours).map(|(&rank, &[r, g, b])| u32::from_le_bytes([r, g, b, rank])).collect()
}

/// Compiles a shader.
pub fn shader(gpu: &Gpu, source: &'static str) -> wgpu::ShaderModule {
    gpu.device
        .create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source: wgpu::ShaderSource::Wgsl(source.into()) })
}

/// Depth as everything here uses it.
pub fn depth_state(write: bool, compare: wgpu::CompareFunction) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(write),
        depth_compare: Some(compare),
        stencil: Default::default(),
        bias: Default::default(),
    }
}

/// A render pipeline of the viewer.
pub struct PipelineDesc<'r> {
    /// The shaders.
    pub module: &'r wgpu::ShaderModule,
    /// The entry point for corners.
    pub corner: &'r str,
    /// The buffer that corners come from, if there is one.
    pub corners: Option<wgpu::VertexBufferLayout<'r>>,
    /// How corners make primitives.
    pub topology: wgpu::PrimitiveTopology,
    /// Layouts of the groups.
    pub groups: &'r [Option<&'r wgpu::BindGroupLayout>],
    /// Depth, if it is looked at.
    pub depth: Option<wgpu::DepthStencilState>,
    /// Samples a pixel.
    pub samples: u32,
    /// The entry point for pixels, if there are any, and what they are written to.
    pub pixel: Option<(&'r str, wgpu::ColorTargetState)>,
}

impl<'r> PipelineDesc<'r> {
    /// Triangles without a buffer, depth or pixels, of one sample.
    pub fn new(module: &'r wgpu::ShaderModule, corner: &'r str) -> Self {
        let topology = wgpu::PrimitiveTopology::TriangleList;
        Self { module, corner, corners: None, topology, groups: &[], depth: None, samples: 1, pixel: None }
    }

    /// The pipeline.
    pub fn pipeline(self, gpu: &Gpu) -> wgpu::RenderPipeline {
        let corners: Vec<_> = self.corners.into_iter().map(Some).collect();
        let (pixel, target) = self.pixel.unzip();
        let targets = [target];
        gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&layout(gpu, self.groups)),
            vertex: wgpu::VertexState {
                module: self.module,
                entry_point: Some(self.corner),
                compilation_options: Default::default(),
                buffers: &corners,
            },
            primitive: wgpu::PrimitiveState { topology: self.topology, ..Default::default() },
            depth_stencil: self.depth,
            multisample: wgpu::MultisampleState { count: self.samples, ..Default::default() },
            fragment: pixel.map(|pixel| wgpu::FragmentState {
                module: self.module,
                entry_point: Some(pixel),
                compilation_options: Default::default(),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// A pipeline of a compute shader.
pub fn compute(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    name: &str,
    groups: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::ComputePipeline {
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: Some(&layout(gpu, groups)),
        module,
        entry_point: Some(name),
        compilation_options: Default::default(),
        cache: None,
    })
}

/// The layout of a pipeline.
pub fn layout(gpu: &Gpu, groups: &[Option<&wgpu::BindGroupLayout>]) -> wgpu::PipelineLayout {
    let wanted = wgpu::PipelineLayoutDescriptor { label: None, bind_group_layouts: groups, ..Default::default() };
    gpu.device.create_pipeline_layout(&wanted)
}

/// Makes pipelines of the scene.
struct Maker<'m> {
    gpu: &'m Gpu,
    groups: &'m [Option<&'m wgpu::BindGroupLayout>],
    module: wgpu::ShaderModule,
}

impl Maker<'_> {
    fn pair(&self, vertex: &str, [solid, transparent]: [&str; 2], format: TextureFormat) -> Pair {
        Pair { solid: self.pipeline(vertex, solid, format), transparent: self.pipeline(vertex, transparent, format) }
    }

    fn pipeline(&self, vertex: &str, fragment: &str, format: TextureFormat) -> wgpu::RenderPipeline {
        // Models are wound both ways: nothing is culled by winding.
        PipelineDesc {
            groups: self.groups,
            depth: Some(depth_state(true, wgpu::CompareFunction::Greater)),
            pixel: Some((fragment, format.into())),
            ..PipelineDesc::new(&self.module, vertex)
        }
        .pipeline(self.gpu)
    }
}
