//! Which engine a bake makes its cubes with, and what its file says about that.

#[cfg(feature = "gpu")]
use super::gpu::{GpuCubes, GpuError, GpuScene};
use super::{CubeEngine, CubeScene, Raster};
use crate::scene::Scene;
#[cfg(feature = "gpu")]
use std::sync::Arc;

/// Which engine is wanted.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize)]
pub enum Choice {
    /// [`Raster`]: the bytes are the same on every machine.
    #[default]
    Raster,
    /// [`GpuCubes`]: the bytes may depend on the driver, which the file's notes then say. Where there is no device that the scene fits on,
    /// [`Choice::Raster`], and a note. [`GpuScene::check`] tells beforehand.
    #[cfg(feature = "gpu")]
    Gpu,
}

/// The engine that was chosen; threads share it.
pub(in crate::pvs) struct Chosen {
    #[cfg(feature = "gpu")]
    gpu: Option<Result<Arc<GpuScene>, GpuError>>,
}

impl Chosen {
    /// Opens a device if one is wanted.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables, reason = "there is one engine"))]
    pub fn new(choice: Choice, scene: &Scene) -> Self {
        Self {
            #[cfg(feature = "gpu")]
            gpu: (choice == Choice::Gpu).then(|| GpuScene::new(scene).map(Arc::new)),
        }
    }

    /// An engine for one thread.
    pub fn start<'s>(&self, cubes: &'s CubeScene) -> Box<dyn CubeEngine + Send + 's> {
        #[cfg(feature = "gpu")]
        if let Some(Ok(gpu)) = &self.gpu {
            return Box::new(GpuCubes::new(gpu.clone(), cubes));
        }
        Box::new(Raster::new(cubes))
    }

    /// What the file should say of `count` cubes made so.
    pub fn note(&self, count: u64) -> Option<String> {
        #[cfg(feature = "gpu")]
        return self.gpu.as_ref().map(|gpu| match gpu {
            Ok(gpu) => {
                let made =
                    format!("visibility cubes were made on {}: with another driver, the bytes may differ", gpu.adapter());
                match gpu.missed() {
                    None => made,
                    Some((missed, why)) => format!("{made}; {missed} of {count} cubes were made without it: {why}"),
                }
            }
            Err(why) => format!("visibility cubes were made without a graphics processor: {why}"),
        });
        #[cfg(not(feature = "gpu"))]
        {
            let _ = count;
            None
        }
    }
}
