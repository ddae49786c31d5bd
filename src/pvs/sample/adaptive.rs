//! Visibility cubes where they are needed.
//!
//! Based on: Nirenstein, Blake, *Hardware accelerated visibility preprocessing using adaptive sampling*, 2004: whatever is seen
//! from inside a closed cell beyond itself is seen through its portals, so cubes stand on portals, in the corners of a quadtree
//! that splits where its corners disagree. Deviations: disagreement is measured in missed solid angle, since the paper's counts
//! of ids weigh a distant screw like a wall; patches are split in the order of what they miss until the rays are spent, since a
//! fixed threshold says nothing about time; and a few cubes stand inside each cell, since objects in the cell itself need proofs too.

use super::cast::{BATCH, Caster, Seen};
use super::schedule::Source;
use super::witness::Lower;
use super::{Sampler, Site, lines, mix};
use crate::cells::Portal;
use crate::geom::{self, Plane};
use crate::pvs::repair::corners;
use crate::{CellId, PortalId};
use glam::DVec3;
use std::collections::{HashMap, VecDeque};

/// A patch whose corners miss less than this fraction of the sphere is not split.
const THRESHOLD: f64 = 2e-4;
/// Halvings of a portal's sides, at most.
const DEPTH: u32 = 6;
/// Of the patches that may be split, one in so many is, before what they miss is compared again; at least and at most.
const SPLIT: usize = 8;
const SPLIT_RANGE: [usize; 2] = [16, 1024];
/// Pieces of a cell that get a cube in the middle; of an open cell, or an unbounded one.
const INSIDE: usize = 4;
const INSIDE_OPEN: usize = 24;

/// A patch of a portal: its lesser corner and size in units of `1 / 2^DEPTH` of the portal's rectangle.
#[derive(Clone, Copy)]
struct Patch {
    portal: u32,
    u: u32,
    v: u32,
    size: u32,
    missed: f64,
}

/// Names a site.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Key {
    Portal(u32, u32, u32),
    Inside(u32),
}

impl Key {
    fn hash(self, seed: u64) -> u64 {
        match self {
            Self::Portal(p, u, v) => mix(mix(mix(seed, 1 + u64::from(p)), u64::from(u)), u64::from(v)),
            Self::Inside(i) => mix(mix(seed, 0), u64::from(i)),
        }
    }
}

/// Where cubes may stand.
pub(super) struct Places {
    surfaces: Vec<Surface>,
    inside: Vec<Site>,
}

impl Places {
    pub fn new(sampler: &Sampler<'_>) -> Self {
        let surface = |p: &Portal| Surface::new(&p.winding, p.plane.n, sampler.prover.clearance);
        Self { surfaces: sampler.graph.portals.iter().map(surface).collect(), inside: inside(sampler) }
    }

    /// Cubes that stand before any patch is split.
    pub fn base(&self) -> u64 {
        (4 * self.surfaces.len() + self.inside.len()) as u64
    }

    /// A few of the places.
    pub fn some(&self) -> Vec<DVec3> {
        let all = self.surfaces.iter().map(|s| s.middle).chain(self.inside.iter().map(|s| s.at));
        all.step_by((self.surfaces.len() + self.inside.len()).div_ceil(4).max(1)).collect()
    }
}

/// Quadtrees on all portals.
pub(super) struct Adaptive<'a, 'c> {
    sampler: &'a Sampler<'a>,
    caster: &'a Caster<'c>,
    places: &'a Places,
    seen: HashMap<Key, Seen>,
    /// Sites whose cubes come next.
    queue: VecDeque<(Key, Site)>,
    /// Patches to be judged once those are cast.
    young: Vec<Patch>,
    /// Patches that miss enough to be split.
    open: Vec<Patch>,
}

impl<'a, 'c> Adaptive<'a, 'c> {
    /// The corners of every portal, one corner of each after the other, and the insides of cells come first.
    pub fn new(sampler: &'a Sampler<'a>, caster: &'a Caster<'c>, places: &'a Places) -> Self {
        let step = 1 << DEPTH;
        let site = |p: u32, s: &Surface, u, v| (Key::Portal(p, u, v), s.site(sampler, p, u, v));
        let corners = [(0, 0), (step, step), (step, 0), (0, step)];
        let mut wanted: Vec<Vec<(Key, Site)>> =
            corners.iter().map(|&(u, v)| (0u32..).zip(&places.surfaces).map(|(p, s)| site(p, s, u, v)).collect()).collect();
        wanted.insert(1, (0u32..).zip(&places.inside).map(|(i, site)| (Key::Inside(i), *site)).collect());
        // Neighbours in the list tend to share cells; apart, they don't prove the same pairs twice in one batch.
        wanted.iter_mut().for_each(|sites| sites.sort_by_key(|&(key, _)| key.hash(sampler.seed)));
        let young = (0..places.surfaces.len() as u32).map(|portal| Patch { portal, u: 0, v: 0, size: step, missed: 0.0 });
        let (queue, young) = (wanted.into_iter().flatten().collect(), young.collect());
        Self { sampler, caster, places, seen: HashMap::new(), queue, young, open: Vec::new() }
    }

