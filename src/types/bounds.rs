//! Confidence bounds of what sampling missed.

/// The bounds hold with at least this probability, each.
pub const CONFIDENCE: f64 = 0.95;
/// Upper bounds of what is unseen, as fractions of the sphere; each holds with probability [`CONFIDENCE`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Unseen {
    /// Of the mean over all cells.
    pub mean: f64,
    /// For each cell; 1 for one without room for an eye.
    pub cells: Vec<f32>,
}

/// What ended sampling.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "snake_case"))]
pub enum SamplingEnd {
    /// All rays were cast, or none found anything more.
    #[default]
    Rays,
    /// The bound that was asked for was reached.
    Unseen,
    /// A bound was asked for, and there was no memory for the proofs that it takes.
    Memory,
}

/// A fraction in percent, with two digits that count.
#[cfg(feature = "bake")]
pub(crate) fn percent(fraction: f64) -> String {
    let percent = 100.0 * fraction;
    let digits = if percent > 0.0 { (1.0 - percent.log10().floor()).clamp(0.0, 9.0) as usize } else { 0 };
    format!("{percent:.digits$} %")
}
