//! Ways to cull that need no queries.

use std::fmt;

/// How to cull.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Mode {
    /// Everything: what the others are measured against.
    None,
    /// Objects whose box meets the view frustum.
    Frustum,
    /// Through portals, with the frustum narrowed at each.
    Portals,
    /// The row of the eye's cell, and the frustum.
    Pvs,
    /// Through portals into cells of the row, and of those the objects of the row.
    Both,
}

impl Mode {
    /// Every mode, the least culling first.
    pub const ALL: [Self; 5] = [Self::None, Self::Frustum, Self::Portals, Self::Pvs, Self::Both];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        ["none", "frustum", "portals", "pvs", "both"][self as usize]
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
