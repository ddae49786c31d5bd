//! Access to a graphics processor: opening, errors, and points with 48 bits. Behind the cargo feature `gpu`.
//!
//! **Points** are pairs of `f32`, 48 bits of a coordinate, and so is the eye; shaders (`points.wgsl`) subtract the high parts first.
//! Compilers may reorder float sums, so the first difference passes through integers, where it is combined with a word that is 0 at run
//! time, unknown to the compiler: for any order of the rest, only differences and low parts are left.
//! `far_from_the_origin_is_as_good_as_near` of `tests/occlusion/queries.rs` fails on a driver where this fails.

use glam::DVec3;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use thiserror::Error;
use wgpu::{Backends, DownlevelFlags, Features};

/// Time without an answer after which the device counts as hung. A software driver takes seconds for the largest cubes.
const PATIENCE: Duration = Duration::from_secs(60);

/// Errors of a graphics processor.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum GpuError {
    /// No adapter.
    #[error(
        "no graphics processor can be used: {reason}; Vulkan, Metal or Direct3D 12 is required; a software driver is enough"
    )]
    NoAdapter {
        /// The drivers' messages.
        reason: String,
    },
    /// The adapter lacks a required feature.
    #[error("{adapter} has no {what}")]
    Lacks {
        /// Its name.
        adapter: String,
        /// The missing feature.
        what: &'static str,
    },
    /// The data exceeds the adapter's buffer limit.
    #[error("{what} take {bytes} bytes; a buffer of {adapter} holds at most {limit}")]
    TooLarge {
        /// Its name.
        adapter: String,
        /// The kind of data.
        what: &'static str,
        /// Required bytes.
        bytes: u64,
        /// The limit, bytes.
        limit: u64,
    },
    /// The device was lost, ran out of memory, rejected a command, or did not answer. All later calls fail, too.
    #[error("{adapter} failed: {reason}")]
    Failed {
        /// Its name.
        adapter: String,
        /// The driver's message.
        reason: String,
    },
}

