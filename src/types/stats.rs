//! What a bake did.

/// What the bake did, for the report; times are kept out of the file, so that its bytes don't depend on the machine.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct PvsStats {
    /// Rays cast, but for those within shafts.
    pub rays: u64,
    /// Visibility cubes placed.
    pub cubes: u64,
    /// Steps of portal flow.
    pub flow_steps: u64,
    /// Source portals whose flow ran out of steps and kept what might be seen.
    pub flow_over_budget: u64,
    /// Cell-object pairs that only rays within the clearance of a surface met, and that count as visible all the same: all of them, where they
    /// cost less than a hundredth of the upper set.
    pub kept_unproven: u64,
    /// Such pairs where they would have cost more: they are left out.
    pub left_out_unproven: u64,
    /// Pairs (cell-cell and cell-object) that were proven visible, that flow took for hidden, and for which no hole was found
    /// in the cell graph: a fault of ours. They were added to the upper set.
    pub contradictions: u64,
}
