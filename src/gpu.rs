//! A graphics processor: how it is opened, what can go wrong with it, and points to 48 bits. Behind the cargo feature `gpu`.
//!
//! **Points** are pairs of `f32`, 48 bits of a coordinate, and so is the eye; shaders (`points.wgsl`) subtract the great parts first.
//! Compilers may reorder sums of floats, so the first difference passes through whole numbers, where it is combined with a word that
//! holds 0, which the compiler can't know: whatever order the rest is taken in, only differences and small parts are left in it.
//! `far_from_the_origin_is_as_good_as_near` of `tests/occlusion/queries.rs` fails on a driver where this doesn't hold.

use glam::DVec3;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use thiserror::Error;
use wgpu::{Backends, DownlevelFlags, Features};

/// No answer for this long: the device hangs. A software driver takes seconds for the largest cubes.
const PATIENCE: Duration = Duration::from_secs(60);

/// Why a graphics processor can't be used.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum GpuError {
    /// Nothing to draw with.
    #[error(
        "no graphics processor can be used: {reason}; Vulkan, Metal or Direct3D 12 is needed, a software driver will do"
    )]
    NoAdapter {
        /// What the drivers say.
        reason: String,
    },
    /// The adapter can't do what is needed.
    #[error("{adapter} has no {what}")]
    Lacks {
        /// Its name.
        adapter: String,
        /// What it hasn't.
        what: &'static str,
    },
    /// More than a buffer of the adapter holds.
    #[error("{what} take {bytes} bytes, more than the {limit} that a buffer of {adapter} holds")]
    TooLarge {
        /// Its name.
        adapter: String,
        /// Of what there is too much.
        what: &'static str,
        /// How much.
        bytes: u64,
        /// The most that fits.
        limit: u64,
    },
    /// The device was lost, ran out of memory, refused a command, or gave no answer. All that comes after fails alike.
    #[error("{adapter} failed: {reason}")]
    Failed {
        /// Its name.
        adapter: String,
        /// What the driver says.
        reason: String,
    },
}

/// A device, opened.
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// What it is given work by.
    pub queue: wgpu::Queue,
    /// What it can do at most.
    pub limits: wgpu::Limits,
    /// Of what was wished for, what it can do.
    pub features: Features,
    /// The adapter, its driver, and how it is spoken to.
    pub name: String,
    /// Whether it is a driver that draws on the processor.
    pub is_software: bool,
    adapter: wgpu::Adapter,
    /// What went wrong first.
    failure: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// The fastest adapter that there is; a software driver where there is no other. `needs` are what it must have, each with a name.
    ///
    /// # Errors
    ///
    /// [`GpuError`]: there is none, or it lacks something.
    pub fn open(needs: &[(DownlevelFlags, &'static str)]) -> Result<Self, GpuError> {
        Self::open_on(&Self::instance()?, None, needs, Features::empty())
    }

    /// Where adapters and surfaces come from.
    ///
    /// # Errors
    ///
    /// [`GpuError::NoAdapter`] where the system has no interface that can be used.
    pub fn instance() -> Result<wgpu::Instance, GpuError> {
        if wgpu::Instance::enabled_backend_features().is_empty() {
            return Err(GpuError::NoAdapter { reason: "this system has none of them".into() });
        }
        // Without it Direct3D 12 counts the corners of an indirect draw from 0, not from its first one.
        let indirect = wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL;
        Ok(wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: Backends::VULKAN | Backends::METAL | Backends::DX12,
            flags: if cfg!(windows) { indirect } else { wgpu::InstanceFlags::empty() },
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        }))
    }

    /// The same for an adapter that draws on a surface, if one is given, with those of the features `wishes` that it has.
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

    /// How the pixels of a surface may be laid out, the preferred way first; none where the adapter can't draw on it.
    pub fn formats(&self, surface: &wgpu::Surface<'_>) -> Vec<wgpu::TextureFormat> {
        surface.get_capabilities(&self.adapter).formats
    }

    /// The most that a buffer holds, bytes.
    pub fn most(&self) -> u64 {
        self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size)
    }

    /// An error where something doesn't fit into a buffer.
    pub fn fits(&self, what: &'static str, bytes: u64) -> Result<(), GpuError> {
        let limit = self.most();
        let too_large = || GpuError::TooLarge { adapter: self.name.clone(), what, bytes, limit };
        if bytes <= limit { Ok(()) } else { Err(too_large()) }
    }

    /// An empty buffer.
    pub fn buffer(&self, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor { label: None, size: bytes, usage, mapped_at_creation: false })
    }

    /// A buffer that holds some words; one that holds a 0 where there are none.
    pub fn filled(&self, words: &[u32], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let words = if words.is_empty() { &[0; 4] } else { words };
        let bytes: &[u8] = bytemuck::cast_slice(words);
        let buffer = self.buffer(bytes.len() as u64, usage | wgpu::BufferUsages::COPY_DST);
        self.queue.write_buffer(&buffer, 0, bytes);
        buffer
    }

    /// An error where anything has gone wrong so far.
    pub fn check(&self) -> Result<(), GpuError> {
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        match &*failure {
            Some(reason) => Err(GpuError::Failed { adapter: self.name.clone(), reason: reason.clone() }),
            None => Ok(()),
        }
    }

    /// Gives the device up.
    pub fn close(&self) {
        self.fail("closed");
        self.device.destroy();
    }

    /// Fails for good.
    pub fn fail(&self, reason: &str) -> GpuError {
        note(&self.failure, reason.to_owned());
        GpuError::Failed { adapter: self.name.clone(), reason: reason.to_owned() }
    }

    /// Waits for the end of some commands, with all that came before them.
    pub fn wait(&self, commands: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        let wait = wgpu::PollType::Wait { submission_index: Some(commands), timeout: Some(PATIENCE) };
        self.device.poll(wait).map(drop).map_err(|error| self.fail(&error.to_string()))
    }

    /// Runs commands to their end and hands what some buffers then hold to `read`.
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
            // Nobody listens any more after a failure.
            buffer.map_async(wgpu::MapMode::Read, ..*bytes, move |result| drop(told.send(result)));
        }
        self.wait(index)?;
        for _ in buffers {
            // Another thread that waits may be the one that is told.
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

/// A render pipeline of triangles without vertex buffers, held against a depth buffer: where pipelines of this crate differ.
pub(crate) struct DepthPipeline<'d> {
    pub module: &'d wgpu::ShaderModule,
    /// Entry points: of corners, and of pixels.
    pub shaders: [&'d str; 2],
    pub groups: &'d [Option<&'d wgpu::BindGroupLayout>],
    pub writes_depth: bool,
    pub compare: wgpu::CompareFunction,
}

impl DepthPipeline<'_> {
    /// Makes it.
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

/// What a pipeline binds.
pub fn pipeline_layout(device: &wgpu::Device, groups: &[Option<&wgpu::BindGroupLayout>]) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: groups,
        immediate_size: 0,
    })
}

/// The first failure is the one that tells why.
fn note(failure: &Mutex<Option<String>>, reason: String) {
    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(reason);
}

/// A number in two parts, of which the second is what the first lacks.
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
