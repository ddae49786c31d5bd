//! What was tried and does not pay. README.md has the figure and the command of each.

pub mod boxes;
pub mod device_cubes;
pub mod levels;
pub mod reductions;
pub mod shadow_frusta;
pub mod trees;
