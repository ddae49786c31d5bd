//! The container: a header, a section table, the sections. docs/format.md describes every byte.
//!
//! A checksum covers every byte of a file, every length is checked against the file's before use, and decompression never exceeds a length
//! that was declared, checked and reserved in a budget (see [`super::PvsFile::read`]).

use super::bytes::Budget;
use super::codes::GUARANTEES;
use super::error::{Fault, FileError};
use crate::types::guarantee::Guarantee;
use std::borrow::Cow;
use std::fmt;
use xxhash_rust::xxh3::xxh3_64;

/// First bytes of every file: not text, and damaged by text-mode transfers.
pub const MAGIC: [u8; 8] = *b"\x89PVS\r\n\x1a\n";
/// The version that this program writes, and the only one that it reads.
pub const VERSION: u32 = 3;

/// Bytes of the header, up to the section table.
pub(super) const HEADER: usize = 56;
/// Bytes of one entry of the section table.
pub(super) const ENTRY: usize = 32;
/// Byte of the header's checksum, which covers the bytes before it, and the table.
pub(super) const CHECKSUM_AT: usize = 48;
/// Section flag: a reader that does not know the section must reject the file.
pub(super) const REQUIRED: u32 = 1;
/// Section flag: the stored bytes are zstd frames.
pub(super) const ZSTD: u32 = 2;
/// The content of a section. Its number in the file is the position in [`SectionId::ALL`], from 1.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SectionId {
    /// Origin, strategy, import, counts.
    Meta,
    /// Omissions and notes.
    Notes,
    /// Cells and their pieces.
    Cells,
    /// Portals.
    Portals,
    /// Objects.
    Objects,
    /// The objects in each cell.
    Placement,
    /// The cells that each cell sees.
    CellRows,
    /// The objects that each cell sees.
    ObjectRows,
    /// Upper and lower set of cells.
    CellBounds,
    /// Upper and lower set of objects.
    ObjectBounds,
    /// A segment for each pair of the lower set of objects.
    Witnesses,
    /// Repaired holes.
    Repairs,
    /// The bake's counters.
    Stats,
    /// States of portals, if one differs from the default of its kind.
    PortalStates,
    /// View cells.
    ViewCells,
    /// The objects that each view cell sees.
    ViewRows,
    /// Upper and lower set of view cells.
    ViewBounds,
    /// A segment for each pair of the lower set of view cells.
    ViewWitnesses,
    /// Confidence bounds of the unseen parts.
    Unseen,
    /// Undecided pairs, by kind.
    Gap,
    /// Boxes of each object's part in each of its cells.
    Placed,
    /// Holes that count as opaque.
    ClosedHoles,
    /// Number of cells joined into each cell.
    Clusters,
    /// How far a body goes.
    Relevance,
    /// The cells that may be seen from where a body may soon be.
    RelevantCells,
    /// The same, objects.
    RelevantObjects,
    /// Portals that lead in from outside.
    WaysIn,
    /// The cells that each of them shows.
    WayInCells,
    /// The same, objects.
    WayInObjects,
    /// What the bake was of.
    Bake,
}

impl SectionId {
    /// Every section that this program knows, in file order.
    pub const ALL: [Self; 30] = [
        Self::Meta,
        Self::Notes,
        Self::Cells,
        Self::Portals,
        Self::Objects,
        Self::Placement,
        Self::CellRows,
        Self::ObjectRows,
        Self::CellBounds,
        Self::ObjectBounds,
        Self::Witnesses,
        Self::Repairs,
        Self::Stats,
        Self::PortalStates,
        Self::ViewCells,
        Self::ViewRows,
        Self::ViewBounds,
        Self::ViewWitnesses,
        Self::Unseen,
        Self::Gap,
        Self::Placed,
        Self::ClosedHoles,
        Self::Clusters,
        Self::Relevance,
        Self::RelevantCells,
        Self::RelevantObjects,
        Self::WaysIn,
        Self::WayInCells,
        Self::WayInObjects,
        Self::Bake,
    ];

    /// The number in the file.
    pub fn number(self) -> u32 {
        self as u32 + 1
    }

