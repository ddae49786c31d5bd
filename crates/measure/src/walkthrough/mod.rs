//! Walks a camera through a model with each culling mode, measures the frames, and draws them.

pub mod crowd;
mod exact_culler;
pub mod expected;
pub mod loading;
mod lost;
pub mod missed;
pub mod mode;
mod overlay;
pub mod path;
pub mod picture;
pub mod plan;
pub mod portal_costs;
pub mod raster;
pub mod shade;
pub mod stroll;
mod timed_culler;
pub mod tour;
pub mod walk;

/// The `i`-th part of a turn, 0 to 1: multiples of the golden section are never close to each other.
fn golden_turn(i: usize) -> f64 {
    (i as f64 * 0.618_033_988_749_895).fract()
}
