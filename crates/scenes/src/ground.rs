//! Seeded ground: mountains with valleys, and plains between them, as a GeoTIFF with a resolution of a decimetre or coarser.
//!
//! Heights are a sum of octaves of gradient noise (K. Perlin, *An image synthesizer*, 1985): smooth ones for the large-scale
//! terrain, ridged ones for mountains where it is high. Octaves are damped where the sum is already steep, so ridges are rough
//! and valleys smooth. Only `+ - * /` are used, which round alike on every machine. The crate `tiff` writes the file strip by
//! strip in the machine's byte order: machines of either order write the same heights, and those of one order the same bytes.

use super::GenerateError;
use enfilade::math::parallel;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Seek, Write};
use std::path::Path;
use tiff::TiffError;
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray16;
use tiff::tags::Tag;

/// Allowed samples per side of a ground.
pub const GROUND_SIZES: std::ops::RangeInclusive<u32> = 65..=32_769;
/// Allowed spacing of a ground's samples, metres.
pub const GROUND_SPACINGS: std::ops::RangeInclusive<f64> = 0.01..=1000.0;

/// Height range per metre of a side: 2 km on 4,097 samples 30 m apart.
const RELIEF: f64 = 2000.0 / 122_880.0;
/// Largest height range, metres: more than Earth's highest mountains rise above their base.
const MAX_RELIEF: f64 = 6000.0;
/// Height step, metres.
const STEP: f64 = 0.1;
/// Rows computed and written at once.
const STRIP: u32 = 16;
/// Wavelengths per side of the first octave.
const WAVES: u32 = 4;

/// Summary of a generated ground.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ground {
    /// Samples on a side.
    pub size: u32,
    /// Metres between them.
    pub spacing: f64,
    /// The seed.
    pub seed: u64,
    /// Lowest and highest height, metres.
    pub heights: [f64; 2],
}

/// Makes a ground and writes it as a GeoTIFF: `size` x `size` samples `spacing` metres apart, in metres of UTM zone 32 north.
///
/// # Errors
///
/// A size or spacing out of range, or an error of the file system.
pub fn ground(size: u32, spacing: f64, seed: u64, path: &Path) -> Result<Ground, GenerateError> {
    if !GROUND_SIZES.contains(&size) {
        return Err(GenerateError::GroundSize { size });
    }
    if !GROUND_SPACINGS.contains(&spacing) {
        return Err(GenerateError::GroundSpacing { spacing: spacing.to_string() });
    }
    let file = File::create(path).map_err(TiffError::from);
    let written = file.and_then(|file| write(size, spacing, seed, BufWriter::new(file)));
    let steps = written.map_err(|e| GenerateError::Write { what: e.to_string() })?;
    Ok(Ground { size, spacing, seed, heights: steps.map(|s| f64::from(s) * STEP) })
}

/// Writes the raster. Returns the lowest and highest height, in steps.
fn write<W: Write + Seek>(size: u32, spacing: f64, seed: u64, sink: W) -> Result<[u16; 2], TiffError> {
    let relief = (RELIEF * spacing * f64::from(size - 1)).min(MAX_RELIEF);
    let noise = Noise::new(size, seed);
    let mut file = TiffEncoder::new(sink)?;
    let mut image = file.new_image::<Gray16>(size, size)?;
    image.rows_per_strip(STRIP)?;
    let tags = image.encoder();
    let side = spacing * f64::from(size);
    // The middle of the zone, in the middle of Europe.
    let corner = [500_000.0 - 0.5 * side, 5_300_000.0 + 0.5 * side];
    tags.write_tag(Tag::ModelPixelScaleTag, &[spacing, spacing, 0.0][..])?;
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, corner[0], corner[1], 0.0][..])?;
    // Projected; a sample is an area; WGS 84 / UTM zone 32N; coordinates and heights in metres.
    let keys: [[u16; 4]; 6] =
        [[1, 1, 1, 5], [1024, 0, 1, 1], [1025, 0, 1, 1], [3072, 0, 1, 32632], [3076, 0, 1, 9001], [4099, 0, 1, 9001]];
    tags.write_tag(Tag::GeoKeyDirectoryTag, keys.as_flattened())?;
    let mut xml = String::from("<GDALMetadata>\n");
    for (name, role, value) in [("OFFSET", "offset", 0.0), ("SCALE", "scale", STEP)] {
        _ = writeln!(xml, "  <Item name=\"{name}\" sample=\"0\" role=\"{role}\">{value}</Item>");
    }
    xml += "</GDALMetadata>\n";
    /// GDAL's metadata tag.
    const GDAL_METADATA: u16 = 42112;
    tags.write_tag(Tag::Unknown(GDAL_METADATA), xml.as_str())?;
    let mut ends = [u16::MAX, 0];
    for start in (0..size).step_by(STRIP as usize) {
        let rows = start as usize..(start + STRIP).min(size) as usize;
        let made = parallel::map_range(rows, |row| noise.row(row as u32, relief / STEP));
        let strip = made.concat();
        ends = strip.iter().fold(ends, |[low, high], h| [low.min(*h), high.max(*h)]);
        image.write_strip(&strip)?;
    }
    image.finish()?;
    Ok(ends)
}

/// Octaves of gradient noise on a square.
struct Noise {
    size: u32,
    octaves: Vec<Octave>,
}

/// Gradient noise of one wavelength.
struct Octave {
    /// Samples of a wave, a power of two.
    wave: u32,
    seed: u64,
    /// For each sample of a wave: its position in the wave, the weight of the right end, and the slope of the weight.
    weights: Vec<[f64; 3]>,
}

