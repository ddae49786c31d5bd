//! Classifies portals as doors and windows, and finds their states.
//!
//! In: a scene, and the portals of a finished split. Out: the same portals with a [`PortalKind`](super::PortalKind), the author's id, and
//! a [`PortalState`](super::PortalState).
//!
//! The steps, one file each: [`kinds`] (door, window or opening, by the author's openings or by the leaf there), [`state`] (shut or open,
//! see-through or not, by the share of the portal that the leaf covers), [`gap`] (gaps beside a shut leaf), and, for the first two,
//! [`leaves`] (splits an object into leaves). [`stoppers`] reports unnamed meshes that close a doorway.
//!
//! Rows do not depend on it: a bake takes every door as open. A wrong result costs culling at run time; only a leaf wrongly called shut
//! would lose objects, so [`gap`] looks for lines through shut leaves. Names follow IFC (ISO 16739); no paper: new here.

pub(in crate::cells) mod gap;
pub(in crate::cells) mod kinds;
mod leaves;
pub(in crate::cells) mod state;
pub(in crate::cells) mod stoppers;
