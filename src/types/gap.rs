//! What is neither witnessed nor proven hidden.

/// Cell-object pairs between the two sides: neither witnessed nor proven hidden.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct Gap {
    /// From closed cells: those of the upper set, decided or not.
    pub closed_upper: u64,
    /// From closed cells, undecided: rays reached it, or shafts closed in on it, but nothing clears or shuts it down to the tolerance.
    pub tolerance: u64,
    /// Likewise: the object is in the cell itself, hidden by what else is there or within a wall, and no ray has met it.
    pub inside: u64,
    /// Likewise: what it would take to decide it was not spent.
    pub budget: u64,
    /// Undecided from open cells, where culling is done online.
    pub open: u64,
}

impl Gap {
    /// Undecided pairs of closed cells.
    pub fn closed(&self) -> u64 {
        self.tolerance.saturating_add(self.inside).saturating_add(self.budget)
    }

    /// All undecided pairs.
    pub fn all(&self) -> u64 {
        self.closed().saturating_add(self.open)
    }
}
