//! The gap: undecided pairs.

/// Cell-object pairs between the two bounds: neither witnessed nor proven hidden.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct Gap {
    /// Pairs of closed cells in the upper set, decided or not.
    pub closed_upper: u64,
    /// Pairs of closed cells, undecided: rays or shafts reached the object, but did not decide down to the tolerance.
    pub tolerance: u64,
    /// Likewise: the object is in the cell itself, behind other objects or within a wall, and no ray has hit it.
    pub inside: u64,
    /// Likewise: the budget was too small to decide.
    pub budget: u64,
    /// Undecided pairs of open cells, where culling is online.
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
