//! Ways to cull.

use std::fmt;
use std::str::FromStr;

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
    PortalsAndPvs,
    /// [`Mode::PortalsAndPvs`], then CHC for the rest.
    Chc,
    /// [`Mode::PortalsAndPvs`], then CHC++ for the rest.
    ChcPlus,
    /// [`Mode::PortalsAndPvs`] in a closed cell; [`Mode::Chc`] in an open one, where portals and rows hide little.
    Auto,
}

impl Mode {
    /// Every mode, the least culling first.
    pub const ALL: [Self; 8] =
        [Self::None, Self::Frustum, Self::Portals, Self::Pvs, Self::PortalsAndPvs, Self::Chc, Self::ChcPlus, Self::Auto];
    /// The modes that never issue occlusion queries.
    pub const WITHOUT_QUERIES: [Self; 5] = [Self::None, Self::Frustum, Self::Portals, Self::Pvs, Self::PortalsAndPvs];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        ["none", "frustum", "portals", "pvs", "both", "chc", "chc++", "auto"][self as usize]
    }

    /// Whether it may issue occlusion queries.
    pub const fn has_queries(self) -> bool {
        matches!(self, Self::Chc | Self::ChcPlus | Self::Auto)
    }

    /// The part that needs no queries.
    pub(super) const fn without_queries(self) -> Self {
        if self.has_queries() { Self::PortalsAndPvs } else { self }
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Mode {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|mode| mode.name() == name);
        found.ok_or_else(|| format!("no mode \"{name}\"; give {}, or all", Self::ALL.map(Self::name).join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_are_known_by_name() {
        for mode in Mode::ALL {
            assert_eq!(mode.to_string().parse(), Ok(mode));
            assert_eq!(Mode::WITHOUT_QUERIES.contains(&mode), !mode.has_queries());
        }
        assert!("Both".parse::<Mode>().unwrap_err().contains("no mode"));
    }
}
