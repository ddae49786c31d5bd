//! Which region is each leaf of the tree.
//!
//! Leaves take the region of most voxels in them, after those that ridges cross are cut there, and those that still hold
//! voxels of several regions are cut around the ridges (as a decision tree is grown: Breiman, Friedman, Olshen, Stone,
//! *Classification and regression trees*, 1984, by the Gini impurity). Leaves without voxels take the region that they are most
//! open to, widest openings first, so that what is sealed off stays solid, and what a crack opens goes to one region whole.

use super::grid::{CELLS, Grid, SIDE, place_of};
use super::labels::{Labels, VOID};
use super::ridges::Ridge;
use crate::cells::bsp::adjacency::{Contact, open_around, push};
use crate::cells::bsp::tree::{Bsp, Child, Leaf};
use crate::cells::disjoint_sets::DisjointSets;
use crate::geom::Plane;
use crate::parallel;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Regions that differ by less than this share of a face are worth the same.
const TIE: f64 = 1e-9;

/// A leaf is cut where that leaves less than this share of its impurity.
const PURER: f64 = 0.9;

/// Voxels of a leaf that others than the most frequent region may hold, as a share.
const STRAY_SHARE: f64 = 0.1;
/// So few voxels are never worth a cut.
const STRAY_VOXELS: f64 = 30.0;
/// A leaf is cut at most this many times over for its voxels.
const MOST_CUTS: u32 = 6;
/// Voxels of a leaf that are looked at to cut it.
const SAMPLES: usize = 2048;

/// Cuts leaves along ridges; calls `made` with each leaf that is cut and its new front half.
pub fn cut_along(bsp: &mut Bsp, ridges: &[Ridge], mut made: impl FnMut(u32, u32)) {
    for ridge in ridges {
        let mut found = Vec::new();
        push(bsp, bsp.root, ridge.corners.to_vec(), ridge.plane.n, bsp.thin, &mut found);
        let mut crossed: Vec<u32> = found.into_iter().map(|f| f.0).collect();
        crossed.sort_unstable();
        crossed.dedup();
        for leaf in crossed {
            if let Some(new) = bsp.split_leaf(leaf, ridge.plane) {
                made(leaf, new);
            }
        }
    }
}

/// Cuts what holds voxels of several regions.
pub fn refine(bsp: &mut Bsp, grid: &Grid, labels: &Labels, ridges: &[Ridge]) {
    let counts = counts(bsp, grid, labels);
    // Of every so many voxels one, where there are many.
    let strides: Vec<u64> = counts
        .iter()
        .map(|c| {
            if is_mixed(c) {
                (c.iter().filter(|c| c.0 < VOID).map(|c| c.1).sum::<f64>() / SAMPLES as f64).ceil() as u64
            } else {
                0
            }
        })
        .collect();
    let mut samples = visit_some(bsp, grid, labels, &strides);
    parallel::sort(&mut samples);
    for of_leaf in samples.chunk_by(|a, b| a.0 == b.0) {
        let leaf = of_leaf[0].0;
        let middle = |&(_, brick, v, label): &Sample| {
            let place = DVec3::from_array(place_of(usize::from(v)).map(|c| c as f64 + 0.5));
            (grid.frame.to_world(grid.corner(brick as usize) + place), label)
        };
        let points: Vec<(DVec3, u32)> = of_leaf.iter().map(middle).collect();
        let here: Vec<u32> = counts[leaf as usize].iter().map(|c| c.0).collect();
        let near = ridges.iter().filter(|r| r.regions.iter().all(|l| here.contains(l)));
        let planes: Vec<Plane> = near.flat_map(planes_around).collect();
        part(bsp, leaf, points, &planes, MOST_CUTS);
    }
}

/// A ridge's plane and those around its rectangle.
fn planes_around(ridge: &Ridge) -> Vec<Plane> {
    let c = &ridge.corners;
    let mut out = vec![ridge.plane];
    for i in 0..4 {
        let along = (c[(i + 1) % 4] - c[i]).normalize_or_zero();
        if along != DVec3::ZERO {
            out.push(Plane::through(c[i], along.cross(ridge.plane.n)));
        }
    }
    out
}

fn is_mixed(counts: &[(u32, f64)]) -> bool {
    let of_regions = counts.iter().filter(|c| c.0 < VOID).map(|c| c.1);
    let all: f64 = of_regions.clone().sum();
    let most = of_regions.fold(0.0, f64::max);
    all - most > STRAY_VOXELS.max(STRAY_SHARE * all)
}

fn tally<'p>(points: impl Iterator<Item = &'p (DVec3, u32)>) -> Vec<(u32, f64)> {
    let mut out: BTreeMap<u32, f64> = BTreeMap::new();
    points.for_each(|p| *out.entry(p.1).or_default() += 1.0);
    out.into_iter().collect()
}

