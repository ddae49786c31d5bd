//! Rasters from files.

use super::heights::Heights;
use crate::raster::Raster;
use std::ops::Range;

impl Heights for Raster {
    fn size(&self) -> [u32; 2] {
        Raster::size(self)
    }

    fn spacing(&self) -> [f64; 2] {
        Raster::spacing(self)
    }

    fn first(&self) -> [f64; 2] {
        Raster::first(self)
    }

    fn lattice(&self) -> Option<f64> {
        Raster::lattice(self)
    }

    fn read(&mut self, rows: Range<u32>, out: &mut [f64]) -> Result<(), String> {
        Raster::read(self, rows, out).map_err(|e| e.to_string())
    }
}
