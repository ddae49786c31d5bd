//! Errors of imports: one line, with the place in the file and the remedy.

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

/// An error of an import. The command line puts the path before it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The file can't be opened or read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// No importer for this extension.
    #[error("no importer for \".{extension}\"; give {known}")]
    UnknownFormat {
        /// The extension, in lower case.
        extension: String,
        /// The known extensions.
        known: String,
    },
    /// This binary was built without the format.
    #[error("this binary reads no {format}; build it with `--features {feature}`")]
    MissingFeature {
        /// The format of the file.
        format: &'static str,
        /// The cargo feature that reads it.
        feature: &'static str,
    },
    /// The file is not of its stated format, or is damaged.
    #[error("{place}{what}")]
    Malformed {
        /// The place.
        place: Place,
        /// The fault and the remedy.
        what: String,
    },
    /// The file is valid but uses an unsupported feature.
    #[error("{what} is not supported; {hint}")]
    Unsupported {
        /// The feature.
        what: String,
        /// The remedy.
        hint: &'static str,
    },
    /// A position is not a finite number.
    #[error("{node}: a vertex is not a finite number")]
    NotFinite {
        /// The mesh.
        node: String,
    },
    /// No triangles.
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
