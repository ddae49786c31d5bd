//! Shadow frusta, a competitor: `tests/shadow.rs` checks them on scenes with known answers.

mod cones;
mod culler;
mod occluders;
mod patches;
mod polygons;

pub use culler::ShadowCuller;
pub use occluders::Occluders;
