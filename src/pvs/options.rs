//! How visibility is worked out.

use crate::types::guarantee::Guarantee;

/// How to bake.
#[derive(Clone, PartialEq, Debug, serde::Serialize)]
pub struct PvsOptions {
    /// Which side the rows take.
    pub rows_from: Guarantee,
    /// Seed of every random choice.
    pub seed: u64,
    /// Rays over the whole bake: the sampling budget; a count, so that the bytes don't depend on the machine. What flow leaves undecided
    /// is then asked of the triangles, one shaft for five of them: 0 leaves out both.
    pub ray_budget: u64,
    /// What may be unseen of what there is to see from a cell, in the mean over cells, as a fraction above 0: sampling goes on until a test
    /// bounds it by this, or all rays are cast. See [`Unseen`](crate::types::bounds::Unseen).
    pub unseen: Option<f64>,
    /// Steps of portal flow that one source portal may take before its remaining targets are left "visible" and counted.
    pub flow_steps: u64,
    /// Most witnesses that are kept; pairs beyond them stay undecided.
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
