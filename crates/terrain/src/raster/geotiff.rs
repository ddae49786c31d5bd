//! GeoTIFF: the first image of a file, in strips or tiles. The crate `tiff` unpacks data; metadata is checked here first.
//!
//! Uncompressed strips are read row by row. Otherwise one row of strips or tiles is kept unpacked.

use super::directory::Directory;
use super::error::{Place, RasterError};
use super::geokeys;
use super::grid::{Heights, MAX_SIDE, Part, RasterOptions, Samples, Source};
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use tiff::TiffError;
use tiff::decoder::{Decoder, Limits};

const WIDTH: u16 = 256;
const HEIGHT: u16 = 257;
const BITS: u16 = 258;
const COMPRESSION: u16 = 259;
const PHOTOMETRIC: u16 = 262;
const STRIP_OFFSETS: u16 = 273;
const SAMPLES_A_PIXEL: u16 = 277;
const ROWS_A_STRIP: u16 = 278;
const STRIP_BYTES: u16 = 279;
const PREDICTOR: u16 = 317;
const TILE_WIDTH: u16 = 322;
const TILE_HEIGHT: u16 = 323;
const TILE_OFFSETS: u16 = 324;
const TILE_BYTES: u16 = 325;
const FORMAT: u16 = 339;
/// GDAL's XML of a raster's scale and offset.
const GDAL_METADATA: u16 = 42112;
/// GDAL's no-data value, as text.
const GDAL_NODATA: u16 = 42113;

/// Supported values of `COMPRESSION`.
const UNCOMPRESSED: u64 = 1;
const READ: [u64; 4] = [UNCOMPRESSED, 5, 8, 32946];
/// How to convert to a supported raster.
const TRANSLATE: &str = "write it again: gdal_translate -co TILED=YES -co COMPRESS=DEFLATE";

/// Maximum bytes of an unpacked row of strips or tiles.
const MAX_ROW: u64 = 256 << 20;
/// Limit of unpacked bytes: a constant, and a factor per byte of the file that no supported compression exceeds.
const FILLS: [u64; 2] = [4 << 20, 4096];

/// The type of a sample.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    U8,
    U16,
    U32,
    I8,
    I16,
    I32,
    F32,
    F64,
}

impl Kind {
    /// Bytes.
    fn width(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Samples in this machine's order as numbers.
    fn widen(self, bytes: &[u8], out: &mut [f64]) {
        fn each<const N: usize>(bytes: &[u8], out: &mut [f64], number: impl Fn([u8; N]) -> f64) {
            for (bytes, out) in bytes.as_chunks().0.iter().zip(out) {
                *out = number(*bytes);
            }
        }
        match self {
            Self::U8 => each(bytes, out, |[b]| f64::from(b)),
            Self::I8 => each(bytes, out, |b| f64::from(i8::from_ne_bytes(b))),
            Self::U16 => each(bytes, out, |b| f64::from(u16::from_ne_bytes(b))),
            Self::I16 => each(bytes, out, |b| f64::from(i16::from_ne_bytes(b))),
            Self::U32 => each(bytes, out, |b| f64::from(u32::from_ne_bytes(b))),
            Self::I32 => each(bytes, out, |b| f64::from(i32::from_ne_bytes(b))),
            Self::F32 => each(bytes, out, |b| f64::from(f32::from_ne_bytes(b))),
            Self::F64 => each(bytes, out, f64::from_ne_bytes),
        }
    }
}

/// Layout of samples in the file.
struct Layout {
    size: [u32; 2],
    kind: Kind,
    tiled: bool,
    /// Columns and rows of a strip or tile; at most those of the image.
    chunk: [u32; 2],
    /// Whether strips are stored uncompressed.
    plain: bool,
    /// By strip or tile, row by row: place and number of bytes.
    chunks: Vec<[u64; 2]>,
}

impl Layout {
    /// Number of tiles side by side.
    fn across(&self) -> u32 {
        self.size[0].div_ceil(self.chunk[0])
    }

