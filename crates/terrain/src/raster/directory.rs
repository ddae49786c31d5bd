//! The first directory of a TIFF file: tags are checked against the file's length before values are read. Based on *TIFF 6.0*
//! (Adobe, 1992), section 2, and the BigTIFF of libtiff's documentation.

use super::error::{Place, RasterError};
use super::grid::Source;
use std::collections::BTreeMap;
use std::io::SeekFrom;

/// Maximum tags of a directory.
const MAX_TAGS: u64 = 4096;
/// The type of texts.
const ASCII: u16 = 2;

/// Tags by number.
pub(super) struct Directory {
    file: String,
    tags: BTreeMap<u16, Value>,
    /// Whether the file is little-endian.
    pub little: bool,
    /// Bytes of the file.
    pub length: u64,
}

/// The place of a tag's values.
struct Value {
    kind: u16,
    count: u64,
    at: u64,
}

/// Bytes of a value of a type; `None` for an unknown type, which readers skip.
fn width(kind: u16) -> Option<u64> {
    Some(match kind {
        1 | 2 | 6 | 7 => 1,
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16 | 17 | 18 => 8,
        _ => return None,
    })
}

/// Bytes as a whole number.
fn whole(bytes: &[u8], little: bool) -> u64 {
    let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
    if little { bytes.iter().rev().fold(0, add) } else { bytes.iter().fold(0, add) }
}

impl Directory {
    /// Reads the first directory of a file of `length` bytes.
    pub fn read(file: &str, source: &mut dyn Source, length: u64) -> Result<Self, RasterError> {
        let mut directory = Self { file: file.to_owned(), tags: BTreeMap::new(), little: true, length };
        let head = directory.bytes(source, 0, 8)?;
        directory.little = match &head[..2] {
            b"II" => true,
            b"MM" => false,
            _ => return Err(directory.wrong(0, "not a TIFF: it begins with neither II nor MM; give a GeoTIFF")),
        };
        let little = directory.little;
        let big = match whole(&head[2..4], little) {
            42 => false,
            43 => true,
            version => return Err(directory.wrong(2, format!("version {version} of TIFF; 42 and 43 are supported"))),
        };
        let at = if big { whole(&directory.bytes(source, 8, 8)?, little) } else { whole(&head[4..], little) };
        let (counter, entry, room) = if big { (8, 20, 8) } else { (2, 12, 4) };
        let count = whole(&directory.bytes(source, at, counter)?, little);
        if count == 0 || count > MAX_TAGS {
            return Err(directory.wrong(at, format!("a directory of {count} tags; 1 to {MAX_TAGS} are supported")));
        }
        let bytes = directory.bytes(source, at + counter, count * entry)?;
        for (place, bytes) in (at + counter..).step_by(entry as usize).zip(bytes.chunks_exact(entry as usize)) {
            let [tag, kind] = [0, 2].map(|i| whole(&bytes[i..i + 2], little) as u16);
            let Some(width) = width(kind) else { continue };
            let values = (entry - room) as usize;
            let count = whole(&bytes[4..values], little);
            let size = count.saturating_mul(width);
            let inside = place + values as u64;
            let at = if size <= room { inside } else { whole(&bytes[values..], little) };
            if at.checked_add(size).is_none_or(|end| end > length) {
                let what =
                    format!("tag {tag} has {count} values at byte {at}, beyond the file's end at {length}; copy it again");
                return Err(directory.wrong(place, what));
            }
            directory.tags.insert(tag, Value { kind, count, at });
        }
        Ok(directory)
    }

    /// Whole numbers of a tag.
    pub fn wholes(&self, source: &mut dyn Source, tag: u16) -> Result<Option<Vec<u64>>, RasterError> {
        let Some((value, bytes)) = self.values(source, tag)? else { return Ok(None) };
        if ![1, 3, 4, 13, 16, 18].contains(&value.kind) {
            return Err(self.wrong(value.at, format!("tag {tag} has values of type {}, not whole numbers", value.kind)));
        }
        let width = width(value.kind).unwrap_or(1) as usize;
        Ok(Some(bytes.chunks_exact(width).map(|b| whole(b, self.little)).collect()))
    }

    /// The first whole number of a tag.
    pub fn one(&self, source: &mut dyn Source, tag: u16) -> Result<Option<u64>, RasterError> {
        Ok(self.wholes(source, tag)?.and_then(|v| v.first().copied()))
    }

    /// Numbers of a tag with `f64` values.
    pub fn reals(&self, source: &mut dyn Source, tag: u16) -> Result<Option<Vec<f64>>, RasterError> {
        /// The type of `f64`.
        const DOUBLE: u16 = 12;
        let Some((value, bytes)) = self.values(source, tag)? else { return Ok(None) };
        if value.kind != DOUBLE {
            return Err(self.wrong(value.at, format!("tag {tag} has values of type {}, not doubles", value.kind)));
        }
        Ok(Some(bytes.chunks_exact(8).map(|b| f64::from_bits(whole(b, self.little))).collect()))
    }

    /// The text of a tag, without trailing zeros.
    pub fn text(&self, source: &mut dyn Source, tag: u16) -> Result<Option<String>, RasterError> {
        let Some((value, bytes)) = self.values(source, tag)? else { return Ok(None) };
        if value.kind != ASCII {
            return Err(self.wrong(value.at, format!("tag {tag} has values of type {}, not a text", value.kind)));
        }
        Ok(Some(String::from_utf8_lossy(&bytes).trim_matches(['\0', ' ']).to_owned()))
    }

    /// Whether a tag exists.
    pub fn has(&self, tag: u16) -> bool {
        self.tags.contains_key(&tag)
    }

    fn values(&self, source: &mut dyn Source, tag: u16) -> Result<Option<(&Value, Vec<u8>)>, RasterError> {
        let Some(value) = self.tags.get(&tag) else { return Ok(None) };
        let size = value.count * width(value.kind).unwrap_or(1);
        Ok(Some((value, self.bytes(source, value.at, size)?)))
    }

    fn bytes(&self, source: &mut dyn Source, at: u64, size: u64) -> Result<Vec<u8>, RasterError> {
        if at.checked_add(size).is_none_or(|end| end > self.length) {
            return Err(self.wrong(at, format!("cut off: the file ends at byte {}; copy it again", self.length)));
        }
        let io = |e| RasterError::io(&self.file, e);
        source.seek(SeekFrom::Start(at)).map_err(io)?;
        let mut bytes = vec![0; size as usize];
        source.read_exact(&mut bytes).map_err(io)?;
        Ok(bytes)
    }

    fn wrong(&self, at: u64, what: impl Into<String>) -> RasterError {
        RasterError::malformed(&self.file, Place::Byte(at), what)
    }
}
