//! Walks a camera through a model with each culling mode, measures the frames, and draws them.

pub mod compare;
pub mod expected;
pub mod missed;
pub mod overlay;
pub mod path;
pub mod picture;
pub mod plan;
pub mod raster;
pub mod shade;
mod timed_culler;
pub mod tour;
pub mod walk;