/// Cuts a leaf where that parts its voxels best, as long as that is worth it.
fn part(bsp: &mut Bsp, leaf: u32, points: Vec<(DVec3, u32)>, planes: &[Plane], cuts: u32) {
    if cuts == 0 || !is_mixed(&tally(points.iter())) {
        return;
    }
    // Gini impurity times the number of points.
    let impurity = |counts: &[(u32, f64)]| {
        let all: f64 = counts.iter().map(|c| c.1).sum();
        if all == 0.0 { 0.0 } else { all - counts.iter().map(|c| c.1 * c.1).sum::<f64>() / all }
    };
    let before = impurity(&tally(points.iter()));
    let after = |plane: &Plane| {
        let side = |front: bool| tally(points.iter().filter(|p| (plane.distance(p.0) > 0.0) == front));
        impurity(&side(false)) + impurity(&side(true))
    };
    let best = planes.iter().map(|p| (after(p), *p)).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, plane)) = best.filter(|b| b.0 < PURER * before) else { return };
    let Some(front) = bsp.split_leaf(leaf, plane) else { return };
    let (ahead, behind) = points.into_iter().partition(|p| plane.distance(p.0) > 0.0);
    part(bsp, leaf, behind, planes, cuts - 1);
    part(bsp, front, ahead, planes, cuts - 1);
}

/// How many voxels of each region each leaf holds, by region; those of the [`VOID`] come last.
pub fn counts(bsp: &Bsp, grid: &Grid, labels: &Labels) -> Vec<Vec<(u32, f64)>> {
    let mut out: Vec<Vec<(u32, f64)>> = vec![Vec::new(); bsp.leaves.len()];
    let of_block = |block: usize| {
        let mut found: Vec<(u32, u32, u32)> = Vec::new();
        each_brick(bsp, grid, block, &mut |brick, child| {
            if labels.only(grid, brick).is_some_and(|l| l > VOID) {
                return;
            }
            let mut count = |leaf: u32, label: u32, n: u32| match found.last_mut() {
                Some(last) if (last.0, last.1) == (leaf, label) => last.2 += n,
                _ => found.push((leaf, label, n)),
            };
            descend(bsp, grid, brick, child, [0; 3], SIDE, &mut |leaf, low, edge| match labels.whole(grid, brick) {
                Some(label) => count(leaf, label, (edge * edge * edge) as u32),
                None => each_voxel(low, edge, &mut |v| {
                    let label = labels.get(grid, brick, v);
                    if label <= VOID {
                        count(leaf, label, 1);
                    }
                }),
            });
        });
        found.sort_unstable();
        found.dedup_by(|b, a| {
            let same = (a.0, a.1) == (b.0, b.1);
            if same {
                a.2 += b.2;
            }
            same
        });
        found
    };
    let all = parallel::flat_map_range(0..blocks(grid).iter().product(), of_block);
    for (leaf, label, n) in all {
        let of = &mut out[leaf as usize];
        match of.iter_mut().find(|o| o.0 == label) {
            Some(o) => o.1 += f64::from(n),
            None => of.push((label, f64::from(n))),
        }
    }
    out.iter_mut().for_each(|o| o.sort_by_key(|c| c.0));
    out
}

/// A voxel: its leaf, brick, place in it and label.
type Sample = (u32, u32, u16, u32);

