//! The grid of a raster's samples, in its own units and in metres; common types of all readers.

use super::error::{Place, RasterError};
use std::io::{Read, Seek};
use std::ops::Range;

/// Maximum samples of a ground.
pub const MAX_SAMPLES: u64 = 1 << 31;
/// Maximum samples from west to east, and from north to south.
pub const MAX_SIDE: u32 = 1 << 20;
/// Greater heights are an unnamed no-data value, metres.
const MAX_HEIGHT: f64 = 1e6;
/// Greater coordinates lose the sample's place to rounding, in the raster's unit.
const MAX_COORDINATE: f64 = 1e12;

/// Semi-major axis of WGS 84, metres.
const WGS84_AXIS: f64 = 6_378_137.0;
/// Square of the eccentricity of WGS 84.
const WGS84_E2: f64 = 0.006_694_379_990_141_317;

/// Options for reading rasters.
#[derive(Clone, Copy, PartialEq, Default, Debug)]
pub struct RasterOptions {
    /// Metres per sample, for a raster without georeference; positive and finite. `None`: 1.
    pub spacing: Option<f64>,
}

/// Input of a raster.
pub(super) trait Source: Read + Seek + Send {}

impl<T: Read + Seek + Send> Source for T {}

/// The unit of a raster's coordinates.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Unit {
    /// Metres per unit.
    Metres(f64),
    /// Degrees of longitude and latitude.
    Degrees,
}

/// Places of samples, in the raster's unit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Grid {
    /// Columns, rows.
    pub size: [u32; 2],
    /// East and north of the sample of column 0, row 0.
    pub first: [f64; 2],
    /// Distance of columns, to the east, and of rows, to the south. Positive.
    pub step: [f64; 2],
    /// Unit of `first` and `step`.
    pub unit: Unit,
}

/// Reads samples by rows.
pub(super) trait Samples: Send {
    /// Heights of rows, row-major, metres; NaN for voids.
    fn read(&mut self, rows: Range<u32>, out: &mut [f64]) -> Result<(), RasterError>;

    /// Frees decoded samples.
    fn forget(&mut self) {}
}

/// A raster of one file.
pub(super) struct Part {
    /// Its path.
    pub file: String,
    /// Places of its samples.
    pub grid: Grid,
    /// Whether it has a georeference.
    pub placed: bool,
    /// Assumptions and conversions.
    pub notes: Vec<String>,
    /// Height step, metres: every height is a multiple of it.
    pub lattice: Option<f64>,
    /// Its samples.
    pub samples: Box<dyn Samples>,
}

/// A grid in metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct InMetres {
    /// Distance of columns and of rows.
    pub spacing: [f64; 2],
    /// East and north of the sample of column 0, row 0.
    pub first: [f64; 2],
    /// The latitude at which degrees were converted.
    pub latitude: Option<f64>,
}

impl Grid {
    /// A grid without georeference: `spacing` metres per sample, or 1.
    pub fn unplaced(size: [u32; 2], spacing: Option<f64>, notes: &mut Vec<String>) -> Self {
        let step = spacing.unwrap_or(1.0);
        let source = if spacing.is_some() { "as given" } else { "assumed" };
        notes.push(format!("no georeference: {step} m a sample, {source}"));
        Self { size, first: [0.0; 2], step: [step; 2], unit: Unit::Metres(1.0) }
    }

    /// Rejects grids that are too large or invalid.
    pub fn checked(self, file: &str) -> Result<Self, RasterError> {
        let [columns, rows] = self.size.map(u64::from);
        if columns * rows > MAX_SAMPLES || columns.max(rows) > u64::from(MAX_SIDE) {
            return Err(RasterError::TooLarge { file: file.to_owned(), columns, rows });
        }
        if columns == 0 || rows == 0 {
            return Err(RasterError::malformed(file, Place::File, format!("{columns} x {rows} samples: it is empty")));
        }
        if let Some(step) = self.step.iter().find(|s| !(s.is_finite() && **s > 0.0)) {
            let what = format!("samples are {step} apart; the distance must be finite and above 0");
            return Err(RasterError::malformed(file, Place::File, what));
        }
        if let Some(x) = self.first.iter().find(|x| !(-MAX_COORDINATE..=MAX_COORDINATE).contains(*x)) {
            let what = format!("its corner is at {x}; coordinates must be finite and at most {MAX_COORDINATE:e}");
            return Err(RasterError::malformed(file, Place::File, what));
        }
        let metres = self.in_metres();
        if metres.latitude.is_some_and(|l| l.is_nan() || l.abs() >= POLE) {
            let latitude = metres.latitude.unwrap_or_default();
            let what = format!("its middle is at latitude {latitude}, which is not between the poles");
            return Err(RasterError::malformed(file, Place::File, what));
        }
        if !metres.spacing.iter().all(|s| s.is_finite() && *s > 0.0) {
            let what = format!("samples are {:?} m apart; the distance must be finite and above 0", metres.spacing);
            return Err(RasterError::malformed(file, Place::File, what));
        }
        Ok(self)
    }

