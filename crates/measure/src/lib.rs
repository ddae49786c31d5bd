//! Judges of a bake: they share only the scene and the file with it.
//!
//! [`verify`] is `check`, [`walkthrough`] is `walk`, [`pages`] is `report`, [`exact`] is exact visibility from a point, and [`why`] has the
//! words for a pair.

pub mod exact;
pub mod pages;
pub mod verify;
pub mod walkthrough;
pub mod why;
