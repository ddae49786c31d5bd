//! Why a raster cannot be read: one line, with the file, the place in it and a remedy.

use std::fmt;

/// A place in a raster's file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// Line number, from 1.
    Line(u64),
    /// Byte offset.
    Byte(u64),
    /// A sample, counted from 0.
    Sample {
        /// From the west.
        column: u32,
        /// From the north.
        row: u32,
    },
    /// The whole file.
    File,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(n) => write!(f, "line {n}: "),
            Self::Byte(n) => write!(f, "byte {n}: "),
            Self::Sample { column, row } => write!(f, "column {column}, row {row}: "),
            Self::File => Ok(()),
        }
    }
}

/// Why rasters cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RasterError {
    /// No file was given.
    #[error("no raster given; give .tif, .hgt or .asc")]
    NoFiles,
    /// The file cannot be opened or read.
    #[error("{file}: {source}")]
    Io {
        /// Its path.
        file: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// No reader for this extension.
    #[error("{file}: no reader for \".{extension}\"; give .tif, .hgt or .asc")]
    UnknownFormat {
        /// Its path.
        file: String,
        /// Its extension, in lower case.
        extension: String,
    },
    /// The file is damaged or of another format.
    #[error("{file}: {place}{what}")]
    Malformed {
        /// Its path.
        file: String,
        /// Where.
        place: Place,
        /// The fault and the remedy.
        what: String,
    },
    /// The file is valid but uses an unsupported feature.
    #[error("{file}: {what} is not supported; {hint}")]
    Unsupported {
        /// Its path.
        file: String,
        /// The feature.
        what: String,
        /// The remedy.
        hint: &'static str,
    },
    /// More samples than [`super::MAX_SAMPLES`], or more on a side than [`super::MAX_SIDE`].
    #[error("{file}: {columns} x {rows} samples; at most 2^31 are supported, and 2^20 on a side: cut it into parts")]
    TooLarge {
        /// Its path, or that of a mosaic's first file.
        file: String,
        /// Samples from west to east.
        columns: u64,
        /// Samples from north to south.
        rows: u64,
    },
    /// Two rasters that do not form one ground.
    #[error("{second}: {what} of {first}; give rasters of one lattice that abut")]
    Apart {
        /// A raster.
        first: String,
        /// The one that does not fit.
        second: String,
        /// The mismatch, up to the name of the first.
        what: String,
    },
}

impl RasterError {
    /// Shorthand for [`RasterError::Malformed`].
    pub(super) fn malformed(file: &str, place: Place, what: impl Into<String>) -> Self {
        Self::Malformed { file: file.to_owned(), place, what: what.into() }
    }

    /// Shorthand for [`RasterError::Unsupported`].
    pub(super) fn unsupported(file: &str, what: impl Into<String>, hint: &'static str) -> Self {
        Self::Unsupported { file: file.to_owned(), what: what.into(), hint }
    }

    /// The system's error for a file; one that ends too early was cut off.
    pub(super) fn io(file: &str, source: std::io::Error) -> Self {
        if source.kind() == std::io::ErrorKind::UnexpectedEof {
            return Self::malformed(file, Place::File, "the file is cut off; copy it again");
        }
        Self::Io { file: file.to_owned(), source }
    }
}
