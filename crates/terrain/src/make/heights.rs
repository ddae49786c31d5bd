//! What a ground is made of.

use std::ops::Range;

/// Heights of a regular grid, to be read some rows at a time.
pub trait Heights {
    /// Columns and rows; at least two of each.
    fn size(&self) -> [u32; 2];
    /// Metres between columns (to the east) and between rows (to the south): above 0, finite.
    fn spacing(&self) -> [f64; 2];
    /// Metres to the east and to the north of column 0 of row 0, the northernmost.
    fn first(&self) -> [f64; 2];
    /// Where heights are whole numbers: how many metres one is.
    fn lattice(&self) -> Option<f64>;
    /// Heights of some rows, row after row: metres, not a number for a void. An error is one line.
    fn read(&mut self, rows: Range<u32>, out: &mut [f64]) -> Result<(), String>;
}
