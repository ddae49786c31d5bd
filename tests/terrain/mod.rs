//! Ground.

mod file;
mod horizon;
mod raster;
mod select;
