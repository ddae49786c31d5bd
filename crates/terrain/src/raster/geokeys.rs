//! Georeference of a GeoTIFF: *OGC GeoTIFF Standard 1.1* (OGC 19-008r4), which names requirements by tags and keys.

use super::directory::Directory;
use super::error::{Place, RasterError};
use super::grid::{Grid, Source, Unit};

const PIXEL_SCALE: u16 = 33550;
const TIEPOINT: u16 = 33922;
const TRANSFORMATION: u16 = 34264;
const DIRECTORY: u16 = 34735;
const DOUBLES: u16 = 34736;
const TEXTS: u16 = 34737;

/// `GTModelTypeGeoKey`: 1 projected, 2 geographic, 3 geocentric.
const MODEL: u16 = 1024;
/// `GTRasterTypeGeoKey`: 1: a sample is an area; 2: a point.
const RASTER: u16 = 1025;
const ANGULAR_UNIT: u16 = 2054;
const PROJECTED: u16 = 3072;
const LINEAR_UNIT: u16 = 3076;
const LINEAR_SIZE: u16 = 3077;
const VERTICAL: u16 = 4096;
const VERTICAL_UNIT: u16 = 4099;

/// A unit whose size another key gives.
const USER_DEFINED: u16 = 32767;
/// EPSG's code of the degree.
const DEGREE: u16 = 9102;

/// Metres of a foot, and of a US survey foot.
const FOOT: f64 = 0.3048;
const US_FOOT: f64 = 1200.0 / 3937.0;

/// Projected systems of US states in US survey feet: ranges of EPSG's codes, for files that do not name the unit.
const IN_US_FEET: [(u16, u16); 12] = [
    (2225, 2250),
    (2254, 2255),
    (2257, 2264),
    (2267, 2268),
    (2271, 2272),
    (2274, 2279),
    (2283, 2289),
    (3089, 3089),
    (3547, 3547),
    (6473, 6473),
    (3437, 3438),
    (2965, 2968),
];
/// The same in feet.
const IN_FEET: [(u16, u16); 7] =
    [(2222, 2224), (2251, 2253), (2256, 2256), (2265, 2266), (2269, 2270), (2273, 2273), (2280, 2282)];

/// The grid of samples, and the unit of heights.
pub(super) struct Geo {
    pub grid: Grid,
    /// False if the file has no georeference.
    pub placed: bool,
    /// Metres per unit of height.
    pub vertical: f64,
}

/// Keys with whole numbers, and the texts.
struct Keys {
    shorts: Vec<(u16, u16)>,
    user_unit: Option<f64>,
    texts: String,
}

impl Keys {
    fn read(file: &str, directory: &Directory, source: &mut dyn Source) -> Result<Option<Self>, RasterError> {
        let Some(words) = directory.wholes(source, DIRECTORY)? else { return Ok(None) };
        let doubles = directory.reals(source, DOUBLES)?.unwrap_or_default();
        let texts = directory.text(source, TEXTS)?.unwrap_or_default().to_ascii_lowercase();
        let count = words.get(3).copied().unwrap_or_default() as usize;
        let entries = words.get(4..).unwrap_or_default().chunks_exact(4);
        if entries.len() < count {
            let what = format!("tag {DIRECTORY} has {} keys of {count}; write the file again", entries.len());
            return Err(RasterError::malformed(file, Place::File, what));
        }
        let mut keys = Self { shorts: Vec::new(), user_unit: None, texts };
        for entry in entries.take(count) {
            let (key, place, value) = (entry[0] as u16, entry[1], entry[3]);
            if place == 0 {
                keys.shorts.push((key, value as u16));
            } else if key == LINEAR_SIZE {
                keys.user_unit = doubles.get(value as usize).copied();
            }
        }
        Ok(Some(keys))
    }

    fn get(&self, key: u16) -> Option<u16> {
        self.shorts.iter().find(|(k, v)| *k == key && *v != 0).map(|(_, v)| *v)
    }
}

/// Metres per unit, by EPSG's code.
fn linear(unit: u16) -> Option<f64> {
    Some(match unit {
        9001 => 1.0,
        9002 => FOOT,
        9003 => US_FOOT,
        9036 => 1000.0,
        _ => return None,
    })
}

/// Reads the georeference of a raster of this size.
pub(super) fn read(
    file: &str,
    directory: &Directory,
    source: &mut dyn Source,
    size: [u32; 2],
    (spacing, notes): (Option<f64>, &mut Vec<String>),
) -> Result<Geo, RasterError> {
    let keys = Keys::read(file, directory, source)?;
    let Some((corner, step)) = affine(file, directory, source)? else {
        let grid = Grid::unplaced(size, spacing, notes).checked(file)?;
        return Ok(Geo { grid, placed: false, vertical: 1.0 });
    };
    let Some(keys) = keys else {
        notes.push("no coordinate system: metres are assumed".to_owned());
        let first = [corner[0] + 0.5 * step[0], corner[1] - 0.5 * step[1]];
        let grid = Grid { size, first, step, unit: Unit::Metres(1.0) }.checked(file)?;
        return Ok(Geo { grid, placed: true, vertical: 1.0 });
    };
    let unit = horizontal(file, &keys, notes)?;
    let vertical = vertical(file, &keys, unit, notes)?;
    // The sample of an area is at its centre, half a cell from the referenced corner.
    const IS_POINT: u16 = 2;
    let half = if keys.get(RASTER) == Some(IS_POINT) { 0.0 } else { 0.5 };
    let first = [corner[0] + half * step[0], corner[1] - half * step[1]];
    let grid = Grid { size, first, step, unit }.checked(file)?;
    Ok(Geo { grid, placed: true, vertical })
}

