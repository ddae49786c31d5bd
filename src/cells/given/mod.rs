//! Cells, portals and view cells that a user brings, instead of a split.

pub(in crate::cells) mod cells_file;
pub(in crate::cells) mod indoorgml;
pub(in crate::cells) mod view_cells;
