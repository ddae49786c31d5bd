//! The input of a ground.

use std::ops::Range;

/// Heights of a regular grid, read some rows at a time.
pub trait Heights {
    /// Columns and rows; at least two of each.
    fn size(&self) -> [u32; 2];
    /// Metres between columns (to the east) and between rows (to the south): above 0, finite.
    fn spacing(&self) -> [f64; 2];
    /// Metres to the east and to the north of column 0 of row 0, the northernmost.
    fn first(&self) -> [f64; 2];
    /// For heights in whole numbers: metres per unit.
    fn lattice(&self) -> Option<f64>;
    /// Heights of some rows, row after row: metres, NaN for a void. Errors have one line.
    fn read(&mut self, rows: Range<u32>, out: &mut [f64]) -> Result<(), String>;
}