    /// Keeps those young patches that miss enough, and splits some of all such; their new corners are queued.
    fn split(&mut self) {
        for mut patch in std::mem::take(&mut self.young) {
            let surface = &self.places.surfaces[patch.portal as usize];
            let extent = surface.extent() * f64::from(patch.size) / f64::from(1u32 << DEPTH);
            if patch.size < 2 || extent < surface.inset * 4.0 {
                continue;
            }
            let (u, v, s) = (patch.u, patch.v, patch.size);
            let seen =
                [(u, v), (u + s, v), (u, v + s), (u + s, v + s)].map(|(u, v)| &self.seen[&Key::Portal(patch.portal, u, v)]);
            patch.missed = missed(&seen);
            if patch.missed >= THRESHOLD {
                patch.missed *= extent;
                self.open.push(patch);
            }
        }
        let order =
            |a: &Patch, b: &Patch| b.missed.total_cmp(&a.missed).then((a.portal, a.u, a.v).cmp(&(b.portal, b.u, b.v)));
        self.open.sort_by(order);
        let some = (self.open.len() / SPLIT).clamp(SPLIT_RANGE[0], SPLIT_RANGE[1]).min(self.open.len());
        for patch in self.open.drain(..some) {
            let half = patch.size / 2;
            for (du, dv) in [(half, half), (half, 0), (0, half), (2 * half, half), (half, 2 * half)] {
                let (u, v) = (patch.u + du, patch.v + dv);
                let key = Key::Portal(patch.portal, u, v);
                // An empty list holds the place of one that is queued.
                if !self.seen.contains_key(&key) {
                    self.seen.insert(key, Seen::new());
                    self.queue.push_back((
                        key,
                        self.places.surfaces[patch.portal as usize].site(self.sampler, patch.portal, u, v),
                    ));
                }
            }
            let child = |(du, dv)| Patch { u: patch.u + du, v: patch.v + dv, size: half, ..patch };
            self.young.extend([(0, 0), (half, 0), (0, half), (half, half)].map(child));
        }
    }
}

impl Source for Adaptive<'_, '_> {
    fn step(&mut self, lower: &mut Lower, rays: u64) -> bool {
        let end = lower.rays + rays;
        while lower.rays < end {
            if self.queue.is_empty() {
                self.split();
                if self.queue.is_empty() && self.young.is_empty() {
                    return false;
                }
            }
            let count = BATCH.min(self.queue.len());
            let (keys, sites): (Vec<Key>, Vec<(u64, Site)>) =
                self.queue.drain(..count).map(|(key, site)| (key, (key.hash(self.sampler.seed), site))).unzip();
            lower.cubes += sites.len() as u64;
            self.seen.extend(keys.into_iter().zip(self.caster.cast(&sites, lower)));
        }
        true
    }
}

/// The solid angle (fraction of the sphere) of what some, but not all of the sites see.
fn missed(seen: &[&Seen]) -> f64 {
    let mut all: Vec<(u32, f32)> = seen.iter().flat_map(|s| s.iter().copied()).collect();
    all.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    let same = all.chunk_by(|a, b| a.0 == b.0);
    same.filter(|group| group.len() < seen.len()).map(|group| f64::from(group[0].1)).sum()
}

/// A portal's winding with a rectangle around it.
struct Surface {
    origin: DVec3,
    axes: [DVec3; 2],
    middle: DVec3,
    /// Planes through the edges, moved in.
    edges: Vec<Plane>,
    /// By how much.
    inset: f64,
}

