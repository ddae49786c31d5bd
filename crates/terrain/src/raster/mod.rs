//! Heights from files: GeoTIFF, SRTM's `.hgt`, Esri's `.asc`; adjoining files are one ground. Rows are read on demand.
//!
//! A reader takes at most 16 MiB, and 8192 bytes for each byte of its file.

mod directory;
mod error;
mod esri;
mod geokeys;
mod geotiff;
mod grid;
mod hgt;
mod mosaic;

pub use error::{Place, RasterError};
pub use grid::{MAX_SAMPLES, MAX_SIDE, RasterOptions};

use grid::{Part, Source};
use mosaic::Mosaic;
use std::fs::File;
use std::io::{BufReader, Cursor};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Heights on a grid: one file, or several adjoining ones.
pub struct Raster {
    mosaic: Mosaic,
    spacing: [f64; 2],
    first: [f64; 2],
    notes: Vec<String>,
    lattice: Option<f64>,
}

impl Raster {
    /// Opens files. Their order matters only where two have a height at one place: the first one counts.
    ///
    /// # Errors
    ///
    /// One line for a file that cannot be read, is damaged or is unsupported, and for files that do not form one ground.
    pub fn open(paths: &[PathBuf], options: &RasterOptions) -> Result<Self, RasterError> {
        let part = |path: &PathBuf| {
            let file = path.display().to_string();
            let io = |e| RasterError::io(&file, e);
            let opened = File::open(path).map_err(io)?;
            let about = opened.metadata().map_err(io)?;
            if about.is_dir() {
                return Err(RasterError::malformed(&file, Place::File, "a folder; give the files in it"));
            }
            read_part(&file, Box::new(BufReader::new(opened)), about.len(), options)
        };
        Self::of(paths.iter().map(part).collect::<Result<_, _>>()?)
    }

    /// Opens a file in memory; `name` has the format's extension.
    ///
    /// # Errors
    ///
    /// As of [`Raster::open`].
    pub fn from_bytes(name: &str, bytes: Vec<u8>, options: &RasterOptions) -> Result<Self, RasterError> {
        let length = bytes.len() as u64;
        Self::of(vec![read_part(name, Box::new(Cursor::new(bytes)), length, options)?])
    }

    fn of(parts: Vec<Part>) -> Result<Self, RasterError> {
        let mosaic = Mosaic::new(parts)?;
        let named = mosaic.parts().flat_map(|p| p.notes.iter().map(move |n| format!("{}: {n}", p.file)));
        let mut notes: Vec<String> = named.collect();
        let metres = mosaic.grid.in_metres();
        if let Some(latitude) = metres.latitude {
            let [x, y] = metres.spacing;
            notes.push(format!(
                "degrees were converted to metres at latitude {latitude:.4}: samples are {x:.3} x {y:.3} m apart"
            ));
        }
        if mosaic.uncovered > 0 {
            notes.push(format!(
                "{} samples of the rectangle around all rasters are in none of them; they become voids",
                mosaic.uncovered
            ));
        }
        let lattices: Vec<Option<f64>> = mosaic.parts().map(|p| p.lattice).collect();
        let lattice = lattices[0].filter(|first| lattices.iter().all(|l| *l == Some(*first)));
        Ok(Self { spacing: metres.spacing, first: metres.first, notes, lattice, mosaic })
    }

    /// Columns and rows, 1 to [`MAX_SIDE`] each, at most [`MAX_SAMPLES`] together.
    pub fn size(&self) -> [u32; 2] {
        self.mosaic.grid.size
    }

    /// Metres between columns, to the east, and between rows, to the south; positive and finite.
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }

    /// Metres to the east and to the north of the north-western sample (column 0, row 0), in the files' own system.
    pub fn first(&self) -> [f64; 2] {
        self.first
    }

    /// Assumptions and conversions, one line each, after the file's name.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// A step in metres that divides all heights, within rounding; `None` if samples are not whole numbers.
    pub fn lattice(&self) -> Option<f64> {
        self.lattice
    }

    /// Heights of rows, metres, row by row from the north; NaN for voids: a no-data value, NaN or infinity in the file.
    ///
    /// Reading from north to south is fastest.
    ///
    /// # Errors
    ///
    /// A file that cannot be read there, with the place in it.
    ///
    /// # Panics
    ///
    /// If rows are not below [`Raster::size`], or `out` does not have a place for each sample.
    pub fn read(&mut self, rows: Range<u32>, out: &mut [f64]) -> Result<(), RasterError> {
        let [columns, all] = self.size();
        assert!(rows.start <= rows.end && rows.end <= all, "rows {rows:?} of {all}");
        assert_eq!(out.len() as u64, rows.len() as u64 * u64::from(columns), "a place for each sample");
        if rows.is_empty() {
            return Ok(());
        }
        self.mosaic.read(rows, out)
    }
}

impl std::fmt::Debug for Raster {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let files: Vec<&str> = self.mosaic.parts().map(|p| p.file.as_str()).collect();
        f.debug_struct("Raster").field("files", &files).field("grid", &self.mosaic.grid).finish_non_exhaustive()
    }
}

/// Opens a file by its extension.
fn read_part(file: &str, source: Box<dyn Source>, length: u64, options: &RasterOptions) -> Result<Part, RasterError> {
    if let Some(spacing) = options.spacing.filter(|s| !(s.is_finite() && *s > 0.0)) {
        let what = format!("{spacing} m per sample requested; give a number above 0");
        return Err(RasterError::malformed(file, Place::File, what));
    }
    let extension = Path::new(file).extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "tif" | "tiff" => geotiff::open(file, source, length, options),
        "hgt" => hgt::open(file, source, length, options),
        "asc" => esri::open(file, source, options),
        _ => Err(RasterError::UnknownFormat { file: file.to_owned(), extension }),
    }
}
