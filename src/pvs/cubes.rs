//! The lower bound: what visibility cubes see.
//!
//! Based on: Nirenstein, Blake, *Hardware accelerated visibility preprocessing using adaptive sampling*, 2004: whatever is seen
//! from inside a closed cell beyond itself is seen through its portals, so cubes stand on portals, in the corners of a quadtree
//! that splits where its corners disagree. Deviations: disagreement is measured in missed solid angle, since the paper's counts
//! of ids weigh a distant screw like a wall; patches are split in the order of what they miss until the rays are spent, since a
//! fixed threshold says nothing about time; the two halves of a cube's opposite pixels make one line, which serves every cell
//! that it crosses (`lines`); and a few cubes stand inside each cell, since objects in the cell itself need proofs too.

use super::cube::{Cube, CubeEngine, CubeScene, CubeView, Engine, NONE};
use super::lines::{PortalTree, Start};
use super::repair::corners;
use super::witness::{Found, Line, Lower, Prover};
use super::{Progress, PvsOptions};
use crate::cells::{CellGraph, Locator, Portal};
use crate::geom::{self, Aabb, Plane};
use crate::scene::rays::{Hit, RayScene};
use crate::{CellId, PortalId};
use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::f64::consts::TAU;

/// Cubes worked on between two looks at what is known; fixed, so that results don't depend on the number of threads.
const BATCH: usize = 64;
/// Pixels along a face's edge: the most that allow every portal its cubes. More: more of what is small is seen, fewer cubes in the
/// same time.
const SIZES: [u32; 4] = [128, 64, 32, 16];
/// Pixels of a cube that take about as long as a ray.
const PIXELS_A_RAY: u64 = 160;
/// Lines followed through pixels of one object: where one of the cells beside the cube isn't known to see it, and else, for the
/// cells farther along.
const LINES: [usize; 2] = [4, 1];

/// Most lines followed from a cube.
fn most_lines(size: u32) -> u64 {
    3 * u64::from(size)
}

/// What a cube costs at most, in rays.
fn cost(size: u32) -> u64 {
    6 * u64::from(size).pow(2) / PIXELS_A_RAY + 2 * most_lines(size)
}
/// A patch whose corners miss less than this fraction of the sphere is not split.
const THRESHOLD: f64 = 2e-4;
/// Halvings of a portal's sides, at most.
const DEPTH: u32 = 6;
/// Pieces of a cell that get a cube in the middle; of an open cell, or an unbounded one.
const INSIDE: usize = 4;
const INSIDE_OPEN: usize = 24;

/// Where a cube stands.
#[derive(Clone, Copy)]
struct Site {
    at: DVec3,
    /// Behind and in front of the portal; twice the same inside a cell.
    cells: [CellId; 2],
    normal: DVec3,
    portal: Option<PortalId>,
}

/// Objects seen from a site with their solid angles (fractions of the sphere), ascending.
type Seen = Vec<(u32, f32)>;

/// A patch of a portal: its lesser corner and size in units of `1 / 2^DEPTH` of the portal's rectangle.
#[derive(Clone, Copy)]
struct Patch {
    portal: u32,
    u: u32,
    v: u32,
    size: u32,
    missed: f64,
}

