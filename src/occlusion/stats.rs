//! Counters of a frame of online culling.

use std::ops::{Add, AddAssign};

/// Counters of a frame; the sum of two is that of both frames.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct OnlineStats {
    /// Nodes visited.
    pub nodes: u64,
    /// Tests of a box against a plane of the frustum.
    pub plane_tests: u64,
    /// Occlusion queries.
    pub queries: u64,
    /// Boxes in these queries.
    pub boxes: u64,
    /// Waits for an answer without other work.
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
