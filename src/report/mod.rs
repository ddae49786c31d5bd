//! What people look at: checks, walks, pictures, plans.

pub mod check;
pub mod lines;
pub mod missed;
pub mod overlay;
pub mod path;
pub mod picture;
pub mod plan;
pub mod raster;
pub mod shade;
pub mod tour;
pub mod walk;
