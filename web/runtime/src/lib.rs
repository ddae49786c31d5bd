//! The run time for browsers: handles and numbers, which `web/runtime/src/*.ts` makes classes of.
//!
//! What a frame takes and gives goes through [`numbers`] and through lists that stay where they are, so that nothing is allocated for it.
//! Positions are the model's own, in doubles; the run time's are relative to the file's origin.

mod building;
mod camera;
mod movers;
mod numbers;
mod paths;
mod prefetch;
mod view;

pub use camera::camera;
