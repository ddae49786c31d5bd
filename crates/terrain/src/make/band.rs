//! A band of rows of a raster: its heights, and the heights that tiles draw.

use super::footprint::Keeper;
use super::heights::Heights;
use crate::error::GroundError;
use crate::format::Width;

/// Approximate samples of a band: 4 million take 48 MiB. More: memory. Fewer: voids across bands seem farther from the ground.
const SAMPLES: u64 = 4 << 20;

/// Conversion of heights to the numbers of a file.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// The least height, metres.
    pub base: f64,
    /// Metres between two heights.
    pub step: f64,
    /// Bytes of a height.
    pub width: Width,
}

impl Scale {
    /// The number nearest to a height above the base; the void's for no height.
    pub fn number(&self, height: f64) -> u32 {
        if height.is_nan() {
            return self.width.void();
        }
        let most = f64::from(self.width.void() - 1);
        (height / self.step).round().clamp(0.0, most) as u32
    }

    /// The drawn height of a number, as in the run time: metres above the base, NaN for a void.
    pub fn drawn(&self, number: u32) -> f32 {
        if number >= self.width.void() { f32::NAN } else { number as f32 * self.step as f32 }
    }
}

/// Rows `first..=last` of a raster.
pub struct Band {
    /// The first row.
    pub first: u32,
    /// The last row; also the first of the next band.
    pub last: u32,
    columns: usize,
    /// Metres above the base, row after row; NaN for voids.
    true_heights: Vec<f64>,
    /// The drawn heights.
    drawn: Vec<f32>,
}

impl Band {
    /// Rows of a band: a multiple of `coarsest`, the distance of the coarsest tiles' samples.
    pub fn rows(columns: u32, coarsest: u32) -> u32 {
        let at_once = SAMPLES / u64::from(columns) / u64::from(coarsest);
        coarsest.saturating_mul(at_once.clamp(1, 1 << 16) as u32)
    }

    /// An empty band, to read into.
    pub fn new() -> Self {
        Self { first: 0, last: 0, columns: 0, true_heights: Vec::new(), drawn: Vec::new() }
    }

    /// Reads rows; samples under the keep-out triangles become voids.
    pub fn read(
        &mut self,
        from: &mut dyn Heights,
        [first, last]: [u32; 2],
        scale: &Scale,
        keeper: &Keeper<'_>,
    ) -> Result<(), GroundError> {
        let columns = from.size()[0] as usize;
        (self.first, self.last, self.columns) = (first, last, columns);
        let samples = columns * (last - first + 1) as usize;
        self.true_heights.clear();
        self.true_heights.resize(samples, f64::NAN);
        from.read(first..last + 1, &mut self.true_heights).map_err(GroundError::Raster)?;
        keeper.keep_out(first, columns, &mut self.true_heights);
        let (heights, base) = (&mut self.true_heights, scale.base);
        enfilade::math::parallel::for_each_chunk(heights, columns, |_, row| row.iter_mut().for_each(|h| *h -= base));
        self.drawn.clear();
        self.drawn.resize(samples, f32::NAN);
        let heights = &self.true_heights;
        enfilade::math::parallel::for_each_chunk(&mut self.drawn, columns, |row, drawn| {
            for (drawn, &h) in drawn.iter_mut().zip(&heights[row * columns..]) {
                *drawn = scale.drawn(scale.number(h));
            }
        });
        Ok(())
    }

    /// The raster's height, NaN for a void.
    pub fn true_height(&self, column: u32, row: u32) -> f64 {
        self.true_heights[self.at(column, row)]
    }

    /// The drawn height, NaN for a void.
    pub fn drawn(&self, column: u32, row: u32) -> f64 {
        f64::from(self.drawn[self.at(column, row)])
    }

    /// The raster's heights of a row, columns `from..=to`.
    pub fn true_row(&self, row: u32, from: u32, to: u32) -> &[f64] {
        &self.true_heights[self.at(from, row)..=self.at(to, row)]
    }

    fn at(&self, column: u32, row: u32) -> usize {
        (row - self.first) as usize * self.columns + column as usize
    }
}
