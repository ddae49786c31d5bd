//! Which engine is fastest on this scene, by the clock. All give the same cubes, so the choice shows in nothing but time.

use super::{Cube, CubeEngine, CubeScene, CubeView, Packets, Raster};
use glam::DVec3;
use std::time::{Duration, Instant};

/// An engine of one's choice.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Engine {
    /// [`Raster`].
    Raster,
    /// [`Packets`].
    Packets,
}

impl Engine {
    /// Every engine that gives the same cubes as the others, to the bit.
    pub const ALL: [Self; 2] = [Self::Raster, Self::Packets];

    /// An engine for one thread.
    pub fn start<'s>(self, scene: &'s CubeScene) -> Box<dyn CubeEngine + Send + 's> {
        match self {
            Self::Raster => Box::new(Raster::new(scene)),
            Self::Packets => Box::new(Packets::new(scene)),
        }
    }

    /// The one that makes cubes of this size fastest at these eyes: a few of the places where cubes will stand. Each cube is made
    /// twice, and the lesser time counts.
    pub fn fastest(scene: &CubeScene, eyes: &[DVec3], size: u32) -> Self {
        let time = |engine: Self| {
            let (mut engine, mut out) = (engine.start(scene), Cube::default());
            let mut once = |eye: DVec3| {
                let start = Instant::now();
                engine.cube(&CubeView::new(eye, size), &mut out);
                start.elapsed()
            };
            eyes.iter().map(|&eye| once(eye).min(once(eye))).sum::<Duration>()
        };
        let [raster, packets] = Self::ALL.map(time);
        if packets < raster { Self::Packets } else { Self::Raster }
    }
}
