//! Why a `.pvs` file can't be read or written: the section, the byte in it, what is wrong, what to do.

use super::format::{SectionId, VERSION};
use std::io;

/// Why a file can't be read or written. Each prints as one line; the command line puts the path before it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The file can't be opened, read or written.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It doesn't begin as a `.pvs` file does.
    #[error("not a .pvs file; give one that `enfilade bake` wrote")]
    NotPvs,
    /// Another version of the format.
    #[error("format version {found}, this program reads version {VERSION}; bake the model again with this program")]
    Version {
        /// As found.
        found: u32,
    },
    /// Shorter than it says.
    #[error("cut short: {has} bytes of {needs}; copy the file again, or bake the model again")]
    Truncated {
        /// Bytes that are there.
        has: u64,
        /// Bytes that there should be at least.
        needs: u64,
    },
    /// Longer than it says.
    #[error("{extra} bytes too many at byte {end}; copy the file again, or bake the model again")]
    TrailingBytes {
        /// Where the file should end.
        end: u64,
        /// Bytes after that.
        extra: u64,
    },
    /// The header or the section table is wrong.
    #[error("header, byte {offset}: {what}; bake the model again")]
    Header {
        /// Byte in the file.
        offset: u64,
        /// What is wrong.
        what: String,
    },
    /// A section's bytes aren't the ones that were written.
    #[error(
        "section {section}, {bytes} bytes from byte {offset}: damaged (the checksum differs); copy the file again, or bake the model again"
    )]
    Checksum {
        /// The section's name, or its number where this program doesn't know it.
        section: String,
        /// Byte in the file where the section begins.
        offset: u64,
        /// The section's stored length.
        bytes: u64,
    },
    /// A section that a reader must know, and this one doesn't.
    #[error("section {id} is required and unknown to this program; read the file with the program that wrote it")]
    UnknownRequired {
        /// The section's number.
        id: u32,
    },
    /// A section that can't be left out was.
    #[error("section {section} is missing; bake the model again")]
    Missing {
        /// The section.
        section: SectionId,
    },
    /// Decoding it would take more memory than a file of this length may ask for.
    #[error(
        "section {section}: needs {needs} bytes of memory, of which {left} are left to a file of this length; bake the model again"
    )]
    TooLarge {
        /// The section.
        section: SectionId,
        /// Bytes asked for.
        needs: u64,
        /// Bytes left of what a file of this length may ask for.
        left: u64,
    },
    /// A section's content breaks a rule of the format.
    #[error("section {section}, byte {offset}: {what}; bake the model again")]
    Malformed {
        /// The section.
        section: SectionId,
        /// Byte in the decoded section.
        offset: u64,
        /// The rule.
        what: String,
    },
}
