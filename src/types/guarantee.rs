//! What rows promise.

/// Which side of the truth a file's rows are on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "kebab-case"))]
pub enum Guarantee {
    /// Rows are the upper set: whatever shows along a line with the stated clearance is in them.
    Conservative,
    /// Rows are the lower set: everything in them is visible; something may be missing.
    Sampled,
}

impl Guarantee {
    /// What both sides rest on, wherever it is told: README, `info`, pages.
    pub const STATEMENT: &'static str = "Every line of sight that keeps the stated clearance from all surfaces is accounted for: \
        what the rows leave out can't be seen along such a line.";

    /// What the rows promise, in a line.
    pub const fn in_words(self) -> &'static str {
        match self {
            Self::Conservative => {
                "conservative: nothing is missing from the rows that shows along a line with the stated clearance"
            }
            Self::Sampled => "sampled: what is in the rows is visible, something visible may be missing",
        }
    }
}
