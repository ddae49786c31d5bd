//! How frames are culled: as the library does it, or by a pyramid of depth on the device.

use enfilade::runtime::Mode;
use std::fmt;
use std::str::FromStr;

/// See [`self`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ViewMode {
    /// By the library.
    Culled(Mode),
    /// By the frustum on the processor, and in two passes against a pyramid of depth on the device ([`crate::draw::hiz`]).
    Hiz,
}

impl ViewMode {
    /// Every mode, those of the library first.
    pub const ALL: [Self; Mode::ALL.len() + 1] = {
        let mut all = [Self::Hiz; Mode::ALL.len() + 1];
        let mut i = 0;
        while i < Mode::ALL.len() {
            all[i] = Self::Culled(Mode::ALL[i]);
            i += 1;
        }
        all
    };

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Culled(mode) => mode.name(),
            Self::Hiz => "hiz",
        }
    }

    /// The mode of the library.
    pub const fn of_library(self) -> Mode {
        match self {
            Self::Culled(mode) => mode,
            Self::Hiz => Mode::Frustum,
        }
    }
}

impl From<Mode> for ViewMode {
    fn from(mode: Mode) -> Self {
        Self::Culled(mode)
    }
}

impl fmt::Display for ViewMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for ViewMode {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let unknown = || {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("no mode \"{name}\"; give one of {names}")
        };
        Self::ALL.into_iter().find(|mode| mode.name() == name).ok_or_else(unknown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_are_known_by_name() {
        for mode in ViewMode::ALL {
            assert_eq!(mode.to_string().parse(), Ok(mode));
        }
        assert_eq!("hiz".parse(), Ok(ViewMode::Hiz));
        assert!("Hiz".parse::<ViewMode>().unwrap_err().contains("no mode"));
    }
}
