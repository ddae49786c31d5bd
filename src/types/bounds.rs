//! Confidence bounds of the unseen part.

/// Each bound holds with at least this probability.
pub const CONFIDENCE: f64 = 0.95;
/// Upper bounds of unseen parts, as fractions of the sphere; each holds with probability [`CONFIDENCE`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Unseen {
    /// Bound of the mean over all cells.
    pub mean: f64,
    /// Bound of each cell; 1 for a cell without room for an eye.
    pub cells: Vec<f32>,
}

/// The reason for the end of sampling.
#[cfg(feature = "bake")]
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SamplingEnd {
    /// All rays were cast, or no strategy found anything more.
    #[default]
    Rays,
    /// The accuracy goal was reached.
    Unseen,
    /// The accuracy goal needs more proofs than memory allows.
    Memory,
}

/// A fraction in percent, with two significant digits.
#[cfg(feature = "bake")]
pub(crate) fn percent(fraction: f64) -> String {
    let percent = 100.0 * fraction;
    let digits = if percent > 0.0 { (1.0 - percent.log10().floor()).clamp(0.0, 9.0) as usize } else { 0 };
    format!("{percent:.digits$} %")
}
