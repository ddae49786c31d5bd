//! The split into cells.

mod audit;
mod auto;
mod bsp;
mod cells_file;
mod coarsen;
mod invariance;
mod limits;
mod plan;
mod small_holes;
mod split;
