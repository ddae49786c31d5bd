//! The plan strategy: rooms of buildings, as labels for the pieces of the [column complex](super::complex).
//!
//! In: the pieces and the faces between them, the author's rooms if there are any, and thresholds ([`options`]). Out: a region for each
//! piece of free space ([`space`]). A region may be the outside, a courtyard, or an author's room.
//!
//! The steps, one file each: [`clearance`] (the width of space), [`free_space`] (free or solid), [`claims`] (fixed labels), [`bottlenecks`]
//! (the openings between pieces), the watershed in [`rooms`], [`adjacency`] (whole regions), [`voids`] (yards and plenums), [`boundaries`]
//! (smoothing), [`courtyards`]. A file uses only files before it in this order: options, space, clearance, bottlenecks, then the steps,
//! then rooms.
//!
//! Based on: Haumont, Debeir, Sillion, *Volumetric cell-and-portal generation*, 2003: the watershed of clearance. Deviation: on the
//! triangles of the plan instead of voxels, so that boundaries follow the lines of walls and doors.

pub(in crate::cells) mod adjacency;
pub(in crate::cells) mod bottlenecks;
pub(in crate::cells) mod boundaries;
pub(in crate::cells) mod claims;
pub(in crate::cells) mod clearance;
pub(in crate::cells) mod courtyards;
pub(in crate::cells) mod free_space;
pub(in crate::cells) mod options;
pub(in crate::cells) mod rooms;
pub(in crate::cells) mod space;
pub(in crate::cells) mod voids;
