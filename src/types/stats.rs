//! Counters of a bake.

/// Counters of a bake, for the report; the file has no times, so that its bytes do not depend on the machine.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct PvsStats {
    /// Rays cast, without those within shafts.
    pub rays: u64,
    /// Visibility cubes placed.
    pub cubes: u64,
    /// Steps of portal flow.
    pub flow_steps: u64,
    /// Source portals whose flow ran out of steps, so that its targets stayed visible.
    pub flow_over_budget: u64,
    /// Cell-object pairs that only rays within the clearance of a surface reached, but that count as visible: all of them, if they are less
    /// than a hundredth of the upper set.
    pub kept_unproven: u64,
    /// Such pairs left out, if they would be more.
    pub left_out_unproven: u64,
    /// Pairs (cell-cell and cell-object) proven visible that flow refuted, without a hole in the cell graph: a bug. They were added to the
    /// upper set.
    pub contradictions: u64,
}
