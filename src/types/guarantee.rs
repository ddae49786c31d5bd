//! What rows promise.

/// Which side of the truth a file's rows are on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "kebab-case"))]
pub enum Guarantee {
    /// Rows are the upper set: nothing visible is missing.
    Conservative,
    /// Rows are the lower set: everything in them is visible; something may be missing.
    Sampled,
}
