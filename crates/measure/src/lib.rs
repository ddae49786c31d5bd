//! Judges of a bake: they share nothing with it but the scene and the file.
//!
//! [`verify`] is `check`, [`walkthrough`] is `walk`, [`pages`] is `report`, [`exact`] is what is visible from a point, without sampling.

pub mod exact;
pub mod pages;
pub mod verify;
pub mod walkthrough;
