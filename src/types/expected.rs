//! The expected saving of culling.

use std::fmt;

/// Share of the frustum's triangles above which portals and rows save almost nothing.
const NEXT_TO_NOTHING: f64 = 0.9;

/// Triangles drawn by each mode on a walk through every cell.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct ExpectedDraw {
    /// Frames of the walk.
    pub frames: usize,
    /// Mean triangles per frame with frustum culling alone.
    pub frustum_triangles: f64,
    /// Triangles of `portals`, relative to those of the frustum; 1 if the frustum has none.
    pub portals: f64,
    /// Likewise for `pvs`.
    pub pvs: f64,
    /// Likewise for `both`.
    pub both: f64,
}

impl ExpectedDraw {
    /// Whether portals and rows save less than a tenth.
    pub fn saves_nothing(&self) -> bool {
        self.both > NEXT_TO_NOTHING
    }

    /// The main figure.
    pub fn brief(&self) -> String {
        format!("portals and rows draw {:.0} % of the triangles in the frustum", 100.0 * self.both)
    }
}

/// One line, with each mode.
impl fmt::Display for ExpectedDraw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [portals, pvs, both] = [self.portals, self.pvs, self.both].map(|share| 100.0 * share);
        write!(f, "of the triangles in the frustum, portals draw {portals:.0} %, pvs {pvs:.0} %, both {both:.0} %")
    }
}