/// Labelled voxels of leaves, one of about every so many of each (0: none).
fn visit_some(bsp: &Bsp, grid: &Grid, labels: &Labels, strides: &[u64]) -> Vec<Sample> {
    let of_block = |block: usize| {
        let mut out = Vec::new();
        each_brick(bsp, grid, block, &mut |brick, child| {
            if labels.only(grid, brick).is_some_and(|l| l >= VOID) {
                return;
            }
            descend(bsp, grid, brick, child, [0; 3], SIDE, &mut |leaf, low, edge| {
                let stride = strides[leaf as usize];
                if stride == 0 {
                    return;
                }
                each_voxel(low, edge, &mut |v| {
                    // Fibonacci hashing (Knuth 1973) scatters them.
                    let hash = ((brick * CELLS + v) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
                    if hash.is_multiple_of(stride) {
                        let label = labels.get(grid, brick, v);
                        if label < VOID {
                            out.push((leaf, brick as u32, v as u16, label));
                        }
                    }
                });
            });
        });
        out
    };
    parallel::flat_map_range(0..blocks(grid).iter().product(), of_block)
}

fn each_voxel(low: [usize; 3], edge: usize, visit: &mut impl FnMut(usize)) {
    for z in low[2]..low[2] + edge {
        for y in low[1]..low[1] + edge {
            for x in low[0]..low[0] + edge {
                visit(super::grid::voxel(x, y, z));
            }
        }
    }
}

/// Bricks along the edge of a block.
const BLOCK: usize = 8;

/// Blocks of bricks along each axis.
fn blocks(grid: &Grid) -> [usize; 3] {
    grid.bricks.map(|n| n.div_ceil(BLOCK))
}

/// Visits the bricks of a block, each with the part of the tree that it lies in whole.
fn each_brick(bsp: &Bsp, grid: &Grid, block: usize, visit: &mut impl FnMut(usize, Child)) {
    let [nx, ny, _] = blocks(grid);
    let low = [block % nx, block / nx % ny, block / (nx * ny)].map(|b| b * BLOCK);
    within_block(bsp, grid, bsp.root, low, BLOCK, visit);
}

fn within_block(bsp: &Bsp, grid: &Grid, child: Child, low: [usize; 3], edge: usize, visit: &mut impl FnMut(usize, Child)) {
    let Some(brick) = grid.brick_at(low.map(|c| c as i64)) else { return };
    let half = (edge * SIDE) as f64 * 0.5;
    let child = around(bsp, grid, child, grid.corner(brick) + half, half);
    if edge == 1 {
        return visit(brick, child);
    }
    for k in 0..8 {
        let low = std::array::from_fn(|a| low[a] + (k >> a & 1) * edge / 2);
        within_block(bsp, grid, child, low, edge / 2, visit);
    }
}

/// The part of the tree that holds the middles of all voxels of a cube; `middle` and `half` its edge in voxels.
fn around(bsp: &Bsp, grid: &Grid, mut child: Child, middle: DVec3, half: f64) -> Child {
    let middle = grid.frame.to_world(middle);
    let radius = (half - 0.5) * 3f64.sqrt() * grid.frame.voxel;
    while let Child::Node(node) = child {
        let node = &bsp.nodes[node as usize];
        let d = node.plane.distance(middle);
        if d.abs() <= radius && half > 0.5 {
            break;
        }
        child = node.children[usize::from(d > 0.0)];
    }
    child
}

/// The leaves that a cube of a brick's voxels lies in, divided where planes cut it; a voxel goes with its middle.
fn descend(
    bsp: &Bsp,
    grid: &Grid,
    brick: usize,
    child: Child,
    low: [usize; 3],
    edge: usize,
    add: &mut impl FnMut(u32, [usize; 3], usize),
) {
    let half = 0.5 * edge as f64;
    let middle = grid.corner(brick) + DVec3::from_array(low.map(|c| c as f64 + half));
    match around(bsp, grid, child, middle, half) {
        Child::Leaf(leaf) => add(leaf, low, edge),
        within @ Child::Node(_) => {
            for k in 0..8 {
                let low = std::array::from_fn(|a| low[a] + (k >> a & 1) * edge / 2);
                descend(bsp, grid, brick, within, low, edge / 2, add);
            }
        }
    }
}

/// An opening between a leaf that has a region and one that hasn't yet; wider ones first, then the lower number.
#[derive(PartialEq)]
struct Way(f64, u32);

impl Eq for Way {}

impl PartialOrd for Way {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Way {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}

/// Who has which leaf.
pub struct Owners {
    /// The region of each leaf; `None` in solid matter.
    pub leaves: Vec<Option<u32>>,
    /// The region of all that lies beyond the rim, and so of every leaf at it.
    pub beyond: Option<u32>,
}

/// How far the leaf reaches from the face that it reaches least far from, metres.
fn thickness(leaf: &Leaf) -> f64 {
    let faces = &leaf.poly.faces;
    let from = |plane: &Plane| faces.iter().flat_map(|f| &f.points).map(|&p| plane.distance(p).abs()).fold(0.0, f64::max);
    faces.iter().map(|f| from(&f.plane)).fold(f64::INFINITY, f64::min)
}

/// A region for each leaf; `outside` is the one beyond the rim, where that isn't solid.
///
/// Leaves thinner than `thin` metres lie between planes that are one but for rounding. Their faces may be wide open to what is
/// free at one end and to what is solid at the other, with no way between that anything would fit through. So they pass nothing
/// on, until all else has its region; and then nothing to what hangs together with the void around a level.
pub fn assign(bsp: &Bsp, counts: &[Vec<(u32, f64)>], contacts: &[Contact], outside: Option<u32>, thin: f64) -> Owners {
    let rim = bsp.leaves_at_rim();
    let void = |leaf: usize| if rim[leaf] { outside.is_none() } else { counts[leaf].iter().any(|c| c.0 == VOID) };
    let sliver: Vec<bool> = parallel::map(&bsp.leaves, |l| thickness(l) < thin);
    let most = |c: &Vec<(u32, f64)>| {
        let regions = c.iter().filter(|c| c.0 < VOID);
        regions.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0))).map(|c| c.0)
    };
    let mut leaves: Vec<Option<u32>> =
        counts.iter().zip(&rim).map(|(c, &rim)| if rim { outside } else { most(c) }).collect();
    let mut beyond = outside;
    let around = open_around(contacts, leaves.len());
    let mut ways: BinaryHeap<Way> = BinaryHeap::new();
    let open = |leaf: usize, leaves: &[Option<u32>], ways: &mut BinaryHeap<Way>| {
        for &i in &around[leaf] {
            let c = &contacts[i as usize];
            if c.leaves.iter().any(|&l| leaves[l as usize].is_none()) {
                ways.push(Way(c.open_area, i));
            }
        }
    };
    for through_slivers in [false, true] {
        let passes = |leaf: usize| through_slivers || !sliver[leaf];
        let solid = if through_slivers { around_void(contacts, &leaves, &sliver, void) } else { vec![false; leaves.len()] };
        for leaf in (0..leaves.len()).filter(|&l| passes(l)) {
            if leaves[leaf].is_some() {
                open(leaf, &leaves, &mut ways);
            }
        }
        while let Some(Way(_, i)) = ways.pop() {
            let [a, b] = contacts[i as usize].leaves.map(|l| l as usize);
            let (from, to) = if leaves[a].is_some() { (a, b) } else { (b, a) };
            // At the rim a sliver would pass on what it takes, to all that lies beyond.
            if leaves[to].is_some() || !passes(from) || solid[to] || (sliver[to] && rim[to]) {
                continue;
            }
            leaves[to] = leaves[from];
            open(to, &leaves, &mut ways);
            if rim[to] {
                // Beyond the rim nothing parts anything.
                beyond = leaves[to];
                for other in (0..leaves.len()).filter(|&l| rim[l]) {
                    leaves[other] = beyond;
                    open(other, &leaves, &mut ways);
                }
            }
        }
    }
    Owners { leaves, beyond }
}

