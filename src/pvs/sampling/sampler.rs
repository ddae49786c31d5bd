//! Common data of all sampling methods: the scene, the graph, and rays that become proofs.

use super::lines::{PortalTree, Start};
use super::witness::{Line, Prover};
use crate::cells::{CellGraph, Locator};
use crate::math::geom::Aabb;
pub(in crate::pvs) use crate::math::random::SplitMix as Random;
use crate::math::random::mixed;
use crate::scene::rays::{Hit, RayScene};
use crate::{CellId, PortalId};
use glam::DVec3;

/// Common data of all strategies.
pub(in crate::pvs) struct Sampler<'a> {
    pub prover: Prover<'a>,
    pub graph: &'a CellGraph,
    pub portals: PortalTree<'a>,
    /// The part of space with eyes.
    pub near: Aabb,
    /// Largest length of a ray, metres.
    pub reach: f64,
    pub seed: u64,
}

impl<'a> Sampler<'a> {
    pub fn new(rays: &'a RayScene<'a>, graph: &'a CellGraph, locator: &'a Locator<'a>, seed: u64) -> Self {
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

    /// Traces both halves of the line through a site: its end hits, the see-through objects, and the cells along it.
    pub fn trace(&self, site: Site, line: &mut Line, crossings: &mut Vec<(f64, PortalId)>) {
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

/// The part of space with eyes: the scene, with a margin of a quarter of its diagonal.
pub(in crate::pvs) fn near(scene: Aabb) -> Aabb {
    scene.inflated(0.25 * scene.diagonal())
}

/// Origin of lines and cubes.
#[derive(Clone, Copy)]
pub(in crate::pvs) struct Site {
    pub at: DVec3,
    /// The cells behind and in front of the portal; equal inside a cell.
    pub cells: [CellId; 2],
    pub normal: DVec3,
    pub portal: Option<PortalId>,
}

impl Site {
    pub fn inside(cell: CellId, at: DVec3) -> Self {
        Self { at, cells: [cell; 2], normal: DVec3::ZERO, portal: None }
    }
}

/// Derives a seed from a seed and a number.
pub(in crate::pvs) fn mix(seed: u64, number: u64) -> u64 {
    mixed(seed ^ number.wrapping_mul(0xd6e8_feb8_6659_fd93))
}
