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