/// Samples until `rays` are spent or nothing is left to split; returns the number of cubes.
pub(super) fn sample(
    rays: &RayScene<'_>,
    graph: &CellGraph,
    options: &PvsOptions,
    budget: u64,
    lower: &mut Lower,
    progress: Progress<'_>,
) -> u64 {
    let locator = Locator::new(graph);
    let clearance = rays.scene().tolerance().clearance;
    let bounds = rays.scene().bounds();
    let surfaces: Vec<Surface> = graph.portals.iter().map(|p| Surface::new(&p.winding, p.plane.n, clearance)).collect();
    let inside = inside_sites(graph, &locator, bounds);
    let base = (4 * graph.portals.len() + inside.len()) as u64;
    let size = SIZES.into_iter().find(|&n| 2 * base * cost(n) <= budget).unwrap_or(SIZES[SIZES.len() - 1]);
    let cubes = CubeScene::new(rays.scene());
    // The choice shows in nothing but time.
    let eyes: Vec<DVec3> = surfaces.iter().map(|s| s.middle).step_by(surfaces.len().div_ceil(4).max(1)).collect();
    let flat = CubeView::new(DVec3::ZERO, size);
    let mut owners = vec![0; rays.scene().triangles.len()];
    for (i, object) in (0u32..).zip(&rays.scene().objects) {
        owners[object.triangles.start as usize..object.triangles.end as usize].fill(i);
    }
    let sampler = Sampler {
        prover: Prover { rays, locator: &locator, clearance },
        portals: PortalTree::new(graph),
        reach: 2.0 * bounds.diagonal() + 1.0,
        engine: Engine::fastest(&cubes, &eyes, size),
        cubes: &cubes,
        owners,
        size,
        solid: (0..flat.pixels() / 6).map(|p| flat.solid_angle(p) as f32).collect(),
        seed: options.seed,
    };

    // 1. The corners of every portal, one corner of each after the other, and the insides of cells.
    let step = 1 << DEPTH;
    let corners = [(0, 0), (step, step), (step, 0), (0, step)];
    let mut wanted: Vec<Vec<(Key, Site)>> = corners
        .iter()
        .map(|&(u, v)| (0u32..).zip(&surfaces).map(|(p, s)| (Key::Portal(p, u, v), s.site(graph, p, u, v))).collect())
        .collect();
    wanted.insert(1, (0u32..).zip(inside).map(|(i, site)| (Key::Inside(i), site)).collect());
    let mut run = Run { sampler: &sampler, seen: HashMap::new(), lower, budget, progress };
    for mut sites in wanted {
        // Neighbours in the list tend to share cells; apart, they don't prove the same pairs twice in one batch.
        sites.sort_by_key(|&(key, _)| key.hash(options.seed));
        run.cast(&sites);
    }

    // 2. Split where the corners disagree most.
    let mut patches: Vec<Patch> = Vec::new();
    let whole = (0..surfaces.len() as u32).map(|portal| Patch { portal, u: 0, v: 0, size: step, missed: 0.0 });
    run.keep_open(whole, &surfaces, &mut patches);
    while !patches.is_empty() && run.spare() > 0 {
        let order =
            |a: &Patch, b: &Patch| b.missed.total_cmp(&a.missed).then((a.portal, a.u, a.v).cmp(&(b.portal, b.u, b.v)));
        patches.sort_by(order);
        // At most an eighth of what is left, so that later rounds can tell what matters.
        let some = ((run.spare() / 8 / 5) as usize).clamp(BATCH / 4, 4096).min(patches.len());
        let split: Vec<Patch> = patches.drain(..some).collect();
        let (mut sites, mut listed) = (Vec::new(), HashSet::new());
        for patch in &split {
            let half = patch.size / 2;
            for (du, dv) in [(half, half), (half, 0), (0, half), (2 * half, half), (half, 2 * half)] {
                let key = Key::Portal(patch.portal, patch.u + du, patch.v + dv);
                if !run.seen.contains_key(&key) && listed.insert(key) {
                    let site = surfaces[patch.portal as usize].site(graph, patch.portal, patch.u + du, patch.v + dv);
                    sites.push((key, site));
                }
            }
        }
        run.cast(&sites);
        let children = split.iter().flat_map(|patch| {
            let half = patch.size / 2;
            [(0, 0), (half, 0), (0, half), (half, half)].map(|(du, dv)| Patch {
                u: patch.u + du,
                v: patch.v + dv,
                size: half,
                ..*patch
            })
        });
        run.keep_open(children.collect::<Vec<_>>(), &surfaces, &mut patches);
    }
    run.seen.len() as u64
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

/// The state of a run.
struct Run<'a, 'p> {
    sampler: &'a Sampler<'a>,
    seen: HashMap<Key, Seen>,
    lower: &'a mut Lower,
    budget: u64,
    progress: Progress<'p>,
}

impl Run<'_, '_> {
    /// Cubes that the budget still allows.
    fn spare(&self) -> u64 {
        self.budget.saturating_sub(self.lower.rays) / cost(self.sampler.size)
    }

    /// Casts cubes in the order given, as many as the budget allows.
    fn cast(&mut self, sites: &[(Key, Site)]) {
        let sites = &sites[..sites.len().min(self.spare() as usize)];
        for batch in sites.chunks(BATCH) {
            let (sampler, lower) = (self.sampler, &*self.lower);
            let cast = |eyes: &mut Eyes<'_>, &(key, site): &(Key, Site)| eyes.cube(site, key.hash(sampler.seed), lower);
            let results: Vec<(Seen, Found)> = batch.par_iter().map_init(|| Eyes::new(sampler), cast).collect();
            for (&(key, _), (seen, found)) in batch.iter().zip(results) {
                self.lower.merge(found);
                self.seen.insert(key, seen);
            }
            (self.progress)("cubes", self.lower.rays as f64 / self.budget.max(1) as f64);
        }
    }

    /// Adds those patches that miss enough to be split, if all their corners were cast.
    fn keep_open(&self, candidates: impl IntoIterator<Item = Patch>, surfaces: &[Surface], out: &mut Vec<Patch>) {
        for mut patch in candidates {
            let surface = &surfaces[patch.portal as usize];
            let extent = surface.extent() * f64::from(patch.size) / f64::from(1u32 << DEPTH);
            if patch.size < 2 || extent < surface.inset * 4.0 {
                continue;
            }
            let (u, v, s) = (patch.u, patch.v, patch.size);
            let corners = [(u, v), (u + s, v), (u, v + s), (u + s, v + s)];
            let seen: Option<Vec<&Seen>> =
                corners.iter().map(|&(u, v)| self.seen.get(&Key::Portal(patch.portal, u, v))).collect();
            patch.missed = seen.map_or(0.0, |seen| missed(&seen));
            if patch.missed >= THRESHOLD {
                patch.missed *= extent;
                out.push(patch);
            }
        }
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
        let mut edges = super::lines::edges(winding, n);
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
    fn site(&self, graph: &CellGraph, portal: u32, u: u32, v: u32) -> Site {
        let Portal { cells, plane, .. } = &graph.portals[portal as usize];
        Site { at: self.point(u, v), cells: *cells, normal: plane.n, portal: Some(PortalId(portal)) }
    }
}

/// Middles of each cell's largest pieces.
fn inside_sites(graph: &CellGraph, locator: &Locator<'_>, bounds: Aabb) -> Vec<Site> {
    let near = bounds.inflated(0.25 * bounds.diagonal());
    let mut sites = Vec::new();
    for (c, cell) in (0u32..).zip(&graph.cells) {
        let volume = |b: Aabb| (b.min.max(near.min), b.max.min(near.max));
        let volume = |b: Aabb| (volume(b).1 - volume(b).0).max(DVec3::ZERO).element_product();
        let mut pieces: Vec<usize> = (0..cell.pieces.len()).collect();
        pieces.sort_by(|&a, &b| volume(cell.pieces[b].bounds).total_cmp(&volume(cell.pieces[a].bounds)).then(a.cmp(&b)));
        let unbounded = cell.pieces.iter().any(|p| !p.bounds.size().is_finite());
        let count = if cell.open || unbounded { INSIDE_OPEN } else { INSIDE };
        for piece in pieces.into_iter().take(count).map(|i| &cell.pieces[i]) {
            let corners = corners(piece, near);
            let at = geom::middle(&corners);
            if corners.len() >= 4 && locator.holds(CellId(c), at) {
                sites.push(Site { at, cells: [CellId(c); 2], normal: DVec3::ZERO, portal: None });
            }
        }
    }
    sites
}

/// What all threads share.
struct Sampler<'a> {
    prover: Prover<'a>,
    portals: PortalTree<'a>,
    /// No ray goes farther, metres.
    reach: f64,
    cubes: &'a CubeScene,
    engine: Engine,
    /// Object of each triangle.
    owners: Vec<u32>,
    /// Pixels along a face's edge.
    size: u32,
    /// Fraction of the sphere of each pixel of a face.
    solid: Vec<f32>,
    seed: u64,
}

/// Makes cubes: scratch memory of a thread.
struct Eyes<'a> {
    sampler: &'a Sampler<'a>,
    engine: Box<dyn CubeEngine + Send + 'a>,
    cube: Cube,
    /// For each object its solid angle and number of pixels in this cube, and a few of those.
    objects: Vec<(f32, u32, [u32; LINES[0]])>,
    touched: Vec<u32>,
    line: Line,
    crossings: Vec<(f64, PortalId)>,
}

