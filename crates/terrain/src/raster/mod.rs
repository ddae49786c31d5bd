//! Heights from files: GeoTIFF, SRTM's `.hgt`, Esri's `.asc`; several that abut are one ground. Rows are read as they are wanted.
//!
//! No file makes a reader take more than 16 MiB and 8192 bytes for each of its own.

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

/// Heights on a lattice: one file, or several that abut.
pub struct Raster {
    mosaic: Mosaic,
    spacing: [f64; 2],
    first: [f64; 2],
    notes: Vec<String>,
    lattice: Option<f64>,
}

impl Raster {
    /// Opens files; their order matters only where two have a height at the same place: the first of them gives it.
    ///
    /// # Errors
    ///
    /// One line for a file that can't be read, that is broken or that uses what isn't supported, and for files that are not one ground.
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

    /// Opens one file that is in memory, of a name with the format's extension.
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
            notes.push(format!("no raster has {} samples of the rectangle around all: they are voids", mosaic.uncovered));
        }
        let lattices: Vec<Option<f64>> = mosaic.parts().map(|p| p.lattice).collect();
        let lattice = lattices[0].filter(|first| lattices.iter().all(|l| *l == Some(*first)));
        Ok(Self { spacing: metres.spacing, first: metres.first, notes, lattice, mosaic })
    }

    /// Columns and rows, 1 to [`MAX_SIDE`] each, and [`MAX_SAMPLES`] together at most.
    pub fn size(&self) -> [u32; 2] {
        self.mosaic.grid.size
    }

    /// Metres between columns, to the east, and between rows, to the south; positive and finite.
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }

    /// Metres to the east and to the north of the sample of column 0 and row 0, the north-western one, in the files' own system.
    pub fn first(&self) -> [f64; 2] {
        self.first
    }

    /// What was assumed or converted, one line each, after the name of its file.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Metres of which every height is a whole multiple, to rounding; `None` where samples are not whole numbers.
    pub fn lattice(&self) -> Option<f64> {
        self.lattice
    }

    /// Heights of rows, metres, row by row from the north; NaN where there is none: a no-data value, NaN or infinity in the file.
    ///
    /// Windows that go from north to south cost least.
    ///
    /// # Errors
    ///
    /// A file that can't be read to there, with the place in it.
    ///
    /// # Panics
    ///
    /// If rows are not below [`Raster::size`], or `out` has not a place for each sample of them.
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
        let what = format!("{spacing} m a sample asked for; give a number above 0");
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
