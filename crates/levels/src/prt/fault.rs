//! Faults of portal files.

use super::FLATNESS;
use crate::FARTHEST;

/// The fault and its place.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[error("line {line}, {field}: {fault}")]
pub struct PrtError {
    /// Line of the file, from 1; one past the last if something is missing at the end.
    pub line: usize,
    /// The field: `magic`, `clusters`, `points`, `first cluster`, `point 3 y`, ...
    pub field: String,
    /// The fault.
    pub fault: PrtFault,
}

/// Faults of a portal file.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PrtFault {
    /// Bytes that are not UTF-8.
    #[error("not text")]
    NotText,
    /// An invisible character left by an editor.
    #[error("U+{:04X} ({name}) is not allowed in a portal file; save it as plain text", u32::from(*.character))]
    Unseen {
        /// The character.
        character: char,
        /// Its name.
        name: &'static str,
    },
    /// Another magic.
    #[error("a portal file does not begin with '{0}', but with PRT1, PRT2, PRT1-AM, or in Half-Life a number")]
    NotPrt(String),
    /// A missing field.
    #[error("missing")]
    Missing,
    /// An unexpected field.
    #[error("'{0}' instead of {1}")]
    Unexpected(String, &'static str),
    /// A whole number out of its range.
    #[error("{value} is not in {least}..={most}")]
    OutOfRange {
        /// The number.
        value: i64,
        /// Least allowed.
        least: u64,
        /// Greatest allowed.
        most: u64,
    },
    /// A coordinate that is infinite, NaN or too far away.
    #[error("'{0}' is not within {FARTHEST:e} of the origin")]
    Coordinate(String),
    /// A portal that joins a cluster with itself.
    #[error("cluster {0} on both sides")]
    SameCluster(u32),
    /// A winding without area.
    #[error("all points lie on a line")]
    NoArea,
    /// A winding whose points are off its plane.
    #[error("a point is {0} off the plane, more than {FLATNESS}")]
    NotPlanar(f64),
    /// A winding that turns the wrong way, or twice around.
    #[error("not convex: a point is {0} outside an edge, more than {FLATNESS}")]
    NotConvex(f64),
    /// Text after the end of a line or the file.
    #[error("'{0}' follows the end")]
    Trailing(String),
    /// More clusters than portals lead to.
    #[error("the header has {clusters}, but portals lead to only {named}")]
    Isolated {
        /// In the header.
        clusters: u64,
        /// Number that portals lead to.
        named: u64,
    },
    /// A leaf that is in two clusters, or twice in one.
    #[error("leaf {0} is listed twice")]
    LeafTwice(u32),
    /// Lists of clusters that do not hold every leaf.
    #[error("the header has {promised}, the lists have {found}")]
    Leaves {
        /// In the header.
        promised: u64,
        /// In the lists.
        found: u64,
    },
}
