//! Tubes: a curve, a radius and a frame a section, of which triangles are made as fine as somebody needs them.
//!
//! Based on: the thesis' tubes of discrete curves (sections with a frame of their own, made into triangles as they are drawn). What differs:
//! a section takes 16 bytes, not 36, since its frame follows from its neighbours and an angle; sections are taken where the curve bends, by
//! an error in metres, not by a turn in degrees; and ends, arcs and joints have the curve's own tangents, not differences of points.

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
