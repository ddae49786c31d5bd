//! What people look at: checks, walks, pictures, plans, pages.

pub mod building_report;
pub mod chart;
pub mod check;
pub mod curves;
pub mod doubts;
pub mod html;
pub mod level_report;
pub mod lines;
pub mod matrix;
pub mod missed;
pub mod overlay;
pub mod path;
pub mod picture;
pub mod plan;
pub mod raster;
pub mod shade;
pub mod storeys;
pub mod tour;
pub mod walk;
pub mod walkers;
