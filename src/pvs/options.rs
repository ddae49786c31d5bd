//! Options of the visibility computation.

use crate::types::guarantee::Guarantee;

/// Options of a bake.
#[derive(Clone, PartialEq, Debug, serde::Serialize)]
pub struct PvsOptions {
    /// The bound that the rows take.
    pub rows_from: Guarantee,
    /// Seed of every random choice.
    pub seed: u64,
    /// Rays of the whole bake: the sampling budget; a count, so that the bytes do not depend on the machine. It also limits the shafts for
    /// undecided pairs, one per five rays: 0 turns off both.
    pub ray_budget: u64,
    /// Accuracy goal: the unseen part, in the mean over cells, as a fraction above 0. Sampling continues until a test bounds it by this, or
    /// all rays are cast. See [`Unseen`](crate::types::bounds::Unseen).
    pub unseen: Option<f64>,
    /// Most steps of portal flow per source portal; then its remaining targets count as visible, and a counter records it.
    pub flow_steps: u64,
    /// Most witnesses; further pairs stay undecided.
    pub most_witnesses: usize,
}

impl Default for PvsOptions {
    fn default() -> Self {
        Self {
            rows_from: Guarantee::Conservative,
            seed: 0,
            ray_budget: 20_000_000,
            unseen: None,
            flow_steps: 20_000,
            most_witnesses: usize::MAX,
        }
    }
}
