//! Why a file can't be read: one line, with the place in the file and what to do.

use std::fmt;

/// A place in a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// Line number, from 1.
    Line(usize),
    /// Byte offset.
    Byte(usize),
    /// The whole file.
    File,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(n) => write!(f, "line {n}: "),
            Self::Byte(n) => write!(f, "byte {n}: "),
            Self::File => Ok(()),
        }
    }
}

/// Why an import failed. The command line puts the path before it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The file can't be opened or read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// No importer for this extension.
    #[error("no importer for \".{extension}\"; give {known}")]
    UnknownFormat {
        /// As found, in lower case.
        extension: String,
        /// Those that there are.
        known: String,
    },
    /// This binary was built without the format.
    #[error("this binary reads no {format}; build it with `--features {feature}`")]
    MissingFeature {
        /// What the file is.
        format: &'static str,
        /// The cargo feature that reads it.
        feature: &'static str,
    },
    /// The file isn't what it says, or is broken.
    #[error("{place}{what}")]
    Malformed {
        /// Where.
        place: Place,
        /// What is wrong, and what to do.
        what: String,
    },
    /// The file is in order but uses what isn't supported.
    #[error("{what} is not supported; {hint}")]
    Unsupported {
        /// The thing.
        what: String,
        /// What to do.
        hint: &'static str,
    },
    /// A position isn't a finite number.
    #[error("{node}: a vertex is not a finite number")]
    NotFinite {
        /// The mesh.
        node: String,
    },
    /// Nothing to see.
    #[error("no triangles in it")]
    Empty,
    /// More sections of tubes than one scene can have.
    #[error("more than {limit} sections of tubes; split the model, or import with --tubes never")]
    Sections {
        /// The limit.
        limit: usize,
    },
    /// More than [`super::ImportOptions::max_triangles`].
    #[error("more than {limit} triangles; raise the limit or split the model")]
    TooLarge {
        /// The limit.
        limit: usize,
    },
}

impl ImportError {
    /// Shorthand for [`ImportError::Malformed`].
    pub fn malformed(place: Place, what: impl Into<String>) -> Self {
        Self::Malformed { place, what: what.into() }
    }
}
