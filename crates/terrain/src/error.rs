//! Why a `.ground` file can't be read or written.

use super::format::VERSION;
use std::{fmt, io};

/// Why a `.ground` file can't be read or written. Each prints as one line; the command line puts the path before it.
#[derive(Debug)]
#[non_exhaustive]
pub enum GroundError {
    /// The file can't be opened, read or written.
    Io(io::Error),
    /// It doesn't begin as a `.ground` file does.
    NotGround,
    /// Another version of the format.
    Version(u32),
    /// Shorter or longer than its header says.
    Length {
        /// Bytes that are there.
        has: u64,
        /// Bytes that should be.
        needs: u64,
    },
    /// The header, the table or a tile isn't what was written.
    Checksum(Part),
    /// The file has become shorter since it was opened.
    CutOff(Part),
    /// A number of the header or of the table that no writer puts there.
    Malformed {
        /// Byte in the file.
        offset: u64,
        /// What is wrong.
        what: &'static str,
    },
    /// A raster that can't be read; the line names its file.
    Raster(String),
    /// Heights that no ground can be made of.
    Heights(String),
}

/// A part of a `.ground` file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Part {
    /// The first bytes.
    Header,
    /// What is known of each tile.
    Table,
    /// A tile, by its number.
    Tile(u32),
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Header => f.write_str("the header"),
            Self::Table => f.write_str("the table of tiles"),
            Self::Tile(tile) => write!(f, "tile {tile}"),
        }
    }
}

impl GroundError {
    /// What the system says of a part; one that ends too early was cut off.
    pub(super) fn of(part: Part, error: io::Error) -> Self {
        if error.kind() == io::ErrorKind::UnexpectedEof { Self::CutOff(part) } else { Self::Io(error) }
    }
}

impl fmt::Display for GroundError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io(e) => write!(f, "{e}"),
            Self::NotGround => f.write_str("not a .ground file (`enfilade ground RASTER -o X.ground` makes one)"),
            Self::Version(found) => {
                write!(
                    f,
                    "version {found} of the format, and this program reads {VERSION}: make the file again (`enfilade ground`)"
                )
            }
            Self::Length { has, needs } if has < needs => {
                write!(f, "cut off: it has {has} bytes and needs {needs}; make the file again")
            }
            Self::Length { has, needs } => write!(f, "{} bytes after its end; make the file again", has - needs),
            Self::Checksum(part) => write!(f, "{part} is damaged (wrong checksum); make the file again"),
            Self::CutOff(part) => write!(f, "{part} is cut off: the file has become shorter; make it again"),
            Self::Malformed { offset, what } => write!(f, "byte {offset}: {what}; make the file again"),
            Self::Raster(what) | Self::Heights(what) => f.write_str(what),
        }
    }
}

impl std::error::Error for GroundError {}

impl From<io::Error> for GroundError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}
