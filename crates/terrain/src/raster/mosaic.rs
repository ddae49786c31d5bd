//! Joins adjoining rasters into one ground.
//!
//! All are on one grid, side by side or with a common row or column, as SRTM tiles have. If two have the same sample, the first
//! with a height there counts.

use super::error::{Place, RasterError};
use super::grid::{Grid, MAX_SAMPLES, MAX_SIDE, Part};
use std::ops::Range;

/// Greatest relative difference of sample distances.
const SAME_SPACING: f64 = 1e-6;
/// Greatest distance of coinciding samples of two rasters, as a part of the sample distance.
const SAME_SAMPLE: f64 = 0.01;

/// Rasters on one grid.
pub(super) struct Mosaic {
    /// The grid of all samples.
    pub grid: Grid,
    parts: Vec<Placed>,
    /// Number of samples in no raster.
    pub uncovered: u64,
    rows: Vec<f64>,
}

/// A raster and the grid place of its first sample.
struct Placed {
    part: Part,
    at: [i64; 2],
}

impl Placed {
    /// Columns or rows.
    fn range(&self, axis: usize) -> Range<i64> {
        self.at[axis]..self.at[axis] + i64::from(self.part.grid.size[axis])
    }
}

/// Common samples of two ranges; negative: samples between them.
fn common(a: &Range<i64>, b: &Range<i64>) -> i64 {
    a.end.min(b.end) - a.start.max(b.start)
}

impl Mosaic {
    /// Joins rasters; there is at least one.
    pub fn new(parts: Vec<Part>) -> Result<Self, RasterError> {
        let mut placed: Vec<Placed> = Vec::new();
        let mut base: Option<(Grid, String)> = None;
        let alone = parts.len() == 1;
        for part in parts {
            if !(alone || part.placed) {
                let what = "no georeference: it has no place beside other rasters; give it alone";
                return Err(RasterError::malformed(&part.file, Place::File, what));
            }
            let (grid, first) = base.get_or_insert_with(|| (part.grid, part.file.clone()));
            let at = place(grid, first, &part)?;
            placed.push(Placed { part, at });
        }
        let Some((mut grid, first)) = base else { return Err(RasterError::NoFiles) };
        abut(&placed)?;
        let bounds = [0, 1].map(|axis| {
            let start = placed.iter().map(|p| p.at[axis]).min().unwrap_or_default();
            start..placed.iter().map(|p| p.range(axis).end).max().unwrap_or_default()
        });
        let [columns, rows] = [0, 1].map(|axis| (bounds[axis].end - bounds[axis].start).unsigned_abs());
        if columns.max(rows) > u64::from(MAX_SIDE) || columns * rows > MAX_SAMPLES {
            return Err(RasterError::TooLarge { file: format!("{first} and others"), columns, rows });
        }
        for p in &mut placed {
            p.at = [0, 1].map(|axis| p.at[axis] - bounds[axis].start);
        }
        grid.size = [columns as u32, rows as u32];
        grid.first[0] += bounds[0].start as f64 * grid.step[0];
        grid.first[1] -= bounds[1].start as f64 * grid.step[1];
        let uncovered = columns * rows - covered(&placed);
        Ok(Self { grid: grid.checked(&first)?, parts: placed, uncovered, rows: Vec::new() })
    }

    /// The rasters, in the order given.
    pub fn parts(&self) -> impl Iterator<Item = &Part> {
        self.parts.iter().map(|p| &p.part)
    }

    /// Heights of rows.
    pub fn read(&mut self, rows: Range<u32>, out: &mut [f64]) -> Result<(), RasterError> {
        if let [only] = &mut self.parts[..] {
            return only.part.samples.read(rows, out);
        }
        out.fill(f64::NAN);
        let columns = self.grid.size[0] as usize;
        let wanted = i64::from(rows.start)..i64::from(rows.end);
        for p in &mut self.parts {
            let has = p.range(1);
            if common(&wanted, &has) <= 0 {
                p.part.samples.forget();
                continue;
            }
            let (start, west) = (p.at[1], p.at[0] as usize);
            let width = p.part.grid.size[0] as usize;
            self.rows.resize(width, 0.0);
            // Row by row: a window may be as high as a narrow raster.
            for y in wanted.start.max(has.start)..wanted.end.min(has.end) {
                let own = (y - start) as u32;
                p.part.samples.read(own..own + 1, &mut self.rows)?;
                let from = (y - wanted.start) as usize * columns + west;
                for (out, height) in out[from..from + width].iter_mut().zip(&self.rows) {
                    if out.is_nan() {
                        *out = *height;
                    }
                }
            }
        }
        Ok(())
    }
}