    /// Rows of samples in a row of strips or tiles.
    fn rows_of(&self, row: u32) -> Range<u32> {
        let start = row * self.chunk[1];
        start..start.saturating_add(self.chunk[1]).min(self.size[1])
    }

    /// "strip" or "tile", and its number.
    fn name(&self, index: usize) -> String {
        format!("{} {index}", if self.tiled { "tile" } else { "strip" })
    }

    /// Whether a tile or strip is missing in the file: it has the no-data value, or 0.
    fn is_absent(&self, index: usize) -> bool {
        self.chunks[index] == [0, 0]
    }
}

/// Reads tags.
struct Tags<'a> {
    file: &'a str,
    directory: &'a Directory,
    source: &'a mut dyn Source,
}

impl Tags<'_> {
    fn one(&mut self, tag: u16) -> Result<Option<u64>, RasterError> {
        self.directory.one(self.source, tag)
    }

    fn or(&mut self, tag: u16, default: u64) -> Result<u64, RasterError> {
        Ok(self.one(tag)?.unwrap_or(default))
    }

    fn must(&mut self, tag: u16, name: &str) -> Result<u64, RasterError> {
        let wrong =
            || RasterError::malformed(self.file, Place::File, format!("no {name} (tag {tag}); write the file again"));
        self.directory.one(self.source, tag)?.ok_or_else(wrong)
    }

    fn side(&mut self, tag: u16, name: &str) -> Result<u32, RasterError> {
        let value = self.must(tag, name)?;
        let wrong =
            || RasterError::malformed(self.file, Place::File, format!("{name} of {value}; 1 to 2^32 - 1 are supported"));
        u32::try_from(value).ok().filter(|n| *n > 0).ok_or_else(wrong)
    }

    fn refuse<T>(&self, what: String) -> Result<T, RasterError> {
        Err(RasterError::unsupported(self.file, what, TRANSLATE))
    }

    /// The type of the one sample of a pixel.
    fn kind(&mut self) -> Result<Kind, RasterError> {
        const BLACK_IS_0: u64 = 1;
        let samples = self.or(SAMPLES_A_PIXEL, 1)?;
        if samples != 1 {
            return self.refuse(format!("a raster of {samples} samples a pixel"));
        }
        let photometric = self.or(PHOTOMETRIC, BLACK_IS_0)?;
        if photometric != BLACK_IS_0 {
            return self.refuse(format!("photometric interpretation {photometric}"));
        }
        let (bits, format) = (self.or(BITS, 1)?, self.or(FORMAT, 1)?);
        Ok(match (format, bits) {
            (1, 8) => Kind::U8,
            (1, 16) => Kind::U16,
            (1, 32) => Kind::U32,
            (2, 8) => Kind::I8,
            (2, 16) => Kind::I16,
            (2, 32) => Kind::I32,
            (3, 32) => Kind::F32,
            (3, 64) => Kind::F64,
            _ => {
                let name = ["unsigned", "signed", "float"].get((format as usize).wrapping_sub(1)).unwrap_or(&"unknown");
                return self.refuse(format!("a sample of {bits} bits ({name}, format {format})"));
            }
        })
    }

    /// Whether samples are compressed, in a supported way.
    fn compressed(&mut self, kind: Kind) -> Result<bool, RasterError> {
        let compression = self.or(COMPRESSION, UNCOMPRESSED)?;
        if !READ.contains(&compression) {
            let name = match compression {
                2..=4 => " (CCITT)",
                6 | 7 => " (JPEG)",
                32773 => " (PackBits)",
                34712 => " (JPEG 2000)",
                34887 => " (LERC)",
                34925 => " (LZMA)",
                50000 => " (ZSTD)",
                50001 => " (WebP)",
                _ => "",
            };
            return self.refuse(format!("compression {compression}{name}"));
        }
        match self.or(PREDICTOR, 1)? {
            1 | 2 => {}
            3 if [Kind::F32, Kind::F64].contains(&kind) => {}
            predictor => return self.refuse(format!("predictor {predictor} for samples of type {kind:?}")),
        }
        Ok(compression != UNCOMPRESSED)
    }

    fn layout(&mut self) -> Result<Layout, RasterError> {
        let size = [self.side(WIDTH, "ImageWidth")?, self.side(HEIGHT, "ImageLength")?];
        let too_large = |[columns, rows]: [u32; 2]| {
            let file = self.file.to_owned();
            Err(RasterError::TooLarge { file, columns: columns.into(), rows: rows.into() })
        };
        if size.iter().any(|s| *s > MAX_SIDE) {
            return too_large(size);
        }
        let kind = self.kind()?;
        let compressed = self.compressed(kind)?;
        let tiled = self.directory.has(TILE_OFFSETS);
        let (chunk, tables) = if tiled {
            let chunk = [self.side(TILE_WIDTH, "TileWidth")?, self.side(TILE_HEIGHT, "TileLength")?];
            if chunk.iter().any(|s| *s > MAX_SIDE) {
                return self.refuse(format!("a tile of {} x {} samples", chunk[0], chunk[1]));
            }
            (chunk, [TILE_OFFSETS, TILE_BYTES])
        } else {
            let rows = self.or(ROWS_A_STRIP, u64::from(size[1]))?.min(u64::from(size[1]));
            if rows == 0 {
                return Err(RasterError::malformed(self.file, Place::File, "strips of 0 rows; write the file again"));
            }
            ([size[0], rows as u32], [STRIP_OFFSETS, STRIP_BYTES])
        };
        let [offsets, bytes] = tables;
        let (offsets, bytes) = (self.directory.wholes(self.source, offsets)?, self.directory.wholes(self.source, bytes)?);
        let (Some(offsets), Some(bytes)) = (offsets, bytes) else {
            let what = "no table of strips or tiles; write the file again";
            return Err(RasterError::malformed(self.file, Place::File, what));
        };
        let predicted = self.or(PREDICTOR, 1)? != 1;
        let chunks: Vec<[u64; 2]> = offsets.iter().zip(&bytes).map(|(o, b)| [*o, *b]).collect();
        let layout = Layout { size, kind, tiled, chunk, plain: !(compressed || tiled || predicted), chunks };
        let expected = u64::from(layout.across()) * u64::from(size[1].div_ceil(chunk[1]));
        if offsets.len() != bytes.len() || expected != layout.chunks.len() as u64 {
            let what =
                format!("tables of {} places and {} lengths for {expected} strips or tiles", offsets.len(), bytes.len());
            return Err(RasterError::malformed(self.file, Place::File, what + "; write the file again"));
        }
        self.within(&layout, compressed)?;
        Ok(layout)
    }

    /// Rejects strips and tiles beyond the end of the file, or too large to unpack.
    fn within(&self, layout: &Layout, compressed: bool) -> Result<(), RasterError> {
        let length = self.directory.length;
        let width = layout.kind.width() as u64;
        for (index, [at, bytes]) in layout.chunks.iter().enumerate().filter(|(i, _)| !layout.is_absent(*i)) {
            let rows = layout.rows_of(index as u32 / layout.across()).len() as u64;
            let rows = if layout.tiled { u64::from(layout.chunk[1]) } else { rows };
            let needed = if compressed { 0 } else { rows * u64::from(layout.chunk[0]) * width };
            if *bytes < needed || at.checked_add(*bytes).is_none_or(|end| end > length) {
                let what = format!("{} is cut off: it needs {} bytes", layout.name(index), needed.max(*bytes));
                let what = format!("{what}, and the file ends at byte {length}; copy it again");
                return Err(RasterError::malformed(self.file, Place::Byte(*at), what));
            }
        }
        let row = u64::from(layout.size[0]) * u64::from(layout.chunk[1].min(layout.size[1])) * width;
        if !layout.plain && row > MAX_ROW.min(FILLS[0] + FILLS[1] * length) {
            let name = if layout.tiled { "tiles" } else { "strips" };
            return self.refuse(format!("a row of {name} of {row} bytes in a file of {length}"));
        }
        Ok(())
    }
}

