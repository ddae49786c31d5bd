//! Tests whether a portal file belongs to a level: compares the number of leaves, and looks up portals in the tree.

use super::Bsp;
use crate::prt::Prt;
use enfilade::math::geom::{middle, newell};
use enfilade::types::level::LevelPortal;
use glam::DVec3;
use std::fmt;

/// Least share of portals that must lie between leaves of their clusters. More: portals through details, which are solid in the
/// tree, or along rounded planes count against their own level (in one, a tenth did). Less: an outdated file is accepted.
const TAKEN_FROM: f64 = 0.75;
/// Distance of test points on both sides of a portal, in [`Bsp::rounding`]. Nearer: rounded planes leave them on the wrong side.
/// Farther: thin leaves lie in between.
const ASIDE: f64 = 16.0;

/// How well a portal file fits a level's tree.
#[derive(Clone, PartialEq, Debug)]
pub struct Fit {
    /// Leaves of the file and of the level; of games that keep rows by cluster, clusters.
    pub leaves: [usize; 2],
    /// What is counted: `leaves` or `clusters`.
    pub counted: &'static str,
    /// Portals of the file.
    pub portals: usize,
    /// Portals that do not lie between leaves of their two clusters, ascending; empty if the numbers of leaves differ.
    pub elsewhere: Vec<usize>,
    /// The centre of the first of them.
    pub first: Option<DVec3>,
}

impl Fit {
    /// Whether the file is of this level: numbers of leaves agree, and three quarters of the portals lie between their clusters.
    pub fn is_taken(&self) -> bool {
        let here = self.portals - self.elsewhere.len();
        self.leaves[0] == self.leaves[1] && here as f64 >= TAKEN_FROM * self.portals as f64
    }
}

impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [leaves, of_level] = self.leaves;
        if leaves != of_level {
            return write!(f, "has {leaves} {}, the level {of_level}", self.counted);
        }
        let all = self.portals;
        match (self.elsewhere.first(), self.first) {
            (Some(&portal), Some(p)) => {
                write!(f, "{} of {all} portals do not lie between leaves of their clusters; ", self.elsewhere.len())?;
                write!(f, "the first, portal {portal}, is near ({:.1} {:.1} {:.1})", p.x, p.y, p.z)
            }
            _ => write!(f, "all {all} portals lie between leaves of their clusters"),
        }
    }
}

impl Bsp {
    /// Tests the portals of a `.prt` in this level's tree: at the centre of each portal, and half-way to its corners.
    pub fn fit(&self, prt: &Prt) -> Fit {
        let leaves = [prt.leaves.len(), self.cells()];
        let portals = &prt.level.portals;
        let tested = if leaves[0] == leaves[1] { portals.len() } else { 0 };
        let elsewhere: Vec<usize> = (0..tested).filter(|&p| !self.has_between(prt, &portals[p])).collect();
        let first = elsewhere.first().map(|&p| middle(&portals[p].winding));
        let counted = if self.is_by_leaf() { "leaves" } else { "clusters" };
        Fit { leaves, counted, portals: portals.len(), elsewhere, first }
    }

    /// Whether the tree has leaves of the portal's two clusters on its two sides at any test point.
    fn has_between(&self, prt: &Prt, portal: &LevelPortal) -> bool {
        let cluster = |p: DVec3| self.cell_at(p).and_then(|cell| prt.leaves.get(cell)).copied();
        let (centre, normal) = (middle(&portal.winding), newell(&portal.winding).normalize());
        let step = normal * ASIDE * self.rounding();
        let mut points = std::iter::once(centre).chain(portal.winding.iter().map(|corner| (centre + corner) / 2.0));
        points.any(|p| [cluster(p - step), cluster(p + step)] == portal.cells.map(Some))
    }
}