/// The place of a raster's first sample on the grid of another.
fn place(base: &Grid, first: &str, part: &Part) -> Result<[i64; 2], RasterError> {
    let apart = |what: String| RasterError::Apart { first: first.to_owned(), second: part.file.clone(), what };
    let grid = &part.grid;
    if grid.unit != base.unit {
        return Err(apart(format!("coordinates are in {:?} and not in the {:?}", grid.unit, base.unit)));
    }
    let mut at = [0; 2];
    for axis in [0, 1] {
        if (grid.step[axis] - base.step[axis]).abs() > SAME_SPACING * base.step[axis] {
            return Err(apart(format!("samples are {} apart and not the {}", grid.step[axis], base.step[axis])));
        }
        let sign = [1.0, -1.0][axis];
        let samples = sign * (grid.first[axis] - base.first[axis]) / base.step[axis];
        let off = (samples - samples.round()).abs();
        if off > SAME_SAMPLE {
            let way = ["east", "north"][axis];
            return Err(apart(format!("samples stand {off:.3} of a sample to the {way} of those")));
        }
        if samples.abs() > 2.0 * f64::from(MAX_SIDE) {
            return Err(apart(format!("its corner is {:.0} samples away from that", samples.abs())));
        }
        at[axis] = samples.round() as i64;
    }
    Ok(at)
}

/// Rejects rasters that overlap or are not connected.
fn abut(placed: &[Placed]) -> Result<(), RasterError> {
    let shared = |a: &Placed, b: &Placed| [0, 1].map(|axis| common(&a.range(axis), &b.range(axis)));
    let mut reached = vec![false; placed.len()];
    let mut next = vec![0];
    while let Some(i) = next.pop() {
        if std::mem::replace(&mut reached[i], true) {
            continue;
        }
        for (j, other) in placed.iter().enumerate().filter(|(j, _)| *j != i) {
            let [across, down] = shared(&placed[i], other);
            if across > 1 && down > 1 {
                let what = format!("it covers {across} x {down} samples");
                return Err(RasterError::Apart {
                    first: placed[i].part.file.clone(),
                    second: other.part.file.clone(),
                    what,
                });
            }
            // Adjoining along at least one sample, with no sample between.
            if across.min(down) >= 0 && across.max(down) > 0 {
                next.push(j);
            }
        }
    }
    let Some(lost) = reached.iter().position(|r| !r) else { return Ok(()) };
    let gap = |i: usize| {
        let [across, down] = shared(&placed[i], &placed[lost]).map(|c| (-c).max(0));
        (across.max(down), i)
    };
    let (distance, nearest) = (0..placed.len()).filter(|&i| reached[i]).map(gap).min().unwrap_or_default();
    let what = format!("it lies {distance} samples away from the border");
    let [first, second] = [nearest, lost].map(|i| placed[i].part.file.clone());
    Err(RasterError::Apart { first, second, what })
}

/// Number of samples in any raster. Rasters share at most single rows and columns.
fn covered(placed: &[Placed]) -> u64 {
    let mut edges: Vec<i64> = placed.iter().flat_map(|p| [p.range(1).start, p.range(1).end]).collect();
    edges.sort_unstable();
    edges.dedup();
    let mut sum = 0;
    for rows in edges.windows(2) {
        let mut ranges: Vec<Range<i64>> =
            placed.iter().filter(|p| p.range(1).contains(&rows[0])).map(|p| p.range(0)).collect();
        ranges.sort_unstable_by_key(|r| (r.start, r.end));
        let mut end = i64::MIN;
        for range in ranges {
            sum += (range.end - range.start.max(end)).max(0) * (rows[1] - rows[0]);
            end = end.max(range.end);
        }
    }
    sum.unsigned_abs()
}
