//! Adaptive placement of visibility cubes, where they are expected to show most unknown objects.
//!
//! Based on: Nirenstein, Blake, *Hardware accelerated visibility preprocessing using adaptive sampling*, 2004: a closed cell sees
//! everything beyond itself through its portals, so cubes are placed on portals, in quadtrees that split where cubes disagree. Deviations:
//!
//! * a patch has one cube, not four at common corners: first at the portal's centre, next at its corners, then at the centres of smaller
//!   and smaller patches, so that a portal that shows nothing new costs one cube;
//! * the measure is solid angle, because the paper's counts of ids weigh a distant screw like a wall: mainly that of objects in a cube that
//!   are new for the adjacent cells, then that of the difference between a patch and its parent;
//! * no threshold, because it does not control time: one queue holds the patches of all portals, and a place inside every cell (objects in
//!   a cell need proofs, too), in the order of the expected result.

use super::cast::{COST, Caster, Seen, Stand};
use super::lines;
use super::region::Region;
use super::sampler::{Random, Sampler, Site, mix};
use super::source::{Part, Source};
use super::witness::Witnessed;
use crate::cells::Portal;
use crate::job::Stopped;
use crate::math::geom::{self, Plane};
use crate::{CellId, PortalId};
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::{BinaryHeap, VecDeque};
use std::sync::Arc;

/// Most halvings of a portal's sides.
const DEPTH: u32 = 6;
/// Weight of the difference between a patch and its parent, relative to unknown objects.
const DISAGREED: f64 = 0.1;
/// Expected result of a patch, as a fraction of its parent's.
const QUARTER: f64 = 0.5;
/// Expected result of a cube in a cell: half of the last result, plus half of the last expectation, plus this fraction of the sphere over
/// the number of cubes, because a corner of a cell may hide objects from all previous cubes. Smaller: cells with badly placed first cubes
/// are given up. Larger: all cells get equally many.
const HOPE: f64 = 1e-2;
/// Best-candidate sampling in a cell: the next cube is at the farthest of this many random points from the last `REMEMBERED` cubes
/// (Mitchell, *Spectrally optimal sampling for distribution ray tracing*, 1991).
const CANDIDATES: u32 = 8;
const REMEMBERED: usize = 64;
/// Expected results of first cubes. In cells: more than any cube shows, so that each cell gets one before any gets two. On portals: less
/// than in a cell with fewer than ten cubes, because most of many portals show nothing new.
const FIRST: f64 = 2.0;
const FIRST_ON_PORTAL: f64 = 1e-3;

/// A candidate place for a cube.
struct Place {
    /// Expected result, solid angle (fraction of the sphere).
    hope: f64,
    /// Tie breaker, and seed of its random numbers.
    key: u64,
    at: At,
}

enum At {
    /// On a patch, with the result of the parent's cube.
    Patch(Patch, Arc<Seen>),
    /// Inside a cell, with the number of previous cubes. Only the last entry of a cell is valid.
    Cell(CellId, u32),
}

/// A patch of a portal: its lesser corner and size in units of `1 / 2^DEPTH` of the portal's rectangle.
#[derive(Clone, Copy)]
struct Patch {
    portal: u32,
    u: u32,
    v: u32,
    size: u32,
}

impl Patch {
    const WHOLE: u32 = 1 << DEPTH;

    /// The position of its cube: the centre, except for a portal's quarters, whose cubes are in the portal's corners.
    fn eye(&self) -> [u32; 2] {
        [self.u, self.v].map(|low| match (2 * self.size == Self::WHOLE, low) {
            (true, 0) => 0,
            (true, _) => Self::WHOLE,
            (false, _) => low + self.size / 2,
        })
    }

    fn quarters(self) -> [Self; 4] {
        let size = self.size / 2;
        [(0, 0), (size, 0), (0, size), (size, size)].map(|(u, v)| Self { u: self.u + u, v: self.v + v, size, ..self })
    }

    fn key(&self, seed: u64) -> u64 {
        mix(mix(seed, 1 + u64::from(self.portal)), u64::from(self.u) << 42 | u64::from(self.v) << 21 | u64::from(self.size))
    }
}

impl Ord for Place {
    fn cmp(&self, other: &Self) -> Ordering {
        self.hope.total_cmp(&other.hope).then(self.key.cmp(&other.key))
    }
}

