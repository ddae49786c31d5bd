//! Which portals are doors and windows, and what stands in them.
//!
//! In: a scene, and the portals of a finished split. Out: the same portals with a [`PortalKind`](super::PortalKind), the author's id, and
//! a [`PortalState`](super::PortalState).
//!
//! The steps, one file each: [`kinds`] (door, window or opening, by the author's openings or by the leaf that hangs there), [`state`]
//! (shut or open, clear or not, by how much of the portal the leaf covers), [`gap`] (whether a shut leaf lets a line through), and for
//! both of the first two [`leaves`] (what of an object is one leaf). [`stoppers`] tells of meshes that close a doorway and have no name.
//!
//! Rows depend on none of it: a bake takes every door as open. A wrong answer costs culling at run time; only a leaf called shut that
//! isn't would lose something, so [`gap`] looks for lines through what seems shut. Names for all of this follow IFC (ISO 16739);
//! no paper: new here.

pub(in crate::cells) mod gap;
pub(in crate::cells) mod kinds;
mod leaves;
pub(in crate::cells) mod state;
pub(in crate::cells) mod stoppers;
