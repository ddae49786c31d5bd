//! Cases of maps and levels.
