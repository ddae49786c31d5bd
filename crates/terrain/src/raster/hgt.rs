//! SRTM tiles, `.hgt`: a square of big-endian `i16`, the northernmost row first, without a header. The name has the corner:
//! `N34W119.hgt` begins at 34 degrees north, 119 west, and is a degree wide, with samples on its borders. Metres; -32768 is void.
//! Based on NASA's description (*SRTM Topography*, version 3, section 2).

use super::error::{Place, RasterError};
use super::grid::{Grid, Heights, Part, RasterOptions, Samples, Source, Unit};
use std::io::SeekFrom;
use std::ops::Range;
use std::path::Path;

/// The value of a void.
const VOID: f64 = -32768.0;

struct Hgt {
    file: String,
    source: Box<dyn Source>,
    side: u32,
    row: Vec<u8>,
}

/// Opens a tile of `length` bytes.
pub(super) fn open(file: &str, source: Box<dyn Source>, length: u64, options: &RasterOptions) -> Result<Part, RasterError> {
    let side = (length / 2).isqrt();
    if side < 2 || side * side * 2 != length {
        let what = format!(
            "{length} bytes are not a square of samples of 2 bytes; a tile has 1201 or 3601 on a side: copy it again"
        );
        return Err(RasterError::malformed(file, Place::File, what));
    }
    let side = u32::try_from(side).unwrap_or(u32::MAX);
    let mut notes = Vec::new();
    let stem = Path::new(file).file_stem().and_then(|s| s.to_str()).unwrap_or_default();
    let corner = corner(stem);
    let grid = match corner {
        Some([west, south]) => {
            let step = 1.0 / f64::from(side - 1);
            Grid { size: [side; 2], first: [west, south + 1.0], step: [step; 2], unit: Unit::Degrees }
        }
        None => Grid::unplaced([side; 2], options.spacing, &mut notes),
    };
    let grid = grid.checked(file)?;
    let row = vec![0; 2 * side as usize];
    let samples = Box::new(Hgt { file: file.to_owned(), source, side, row });
    Ok(Part { file: file.to_owned(), grid, placed: corner.is_some(), notes, lattice: Some(1.0), samples })
}

/// Longitude and latitude of the south-west corner, degrees, from a name such as `N34W119`.
fn corner(stem: &str) -> Option<[f64; 2]> {
    let name = stem.get(..7)?.to_ascii_uppercase();
    let signed = |part: &str, plus: char, minus: char, most: f64| {
        let sign = if part.starts_with(plus) { 1.0 } else { -1.0 };
        let digits = part.strip_prefix([plus, minus])?;
        let degrees = f64::from(digits.parse::<u16>().ok().filter(|_| !digits.starts_with('+'))?);
        (degrees <= most).then_some(sign * degrees)
    };
    Some([signed(name.get(3..)?, 'E', 'W', 180.0)?, signed(name.get(..3)?, 'N', 'S', 90.0)?])
}

impl Samples for Hgt {
    fn read(&mut self, rows: Range<u32>, out: &mut [f64]) -> Result<(), RasterError> {
        let io = |e| RasterError::io(&self.file, e);
        self.source.seek(SeekFrom::Start(u64::from(rows.start) * self.row.len() as u64)).map_err(io)?;
        for (row, out) in rows.zip(out.chunks_exact_mut(self.side as usize)) {
            self.source.read_exact(&mut self.row).map_err(io)?;
            for (bytes, out) in self.row.as_chunks().0.iter().zip(out.iter_mut()) {
                *out = f64::from(i16::from_be_bytes(*bytes));
            }
            Heights::plain(Some(VOID)).convert(&self.file, row, out)?;
        }
        Ok(())
    }
}
