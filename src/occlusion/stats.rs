//! What a frame of online culling cost and kept.

use std::ops::{Add, AddAssign};

/// Counters of a frame; the sum of two is that of both frames.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct OnlineStats {
    /// Nodes looked at.
    pub nodes: u64,
    /// Times that a box was held against a plane of the frustum.
    pub plane_tests: u64,
    /// Questions to the oracle.
    pub queries: u64,
    /// Boxes in those.
    pub boxes: u64,
    /// Times that the oracle had no answer yet and there was nothing else to do.
    pub waits: u64,
    /// Objects to draw.
    pub objects: u64,
}

impl Add for OnlineStats {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            nodes: self.nodes + other.nodes,
            plane_tests: self.plane_tests + other.plane_tests,
            queries: self.queries + other.queries,
            boxes: self.boxes + other.boxes,
            waits: self.waits + other.waits,
            objects: self.objects + other.objects,
        }
    }
}

impl AddAssign for OnlineStats {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