/// The place of raster coordinates 0, 0 and the steps to the east and to the south; `None` without georeference.
type Affine = ([f64; 2], [f64; 2]);

fn affine(file: &str, directory: &Directory, source: &mut dyn Source) -> Result<Option<Affine>, RasterError> {
    let wrong = |what: String| RasterError::malformed(file, Place::File, what);
    let warp = "warp it to a north-up raster (gdalwarp)";
    if let Some(m) = directory.reals(source, TRANSFORMATION)? {
        let [a, b, _, d, e, f, _, h, ..] = m[..] else {
            return Err(wrong(format!("ModelTransformation has {} numbers of 16; write the file again", m.len())));
        };
        if b != 0.0 || e != 0.0 {
            return Err(RasterError::unsupported(file, "a rotated raster (ModelTransformation)", warp));
        }
        if a < 0.0 || f > 0.0 {
            return Err(RasterError::unsupported(file, "a mirrored raster (ModelTransformation)", warp));
        }
        return Ok(Some(([d, h], [a, -f])));
    }
    let (scale, tie) = (directory.reals(source, PIXEL_SCALE)?, directory.reals(source, TIEPOINT)?);
    let (scale, tie) = match (scale, tie) {
        (None, None) => return Ok(None),
        (None, Some(_)) => {
            return Err(RasterError::unsupported(file, "georeference by tiepoints without a pixel scale", warp));
        }
        (Some(_), None) => return Err(wrong("a pixel scale without a tiepoint; write the file again".to_owned())),
        (Some(scale), Some(tie)) => (scale, tie),
    };
    let ([sx, sy, ..], [i, j, _, x, y, _, ..]) = (&scale[..], &tie[..]) else {
        let what = format!("{} numbers of a pixel scale and {} of a tiepoint; write the file again", scale.len(), tie.len());
        return Err(wrong(what));
    };
    if !(sx.is_finite() && sy.is_finite() && *sx > 0.0 && *sy > 0.0) {
        return Err(wrong(format!("a pixel scale of {sx} x {sy}; it must be finite and above 0: write the file again")));
    }
    Ok(Some(([x - i * sx, y + j * sy], [*sx, *sy])))
}

/// The unit of the coordinates.
fn horizontal(file: &str, keys: &Keys, notes: &mut Vec<String>) -> Result<Unit, RasterError> {
    const GEOGRAPHIC: u16 = 2;
    const GEOCENTRIC: u16 = 3;
    let hint = "warp it to degrees or metres (gdalwarp)";
    match keys.get(MODEL) {
        Some(GEOGRAPHIC) => {
            let unit = keys.get(ANGULAR_UNIT).unwrap_or(DEGREE);
            if unit != DEGREE {
                return Err(RasterError::unsupported(file, format!("the angular unit {unit} of EPSG"), hint));
            }
            return Ok(Unit::Degrees);
        }
        Some(GEOCENTRIC) => return Err(RasterError::unsupported(file, "a geocentric model", hint)),
        _ => {}
    }
    match (keys.get(LINEAR_UNIT), keys.user_unit) {
        (Some(USER_DEFINED), Some(metres)) if metres.is_finite() && metres > 0.0 => Ok(Unit::Metres(metres)),
        (Some(unit), _) => {
            let metres = linear(unit);
            let what = || RasterError::unsupported(file, format!("the linear unit {unit} of EPSG"), hint);
            metres.map(Unit::Metres).ok_or_else(what)
        }
        (None, _) => Ok(Unit::Metres(unstated(keys, notes))),
    }
}

/// Metres per unit of a file that does not name it: by its system's code, by its name, or metres.
fn unstated(keys: &Keys, notes: &mut Vec<String>) -> f64 {
    let within =
        |ranges: &[(u16, u16)]| keys.get(PROJECTED).is_some_and(|c| ranges.iter().any(|r| (r.0..=r.1).contains(&c)));
    let named = |words: &[&str]| words.iter().any(|w| keys.texts.contains(w));
    let (metres, unit) = if within(&IN_US_FEET) || named(&["ftus", "us survey f", "us_survey_f", "foot_us", "us foot"]) {
        (US_FOOT, "US survey feet, by its coordinate system")
    } else if within(&IN_FEET) || named(&["(ft)", "foot", "feet"]) {
        (FOOT, "feet, by its coordinate system")
    } else {
        (1.0, "metres are assumed")
    };
    notes.push(format!("no linear unit is stated: {unit}"));
    metres
}

/// Metres per unit of height.
fn vertical(file: &str, keys: &Keys, horizontal: Unit, notes: &mut Vec<String>) -> Result<f64, RasterError> {
    // NAVD88 height in US survey feet and in feet.
    const NAVD88_US_FEET: u16 = 6360;
    const NAVD88_FEET: u16 = 8228;
    let stated = match (keys.get(VERTICAL_UNIT), keys.get(VERTICAL)) {
        (Some(unit), _) => {
            let hint = "convert its heights to metres (gdal_calc)";
            Some(
                linear(unit)
                    .ok_or_else(|| RasterError::unsupported(file, format!("the vertical unit {unit} of EPSG"), hint))?,
            )
        }
        (None, Some(NAVD88_US_FEET)) => Some(US_FOOT),
        (None, Some(NAVD88_FEET)) => Some(FOOT),
        (None, _) => None,
    };
    if let Some(metres) = stated.filter(|m| *m != 1.0) {
        notes.push(format!("heights are in units of {metres:.7} m and were converted"));
    }
    if let (None, Unit::Metres(metres)) = (stated, horizontal)
        && metres != 1.0
    {
        notes.push(format!(
            "no vertical unit is stated: heights count as metres, although cells are in units of {metres:.7} m"
        ));
    }
    Ok(stated.unwrap_or(1.0))
}
