//! Ground: heights on a lattice.

#[cfg(feature = "bake")]
pub mod raster;
