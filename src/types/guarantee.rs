//! The guarantee of rows.

/// The bound that a file's rows take.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "kebab-case"))]
pub enum Guarantee {
    /// Rows are the upper set: everything visible along a line with the stated clearance is in them.
    Conservative,
    /// Rows are the lower set: everything in them is visible; something may be missing.
    Sampled,
}

impl Guarantee {
    /// The statement of the guarantee, for README, `info` and pages.
    pub const STATEMENT: &'static str =
        "The rows hold everything visible along a line of sight that keeps the stated clearance from all surfaces.";

    /// The guarantee in one line.
    pub const fn in_words(self) -> &'static str {
        match self {
            Self::Conservative => "conservative: the rows hold everything visible along a line with the stated clearance",
            Self::Sampled => "sampled: everything in the rows is visible, but visible objects may be missing",
        }
    }
}
