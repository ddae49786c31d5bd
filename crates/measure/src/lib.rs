//! Judges of a bake: they share only the scene and the file with it.
//!
//! [`verify`] is `check`, [`walkthrough`] is `walk`, [`pages`] is `report`, and [`exact`] is exact visibility from a point.

pub mod exact;
pub mod pages;
pub mod verify;
pub mod walkthrough;