/// An open device.
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Its limits.
    pub limits: wgpu::Limits,
    /// The requested features that it has.
    pub features: Features,
    /// The adapter, its driver, and the graphics API.
    pub name: String,
    /// Whether it is a software driver.
    pub is_software: bool,
    adapter: wgpu::Adapter,
    /// The first failure.
    failure: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Opens the fastest adapter; a software driver if there is no other. `needs` are the required features, each with a name.
    ///
    /// # Errors
    ///
    /// [`GpuError`]: there is none, or it lacks a feature.
    pub fn open(needs: &[(DownlevelFlags, &'static str)]) -> Result<Self, GpuError> {
        Self::open_on(&Self::instance()?, None, needs, Features::empty())
    }

    /// Creates an instance, for adapters and surfaces.
    ///
    /// # Errors
    ///
    /// [`GpuError::NoAdapter`] if the system has no supported graphics API.
    pub fn instance() -> Result<wgpu::Instance, GpuError> {
        if wgpu::Instance::enabled_backend_features().is_empty() {
            return Err(GpuError::NoAdapter { reason: "this system has none of them".into() });
        }
        // Without it, Direct3D 12 counts the vertices of an indirect draw from 0, not from its first one.
        let indirect = wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL;
        Ok(wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: Backends::VULKAN | Backends::METAL | Backends::DX12,
            flags: if cfg!(windows) { indirect } else { wgpu::InstanceFlags::empty() },
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        }))
    }

    /// The same for an adapter that can draw on a given surface, with the available features of `wishes`.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub fn open_on(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
        needs: &[(DownlevelFlags, &'static str)],
        wishes: Features,
    ) -> Result<Self, GpuError> {
        let none = |reason: String| GpuError::NoAdapter { reason };
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: surface,
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options)).map_err(|e| none(e.to_string()))?;
        let info = adapter.get_info();
        let driver = [&info.driver, &info.driver_info].map(|s| s.trim()).join(" ");
        let name = format!("{} ({}, {})", info.name, driver.trim(), info.backend);
        let flags = adapter.get_downlevel_capabilities().flags;
        if let Some(&(_, what)) = needs.iter().find(|(flag, _)| !flags.contains(*flag)) {
            return Err(GpuError::Lacks { adapter: name, what });
        }
        let limits = adapter.limits();
        let features = adapter.features() & wishes;
        let wanted = wgpu::DeviceDescriptor {
            required_features: features,
            required_limits: limits.clone(),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&wanted)).map_err(|e| none(e.to_string()))?;
        let failure = Arc::new(Mutex::new(None));
        let to = failure.clone();
        device.on_uncaptured_error(Arc::new(move |error| note(&to, one_line(&error))));
        let to = failure.clone();
        device.set_device_lost_callback(move |_, reason| note(&to, format!("lost: {reason}")));
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        Ok(Self { device, queue, limits, features, name, is_software, adapter, failure })
    }

    /// Texture formats of a surface, the preferred one first; empty if the adapter cannot draw on it.
    pub fn formats(&self, surface: &wgpu::Surface<'_>) -> Vec<wgpu::TextureFormat> {
        surface.get_capabilities(&self.adapter).formats
    }

    /// Largest size of a buffer, bytes.
    pub fn most(&self) -> u64 {
        self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size)
    }

    /// Fails if data does not fit into a buffer.
    pub fn fits(&self, what: &'static str, bytes: u64) -> Result<(), GpuError> {
        let limit = self.most();
        let too_large = || GpuError::TooLarge { adapter: self.name.clone(), what, bytes, limit };
        if bytes <= limit { Ok(()) } else { Err(too_large()) }
    }

    /// An empty buffer.
    pub fn buffer(&self, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor { label: None, size: bytes, usage, mapped_at_creation: false })
    }

    /// A buffer with words; with zeros if there are none.
    pub fn filled(&self, words: &[u32], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let words = if words.is_empty() { &[0; 4] } else { words };
        let bytes: &[u8] = bytemuck::cast_slice(words);
        let buffer = self.buffer(bytes.len() as u64, usage | wgpu::BufferUsages::COPY_DST);
        self.queue.write_buffer(&buffer, 0, bytes);
        buffer
    }

    /// Fails if there was any failure so far.
    pub fn check(&self) -> Result<(), GpuError> {
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        match &*failure {
            Some(reason) => Err(GpuError::Failed { adapter: self.name.clone(), reason: reason.clone() }),
            None => Ok(()),
        }
    }

    /// Closes the device.
    pub fn close(&self) {
        self.fail("closed");
        self.device.destroy();
    }

    /// Marks the device as failed.
    pub fn fail(&self, reason: &str) -> GpuError {
        note(&self.failure, reason.to_owned());
        GpuError::Failed { adapter: self.name.clone(), reason: reason.to_owned() }
    }

    /// Waits for the end of a submission and all previous ones.
    pub fn wait(&self, commands: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        let wait = wgpu::PollType::Wait { submission_index: Some(commands), timeout: Some(PATIENCE) };
        self.device.poll(wait).map(drop).map_err(|error| self.fail(&error.to_string()))
    }

    /// Runs commands to their end, and passes the content of buffers to `read`.
    pub fn run<T>(
        &self,
        commands: wgpu::CommandBuffer,
        buffers: &[(&wgpu::Buffer, u64)],
        read: impl FnOnce(&[wgpu::BufferView]) -> T,
    ) -> Result<T, GpuError> {
        self.check()?;
        let index = self.queue.submit([commands]);
        let (told, done) = std::sync::mpsc::channel();
        for (buffer, bytes) in buffers {
            let told = told.clone();
            // There is no receiver after a failure.
            buffer.map_async(wgpu::MapMode::Read, ..*bytes, move |result| drop(told.send(result)));
        }
        self.wait(index)?;
        for _ in buffers {
            // Another waiting thread may receive the callback.
            match done.recv_timeout(PATIENCE) {
                Ok(Ok(())) => {}
                Ok(Err(error)) => return Err(self.fail(&error.to_string())),
                Err(_) => return Err(self.fail("no answer")),
            }
        }
        self.check()?;
        let views: Result<Vec<_>, _> = buffers.iter().map(|(buffer, bytes)| buffer.get_mapped_range(..*bytes)).collect();
        let result = match views {
            Ok(views) => read(&views),
            Err(error) => return Err(self.fail(&error.to_string())),
        };
        buffers.iter().for_each(|(buffer, _)| buffer.unmap());
        Ok(result)
    }
}

/// A render pipeline of triangles without vertex buffers, with a depth buffer: the parameters that differ between pipelines.
pub(crate) struct DepthPipeline<'d> {
    pub module: &'d wgpu::ShaderModule,
    /// Entry points of the vertex and the fragment shader.
    pub shaders: [&'d str; 2],
    pub groups: &'d [Option<&'d wgpu::BindGroupLayout>],
    pub writes_depth: bool,
    pub compare: wgpu::CompareFunction,
}

impl DepthPipeline<'_> {
    /// Creates the pipeline.
    pub fn on(&self, device: &wgpu::Device) -> wgpu::RenderPipeline {
        let Self { module, shaders: [corners, pixels], .. } = *self;
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&pipeline_layout(device, self.groups)),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(corners),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(self.writes_depth),
                depth_compare: Some(self.compare),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(pixels),
                compilation_options: Default::default(),
                targets: &[],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// Compiles a shader.
pub fn shader_module(device: &wgpu::Device, source: &'static str) -> wgpu::ShaderModule {
    let source = wgpu::ShaderSource::Wgsl(source.into());
    device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source })
}

/// The layout of a pipeline's bind groups.
pub fn pipeline_layout(device: &wgpu::Device, groups: &[Option<&wgpu::BindGroupLayout>]) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: groups,
        immediate_size: 0,
    })
}

/// Records a failure; only the first one counts.
fn note(failure: &Mutex<Option<String>>, reason: String) {
    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(reason);
}

/// A number in two parts; the second is the rounding error of the first.
pub fn two(x: f64) -> [f32; 2] {
    let high = x as f32;
    [high, (x - f64::from(high)) as f32]
}

/// Coordinates of points as words, for `points.wgsl`.
pub fn words(points: &[DVec3]) -> Vec<u32> {
    points.iter().flat_map(|p| p.to_array()).flat_map(|x| two(x).map(f32::to_bits)).collect()
}

fn one_line(error: &impl std::fmt::Display) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}