/// The number of `<Item ... role="ROLE">NUMBER</Item>` in GDAL's metadata.
fn item(xml: &str, role: &str) -> Option<f64> {
    let (_, rest) = xml.split_once(&format!("role=\"{role}\""))?;
    let (_, rest) = rest.split_once('>')?;
    rest.split_once('<')?.0.trim().parse().ok()
}

/// Opens a file of `length` bytes.
pub(super) fn open(
    file: &str,
    mut source: Box<dyn Source>,
    length: u64,
    options: &RasterOptions,
) -> Result<Part, RasterError> {
    let directory = Directory::read(file, &mut *source, length)?;
    let mut tags = Tags { file, directory: &directory, source: &mut *source };
    let layout = tags.layout()?;
    let mut notes = Vec::new();
    let geo = geokeys::read(file, &directory, &mut *source, layout.size, (options.spacing, &mut notes))?;
    let xml = directory.text(&mut *source, GDAL_METADATA)?.unwrap_or_default();
    let (scale, offset) = (item(&xml, "scale").unwrap_or(1.0), item(&xml, "offset").unwrap_or(0.0));
    if !(scale.is_finite() && scale != 0.0 && offset.is_finite()) {
        let what =
            format!("heights have a scale of {scale} and an offset of {offset}; both must be finite, and the scale not 0");
        return Err(RasterError::malformed(file, Place::File, what));
    }
    let void = void(&directory, &mut *source, layout.kind, &mut notes)?;
    let whole = ![Kind::F32, Kind::F64].contains(&layout.kind) && offset == 0.0;
    let heights = Heights { void, scale: scale * geo.vertical, offset: offset * geo.vertical };
    let lattice = whole.then_some(heights.scale.abs());
    let samples = GeoTiff::new(file, source, &directory, layout, heights)?;
    Ok(Part { file: file.to_owned(), grid: geo.grid, placed: geo.placed, notes, lattice, samples: Box::new(samples) })
}

