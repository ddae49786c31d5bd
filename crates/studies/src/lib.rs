//! What was tried and does not pay. README.md has the figure and the command of each.

pub mod device_cubes;
pub mod shadow_frusta;
