//! Cells, portals and view cells that a user brings, instead of a split.
//!
//! In: text, and for cells the scene that they are relative to. Out: a [`CellGraph`](super::CellGraph), or view cells
//! ([`view_cells::ViewCell`]: named convex pieces), or one line that says why not.
//!
//! One file for each form: [`cells_file`] (JSON, as `enfilade dump --json` writes it; see docs/cli.md), [`indoorgml`] (the OGC's
//! IndoorGML: solids of rooms, transitions between them), [`view_cells`] (JSON or boxes, where a camera may be).
//!
//! The steps are those of any reader: parse, check what the graph's types promise (numbers, volumes, windings that are planar and
//! convex and lie between their cells), build. Whether the cells fit the model is for [`validate`](mod@super::validate), that every
//! strategy's graph goes through. A solid that isn't convex is parted by [`convex`](super::convex). No paper: formats.

pub(in crate::cells) mod cells_file;
pub(in crate::cells) mod view_cells;
