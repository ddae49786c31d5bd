//! Ground: terrain around buildings, drawn from tiles on disk within a stated error in pixels.

mod cache;
mod disk;
mod error;
mod format;
mod grid;
mod ground;
mod horizon;
#[cfg(feature = "make")]
mod make;
#[cfg(feature = "make")]
mod measure;
mod mesh;
mod metric;
mod parts;
mod placement;
#[cfg(feature = "make")]
pub mod raster;
mod select;

pub use disk::Disk;
pub use error::{GroundError, Part};
pub use format::{Header, Tile, Width};
pub use grid::{Grid, Key, MOST_SAMPLES, SIDES, Side};
pub use ground::{Ground, Loading};
pub use horizon::{Horizon, Things};
#[cfg(feature = "make")]
pub use make::{Heights, LEAST_TRIANGLES, Made, MakeOptions, make};
#[cfg(feature = "make")]
pub use measure::{Measured, flight, measure};
pub use mesh::{Sample, drawn, snapped};
pub use parts::PARTS;
pub use placement::Placement;
pub use select::{GroundScratch, GroundView, Limit, Patch};
