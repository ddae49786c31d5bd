//! The column complex: a partition of *all* space into convex pieces, on which cells are labelled.
//!
//! The plan is triangulated along every wall (spade's constrained Delaunay triangulation), each triangle becomes an endless column, and
//! floors, ceilings and roofs cut the columns into pieces. Two pieces meet in a *face*; the part of a face without opaque triangles is
//! *open*. A strategy only labels pieces. For any labels, the portals are all open parts of faces between different labels, so the graph is
//! sound by construction, and a poor labelling costs culling, never a missed pixel.
//!
//! In: a scene, and the heights of its storeys. Out: pieces and the faces between them; and, once pieces have labels, convex pieces of
//! cells and portals between them.
//!
//! The steps, one file each: [`facets`] (the splitting planes), [`bands`] (storeys of tall buildings), [`arrange`] (the plan), [`columns`]
//! (the pieces), [`limits`] (their number), [`faces`] with [`coverage`] and [`polygon`] (open faces; [`tiling`] if many triangles lie on a
//! face), then the labelling ([`plan`](super::plan) or [`authored`](super::authored)), then [`assemble`]. There are no cyclic dependencies.
//!
//! Based on: Lerner, Chrysanthou, Cohen-Or, *Breaking the walls* (2003, 2006) for cells from a plan; Teller, *Visibility computations in
//! densely occluded polyhedral environments* (1992) for portals as the cell boundary minus its opaque parts. New: both hold for any
//! triangle soup, because a triangle that is neither wall nor sheet merely counts as open.

pub(super) mod arrange;
pub(super) mod assemble;
pub(super) mod bands;
pub(super) mod columns;
pub(super) mod coverage;
pub(super) mod faces;
pub(super) mod facets;
pub(super) mod limits;
pub(super) mod polygon;
pub(super) mod snap;
pub(super) mod tiling;

use glam::{DVec2, DVec3};

/// Plan coordinates: x to the east, -z to the north, so that counter-clockwise in plan is counter-clockwise seen from above.
#[inline]
pub(super) fn to_plan(p: DVec3) -> DVec2 {
    DVec2::new(p.x, -p.z)
}

/// The point above `q` at height `y`.
#[inline]
pub(super) fn lift(q: DVec2, y: f64) -> DVec3 {
    DVec3::new(q.x, y, -q.y)
}
