//! Why a `.ground` file can't be read or written.

use super::format::VERSION;
use std::{fmt, io};

/// Why a `.ground` file cannot be read or written. Each prints as one line; the command line prefixes the path.
#[derive(Debug)]
#[non_exhaustive]
pub enum GroundError {
    /// The file cannot be opened, read or written.
    Io(io::Error),
    /// It does not begin as a `.ground` file.
    NotGround,
    /// Another version of the format.
    Version(u32),
    /// Its length differs from its header.
    Length {
        /// Actual bytes.
        has: u64,
        /// Expected bytes.
        needs: u64,
    },
    /// The header, the table or a tile is damaged.
    Checksum(Part),
    /// The file has become shorter since it was opened.
    CutOff(Part),
    /// An invalid number in the header or the table.
    Malformed {
        /// Byte in the file.
        offset: u64,
        /// The fault.
        what: &'static str,
    },
    /// A raster that cannot be read; the line names its file.
    Raster(String),
    /// Heights that cannot make a ground.
    Heights(String),
}

/// A part of a `.ground` file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Part {
    /// The first bytes.
    Header,
    /// The entries of all tiles.
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
    /// The error of a part; one that ends too early is cut off.
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
                    "version {found} of the format, but this program reads {VERSION}; make the file again (`enfilade ground`)"
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
