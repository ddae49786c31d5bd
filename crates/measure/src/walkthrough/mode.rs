//! How frames of a walk are culled.

use enfilade::runtime::Mode;
use std::fmt;
use std::str::FromStr;

/// See [`self`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WalkMode {
    /// As in a renderer.
    Culled(Mode),
    /// By the exact judge ([`crate::exact`]): objects with a triangle that is visible from the eye within the picture, or
    /// undecided. This is the reference for the other modes; it takes milliseconds a frame.
    Exact,
}

impl WalkMode {
    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Culled(mode) => mode.name(),
            Self::Exact => "exact",
        }
    }

    /// Whether it may issue occlusion queries.
    pub const fn has_queries(self) -> bool {
        matches!(self, Self::Culled(mode) if mode.has_queries())
    }
}

impl From<Mode> for WalkMode {
    fn from(mode: Mode) -> Self {
        Self::Culled(mode)
    }
}

impl fmt::Display for WalkMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for WalkMode {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        if name == Self::Exact.name() {
            return Ok(Self::Exact);
        }
        let unknown = |_| format!("no mode \"{name}\"; give {}, exact, or all", Mode::ALL.map(Mode::name).join(", "));
        name.parse().map(Self::Culled).map_err(unknown)
    }
}