/// Leaves without a region that hang together, but for slivers, with one that is `void`.
fn around_void(contacts: &[Contact], leaves: &[Option<u32>], sliver: &[bool], void: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut set = DisjointSets::new(leaves.len());
    let within = |leaf: usize| leaves[leaf].is_none() && !sliver[leaf];
    for c in contacts.iter().filter(|c| c.wide && c.leaves.iter().all(|&l| within(l as usize))) {
        set.join(c.leaves[0], c.leaves[1]);
    }
    let mut holds = vec![false; leaves.len()];
    for leaf in (0..leaves.len()).filter(|&l| within(l) && void(l)) {
        holds[set.find(leaf as u32) as usize] = true;
    }
    (0..leaves.len()).map(|l| holds[set.find(l as u32) as usize]).collect()
}

/// What a voxel in a leaf of another region costs, in faces of voxels.
const ASTRAY: f64 = 0.25;
/// Most times that all leaves are looked at.
const MOST_SWEEPS: usize = 16;

/// Boundaries drawn tight: a leaf goes over to a neighbour's region while that makes what is open between regions, and the voxels
/// that are in a leaf of another region, less in sum (iterated conditional modes: Besag, *On the statistical analysis of dirty
/// pictures*, 1986). `face`: a voxel's, square metres.
pub fn smooth(bsp: &Bsp, counts: &[Vec<(u32, f64)>], contacts: &[Contact], face: f64, leaves: &mut [Option<u32>]) {
    let around = open_around(contacts, leaves.len());
    let rim = bsp.leaves_at_rim();
    let mut awake = vec![true; leaves.len()];
    for _ in 0..MOST_SWEEPS {
        let mut moved = false;
        for leaf in 0..leaves.len() {
            if !std::mem::take(&mut awake[leaf]) || rim[leaf] {
                continue;
            }
            let Some(now) = leaves[leaf] else { continue };
            // What each region is worth to this leaf.
            let mut worth: BTreeMap<u32, f64> = counts[leaf].iter().map(|&(r, n)| (r, ASTRAY * face * n)).collect();
            let mut borders = BTreeSet::from([now]);
            for &i in &around[leaf] {
                let c = &contacts[i as usize];
                let other = c.leaves[usize::from(c.leaves[0] as usize == leaf)];
                if let Some(r) = leaves[other as usize] {
                    *worth.entry(r).or_default() += c.open_area;
                    borders.insert(r);
                }
            }
            let of = |r: u32| worth.get(&r).copied().unwrap_or(0.0);
            let best = borders.into_iter().fold(now, |best, r| if of(r) > of(best) + TIE * face { r } else { best });
            if best != now {
                leaves[leaf] = Some(best);
                moved = true;
                for &i in &around[leaf] {
                    contacts[i as usize].leaves.iter().for_each(|&l| awake[l as usize] = true);
                }
            }
        }
        if !moved {
            break;
        }
    }
}
