//! Free space as cells joined by portals.
//!
//! Every strategy makes a [`CellGraph`], and all later steps read it. [`CellGraph`] defines *sound*, and [`validate`](mod@validate) tests
//! it.

mod authored;
mod bsp;
mod coarsen;
mod complex;
pub mod convex;
pub(crate) mod disjoint_sets;
mod doors;
mod f32_rounding;
pub(crate) mod lean;
mod leaves;
pub(crate) mod locate;
pub(crate) mod merge;
mod opaque;
mod placement;
mod plan;
mod scale;
pub(crate) mod small_holes;
mod split;
mod upright;
mod user_cells;
pub mod validate;

pub use crate::types::portal::{PortalKind, PortalState};
pub use crate::types::strategy::Strategy;
pub use authored::audit::{Audit, Finding, FindingKind, audit, audit_rooms};
pub use coarsen::{coarsen, flow_bytes, matrix_bytes};
pub use complex::polygon::convex_hull;
pub use locate::{Locator, Stretch};
pub use placement::{Placement, place_objects};
pub use split::{SplitError, SplitOptions, split, undivided};
pub(crate) use split::{by_author, split_by, undivided_in_metres};
pub(crate) use upright::upright_share;
pub use user_cells::cells_file::{GivenError, read_cells};
pub use user_cells::view_cells::{ViewCell, ViewCellName, read_view_cells};

use crate::math::geom::{Aabb, Plane};
use crate::math::polyhedron;
use crate::types::note::Note;
use crate::{CellId, DirectedPortal, PortalId};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Prefix of a note that a split reached a limit.
pub(crate) const BOUND: &str = "bound: ";

/// A convex piece of a cell: the points inside every plane.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Piece {
    /// Half-spaces `n . p <= d`. May be unbounded (the outside).
    pub planes: Vec<Plane>,
    /// Box around it; infinite where the piece is.
    pub bounds: Aabb,
}

impl Piece {
    /// The intersection of all half-spaces; `None` if it has no volume. Corners within `eps` metres of a plane count as inside. A piece
    /// with more planes than any split makes gets an infinite box.
    pub fn new(planes: Vec<Plane>, eps: f64) -> Option<Self> {
        let everywhere = Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
        let is_many = planes.len() > polyhedron::MAX_PLANES;
        let bounds = if is_many { everywhere } else { polyhedron::bounds(&planes, eps)? };
        Some(Self { planes, bounds })
    }

    /// True if `p` is inside, or at most `eps` metres outside of each plane.
    pub fn contains(&self, p: DVec3, eps: f64) -> bool {
        self.planes.iter().all(|plane| plane.distance(p) <= eps)
    }
}

/// A region of free space.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Cell {
    /// The author's name, or one that states its place (`storey 2, cell 17`).
    pub name: String,
    /// The author's id (GlobalId, node name), if there is one.
    pub source: Option<String>,
    /// True for the outside or an atrium: portals do not help here, so culling is online.
    pub open: bool,
    /// Disjoint convex pieces.
    pub pieces: Vec<Piece>,
    /// The directed portals that lead out of this cell, ascending.
    pub portals: Vec<DirectedPortal>,
}

/// A convex planar polygon through which one cell sees another. Conventions: crate root.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Portal {
    /// `cells[0]` is behind the plane, `cells[1]` in front of it.
    pub cells: [CellId; 2],
    /// Its plane, normal from `cells[0]` into `cells[1]`.
    pub plane: Plane,
    /// Corners, counter-clockwise seen from the tip of the normal; 3 or more.
    pub winding: Vec<DVec3>,
    /// Door, window or opening.
    pub kind: PortalKind,
    /// Whether it is shut, see-through, closable or ajar.
    pub state: PortalState,
    /// The author's id of the door or window, if there is one.
    pub source: Option<String>,
}

impl Portal {
    /// The portal with its plane and winding reversed, between the same cells.
    pub(crate) fn turned(mut self) -> Self {
        self.plane = self.plane.flipped();
        self.winding.reverse();
        self
    }
}

/// Cells and portals.
///
/// Sound means: any segment that keeps [`crate::math::tolerance::Tolerance::clearance`] from opaque triangles and starts inside a
/// cell's piece stays in cells, and goes from cell to cell only through the windings of portals between those two. A line may
/// cross one cell several times (cells need not be convex), and one portal at most once.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct CellGraph {
    /// The strategy that made it.
    pub strategy: Strategy,
    /// The reason for this strategy, in one line.
    pub reason: String,
    /// Cells, including the outside if there is one.
    pub cells: Vec<Cell>,
    /// Portals.
    pub portals: Vec<Portal>,
    /// Openings narrower than this, metres, may have been sealed on purpose.
    pub smallest_hole: f64,
    /// Convex polygons of holes that count as opaque: below the user's limit, or undrawn walls of a level.
    pub closed_holes: Vec<Vec<DVec3>>,
    /// Notes about simplifications of the split.
    pub notes: Vec<Note>,
}

impl CellGraph {
    /// A graph made by hand, for unit tests.
    #[cfg(test)]
    pub(crate) fn given(cells: Vec<Cell>, portals: Vec<Portal>) -> Self {
        let (reason, closed_holes, notes) = Default::default();
        let mut graph = Self { strategy: Strategy::Given, reason, cells, portals, smallest_hole: 0.0, closed_holes, notes };
        graph.link();
        graph
    }

    /// The cell that a directed portal leads into.
    #[inline]
    pub fn target(&self, portal: DirectedPortal) -> CellId {
        self.portals[portal.portal().index()].cells[1 - portal.side()]
    }

    /// The cell that a directed portal leads out of.
    #[inline]
    pub fn source(&self, portal: DirectedPortal) -> CellId {
        self.portals[portal.portal().index()].cells[portal.side()]
    }

    /// The plane of a directed portal, normal pointing the way it leads.
    #[inline]
    pub fn plane(&self, portal: DirectedPortal) -> Plane {
        let plane = self.portals[portal.portal().index()].plane;
        if portal.side() == 0 { plane } else { plane.flipped() }
    }

    /// Fills every [`Cell::portals`] from [`CellGraph::portals`].
    pub fn link(&mut self) {
        for cell in &mut self.cells {
            cell.portals.clear();
        }
        for (i, portal) in self.portals.iter().enumerate() {
            for side in 0..2 {
                self.cells[portal.cells[side].index()].portals.push(PortalId(i as u32).directed(side as u32));
            }
        }
    }
}
