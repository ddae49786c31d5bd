//! The user's cells, portals and view cells, instead of a split.
//!
//! In: text, and, for cells, the scene that they are relative to. Out: a [`CellGraph`](super::CellGraph), or view cells
//! ([`view_cells::ViewCell`]: named convex pieces), or an error of one line.
//!
//! One file for each form: [`cells_file`] (JSON, as `enfilade dump --json` writes it; see docs/cli.md), [`indoorgml`] (the OGC's IndoorGML:
//! solids of rooms, transitions between them), [`view_cells`] (JSON or boxes: regions for cameras).
//!
//! The steps are those of any reader: parse, check the invariants of the graph's types (numbers, volumes, windings that are planar and
//! convex and lie between their cells), build. [`validate`](mod@super::validate), which checks the graph of every strategy, tests whether
//! the cells fit the model. [`convex`](super::convex) decomposes a solid that is not convex. No paper: formats.

pub(in crate::cells) mod cells_file;
pub(in crate::cells) mod view_cells;
