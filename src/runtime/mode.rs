//! The modes of culling.

use std::fmt;
use std::str::FromStr;

/// A mode of culling.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Mode {
    /// Everything: the baseline for the other modes.
    None,
    /// Objects whose box intersects the view frustum.
    Frustum,
    /// Through portals, with the frustum narrowed at each.
    Portals,
    /// Objects in the row of the eye's cell and in the frustum.
    Pvs,
    /// Through portals into cells of the row, with the objects of the row.
    PortalsAndPvs,
    /// [`Mode::PortalsAndPvs`], then CHC on its result.
    Chc,
    /// [`Mode::PortalsAndPvs`], then CHC++ on its result.
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

    /// The mode without its queries.
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
