//! Which portals are doors and windows, and what stands in them.

pub(in crate::cells) mod gap;
pub(in crate::cells) mod kinds;
pub(in crate::cells) mod state;
