//! Tubes: a curve, a radius and a frame per section, tessellated as finely as needed.
//!
//! Based on: the thesis' tubes of discrete curves (sections with their own frames, tessellated when drawn). Differences: a
//! section takes 16 bytes instead of 36, since its frame follows from its neighbours and an angle; sections follow an error in
//! metres, not a turn in degrees; ends, arcs and joints have the curve's own tangents.

mod between;
pub mod curve;
mod drawn;
mod frame;
mod mesh;
mod pieces;
mod prism;
mod runs;
mod section;
mod select;
mod spline;
mod tube;

pub use between::MOST_SECTIONS;
pub use drawn::{Band, Wall};
pub use mesh::{Mesh, mesh, part, sides, usual_error, usual_sides};
pub use prism::{Prism, prism};
pub use runs::Runs;
pub use section::{Section, Tangent};
pub use select::{Chosen, SIDES, Selection, View};
pub use tube::{Counts, Shape, Tube, TubeError, Tubes};
