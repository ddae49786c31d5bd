//! Esri ASCII grids, `.asc`: a header of names and numbers, then heights as text, the northernmost row first. Based on Esri's
//! description (*Esri ASCII raster format*, ArcGIS documentation). Names in any case; rows need not be lines.
//!
//! Opening scans the text once for the places of its rows, 8 bytes each. The text is never kept.

use super::error::{Place, RasterError};
use super::grid::{Grid, Heights, MAX_SIDE, Part, RasterOptions, Samples, Source, Unit};
use std::io::{self, SeekFrom};
use std::ops::Range;

/// Bytes per read.
const BLOCK: usize = 1 << 16;
/// Maximum bytes of a word.
const MAX_WORD: usize = 64;
/// Smaller cells at coordinates valid on Earth are in degrees: 0.05 degrees are 5 km, and no ground has cells of 0.05 m.
const DEGREES_BELOW: f64 = 0.05;

/// The words of a text.
struct Words {
    file: String,
    source: Box<dyn Source>,
    block: Vec<u8>,
    /// The next byte in the block.
    at: usize,
    /// The place of the block's end in the file.
    end: u64,
    line: u64,
    word: Vec<u8>,
}

impl Words {
    fn new(file: &str, source: Box<dyn Source>) -> Self {
        Self { file: file.to_owned(), source, block: Vec::new(), at: 0, end: 0, line: 1, word: Vec::new() }
    }

    /// The place of the next byte.
    fn place(&self) -> u64 {
        self.end - (self.block.len() - self.at) as u64
    }

    /// Continues at a byte of a line.
    fn seek(&mut self, byte: u64, line: u64) -> Result<(), RasterError> {
        self.line = line;
        if byte != self.place() {
            self.source.seek(SeekFrom::Start(byte)).map_err(|e| RasterError::io(&self.file, e))?;
            self.block.clear();
            (self.at, self.end) = (0, byte);
        }
        Ok(())
    }

    /// The next byte, not consumed; `None` at the end.
    fn peek(&mut self) -> Result<Option<u8>, RasterError> {
        if self.at == self.block.len() {
            self.block.resize(BLOCK, 0);
            let read = loop {
                match self.source.read(&mut self.block) {
                    Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                    other => break other.map_err(|e| RasterError::io(&self.file, e)),
                }
            };
            let read = read.inspect_err(|_| self.block.clear())?;
            self.block.truncate(read);
            self.at = 0;
            self.end += read as u64;
        }
        Ok(self.block.get(self.at).copied())
    }

    /// Skips to the next word; returns its place.
    fn skip(&mut self) -> Result<u64, RasterError> {
        while let Some(byte) = self.peek()?.filter(u8::is_ascii_whitespace) {
            self.line += u64::from(byte == b'\n');
            self.at += 1;
        }
        Ok(self.place())
    }

    /// The next word; `None` at the end.
    fn next(&mut self) -> Result<Option<&str>, RasterError> {
        self.skip()?;
        self.word.clear();
        while let Some(byte) = self.peek()?.filter(|b| !b.is_ascii_whitespace()) {
            if self.word.len() == MAX_WORD {
                return Err(self.wrong(format!("a word of more than {MAX_WORD} letters; this is not an .asc")));
            }
            self.word.push(byte);
            self.at += 1;
        }
        let Ok(word) = std::str::from_utf8(&self.word) else {
            return Err(self.wrong("bytes that are not text; this is not an .asc".to_owned()));
        };
        Ok(Some(word).filter(|w| !w.is_empty()))
    }

    /// The next number.
    fn number(&mut self, of: &str) -> Result<f64, RasterError> {
        let Some(word) = self.next()? else {
            return Err(self.wrong(format!("the file ends before {of}; copy it again")));
        };
        let read = word.parse::<f64>().ok();
        let text = word.to_owned();
        let comma = if text.contains(',') { "; decimals have a point" } else { "" };
        read.ok_or_else(|| self.wrong(format!("\"{text}\" is not a number for {of}{comma}")))
    }

    fn wrong(&self, what: String) -> RasterError {
        RasterError::malformed(&self.file, Place::Line(self.line), what)
    }
}

/// The values found in the header.
#[derive(Default)]
struct Header {
    columns: Option<u32>,
    rows: Option<u32>,
    /// West and south, and whether they are the corner or the centre of the south-western cell.
    corner: [Option<(f64, bool)>; 2],
    cell: Option<f64>,
    void: Option<f64>,
}

