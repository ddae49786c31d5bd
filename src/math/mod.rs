//! Mathematics that every room shares.
//!
//! In: nothing. Out: planes, boxes and polygons ([`geom`], [`polygon`]), convex polyhedra of half-spaces
//! ([`polyhedron`]), hierarchies and a grid of boxes ([`box_tree`],
//! [`bvh`], [`box_grid`]), bit sets ([`bits`]), a sort, [tolerances](tolerance), random numbers, threads and registers.

pub mod bits;
pub mod box_grid;
pub mod box_tree;
#[cfg(feature = "bake")]
pub mod bvh;
pub mod geom;
#[cfg(feature = "bake")]
pub(crate) mod lanes;
pub mod parallel;
#[cfg(feature = "bake")]
pub mod polygon;
pub mod polyhedron;
pub mod random;
pub(crate) mod simd;
pub(crate) mod sorting;
pub mod tolerance;