impl PartialOrd for Place {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Place {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Place {}

/// State of the cubes inside a cell.
#[derive(Clone, Default)]
struct Inside {
    /// Eyes of the last cubes.
    eyes: VecDeque<DVec3>,
    /// Expected result of the next one, from known results.
    hope: f64,
    /// Key of its queue entry.
    next: u64,
}

/// Queue of portals and cells, ordered by the expected result of cubes.
pub(super) struct Adaptive<'a, 'c> {
    sampler: &'a Sampler<'a>,
    caster: &'a Caster<'c>,
    regions: &'a [Region],
    insides: Vec<Inside>,
    surfaces: Vec<Surface>,
    queue: BinaryHeap<Place>,
}

impl<'a, 'c> Adaptive<'a, 'c> {
    pub fn new(sampler: &'a Sampler<'a>, caster: &'a Caster<'c>, regions: &'a [Region]) -> Self {
        let surface = |p: &Portal| Surface::new(&p.winding, p.plane.n, sampler.prover.clearance);
        let none = Arc::new(Seen::default());
        let patch = |portal: u32| {
            let patch = Patch { portal, u: 0, v: 0, size: Patch::WHOLE };
            Place { hope: FIRST_ON_PORTAL, key: patch.key(sampler.seed), at: At::Patch(patch, Arc::clone(&none)) }
        };
        let queue = (0..sampler.graph.portals.len() as u32).map(patch).collect();
        let surfaces = sampler.graph.portals.iter().map(surface).collect();
        let mut all = Self { sampler, caster, regions, insides: vec![Inside::default(); regions.len()], surfaces, queue };
        for cell in 0..regions.len() as u32 {
            all.stand_inside(CellId(cell), 0, FIRST, mix(mix(sampler.seed, 0), u64::from(cell)));
        }
        all
    }

    /// Queues the next cube inside a cell, after `count` of them, instead of the previous entry.
    fn stand_inside(&mut self, cell: CellId, count: u32, hope: f64, key: u64) {
        self.insides[cell.index()].next = key;
        self.queue.push(Place { hope, key, at: At::Cell(cell, count) });
    }

    /// The place with the largest expected result. The next cube inside the same cell may be in the same batch: until the result of this
    /// one is known, half as much is expected of it.
    fn next_place(&mut self) -> Option<Place> {
        loop {
            let place = self.queue.pop()?;
            let At::Cell(cell, count) = place.at else { return Some(place) };
            if self.insides[cell.index()].next != place.key {
                continue;
            }
            if count > 0 {
                self.stand_inside(cell, count + 1, 0.5 * place.hope, mix(place.key, 2));
            }
            return Some(place);
        }
    }

    fn site(&mut self, place: &Place) -> Option<Site> {
        match place.at {
            At::Patch(patch, _) => {
                let Portal { cells, plane, .. } = &self.sampler.graph.portals[patch.portal as usize];
                let at = self.surfaces[patch.portal as usize].point(patch.eye());
                Some(Site { at, cells: *cells, normal: plane.n, portal: Some(PortalId(patch.portal)) })
            }
            At::Cell(cell, _) => {
                let mut random = Random::new(mix(place.key, 1));
                let eyes = &mut self.insides[cell.index()].eyes;
                let far = |at: &DVec3| eyes.iter().map(|eye| eye.distance_squared(*at)).fold(f64::INFINITY, f64::min);
                let candidates = (0..CANDIDATES).filter_map(|_| self.regions[cell.index()].draw(&mut random));
                let at = candidates.map(|at| (far(&at), at)).reduce(|a, b| if b.0 > a.0 { b } else { a })?.1;
                eyes.push_back(at);
                if eyes.len() > REMEMBERED {
                    eyes.pop_front();
                }
                Some(Site::inside(cell, at))
            }
        }
    }

    /// True if a patch may be split.
    fn is_split(&self, patch: Patch) -> bool {
        let surface = &self.surfaces[patch.portal as usize];
        let extent = surface.extent() * f64::from(patch.size) / f64::from(Patch::WHOLE);
        patch.size >= 4 && extent >= surface.inset * 4.0
    }

