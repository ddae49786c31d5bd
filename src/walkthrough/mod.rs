//! Walks a camera through a model with each culling mode, measures the frames, and draws them.

pub mod compare;
mod exact_culler;
pub mod expected;
pub mod loading;
mod lost;
pub mod missed;
pub mod mode;
pub mod overlay;
pub mod path;
pub mod picture;
pub mod plan;
pub mod raster;
pub mod shade;
pub mod stroll;
mod timed_culler;
pub mod tour;
pub mod walk;
