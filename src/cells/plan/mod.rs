//! Rooms of buildings: labels for the pieces of the [column complex](super::complex) by the narrowings between them.

pub(in crate::cells) mod adjacency;
pub(in crate::cells) mod boundaries;
pub(in crate::cells) mod clearance;
pub(in crate::cells) mod courtyards;
pub(in crate::cells) mod free_space;
pub(in crate::cells) mod rooms;
pub(in crate::cells) mod voids;
