//! Everything that speaks to the graphics processor. [`frame`] is a frame from top to bottom; the other files hold what it uses.

pub mod alarm;
pub mod caps;
pub mod culled;
pub mod draws;
pub mod frame;
pub mod full;
pub mod geometry;
pub mod ground;
pub mod hidden;
pub mod leaves;
pub mod lines;
pub mod marks;
pub mod mesh;
pub mod mirror;
pub mod pipelines;
pub mod queries;
pub mod ranks;
pub mod readback;
pub mod shade;
pub mod slice;
pub mod smooth;
pub mod split;
pub mod sun;
pub mod surfaces;
pub mod targets;
pub mod timer;
