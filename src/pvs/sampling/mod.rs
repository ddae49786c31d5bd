//! The lower bound: everything here finds free lines and has `witness` make proofs of them; one line serves every cell that it
//! crosses (`lines`).
//!
//! Four ways of finding them, behind [`Strategy`]: `adaptive` visibility cubes on portals and in cells; `guided` rays at the
//! borders of what was found; and, to hold them against, `uniform` cubes and random rays. `schedule` gives the rays away. Then
//! `aimed` segments go to what the upper bound left. How much of what there is to see all of them have missed, [`unseen`] bounds.

mod adaptive;
pub(in crate::pvs) mod aimed;
mod cast;
pub mod confidence;
mod guided;
pub(in crate::pvs) mod lines;
pub(in crate::pvs) mod region;
mod schedule;
mod uniform;
pub(in crate::pvs) mod witness;

pub(in crate::pvs) use schedule::{Plan, sample};
pub use schedule::{Spent, Strategy, sample_alone};

use crate::cells::{CellGraph, Locator};
use crate::geom::Aabb;
pub(in crate::pvs) use crate::random::SplitMix as Random;
use crate::random::mixed;
use crate::scene::rays::{Hit, RayScene};
use crate::{CellId, PortalId};
use glam::DVec3;
use lines::{PortalTree, Start};
use witness::{Line, Prover};

/// What all strategies share.
struct Sampler<'a> {
    prover: Prover<'a>,
    graph: &'a CellGraph,
    portals: PortalTree<'a>,
    /// The part of space that eyes stand in.
    near: Aabb,
    /// No ray goes farther, metres.
    reach: f64,
    seed: u64,
}

impl<'a> Sampler<'a> {
    fn new(rays: &'a RayScene<'a>, graph: &'a CellGraph, locator: &'a Locator<'a>, seed: u64) -> Self {
        let scene = rays.scene();
        let bounds = scene.bounds();
        Self {
            prover: Prover { rays, locator, clearance: scene.tolerance().clearance },
            graph,
            portals: PortalTree::new(graph),
            near: near(bounds),
            reach: 2.0 * bounds.diagonal() + 1.0,
            seed,
        }
    }

    /// Both halves of the line through a site: what ends it, what it passes, and the cells along it.
    fn trace(&self, site: Site, line: &mut Line, crossings: &mut Vec<(f64, PortalId)>) {
        let rays = self.prover.rays;
        let ahead = usize::from(site.normal.dot(line.direction) >= 0.0);
        line.origin = site.at;
        line.spans.clear();
        line.passes.clear();
        for (sign, cell) in [(-1.0, site.cells[1 - ahead]), (1.0, site.cells[ahead])] {
            let direction = line.direction * sign;
            let mut end = rays.first_opaque(site.at, direction, self.reach);
            let limit = end.map_or(self.reach, |hit| hit.t);
            let (spans, passes) = (line.spans.len(), line.passes.len());
            rays.see_through(site.at, direction, limit, &mut line.passes);
            self.portals.chain(Start { at: site.at, direction, cell, skip: site.portal }, limit, crossings, &mut line.spans);
            if sign < 0.0 {
                line.spans[spans..].iter_mut().for_each(|s| s.range = [-s.range[1], -s.range[0]]);
                line.spans.reverse();
                line.passes[passes..].iter_mut().for_each(|hit| hit.t = -hit.t);
                end = end.map(|hit| Hit { t: -hit.t, ..hit });
            } else if site.portal.is_none() {
                // Inside a cell, the two halves of its span are one.
                let joined = line.spans[spans].range[1];
                line.spans[spans - 1].range[1] = joined;
                line.spans.remove(spans);
            }
            line.ends[usize::from(sign > 0.0)] = end;
        }
    }
}

/// The part of space that eyes are taken from: the scene, and a quarter of its diagonal around it.
fn near(scene: Aabb) -> Aabb {
    scene.inflated(0.25 * scene.diagonal())
}

/// Where lines and cubes start.
#[derive(Clone, Copy)]
struct Site {
    at: DVec3,
    /// Behind and in front of the portal; twice the same inside a cell.
    cells: [CellId; 2],
    normal: DVec3,
    portal: Option<PortalId>,
}

impl Site {
    fn inside(cell: CellId, at: DVec3) -> Self {
        Self { at, cells: [cell; 2], normal: DVec3::ZERO, portal: None }
    }
}

/// A seed made of a seed and a number.
pub(in crate::pvs) fn mix(seed: u64, number: u64) -> u64 {
    mixed(seed ^ number.wrapping_mul(0xd6e8_feb8_6659_fd93))
}
