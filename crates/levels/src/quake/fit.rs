//! Whether a portal file is of a level: its leaves are counted, and its portals looked up in the tree.

use super::Bsp;
use crate::prt::Prt;
use enfilade::geom::{middle, newell};
use enfilade::types::level::LevelPortal;
use glam::DVec3;
use std::fmt;

/// A portal file is taken where this share of its portals lies where the tree has their clusters. More: portals that compilers lead
/// through details, which the tree knows as solid, or along planes that are rounded, speak against their own level (a tenth did in one). Less:
/// a file from before the level was changed is taken.
const TAKEN_FROM: f64 = 0.75;
/// Points on both sides are this far from a portal, in [`Bsp::rounding`]. Nearer: rounded planes leave them on the wrong side. Farther:
/// thin leaves lie in between.
const ASIDE: f64 = 16.0;

/// How the portals of a portal file lie in a level's tree.
#[derive(Clone, PartialEq, Debug)]
pub struct Fit {
    /// Leaves of the file, and of the level.
    pub leaves: [usize; 2],
    /// Portals of the file.
    pub portals: usize,
    /// Those that don't lie between leaves of their two clusters, ascending; none where leaves differ in number.
    pub elsewhere: Vec<usize>,
    /// The middle of the first of them.
    pub first: Option<DVec3>,
}

impl Fit {
    /// The file is of this level: leaves are as many, and three quarters of the portals lie where the tree has their clusters.
    pub fn is_taken(&self) -> bool {
        let here = self.portals - self.elsewhere.len();
        self.leaves[0] == self.leaves[1] && here as f64 >= TAKEN_FROM * self.portals as f64
    }
}

impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [leaves, of_level] = self.leaves;
        if leaves != of_level {
            return write!(f, "has {leaves} leaves, the level {of_level}");
        }
        let all = self.portals;
        match (self.elsewhere.first(), self.first) {
            (Some(&portal), Some(p)) => {
                write!(
                    f,
                    "{} of {all} portals lie where the tree has leaves of other clusters, or solid matter; ",
                    self.elsewhere.len()
                )?;
                write!(f, "the first, portal {portal}, around ({:.1} {:.1} {:.1})", p.x, p.y, p.z)
            }
            _ => write!(f, "all {all} portals lie between leaves of their clusters"),
        }
    }
}

impl Bsp {
    /// How portals of a `.prt` lie in this level's tree: in the middle of each portal, and half-way from there to its corners.
    pub fn fit(&self, prt: &Prt) -> Fit {
        let leaves = [prt.leaves.len(), self.leaves()];
        let portals = &prt.level.portals;
        let asked = if leaves[0] == leaves[1] { portals.len() } else { 0 };
        let elsewhere: Vec<usize> = (0..asked).filter(|&p| !self.has_between(prt, &portals[p])).collect();
        let first = elsewhere.first().map(|&p| middle(&portals[p].winding));
        Fit { leaves, portals: portals.len(), elsewhere, first }
    }

    /// Whether the tree has leaves of the portal's two clusters on both sides of it, somewhere.
    fn has_between(&self, prt: &Prt, portal: &LevelPortal) -> bool {
        let cluster = |p: DVec3| {
            let leaf = self.tree.leaf_at(p);
            self.tree.leaves[leaf].open.then(|| leaf.checked_sub(1).and_then(|cell| prt.leaves.get(cell))).flatten().copied()
        };
        let (centre, normal) = (middle(&portal.winding), newell(&portal.winding).normalize());
        let step = normal * ASIDE * self.rounding();
        let mut points = std::iter::once(centre).chain(portal.winding.iter().map(|corner| (centre + corner) / 2.0));
        points.any(|p| [cluster(p - step), cluster(p + step)] == portal.cells.map(Some))
    }
}