impl Surface {
    fn new(winding: &[DVec3], n: DVec3, clearance: f64) -> Self {
        let middle = geom::middle(winding);
        let longest = winding.iter().zip(winding.iter().cycle().skip(1)).map(|(a, b)| b - a);
        let longest = longest.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared())).unwrap_or(DVec3::X);
        let u = longest.normalize_or(n.any_orthonormal_vector());
        let v = n.cross(u);
        let flat = |p: &DVec3| [u.dot(p - middle), v.dot(p - middle)];
        let (mut low, mut high) = ([0.0f64; 2], [0.0f64; 2]);
        for p in winding.iter().map(flat) {
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]));
            }
        }
        let mut edges = lines::edges(winding, n);
        let room = edges.iter().map(|e| -e.distance(middle)).fold(f64::INFINITY, f64::min).max(0.0);
        // Opaque triangles stand along most edges: keep so far off that rays have room.
        let inset = (4.0 * clearance).max(0.02 * room).min(0.5 * room);
        edges.iter_mut().for_each(|e| e.d -= inset);
        let axes = [u * (high[0] - low[0]), v * (high[1] - low[1])];
        Self { origin: middle + u * low[0] + v * low[1], axes, middle, edges, inset }
    }

    fn extent(&self) -> f64 {
        self.axes[0].length().max(self.axes[1].length())
    }

    /// The point at (`u`, `v`), pulled towards the middle until it is within the inset winding.
    fn point(&self, u: u32, v: u32) -> DVec3 {
        let unit = f64::from(1u32 << DEPTH);
        let p = self.origin + self.axes[0] * (f64::from(u) / unit) + self.axes[1] * (f64::from(v) / unit);
        let inside = |e: &Plane| {
            let (dm, dp) = (e.distance(self.middle), e.distance(p));
            if dp > 0.0 { (dm / (dm - dp)).clamp(0.0, 1.0) } else { 1.0 }
        };
        let t = self.edges.iter().map(inside).fold(1.0, f64::min);
        self.middle.lerp(p, t)
    }

    /// The cube at that point of a portal.
    fn site(&self, sampler: &Sampler<'_>, portal: u32, u: u32, v: u32) -> Site {
        let Portal { cells, plane, .. } = &sampler.graph.portals[portal as usize];
        Site { at: self.point(u, v), cells: *cells, normal: plane.n, portal: Some(PortalId(portal)) }
    }
}

/// Middles of each cell's largest pieces.
fn inside(sampler: &Sampler<'_>) -> Vec<Site> {
    let near = sampler.near;
    let mut sites = Vec::new();
    for (c, cell) in (0u32..).zip(&sampler.graph.cells) {
        let within = |b: geom::Aabb| (b.max.min(near.max) - b.min.max(near.min)).max(DVec3::ZERO).element_product();
        let mut pieces: Vec<usize> = (0..cell.pieces.len()).collect();
        let order = |&a: &usize, &b: &usize| within(cell.pieces[b].bounds).total_cmp(&within(cell.pieces[a].bounds));
        pieces.sort_by(|a, b| order(a, b).then(a.cmp(b)));
        let unbounded = cell.pieces.iter().any(|p| !p.bounds.size().is_finite());
        let count = if cell.open || unbounded { INSIDE_OPEN } else { INSIDE };
        for piece in pieces.into_iter().take(count).map(|i| &cell.pieces[i]) {
            let corners = corners(piece, near);
            let at = geom::middle(&corners);
            if corners.len() >= 4 && sampler.prover.locator.holds(CellId(c), at) {
                sites.push(Site::inside(CellId(c), at));
            }
        }
    }
    sites
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_corners_see_is_not_missed() {
        let (a, b): (Seen, Seen) = (vec![(1, 0.5), (2, 0.25)], vec![(1, 0.25), (2, 0.125), (7, 0.0625)]);
        assert_eq!(missed(&[&a, &a, &a, &a]), 0.0);
        assert_eq!(missed(&[&a, &b, &a, &b]), 0.0625);
        assert_eq!(missed(&[&a, &b, &Seen::new(), &b]), 0.5 + 0.25 + 0.0625);
    }

    #[test]
    fn sites_stay_off_the_rim() {
        let corners = [(0.0, 0.0), (2.0, 0.0), (1.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 3.0));
        let surface = Surface::new(&corners, DVec3::Z, 0.001);
        let step = 1 << DEPTH;
        for (u, v) in [(0, 0), (step, 0), (0, step), (step, step), (step / 2, step / 2)] {
            let at = surface.point(u, v);
            let depth = lines::edges(&corners, DVec3::Z).iter().map(|e| -e.distance(at)).fold(f64::MAX, f64::min);
            assert!(depth > 0.003 && (at.z - 3.0).abs() < 1e-12, "{at} is {depth} m inside");
        }
    }
}