    /// The section with this number, if this program knows it.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.get((number as usize).checked_sub(1)?).copied()
    }

    /// Matrices are compressed row block by row block, so that a row can be read alone.
    pub(super) fn is_matrix(self) -> bool {
        let of_cells =
            matches!(self, Self::Placement | Self::CellRows | Self::ObjectRows | Self::CellBounds | Self::ObjectBounds);
        let of_bodies = matches!(self, Self::RelevantCells | Self::RelevantObjects);
        of_cells || of_bodies || matches!(self, Self::ViewRows | Self::ViewBounds | Self::WayInCells | Self::WayInObjects)
    }

    /// A file cannot be used without these sections if they are not empty.
    #[cfg(feature = "bake")]
    pub(super) fn is_required(self) -> bool {
        (self as u32) <= Self::ObjectRows as u32 && self != Self::Notes
    }
}

impl fmt::Display for SectionId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Meta => "meta",
            Self::Notes => "notes",
            Self::Cells => "cells",
            Self::Portals => "portals",
            Self::Objects => "objects",
            Self::Placement => "placement",
            Self::CellRows => "cell-rows",
            Self::ObjectRows => "object-rows",
            Self::CellBounds => "cell-bounds",
            Self::ObjectBounds => "object-bounds",
            Self::Witnesses => "witnesses",
            Self::Repairs => "repairs",
            Self::Stats => "stats",
            Self::PortalStates => "portal-states",
            Self::ViewCells => "view-cells",
            Self::ViewRows => "view-rows",
            Self::ViewBounds => "view-bounds",
            Self::ViewWitnesses => "view-witnesses",
            Self::Unseen => "unseen",
            Self::Gap => "gap",
            Self::Placed => "placed",
            Self::ClosedHoles => "closed-holes",
            Self::Clusters => "clusters",
            Self::Relevance => "relevance",
            Self::RelevantCells => "relevant-cells",
            Self::RelevantObjects => "relevant-objects",
            Self::WaysIn => "ways-in",
            Self::WayInCells => "way-in-cells",
            Self::WayInObjects => "way-in-objects",
            Self::Bake => "bake",
        })
    }
}

/// An entry of the section table.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Section {
    /// The number in the file.
    pub number: u32,
    /// Its start, bytes from the start of the file.
    pub offset: u64,
    /// Length in the file, bytes.
    pub bytes: u64,
    /// Decompressed length, bytes; equal to `bytes` if it is not compressed as a whole.
    pub decoded: u64,
    zstd: bool,
    checksum: u64,
}

impl Section {
    /// Its name, or its number if it is unknown.
    pub fn name(&self) -> String {
        SectionId::from_number(self.number).map_or_else(|| self.number.to_string(), |id| id.to_string())
    }
}

/// A file with a valid header and section table; sections are checked on access.
#[derive(Clone, Debug)]
pub struct Container<'a> {
    bytes: &'a [u8],
    sections: Vec<Section>,
    /// [`crate::scene::Scene::hash`] of the model.
    pub model_hash: u128,
    /// The guarantee of the rows.
    pub guarantee: Guarantee,
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}

/// Checksum of a header (without its own checksum) and the table behind it.
pub(super) fn header_checksum(bytes: &[u8], table_end: usize) -> u64 {
    xxh3_64(&[&bytes[..CHECKSUM_AT], &bytes[HEADER..table_end]].concat())
}

fn header(offset: usize, what: String) -> FileError {
    FileError::Header { offset: offset as u64, what }
}

/// The section table of a file of `length` bytes.
fn sections(bytes: &[u8], count: usize, length: u64) -> Result<Vec<Section>, FileError> {
    let mut sections: Vec<Section> = Vec::with_capacity(count);
    let mut offset = (HEADER + count * ENTRY) as u64;
    for i in 0..count {
        let at = HEADER + i * ENTRY;
        let (number, flags) = (u32_at(bytes, at), u32_at(bytes, at + 4));
        let (stored, decoded, checksum) = (u64_at(bytes, at + 8), u64_at(bytes, at + 16), u64_at(bytes, at + 24));
        if number == 0 || sections.last().is_some_and(|last| last.number >= number) {
            return Err(header(at, format!("section {number} out of order; numbers ascend from 1")));
        }
        if flags & !(REQUIRED | ZSTD) != 0 {
            return Err(header(at + 4, format!("section {number} has unknown flags {flags:#x}")));
        }
        let id = SectionId::from_number(number);
        if id.is_none() && flags & REQUIRED != 0 {
            return Err(FileError::UnknownRequired { id: number });
        }
        let zstd = flags & ZSTD != 0;
        if zstd && id.is_some_and(SectionId::is_matrix) {
            return Err(header(at + 4, format!("section {number} is a matrix and can't be compressed as a whole")));
        }
        if stored > length - offset {
            return Err(header(at + 8, format!("section {number} has {stored} bytes, {} are left", length - offset)));
        }
        if !zstd && decoded != stored {
            return Err(header(at + 16, format!("section {number} isn't compressed and has two lengths")));
        }
        sections.push(Section { number, offset, bytes: stored, decoded, zstd, checksum });
        offset += stored;
    }
    if offset != length {
        return Err(header(16, format!("sections end at byte {offset}, the file at byte {length}")));
    }
    Ok(sections)
}