/// The no-data value, rounded as samples of the type.
fn void(
    directory: &Directory,
    source: &mut dyn Source,
    kind: Kind,
    notes: &mut Vec<String>,
) -> Result<Option<f64>, RasterError> {
    let Some(text) = directory.text(source, GDAL_NODATA)? else { return Ok(None) };
    let Ok(number) = text.trim().parse::<f64>() else {
        notes.push(format!("the no-data value {text:?} is not a number and is ignored"));
        return Ok(None);
    };
    Ok(Some(if kind == Kind::F32 { f64::from(number as f32) } else { number }))
}

/// Samples of a GeoTIFF.
struct GeoTiff {
    file: String,
    decoder: Decoder<Box<dyn Source>>,
    layout: Layout,
    heights: Heights,
    /// Whether the file has another byte order than this machine.
    swapped: bool,
    /// The unpacked row of strips or tiles, and its samples, tile by tile.
    row: Option<u32>,
    bytes: Vec<u8>,
}

impl GeoTiff {
    fn new(
        file: &str,
        mut source: Box<dyn Source>,
        directory: &Directory,
        layout: Layout,
        heights: Heights,
    ) -> Result<Self, RasterError> {
        source.rewind().map_err(|e| RasterError::io(file, e))?;
        let decoder = Decoder::new(source).map_err(|e| unpacked(file, Place::File, &e))?;
        let mut limits = Limits::default();
        limits.intermediate_buffer_size = directory.length as usize;
        limits.decoding_buffer_size = MAX_ROW as usize;
        let swapped = directory.little != cfg!(target_endian = "little");
        let (decoder, file) = (decoder.with_limits(limits), file.to_owned());
        Ok(Self { file, decoder, layout, heights, swapped, row: None, bytes: Vec::new() })
    }