impl Header {
    /// Reads names and numbers up to the first height.
    fn read(words: &mut Words) -> Result<Self, RasterError> {
        let mut header = Self::default();
        loop {
            words.skip()?;
            if !words.peek()?.is_some_and(|b| b.is_ascii_alphabetic()) {
                return Ok(header);
            }
            let name = words.next()?.unwrap_or_default().to_ascii_lowercase();
            // Heights that are not numbers.
            if ["nan", "inf"].contains(&name.as_str()) {
                return Err(words.wrong(format!("\"{name}\" begins the heights; write the no-data value there")));
            }
            let value = words.number(&name)?;
            let count = |words: &Words| {
                let whole = value >= 1.0 && value.fract() == 0.0 && value <= f64::from(u32::MAX);
                if whole {
                    Ok(Some(value as u32))
                } else {
                    Err(words.wrong(format!("{name} of {value}; give a whole number from 1")))
                }
            };
            match name.as_str() {
                "ncols" => header.columns = count(words)?,
                "nrows" => header.rows = count(words)?,
                "xllcorner" => header.corner[0] = Some((value, true)),
                "yllcorner" => header.corner[1] = Some((value, true)),
                "xllcenter" => header.corner[0] = Some((value, false)),
                "yllcenter" => header.corner[1] = Some((value, false)),
                "cellsize" => header.cell = Some(value),
                "nodata_value" => header.void = Some(value),
                _ => {
                    let names = "ncols, nrows, xllcorner or xllcenter, yllcorner or yllcenter, cellsize, NODATA_value";
                    return Err(words.wrong(format!("\"{name}\" is not a header name; these are {names}")));
                }
            }
        }
    }

    fn grid(&self, words: &Words, options: &RasterOptions, notes: &mut Vec<String>) -> Result<Grid, RasterError> {
        let (Some(columns), Some(rows)) = (self.columns, self.rows) else {
            return Err(words.wrong("no ncols and nrows in its header; this is not an .asc".to_owned()));
        };
        let size = [columns, rows];
        let ([Some((west, west_corner)), Some((south, south_corner))], Some(cell)) = (self.corner, self.cell) else {
            return Grid::unplaced(size, options.spacing, notes).checked(&words.file);
        };
        let middle = |value: f64, corner: bool| if corner { value + 0.5 * cell } else { value };
        let first = [middle(west, west_corner), middle(south, south_corner) + cell * f64::from(rows - 1)];
        let extent = [cell * f64::from(columns), cell * f64::from(rows)];
        let on_earth = west >= -0.5 * FULL_TURN && west + extent[0] <= FULL_TURN && south.abs() <= POLE && first[1] <= POLE;
        let unit = if cell < DEGREES_BELOW && on_earth {
            notes.push(format!("cells of {cell} at {west}, {south}: degrees are assumed"));
            Unit::Degrees
        } else {
            Unit::Metres(1.0)
        };
        Grid { size, first, step: [cell; 2], unit }.checked(&words.file)
    }
}

/// Length of the equator, degrees; longitudes go to 180 or to 360.
const FULL_TURN: f64 = 360.0;
/// Latitude of a pole, degrees.
const POLE: f64 = 90.0;

struct Esri {
    words: Words,
    columns: u32,
    void: Option<f64>,
    /// The place and the line of each row.
    rows: Vec<(u64, u64)>,
}

/// Opens a text.
pub(super) fn open(file: &str, source: Box<dyn Source>, options: &RasterOptions) -> Result<Part, RasterError> {
    let mut words = Words::new(file, source);
    let header = Header::read(&mut words)?;
    let mut notes = Vec::new();
    let grid = header.grid(&words, options, &mut notes)?;
    let (rows, whole) = index(&mut words, grid.size)?;
    let placed = header.corner.iter().all(Option::is_some) && header.cell.is_some();
    let samples = Box::new(Esri { words, columns: grid.size[0], void: header.void, rows });
    Ok(Part { file: file.to_owned(), grid, placed, notes, lattice: whole.then_some(1.0), samples })
}

/// The places and lines of all rows, and whether every height is a whole number.
fn index(words: &mut Words, [columns, rows]: [u32; 2]) -> Result<(Vec<(u64, u64)>, bool), RasterError> {
    let mut places = Vec::new();
    let mut whole = true;
    for row in 0..rows.min(MAX_SIDE) {
        let place = words.skip()?;
        places.push((place, words.line));
        for column in 0..columns {
            match words.next()? {
                Some(word) => whole &= word.bytes().all(|b| b.is_ascii_digit() || b == b'-'),
                None => {
                    let what = format!("the file ends in row {row} at column {column} of {columns}; copy it again");
                    return Err(words.wrong(what));
                }
            }
        }
    }
    match words.next()? {
        None => Ok((places, whole)),
        Some(_) => Err(words.wrong(format!("more than {columns} x {rows} heights; correct ncols and nrows"))),
    }
}

impl Samples for Esri {
    fn read(&mut self, rows: Range<u32>, out: &mut [f64]) -> Result<(), RasterError> {
        let heights = Heights::plain(self.void);
        for (row, out) in rows.zip(out.chunks_exact_mut(self.columns as usize)) {
            let (place, line) = self.rows[row as usize];
            self.words.seek(place, line)?;
            for height in out.iter_mut() {
                *height = self.words.number("a height")?;
            }
            heights.convert(&self.words.file, row, out)?;
        }
        Ok(())
    }
}
