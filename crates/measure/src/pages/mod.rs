//! Pages of one HTML file, and the tables beside them, about a building, a level or a ground.

pub mod building;
pub mod chart;
pub mod curves;
pub mod dearest;
pub mod ground;
pub mod html;
pub mod level;
pub mod lost;
pub mod matrix;
pub mod plans;
pub mod splits;
pub mod storeys;
mod tube_errors;
mod tube_weights;
pub mod tubes;
pub mod undecided;
