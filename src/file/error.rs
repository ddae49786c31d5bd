//! Why a `.pvs` file can't be read or written: the section, the byte in it, what is wrong, what to do.

use super::format::{SectionId, VERSION};
use std::{fmt, io};

/// Why a file can't be read or written. Each prints as one line; the command line puts the path before it.
#[derive(Debug)]
#[non_exhaustive]
pub enum FileError {
    /// The file can't be opened, read or written.
    Io(io::Error),
    /// It doesn't begin as a `.pvs` file does.
    NotPvs,
    /// Another version of the format.
    Version {
        /// As found.
        found: u32,
    },
    /// Shorter than it says.
    Truncated {
        /// Bytes that are there.
        has: u64,
        /// Bytes that there should be at least.
        needs: u64,
    },
    /// Longer than it says.
    TrailingBytes {
        /// Where the file should end.
        end: u64,
        /// Bytes after that.
        extra: u64,
    },
    /// The header or the section table is wrong.
    Header {
        /// Byte in the file.
        offset: u64,
        /// What is wrong.
        what: String,
    },
    /// A section's bytes aren't the ones that were written.
    Checksum {
        /// The section's name, or its number where this program doesn't know it.
        section: String,
        /// Byte in the file where the section begins.
        offset: u64,
        /// The section's stored length.
        bytes: u64,
    },
    /// A section that a reader must know, and this one doesn't.
    UnknownRequired {
        /// The section's number.
        id: u32,
    },
    /// A section that can't be left out was.
    Missing {
        /// The section.
        section: SectionId,
    },
    /// Decoding it would take more memory than a file of this length may ask for.
    TooLarge {
        /// The section.
        section: SectionId,
        /// Bytes asked for.
        needs: u64,
        /// Bytes left of what a file of this length may ask for.
        left: u64,
    },
    /// A section's content breaks a rule of the format.
    Malformed {
        /// The section.
        section: SectionId,
        /// Byte in the decoded section.
        offset: u64,
        /// The rule.
        what: String,
    },
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io(error) => write!(f, "{error}"),
            Self::NotPvs => write!(f, "not a .pvs file; give one that `enfilade bake` wrote"),
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
                "section {id} is required and unknown to this program; read the file with the program that wrote it"
            ),
            Self::Missing { section } => write!(f, "section {section} is missing; bake the model again"),
            Self::TooLarge { section, needs, left } => write!(
                f,
                "section {section}: needs {needs} bytes of memory, of which {left} are left to a file of this length; bake the model again"
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
