//! Shadow frusta: what an occluder hides from a point, as planes through its silhouette. `tests/shadow.rs` checks them on scenes with known
//! answers, `benches/shadow.rs` measures them.

mod cones;
mod culler;
mod occluders;
mod patches;
mod polygons;

pub use culler::ShadowCuller;
pub use occluders::Occluders;