    /// Queues the places that follow a cube which showed `seen`, with the new solid angle `fresh`.
    fn follow(&mut self, place: Place, seen: Seen, fresh: f64) {
        match place.at {
            At::Patch(patch, parent) => {
                if !self.is_split(patch) {
                    return;
                }
                let seen = Arc::new(seen);
                let disagreed = if parent.is_empty() { 0.0 } else { missed(&parent, &seen) };
                let hope = QUARTER * (fresh + DISAGREED * disagreed);
                for quarter in patch.quarters() {
                    let key = quarter.key(self.sampler.seed);
                    self.queue.push(Place { hope, key, at: At::Patch(quarter, Arc::clone(&seen)) });
                }
            }
            At::Cell(cell, count) => {
                let before = if count == 0 { fresh } else { self.insides[cell.index()].hope };
                let hope = 0.5 * (before + fresh) + HOPE / f64::from(count + 1);
                self.insides[cell.index()].hope = hope;
                self.stand_inside(cell, count + 1, hope, mix(place.key, 3));
            }
        }
    }
}

impl Source for Adaptive<'_, '_> {
    fn step(&mut self, lower: &mut Witnessed, part: &Part<'_>) -> Result<bool, Stopped> {
        let (mut places, mut stands) = (Vec::new(), Vec::new());
        while stands.len() < (part.rays / COST) as usize {
            let Some(place) = self.next_place() else { break };
            if let Some(site) = self.site(&place) {
                let tells = matches!(place.at, At::Patch(patch, _) if self.is_split(patch));
                stands.push(Stand { seed: place.key, site, tells });
                places.push(place);
            }
        }
        lower.cubes += stands.len() as u64;
        for (place, (seen, fresh)) in places.into_iter().zip(self.caster.cast(&stands, lower, part)?) {
            self.follow(place, seen, fresh);
        }
        Ok(!self.queue.is_empty())
    }
}

/// Solid angle (fraction of the sphere) of the objects that only one of two cubes shows.
fn missed(a: &Seen, b: &Seen) -> f64 {
    let mut all: Vec<(u32, f32)> = a.objects().chain(b.objects()).collect();
    all.sort_unstable_by_key(|&(object, _)| object);
    all.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).map(|alone| f64::from(alone[0].1)).sum()
}

/// A portal's winding with a rectangle around it.
struct Surface {
    origin: DVec3,
    axes: [DVec3; 2],
    middle: DVec3,
    /// Planes through the edges, moved in by `inset`.
    edges: Vec<Plane>,
    /// Metres.
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
        // Opaque triangles are along most edges: keep a distance, so that rays have room.
        let inset = (4.0 * clearance).max(0.02 * room).min(0.5 * room);
        edges.iter_mut().for_each(|e| e.d -= inset);
        let axes = [u * (high[0] - low[0]), v * (high[1] - low[1])];
        Self { origin: middle + u * low[0] + v * low[1], axes, middle, edges, inset }
    }

    fn extent(&self) -> f64 {
        self.axes[0].length().max(self.axes[1].length())
    }

    /// The point at (`u`, `v`), moved towards the centre until it is within the inset winding.
    fn point(&self, [u, v]: [u32; 2]) -> DVec3 {
        let unit = f64::from(Patch::WHOLE);
        let p = self.origin + self.axes[0] * (f64::from(u) / unit) + self.axes[1] * (f64::from(v) / unit);
        let inside = |e: &Plane| {
            let (dm, dp) = (e.distance(self.middle), e.distance(p));
            if dp > 0.0 { (dm / (dm - dp)).clamp(0.0, 1.0) } else { 1.0 }
        };
        let t = self.edges.iter().map(inside).fold(1.0, f64::min);
        self.middle.lerp(p, t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_both_see_is_not_missed() {
        let a: Seen = [(1, 0.5), (2, 0.25)].into_iter().collect();
        let b: Seen = [(1, 0.25), (2, 0.125), (7, 0.0625)].into_iter().collect();
        assert_eq!(b.objects().collect::<Vec<_>>(), [(1, 0.25), (2, 0.125), (7, 0.0625)]);
        assert_eq!(missed(&a, &a), 0.0);
        assert_eq!(missed(&a, &b), 0.0625);
        assert_eq!(missed(&Seen::default(), &a), 0.75);
    }

    #[test]
    fn sites_stay_off_the_rim() {
        let corners = [(0.0, 0.0), (2.0, 0.0), (1.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 3.0));
        let surface = Surface::new(&corners, DVec3::Z, 0.001);
        let whole = Patch { portal: 0, u: 0, v: 0, size: Patch::WHOLE };
        let quarters = whole.quarters();
        assert_eq!(quarters.map(|q| q.eye()), [[0, 0], [64, 0], [0, 64], [64, 64]]);
        let eyes = quarters.into_iter().chain([whole]).chain(quarters[1].quarters()).map(|patch| patch.eye());
        for eye in eyes {
            let at = surface.point(eye);
            let depth = lines::edges(&corners, DVec3::Z).iter().map(|e| -e.distance(at)).fold(f64::MAX, f64::min);
            assert!(depth > 0.003 && (at.z - 3.0).abs() < 1e-12, "{at} is {depth} m inside");
        }
    }
}
