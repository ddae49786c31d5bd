//! A level's file: its kind, known by its content, and its directory of lumps.

use super::error::{BspError, lump as fault};
use super::games::LAYOUTS;
use super::layout::{Layout, Lump};
use super::lzma;
use super::record::Records;
use std::borrow::Cow;

/// An entry of the directory.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Entry {
    pub offset: usize,
    pub length: usize,
    /// Of the records; 0 where the directory has none.
    pub version: i32,
    /// Bytes of a packed lump when unpacked; 0 if it is not packed.
    pub unpacked: u32,
}

impl Entry {
    pub fn end(&self) -> usize {
        self.offset + self.length
    }
}

/// A level's file; all lumps lie within it.
#[derive(Clone, Debug)]
pub(crate) struct LevelFile {
    pub bytes: Vec<u8>,
    pub layout: &'static Layout,
    pub big_endian: bool,
    /// An entry begins with the lump's version (Left 4 Dead 2).
    version_first: bool,
    pub entries: Vec<Entry>,
}

impl LevelFile {
    /// Recognises a file and checks its directory.
    ///
    /// # Errors
    ///
    /// An unknown kind, or a lump beyond the end.
    pub fn read(bytes: Vec<u8>) -> Result<Self, BspError> {
        let (layout, big_endian) = recognise(&bytes)?;
        if bytes.len() < layout.header() {
            return Err(BspError::Cut(bytes.len()));
        }
        if i32::try_from(bytes.len()).is_err() {
            return Err(BspError::TooLong);
        }
        let mut file = Self { bytes, layout, big_endian, version_first: false, entries: Vec::new() };
        // A version is a small number; an offset leads beyond the header.
        let [first, second] = [0, 4].map(|k| file.word(layout.directory.at + k));
        file.version_first = layout.directory.entry == 16 && first < layout.header() && second >= layout.header();
        for number in 0..layout.directory.lumps {
            let entry = file.entry(number)?;
            file.entries.push(entry);
        }
        Ok(file)
    }

    /// The four bytes at a place as a number.
    pub fn word(&self, at: usize) -> usize {
        let bytes = [0, 1, 2, 3].map(|i| self.bytes[at + i]);
        (if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }) as usize
    }

    /// The bytes of a number in this file's order.
    pub fn bytes_of(&self, number: u32) -> [u8; 4] {
        if self.big_endian { number.to_be_bytes() } else { number.to_le_bytes() }
    }

    /// Places of a lump's offset, length, version and unpacked size in the file.
    pub fn entry_places(&self, number: usize) -> [usize; 4] {
        let at = self.layout.directory.at + number * self.layout.directory.entry;
        if self.version_first { [at + 4, at + 8, at, at + 12] } else { [at, at + 4, at + 8, at + 12] }
    }

    fn entry(&self, number: usize) -> Result<Entry, BspError> {
        let [offset, length, version, unpacked] = self.entry_places(number);
        let mut entry = Entry { offset: self.word(offset), length: self.word(length), version: 0, unpacked: 0 };
        if self.layout.directory.entry == 16 {
            entry.version = self.word(version) as u32 as i32;
            entry.unpacked = self.word(unpacked) as u32;
        }
        // An empty lump may point anywhere.
        if entry.length == 0 {
            entry.offset = entry.offset.min(self.bytes.len());
        }
        if entry.end() > self.bytes.len() {
            let name = self
                .layout
                .lumps
                .iter()
                .find(|(_, n)| *n == number)
                .map_or_else(|| number.to_string(), |(l, _)| l.to_string());
            let what = format!("ends at byte {}, the file at {}", entry.end(), self.bytes.len());
            return Err(BspError::Lump { lump: name, what });
        }
        Ok(entry)
    }

    /// The directory's entry of a lump; the game has that lump.
    pub fn entry_of(&self, lump: Lump) -> Entry {
        self.layout.number(lump).map_or_else(Entry::default, |number| self.entries[number])
    }

    /// A lump's bytes, unpacked; none if the game has no such lump.
    ///
    /// # Errors
    ///
    /// A packed lump that can't be unpacked.
    pub fn lump(&self, lump: Lump) -> Result<Cow<'_, [u8]>, BspError> {
        let entry = self.entry_of(lump);
        let bytes = &self.bytes[entry.offset..entry.end()];
        if self.layout.directory.entry == 16 && lzma::is_packed(bytes) {
            let unpacked = lzma::unpack(bytes, self.bytes.len()).map_err(|what| fault(lump, what))?;
            return Ok(Cow::Owned(unpacked));
        }
        Ok(Cow::Borrowed(bytes))
    }

    /// The records of a lump's bytes, as [`Self::lump`] gives them.
    ///
    /// # Errors
    ///
    /// A part of a record at the end.
    pub fn records<'b>(&self, lump: Lump, bytes: &'b [u8], size: usize) -> Result<Records<'b>, BspError> {
        if !bytes.len().is_multiple_of(size) {
            return Err(fault(lump, format!("has {} bytes, not a multiple of {size}", bytes.len())));
        }
        Ok(Records::new(bytes, size, self.big_endian))
    }

    /// The record of a lump's version.
    ///
    /// # Errors
    ///
    /// An unknown version.
    pub fn of_version<R: Copy>(&self, lump: Lump, known: &[(i32, R)]) -> Result<R, BspError> {
        let version = self.entry_of(lump).version;
        let found = known.iter().find(|(of, _)| *of == version).map(|&(_, record)| record);
        found.ok_or_else(|| fault(lump, format!("has version {version}, which isn't known")))
    }
}

/// The layout of a file, and whether its numbers are big-endian.
pub(super) fn recognise(bytes: &[u8]) -> Result<(&'static Layout, bool), BspError> {
    let Some(magic) = bytes.first_chunk::<4>() else { return Err(BspError::Cut(bytes.len())) };
    let version = bytes.get(4..8).and_then(|b| b.first_chunk::<4>());
    let mut reversed = *magic;
    reversed.reverse();
    let mut others = Vec::new();
    for layout in LAYOUTS {
        let Some(of) = layout.version else {
            if layout.magic == *magic {
                return Ok((layout, false));
            }
            continue;
        };
        // A console's files begin with the letters the other way around.
        let is_big = layout.directory.entry == 16 && layout.magic == reversed;
        if layout.magic != *magic && !is_big {
            continue;
        }
        let version = *version.ok_or(BspError::Cut(bytes.len()))?;
        let found = if is_big { i32::from_be_bytes(version) } else { i32::from_le_bytes(version) };
        if found == of {
            return Ok((layout, is_big));
        }
        others.push(found);
    }
    let letters: String = magic.iter().map(|&b| char::from(b).escape_default().to_string()).collect();
    Err(BspError::Format(match others.first() {
        Some(version) => format!("{letters} version {version} isn't known"),
        None => "doesn't begin as a level does".into(),
    }))
}