    /// Reads a row of uncompressed strips.
    fn read_plain(&mut self, row: u32, out: &mut [f64]) -> Result<(), RasterError> {
        let index = row / self.layout.chunk[1];
        if self.layout.is_absent(index as usize) {
            out.fill(self.heights.void.unwrap_or(0.0));
            return Ok(());
        }
        let width = self.layout.kind.width();
        self.bytes.resize(out.len() * width, 0);
        let within = u64::from(row - self.layout.rows_of(index).start) * self.bytes.len() as u64;
        let source = self.decoder.inner();
        let at = SeekFrom::Start(self.layout.chunks[index as usize][0] + within);
        source.seek(at).and_then(|_| source.read_exact(&mut self.bytes)).map_err(|e| RasterError::io(&self.file, e))?;
        if self.swapped {
            self.bytes.chunks_exact_mut(width).for_each(<[u8]>::reverse);
        }
        self.layout.kind.widen(&self.bytes, out);
        Ok(())
    }

    /// Columns of a tile, and the range of a row of its samples in `bytes`.
    fn in_row(&self, tile: u32, row: u32) -> (Range<usize>, Range<usize>) {
        let layout = &self.layout;
        let rows = layout.rows_of(row / layout.chunk[1]);
        let start = tile * layout.chunk[0];
        let columns = start as usize..start.saturating_add(layout.chunk[0]).min(layout.size[0]) as usize;
        let width = layout.kind.width();
        let first = (start as usize * rows.len() + columns.len() * (row - rows.start) as usize) * width;
        (columns.clone(), first..first + columns.len() * width)
    }

    /// Unpacks a row of strips or tiles.
    fn unpack(&mut self, row: u32) -> Result<(), RasterError> {
        if self.row == Some(row) {
            return Ok(());
        }
        self.row = None;
        let (across, rows) = (self.layout.across(), self.layout.rows_of(row));
        self.bytes.resize(self.layout.size[0] as usize * rows.len() * self.layout.kind.width(), 0);
        for tile in 0..across {
            let index = row * across + tile;
            let at = self.in_row(tile, rows.start).1.start..self.in_row(tile, rows.end - 1).1.end;
            if self.layout.is_absent(index as usize) {
                continue;
            }
            let place = Place::Byte(self.layout.chunks[index as usize][0]);
            let read = self.decoder.read_chunk_bytes(index, &mut self.bytes[at]);
            read.map_err(|e| match unpacked(&self.file, place, &e) {
                RasterError::Malformed { file, place, what } => {
                    RasterError::Malformed { file, place, what: format!("{}: {what}", self.layout.name(index as usize)) }
                }
                other => other,
            })?;
        }
        self.row = Some(row);
        Ok(())
    }

    /// Reads a row of compressed strips or tiles.
    fn read_unpacked(&mut self, row: u32, out: &mut [f64]) -> Result<(), RasterError> {
        let chunk_row = row / self.layout.chunk[1];
        self.unpack(chunk_row)?;
        for tile in 0..self.layout.across() {
            let (columns, bytes) = self.in_row(tile, row);
            if self.layout.is_absent((chunk_row * self.layout.across() + tile) as usize) {
                out[columns].fill(self.heights.void.unwrap_or(0.0));
            } else {
                self.layout.kind.widen(&self.bytes[bytes], &mut out[columns]);
            }
        }
        Ok(())
    }
}

/// An error of the unpacker, in one line.
fn unpacked(file: &str, place: Place, error: &TiffError) -> RasterError {
    let what = match error {
        TiffError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => "it ends too early".to_owned(),
        other => other.to_string().replace('\n', " "),
    };
    RasterError::malformed(file, place, what + "; copy the file again")
}

impl Samples for GeoTiff {
    fn read(&mut self, rows: Range<u32>, out: &mut [f64]) -> Result<(), RasterError> {
        for (row, out) in rows.zip(out.chunks_exact_mut(self.layout.size[0] as usize)) {
            if self.layout.plain {
                self.read_plain(row, out)?;
            } else {
                self.read_unpacked(row, out)?;
            }
            self.heights.convert(&self.file, row, out)?;
        }
        Ok(())
    }

    fn forget(&mut self) {
        self.row = None;
        self.bytes = Vec::new();
    }
}
