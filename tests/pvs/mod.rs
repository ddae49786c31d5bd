//! Both bounds of visibility.

mod backfaces;
mod clusters;
mod cubes;
mod lower;
mod occluders;
mod unseen;
mod upper;
mod view_cells;