impl<'a> Container<'a> {
    /// Reads header and table. `bytes` is the whole file.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, FileError> {
        let has = bytes.len() as u64;
        if !MAGIC.starts_with(&bytes[..bytes.len().min(MAGIC.len())]) {
            return Err(FileError::NotPvs);
        }
        if bytes.len() < HEADER {
            return Err(FileError::Truncated { has, needs: HEADER as u64 });
        }
        let version = u32_at(bytes, 8);
        if version != VERSION {
            return Err(FileError::Version { found: version });
        }
        let length = u64_at(bytes, 16);
        if has < length {
            return Err(FileError::Truncated { has, needs: length });
        }
        if has > length {
            return Err(FileError::TrailingBytes { end: length, extra: has - length });
        }
        let count = u32_at(bytes, 12) as usize;
        if count > (bytes.len() - HEADER) / ENTRY {
            return Err(header(12, format!("a table of {count} sections in a file of {length} bytes")));
        }
        let table_end = HEADER + count * ENTRY;
        if header_checksum(bytes, table_end) != u64_at(bytes, CHECKSUM_AT) {
            return Err(header(CHECKSUM_AT, "damaged (the checksum differs)".into()));
        }
        let guarantee = GUARANTEES
            .get(usize::from(bytes[40]))
            .copied()
            .ok_or_else(|| header(40, format!("guarantee {}; there are {}", bytes[40], GUARANTEES.len())))?;
        if let Some(at) = (41..CHECKSUM_AT).find(|&i| bytes[i] != 0) {
            return Err(header(at, "a reserved byte that is not zero".into()));
        }
        let sections = sections(bytes, count, length)?;
        let model_hash = u128::from_le_bytes(std::array::from_fn(|i| bytes[24 + i]));
        Ok(Self { bytes, sections, model_hash, guarantee })
    }

    /// Length of the file.
    #[cfg(feature = "bake")]
    pub fn file_bytes(&self) -> usize {
        self.bytes.len()
    }

    /// The section table.
    #[cfg(feature = "bake")]
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The table entry of a section, if the file has it.
    pub fn section(&self, id: SectionId) -> Option<&Section> {
        self.sections.iter().find(|s| s.number == id.number())
    }

    /// Compares the checksum of every section, known or not.
    pub fn verify(&self) -> Result<(), FileError> {
        self.sections.iter().try_for_each(|s| self.stored(s).map(drop))
    }

    /// The stored bytes of a section.
    fn stored(&self, s: &Section) -> Result<&'a [u8], FileError> {
        let stored = &self.bytes[s.offset as usize..(s.offset + s.bytes) as usize];
        if xxh3_64(stored) != s.checksum {
            return Err(FileError::Checksum { section: s.name(), offset: s.offset, bytes: s.bytes });
        }
        Ok(stored)
    }

    /// The bytes of a matrix section, if the file has it.
    pub(super) fn matrix(&self, id: SectionId) -> Result<Option<&'a [u8]>, FileError> {
        self.section(id).map(|s| self.stored(s)).transpose()
    }

    /// The decompressed bytes of a section, if the file has it.
    pub(super) fn payload(&self, id: SectionId, budget: &mut Budget) -> Result<Option<Cow<'a, [u8]>>, Fault> {
        let Some(s) = self.section(id) else { return Ok(None) };
        let stored = self.stored(s)?;
        // Once for these bytes, once for strings copied from them.
        budget.take(id, s.decoded.saturating_mul(2))?;
        if !s.zstd {
            return Ok(Some(Cow::Borrowed(stored)));
        }
        match super::frame::decompress(stored, s.decoded as usize) {
            Ok(bytes) => Ok(Some(Cow::Owned(bytes))),
            Err(what) => Err(FileError::Malformed { section: id, offset: 0, what }.into()),
        }
    }
}
