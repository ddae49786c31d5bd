//! What people look at: walks, pictures, plans.

pub mod missed;
pub mod overlay;
pub mod path;
pub mod picture;
pub mod plan;
pub mod raster;
pub mod shade;
pub mod tour;
pub mod walk;
