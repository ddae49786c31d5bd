//! Errors of `.pvs` files: the section, the byte in it, the fault, and the remedy.

use super::format::{SectionId, VERSION};
use std::path::PathBuf;
use std::{fmt, io};

/// An error of a file. Each prints as one line.
#[derive(Debug)]
#[non_exhaustive]
pub enum FileError {
    /// A file on disk, and what is wrong with it.
    At {
        /// The file's path.
        path: PathBuf,
        /// The fault.
        fault: Box<FileError>,
    },
    /// The file can't be opened, read or written.
    Io(io::Error),
    /// It does not begin like a `.pvs` file.
    NotPvs,
    /// Another version of the format.
    Version {
        /// The version found.
        found: u32,
    },
    /// Shorter than its stated length.
    Truncated {
        /// Actual length, bytes.
        has: u64,
        /// Least expected length, bytes.
        needs: u64,
    },
    /// Longer than its stated length.
    TrailingBytes {
        /// Expected end of the file.
        end: u64,
        /// Bytes after that.
        extra: u64,
    },
    /// The header or the section table is wrong.
    Header {
        /// Byte in the file.
        offset: u64,
        /// The fault.
        what: String,
    },
    /// The checksum of a section does not match.
    Checksum {
        /// The section's name, or its number if it is unknown.
        section: String,
        /// Byte in the file where the section begins.
        offset: u64,
        /// The section's stored length.
        bytes: u64,
    },
    /// An unknown section that is marked as required.
    UnknownRequired {
        /// The section's number.
        id: u32,
    },
    /// A required section is missing.
    Missing {
        /// The section.
        section: SectionId,
    },
    /// Decoding would exceed the memory limit for a file of this length.
    TooLarge {
        /// The section.
        section: SectionId,
        /// Requested bytes.
        needs: u64,
        /// Remaining bytes of the limit.
        left: u64,
    },
    /// A section's content breaks a rule of the format.
    Malformed {
        /// The section.
        section: SectionId,
        /// Byte in the decoded section.
        offset: u64,
        /// The violated rule.
        what: String,
    },
}

/// An error while a file is read. On the heap: results are small, and so is the code that hands them on.
pub(super) type Fault = Box<FileError>;

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::At { path, fault } => write!(f, "{}: {fault}", path.display()),
            Self::Io(error) => write!(f, "{error}"),
            Self::NotPvs => write!(f, "not a .pvs file; give a file from `enfilade bake`"),
            Self::Version { found } => write!(
                f,
                "format version {found}, this program reads version {VERSION}; bake the model again with this program"
            ),
            Self::Truncated { has, needs } => {
                write!(f, "cut short: {has} bytes of {needs}; copy the file again, or bake the model again")
            }
            Self::TrailingBytes { end, extra } => {
                write!(f, "{extra} bytes too many at byte {end}; copy the file again, or bake the model again")
            }
            Self::Header { offset, what } => write!(f, "header, byte {offset}: {what}; bake the model again"),
            Self::Checksum { section, offset, bytes } => write!(
                f,
                "section {section}, {bytes} bytes from byte {offset}: damaged (the checksum differs); copy the file again, or bake the model again"
            ),
            Self::UnknownRequired { id } => write!(
                f,
                "section {id} is required and unknown to this program; read the file with the program that made it"
            ),
            Self::Missing { section } => write!(f, "section {section} is missing; bake the model again"),
            Self::TooLarge { section, needs, left } => write!(
                f,
                "section {section}: needs {needs} bytes of memory; a file of this length has {left} left; bake the model again"
            ),
            Self::Malformed { section, offset, what } => {
                write!(f, "section {section}, byte {offset}: {what}; bake the model again")
            }
        }
    }
}

impl std::error::Error for FileError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::At { fault, .. } => Some(fault),
            Self::Io(error) => error.source(),
            _ => None,
        }
    }
}

impl From<io::Error> for FileError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}
