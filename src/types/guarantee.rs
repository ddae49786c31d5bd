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
    pub const STATEMENT: &'static str = "Every line of sight that keeps the stated clearance from all surfaces is accounted for: \
        what the rows leave out can't be seen along such a line.";

    /// The guarantee in one line.
    pub const fn in_words(self) -> &'static str {
        match self {
            Self::Conservative => "conservative: the rows hold everything visible along a line with the stated clearance",
            Self::Sampled => "sampled: everything in the rows is visible, but visible objects may be missing",
        }
    }
}