impl<'a> Eyes<'a> {
    fn new(sampler: &'a Sampler<'a>) -> Self {
        let engine = sampler.engine.start(sampler.cubes);
        let objects = vec![(0.0, 0, [0; LINES[0]]); sampler.prover.rays.scene().objects.len()];
        let (cube, touched, line, crossings) = Default::default();
        Self { sampler, engine, cube, objects, touched, line, crossings }
    }

    /// One cube: what it sees, and what that proves.
    fn cube(&mut self, site: Site, seed: u64, known: &Lower) -> (Seen, Found) {
        let sampler = self.sampler;
        let mut random = Random(seed);
        // Turned by chance, so that pixels of neighbours don't fall on the same places.
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, random.unit() * TAU, random.unit() * TAU, random.unit() * TAU);
        let view = CubeView { eye: site.at, frame: DMat3::from_quat(turn), size: sampler.size };
        self.engine.cube(&view, &mut self.cube);
        let face = sampler.solid.len();
        let opaque = self.cube.triangles.iter().enumerate().filter(|&(_, &t)| t != NONE).map(|(p, &t)| (p, t));
        let clear = self.cube.see_through.iter().map(|s| (s.pixel as usize, s.triangle));
        for (pixel, triangle) in opaque.chain(clear) {
            let object = sampler.owners[triangle as usize];
            let (solid, count, some) = &mut self.objects[object as usize];
            if *count == 0 {
                self.touched.push(object);
            }
            *solid += sampler.solid[pixel % face];
            // Each pixel as likely as the others to be one of the few (Vitter, *Random sampling with a reservoir*, 1985).
            let place = if (*count as usize) < some.len() { u64::from(*count) } else { random.next() % u64::from(*count + 1) };
            if let Some(kept) = some.get_mut(place as usize) {
                *kept = pixel as u32;
            }
            *count += 1;
        }
        self.touched.sort_unstable();
        let mut found = Found { rays: 6 * u64::from(sampler.size).pow(2) / PIXELS_A_RAY, ..Found::default() };
        let mut lines = most_lines(sampler.size);
        let mut seen = Seen::with_capacity(self.touched.len());
        self.line.origin = site.at;
        for object in std::mem::take(&mut self.touched) {
            let (solid, count, some) = std::mem::take(&mut self.objects[object as usize]);
            seen.push((object, solid));
            let beside = site.cells.iter().all(|c| known.objects.get(c.index(), object as usize));
            let wanted = LINES[usize::from(beside)].min(count as usize).min(lines as usize);
            lines -= wanted as u64;
            for &pixel in &some[..wanted] {
                self.line.direction = view.direction(pixel as usize).normalize();
                sampler.trace(site, &mut self.line, &mut self.crossings);
                found.rays += 2;
                sampler.prover.line(&self.line, known, &mut found);
            }
        }
        (seen, found.close())
    }
}

impl Sampler<'_> {
    /// Both halves of the line through a site: what ends it, what it passes, and the cells along it.
    fn trace(&self, site: Site, line: &mut Line, crossings: &mut Vec<(f64, PortalId)>) {
        let rays = self.prover.rays;
        let ahead = usize::from(site.normal.dot(line.direction) >= 0.0);
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

/// A seeded sequence (Steele, Lea, Flood, *Fast splittable pseudorandom number generators*, 2014).
pub(super) struct Random(pub u64);

impl Random {
    /// The next number of all 64-bit ones.
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// The next number in `0..1`.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A seed made of a seed and a number.
pub(super) fn mix(seed: u64, number: u64) -> u64 {
    Random(seed ^ number.wrapping_mul(0xd6e8_feb8_6659_fd93)).next()
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
            let depth =
                super::super::lines::edges(&corners, DVec3::Z).iter().map(|e| -e.distance(at)).fold(f64::MAX, f64::min);
            assert!(depth > 0.003 && (at.z - 3.0).abs() < 1e-12, "{at} is {depth} m inside");
        }
    }
}