    /// In metres. Degrees are converted at the latitude of the middle row, with the radii of curvature of WGS 84.
    pub fn in_metres(&self) -> InMetres {
        let (unit, latitude) = match self.unit {
            Unit::Metres(m) => ([m, m], None),
            Unit::Degrees => {
                let latitude = self.first[1] - self.step[1] * 0.5 * f64::from(self.size[1].saturating_sub(1));
                (metres_a_degree(latitude), Some(latitude))
            }
        };
        let scaled = |v: [f64; 2]| [v[0] * unit[0], v[1] * unit[1]];
        InMetres { spacing: scaled(self.step), first: scaled(self.first), latitude }
    }
}

/// Latitude of a pole, degrees; a degree of longitude has no length there.
const POLE: f64 = 90.0;

/// Metres per degree of longitude and of latitude on WGS 84. Avoids the system's library, whose rounding differs between systems.
fn metres_a_degree(latitude: f64) -> [f64; 2] {
    let radian = std::f64::consts::PI / 180.0;
    let sine = sine(latitude * radian);
    let w = 1.0 - WGS84_E2 * sine * sine;
    let across = WGS84_AXIS / w.sqrt() * (1.0 - sine * sine).max(0.0).sqrt();
    let along = WGS84_AXIS * (1.0 - WGS84_E2) / (w * w.sqrt());
    [across * radian, along * radian]
}

/// The sine of an angle between the poles, radians, by its series; the first omitted term is below 1e-17.
fn sine(x: f64) -> f64 {
    let mut sum = 1.0;
    for k in (1..=12).rev() {
        let n = f64::from(2 * k);
        sum = 1.0 - x * x / (n * (n + 1.0)) * sum;
    }
    x * sum
}

/// Conversion of raw numbers to heights in metres; NaN for voids.
pub(super) struct Heights {
    /// The no-data value.
    pub void: Option<f64>,
    /// Metres: `raw * scale + offset`.
    pub scale: f64,
    /// Metres.
    pub offset: f64,
}

impl Heights {
    /// Without conversion, in metres.
    pub fn plain(void: Option<f64>) -> Self {
        Self { void, scale: 1.0, offset: 0.0 }
    }

    /// Converts raw numbers of `row` to heights.
    pub fn convert(&self, file: &str, row: u32, out: &mut [f64]) -> Result<(), RasterError> {
        let mut outside = false;
        for value in out.iter_mut() {
            let height = *value * self.scale + self.offset;
            let void = Some(*value) == self.void || !height.is_finite();
            outside |= !void && height.abs() > MAX_HEIGHT;
            *value = if void { f64::NAN } else { height };
        }
        let Some(column) = out.iter().position(|h| outside && h.abs() > MAX_HEIGHT) else { return Ok(()) };
        let what = format!("a height of {:e} m; if it means no data, set it as the file's no-data value", out[column]);
        Err(RasterError::malformed(file, Place::Sample { column: column as u32, row }, what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lengths of a degree from tables of WGS 84: 110,574 m and 111,320 m at the equator, 111,132 m and 78,847 m at 45 degrees.
    #[test]
    fn degrees_are_as_long_as_in_tables() {
        for (latitude, along, across) in
            [(0.0, 110_574.3, 111_319.5), (45.0, 111_131.8, 78_846.8), (-60.0, 111_412.3, 55_800.0)]
        {
            let [x, y] = metres_a_degree(latitude);
            assert!((x - across).abs() < 0.1 && (y - along).abs() < 0.1, "{latitude}: {x} {y}");
        }
        assert!((sine(1.57) - 1.57f64.sin()).abs() < 1e-15 && (sine(-0.3) - (-0.3f64).sin()).abs() < 1e-16);
    }
}