/// The weight of the far end, `6 t^5 - 15 t^4 + 10 t^3`, and its slope.
fn fade(t: f64) -> [f64; 2] {
    [t * t * t * (t * (t * 6.0 - 15.0) + 10.0), 30.0 * t * t * (t * (t - 2.0) + 1.0)]
}

/// A hash of three numbers.
fn scramble(seed: u64, x: u32, y: u32) -> u64 {
    // The finaliser of SplitMix64 (Steele, Lea, Flood, 2014).
    let mut z = seed ^ (u64::from(x) << 32 | u64::from(y)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

impl Octave {
    fn new(wave: u32, seed: u64) -> Self {
        let weight = |i: u32| {
            let t = f64::from(i) / f64::from(wave);
            let [weight, slope] = fade(t);
            [t, weight, slope]
        };
        Self { wave, seed, weights: (0..wave).map(weight).collect() }
    }

    /// The gradient at a lattice corner, each component in -1 to 1.
    fn gradient(&self, x: u32, y: u32) -> [f64; 2] {
        let bits = scramble(self.seed, x, y);
        [bits as u32, (bits >> 32) as u32].map(|b| f64::from(b) / f64::from(u32::MAX) * 2.0 - 1.0)
    }

    /// Coefficients of the noise and its southward slope beside each lattice column at row `y`.
    ///
    /// At `u` waves east of the column its part of the noise is `n[0] + n[1] * u`, and of the slope `n[2] + n[3] * u`.
    fn columns(&self, y: u32, count: u32, out: &mut Vec<[f64; 4]>) {
        let (row, within) = (y / self.wave, y % self.wave);
        let [v, weight, slope] = self.weights[within as usize];
        out.clear();
        out.extend((0..count).map(|x| {
            let ([ax, ay], [bx, by]) = (self.gradient(x, row), self.gradient(x, row + 1));
            let (above, below) = (ay * v, by * (v - 1.0));
            let mixed = above + (below - above) * weight;
            let east = ax + (bx - ax) * weight;
            [mixed, east, ay + (by - ay) * weight + (below - above) * slope, (bx - ax) * slope]
        }));
    }
}

/// Damping of later octaves by steepness.
const DAMPING: f64 = 0.6;
/// Large-scale terrain below the first is plain, above the second mountainous.
const FOOT: f64 = -0.12;
const CREST: f64 = 0.3;
/// Roughness of plains relative to mountains.
const PLAIN: f64 = 0.02;
/// Octaves of the large-scale terrain.
const LAND: usize = 2;

impl Noise {
    fn new(size: u32, seed: u64) -> Self {
        let first = ((size - 1) / WAVES).next_power_of_two().max(2);
        let waves = std::iter::successors(Some(first), |w| (*w > 2).then_some(w / 2));
        let octaves = waves.zip(1..).map(|(wave, k)| Octave::new(wave, scramble(seed, k, 0))).collect();
        Self { size, octaves }
    }

    /// Heights of a row, in steps, at most `relief`.
    fn row(&self, y: u32, relief: f64) -> Vec<u16> {
        let count = self.size as usize;
        let mut sums = vec![Sum { amplitude: 1.0, ..Sum::default() }; count];
        let mut columns = Vec::new();
        for (k, octave) in self.octaves.iter().enumerate() {
            octave.columns(y, self.size / octave.wave + 2, &mut columns);
            for (ends, sums) in columns.windows(2).zip(sums.chunks_mut(octave.wave as usize)) {
                let [[a, b, c, d], [e, f, g, h]] = [ends[0], ends[1]];
                for (sum, [u, weight, slope]) in sums.iter_mut().zip(&octave.weights) {
                    let (left, right) = (a + b * u, e + f * (u - 1.0));
                    let (down_left, down_right) = (c + d * u, g + h * (u - 1.0));
                    let noise = left + (right - left) * weight;
                    let east = b + (f - b) * weight + (right - left) * slope;
                    let south = down_left + (down_right - down_left) * weight;
                    sum.add(k, noise, [east, south]);
                }
            }
        }
        sums.iter().map(|s| s.steps(relief)).collect()
    }
}

/// Octaves of one sample.
#[derive(Clone, Copy, Default)]
struct Sum {
    /// The large-scale terrain.
    land: f64,
    /// The mountains at full height.
    mountains: f64,
    /// Amplitude of the next octave.
    amplitude: f64,
    /// Slope of the octaves' noise so far, each in its own wavelengths. Unlike ridges, noise has no creases.
    slope: [f64; 2],
}

impl Sum {
    fn add(&mut self, octave: usize, noise: f64, slope: [f64; 2]) {
        if octave < LAND {
            self.land += noise * self.amplitude;
        }
        let ridge = 1.0 - 2.0 * noise.abs();
        let [x, y] = self.slope;
        self.mountains += self.amplitude * ridge / (1.0 + DAMPING * (x * x + y * y));
        self.slope = [x + slope[0] * self.amplitude, y + slope[1] * self.amplitude];
        self.amplitude *= 0.5;
    }

    /// The height, in steps.
    fn steps(&self, relief: f64) -> u16 {
        let t = ((self.land - FOOT) / (CREST - FOOT)).clamp(0.0, 1.0);
        let mountain = PLAIN + (1.0 - PLAIN) * t * t * (3.0 - 2.0 * t);
        // Mountains add up to at most 2, and the large-scale terrain is within -1 and 1.
        let height = 0.15 * (self.land + 1.0) + 0.5 * mountain * self.mountains.max(0.0);
        (height.clamp(0.0, 1.0) * relief + 0.5) as u16
    }
}
