//! Free voxels into regions: basins of the distance field, joined while what parts them is shallow.
//!
//! Based on: Haumont, Debeir, Sillion, *Volumetric cell-and-portal generation*, 2003: the watershed of the distance to the
//! surface, flooded from its maxima; Najman, Schmitt, *Geodesic saliency of watershed contours*, 1996: all mergings from one
//! tree of saddles. Here each voxel points to its highest neighbour instead of waiting in a queue (the basins are the same, but
//! need no order and so no memory and any number of threads), and how shallow a basin may be is a share of its width, as for
//! the gates of `rooms`: a narrowing is one whether the hall behind it is 3 or 30 m wide.

use super::distance::{Distance, voxels_of};
use super::grid::{CELLS, Grid, SIDE, place_of, voxel};
use crate::cells::complex::Human;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// No region: occupied, or inside solid matter.
pub const NONE: u32 = u32::MAX;
/// Solid matter that reaches the rim: what lies around a level that has no outside.
pub const VOID: u32 = u32::MAX - 1;
/// A saddle must be this share of the narrower basin's width, less a voxel, to be no narrowing.
const WIDE_GATE: f64 = 0.9;
/// Two regions are one space where this share of the smaller one's whole boundary is open to the other. Much, because wide
/// openings still hide much in a level whose halls flow into one another.
const OPEN_SHARE: f64 = 0.5;
/// Narrower than this (metres) or smaller (cubic metres) is a part of its neighbour.
const LEAST_WIDTH: f64 = 0.6;
const LEAST_VOLUME: f64 = 3.0;
/// Matter is solid where this many times more triangles show it their backs than their fronts.
const BACKS: f64 = 4.0;

/// A label for each voxel: one a brick, or a few and a choice for each voxel.
pub struct Labels {
    /// Of bricks that aren't detailed.
    bricks: Vec<u32>,
    /// Of each detailed brick, by number.
    palettes: Vec<Vec<u32>>,
    /// Which of them, for each voxel; [`OCCUPIED`] for none.
    choice: Vec<[u8; CELLS]>,
}

const OCCUPIED: u8 = u8::MAX;

/// A face between two voxels of different labels.
pub struct VoxelFace {
    /// The labels, on the lower and on the upper side of the axis.
    pub labels: [u32; 2],
    /// The lower of the two levels, where they are known.
    pub level: u8,
    /// The middle of the face, in voxels.
    pub at: DVec3,
    /// Across which axis.
    pub axis: usize,
}

impl Labels {
    /// The label of a voxel.
    #[inline]
    pub fn get(&self, grid: &Grid, brick: usize, voxel: usize) -> u32 {
        match grid.detail(brick) {
            Some(d) => {
                self.choice[d][voxel].checked_add(1).map_or(NONE, |_| self.palettes[d][self.choice[d][voxel] as usize])
            }
            None => self.bricks[brick],
        }
    }

    /// The label of a whole brick, where it has but one.
    pub fn whole(&self, grid: &Grid, brick: usize) -> Option<u32> {
        grid.detail(brick).is_none().then(|| self.bricks[brick])
    }

    fn map(&mut self, of: impl Fn(u32) -> u32 + Sync) {
        let of = |l: &mut u32| *l = if *l == NONE { NONE } else { of(*l) };
        self.bricks.par_iter_mut().for_each(of);
        self.palettes.par_iter_mut().flatten().for_each(of);
    }

    /// Visits the faces between a brick's voxels of different labels, and those to the bricks on its upper sides (to all its
    /// sides where the other brick has but one label and this one has voxels).
    pub fn contacts(&self, grid: &Grid, distance: Option<&Distance>, brick: usize, visit: &mut impl FnMut(VoxelFace)) {
        let level = |b: usize, d: Option<usize>, v: usize| match (distance, d) {
            (Some(dist), Some(d)) => dist.voxels[d][v],
            (Some(dist), None) => dist.bricks[b],
            (None, _) => 0,
        };
        let corner = grid.corner(brick);
        let detail = grid.detail(brick);
        for axis in 0..3 {
            let mut step = [0i64; 3];
            step[axis] = 1;
            if let Some(d) = detail {
                let stride = SIDE.pow(axis as u32);
                for v in 0..CELLS {
                    let place = place_of(v);
                    if place[axis] + 1 < SIDE && self.choice[d][v] != self.choice[d][v + stride] {
                        let labels = [self.get(grid, brick, v), self.get(grid, brick, v + stride)];
                        if labels[0] != labels[1] {
                            let mut at = corner + DVec3::from_array(place.map(|c| c as f64 + 0.5));
                            at[axis] += 0.5;
                            let level = level(brick, detail, v).min(level(brick, detail, v + stride));
                            visit(VoxelFace { labels, level, at, axis });
                        }
                    }
                }
            }
            for up in [true, false] {
                let Some(other) = grid.beside(brick, step.map(|s| if up { s } else { -s })) else { continue };
                let beyond = grid.detail(other);
                if (up && detail.is_none() && beyond.is_some()) || (!up && (detail.is_none() || beyond.is_some())) {
                    continue;
                }
                if detail.is_none() && self.bricks[brick] == self.bricks[other] {
                    continue;
                }
                for k in 0..SIDE * SIDE {
                    let mut place = [0; 3];
                    place[(axis + 1) % 3] = k % SIDE;
                    place[(axis + 2) % 3] = k / SIDE;
                    let mut there = place;
                    (place[axis], there[axis]) = if up { (SIDE - 1, 0) } else { (0, SIDE - 1) };
                    let [v, w] = [place, there].map(|[x, y, z]| voxel(x, y, z));
                    let mut labels = [self.get(grid, brick, v), self.get(grid, other, w)];
                    if labels[0] != labels[1] {
                        let mut at = corner + DVec3::from_array(place.map(|c| c as f64 + 0.5));
                        at[axis] += if up { 0.5 } else { -0.5 };
                        if !up {
                            labels.swap(0, 1);
                        }
                        visit(VoxelFace { labels, level: level(brick, detail, v).min(level(other, beyond, w)), at, axis });
                    }
                }
            }
        }
    }
}

/// A region of free voxels.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Region {
    /// It reaches the rim.
    pub outside: bool,
    /// Voxels.
    pub volume: f64,
    /// Twice the greatest distance to a surface, in voxels.
    pub width: f64,
    /// Faces between its voxels and occupied ones.
    walls: f64,
}

/// Visits points near triangles, in voxels, with the area that shows them its front, and the area that shows them its back.
pub type Fronts<'f> = dyn Fn(&mut dyn FnMut(DVec3, [f64; 2])) + 'f;

/// Regions with their labels; `fronts` tells which matter is solid.
pub fn watershed(grid: &Grid, distance: &Distance, human: Human, fronts: &Fronts<'_>) -> (Labels, Vec<Region>) {
    let (mut labels, basins) = basins(grid, distance);
    let mut set = Union::new(basins.len());
    let saddles = saddles(grid, distance, &labels);

    // 1. What hangs together, and which of it is solid.
    let mut whole = Union::new(basins.len());
    for s in &saddles {
        whole.join(s.pair.0, s.pair.1);
    }
    let mut looks = vec![[0.0f64; 2]; basins.len()];
    fronts(&mut |q, [front, back]| {
        if let Some((brick, v)) = grid.locate(q)
            && let label @ 0..VOID = labels.get(grid, brick, v)
        {
            let root = whole.find(label) as usize;
            looks[root][0] += front;
            looks[root][1] += back;
        }
    });
    let solid: Vec<bool> = (0..basins.len() as u32)
        .map(|b| {
            let [front, back] = looks[whole.find(b) as usize];
            back > BACKS * front
        })
        .collect();

    // 2. Saddles, highest first.
    let mut regions = basins;
    let first_outside = regions.iter().position(|r| r.outside);
    for b in 0..regions.len() {
        if regions[b].outside {
            unite(&mut set, &mut regions, b as u32, first_outside.unwrap_or(b) as u32);
        }
    }
    let mut order: Vec<usize> = (0..saddles.len()).collect();
    order.sort_by_key(|&i| (std::cmp::Reverse(saddles[i].level), saddles[i].pair));
    for i in order {
        let s = &saddles[i];
        let (a, b) = (set.find(s.pair.0), set.find(s.pair.1));
        let narrower = regions[a as usize].width.min(regions[b as usize].width);
        let wide = 2.0 * voxels_of(s.level) + 1.0;
        if a != b && wide >= WIDE_GATE * narrower {
            unite(&mut set, &mut regions, a, b);
        }
    }

    // 3. Regions that are open to each other over much of their boundary; then what is too small.
    let metre = human.metre / grid.frame.voxel;
    loop {
        let mut open: BTreeMap<(u32, u32), f64> = BTreeMap::new();
        for s in &saddles {
            let (a, b) = (set.find(s.pair.0), set.find(s.pair.1));
            if a != b {
                *open.entry((a.min(b), a.max(b))).or_default() += s.faces;
            }
        }
        let mut boundary: Vec<f64> = regions.iter().map(|r| r.walls).collect();
        for (&(a, b), faces) in &open {
            boundary[a as usize] += faces;
            boundary[b as usize] += faces;
        }
        let mut wishes: Vec<(f64, (u32, u32))> = Vec::new();
        for (&(a, b), &faces) in &open {
            let smaller = if regions[a as usize].volume <= regions[b as usize].volume { a } else { b };
            let share = faces / boundary[smaller as usize];
            let small = |r: u32| is_small(&regions[r as usize], metre);
            if small(a) || small(b) {
                wishes.push((1.0 + share, (a, b)));
            } else if share >= OPEN_SHARE {
                wishes.push((share, (a, b)));
            }
        }
        wishes.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        let mut touched = vec![false; regions.len()];
        let mut joined = false;
        for (_, (a, b)) in wishes {
            if !touched[a as usize] && !touched[b as usize] {
                unite(&mut set, &mut regions, a, b);
                (touched[a as usize], touched[b as usize], joined) = (true, true, true);
            }
        }
        if !joined {
            break;
        }
    }

    // 4. Numbers. What is still too small has no neighbour: a gap between overlapping solids.
    let mut number = vec![NONE; regions.len()];
    let mut out = Vec::new();
    for b in 0..regions.len() as u32 {
        let root = set.find(b);
        if !solid[b as usize] && number[root as usize] == NONE && !is_small(&regions[root as usize], metre) {
            number[root as usize] = out.len() as u32;
            out.push(regions[root as usize]);
        }
    }
    let label = |b: u32| match (solid[b as usize], regions[set.find(b) as usize].outside) {
        (false, _) => number[set.find(b) as usize],
        (true, true) => VOID,
        (true, false) => NONE,
    };
    let number: Vec<u32> = (0..regions.len() as u32).map(label).collect();
    labels.map(|l| number[l as usize]);
    (labels, out)
}

/// Too small or too narrow for a cell; `metre` in voxels.
fn is_small(r: &Region, metre: f64) -> bool {
    !r.outside && (r.volume < LEAST_VOLUME * metre.powi(3) || r.width < LEAST_WIDTH * metre)
}

fn unite(set: &mut Union, regions: &mut [Region], a: u32, b: u32) {
    let (a, b) = (set.find(a), set.find(b));
    if a != b {
        let r = set.join(a, b) as usize;
        let (x, y) = (regions[a as usize], regions[b as usize]);
        regions[r] = Region {
            outside: x.outside || y.outside,
            volume: x.volume + y.volume,
            width: x.width.max(y.width),
            walls: x.walls + y.walls,
        };
    }
}

/// Basins: every voxel (and every undivided brick) goes to its highest neighbour until there is none.
fn basins(grid: &Grid, distance: &Distance) -> (Labels, Vec<Region>) {
    // 1. Within each brick, where the ways end: at a peak, or at a voxel of another brick.
    let ways: Vec<Ways> = (0..grid.occupied.len()).into_par_iter().map(|d| ways(grid, distance, d)).collect();
    let mut start: Vec<u32> = Vec::with_capacity(ways.len());
    let mut total = 0u32;
    for way in &ways {
        start.push(total);
        total += way.ends.len() as u32;
    }
    let node = |key: u64| {
        let (brick, v) = ((key >> 9) as usize, (key & 511) as usize);
        match grid.detail(brick) {
            Some(d) => start[d] + u32::from(ways[d].choice[v]),
            None => total + brick as u32,
        }
    };
    // 2. From end to end.
    let mut next: Vec<u32> = ways.par_iter().flat_map_iter(|w| w.ends.iter().map(|&e| node(e))).collect();
    let of_brick = |brick: usize| match grid.detail(brick) {
        Some(_) => total + brick as u32,
        None => node(above_brick(grid, distance, brick)),
    };
    next.par_extend((0..grid.len()).into_par_iter().map(of_brick));
    for i in 0..next.len() {
        let mut root = i;
        while next[root] as usize != root {
            root = next[root] as usize;
        }
        let mut at = i;
        while next[at] as usize != root {
            at = std::mem::replace(&mut next[at], root as u32) as usize;
        }
    }
    // 3. Numbers; volumes and widths.
    let mut number: Vec<u32> = vec![NONE; next.len()];
    let mut regions: Vec<Region> = Vec::new();
    let mut count = |root: u32, voxels: f64, level: u8, walls: f64, rim: bool| {
        let id = &mut number[root as usize];
        if *id == NONE {
            *id = regions.len() as u32;
            regions.push(Region { outside: false, volume: 0.0, width: 0.0, walls: 0.0 });
        }
        let r = &mut regions[*id as usize];
        r.outside |= rim;
        r.volume += voxels;
        r.width = r.width.max(2.0 * voxels_of(level));
        r.walls += walls;
    };
    for brick in 0..grid.len() {
        let rim = grid.at_rim(brick);
        match grid.detail(brick) {
            None => count(next[total as usize + brick], CELLS as f64, distance.bricks[brick], 0.0, rim),
            Some(d) => {
                let mut found = vec![(0.0, 0u8); ways[d].ends.len()];
                for (v, &c) in ways[d].choice.iter().enumerate().filter(|(_, c)| **c != OCCUPIED) {
                    let f = &mut found[c as usize];
                    *f = (f.0 + 1.0, f.1.max(distance.voxels[d][v]));
                }
                for (k, (voxels, level)) in found.into_iter().enumerate() {
                    count(next[start[d] as usize + k], voxels, level, f64::from(ways[d].walls[k]), rim);
                }
            }
        }
    }
    let palettes =
        (0..ways.len()).map(|d| (0..ways[d].ends.len()).map(|k| number[next[start[d] as usize + k] as usize]).collect());
    let labels = Labels {
        bricks: (0..grid.len())
            .map(|b| if grid.detail(b).is_some() { NONE } else { number[next[total as usize + b] as usize] })
            .collect(),
        palettes: palettes.collect(),
        choice: ways.into_iter().map(|w| w.choice).collect(),
    };
    let mut labels = labels;
    labels.palettes.par_iter_mut().zip(&mut labels.choice).for_each(|(palette, choice)| compact(palette, choice));
    (labels, regions)
}

/// Each label once.
fn compact(palette: &mut Vec<u32>, choice: &mut [u8; CELLS]) {
    let mut kept: Vec<u32> = Vec::new();
    let place: Vec<u8> = palette
        .iter()
        .map(|l| {
            let at = kept.iter().position(|k| k == l).unwrap_or_else(|| {
                kept.push(*l);
                kept.len() - 1
            });
            at as u8
        })
        .collect();
    for c in choice.iter_mut().filter(|c| **c != OCCUPIED) {
        *c = place[*c as usize];
    }
    *palette = kept;
}

/// An element as a key: its brick, then its voxel (0 for an undivided brick).
fn key(brick: usize, voxel: usize) -> u64 {
    (brick as u64) << 9 | voxel as u64
}

/// Where the ways of a brick's voxels end.
struct Ways {
    /// The ends, as keys, and by how many faces the voxels that come to each touch occupied ones.
    ends: Vec<u64>,
    walls: Vec<u32>,
    /// Which end each voxel comes to.
    choice: [u8; CELLS],
}

/// At most 255 ends: beyond, some voxels end where they are, which costs a better place of a portal.
fn ways(grid: &Grid, distance: &Distance, detail: usize) -> Ways {
    let brick = grid.brick_of[detail] as usize;
    let around: [Option<(usize, Option<usize>)>; 27] = std::array::from_fn(|k| {
        let by = [k as i64 % 3 - 1, k as i64 / 3 % 3 - 1, k as i64 / 9 - 1];
        grid.beside(brick, by).map(|b| (b, grid.detail(b)))
    });
    // Levels with those of the neighbours around them.
    const EDGE: usize = SIDE + 2;
    let mut levels = [0u8; EDGE * EDGE * EDGE];
    let split = |c: usize| (c.div_ceil(SIDE), (c + SIDE - 1) % SIDE);
    for (i, l) in levels.iter_mut().enumerate() {
        let [(bx, x), (by, y), (bz, z)] = [i % EDGE, i / EDGE % EDGE, i / (EDGE * EDGE)].map(split);
        if let Some((b, d)) = around[(bz * 3 + by) * 3 + bx] {
            *l = d.map_or_else(|| distance.bricks[b], |d| distance.voxels[d][voxel(x, y, z)]);
        }
    }
    let key_at = |i: usize| {
        let [(bx, x), (by, y), (bz, z)] = [i % EDGE, i / EDGE % EDGE, i / (EDGE * EDGE)].map(split);
        match around[(bz * 3 + by) * 3 + bx] {
            Some((b, Some(_))) => key(b, voxel(x, y, z)),
            Some((b, None)) => key(b, 0),
            None => 0,
        }
    };
    let mut target = [0u64; CELLS];
    for (v, target) in target.iter_mut().enumerate() {
        let [x, y, z] = place_of(v).map(|c| c + 1);
        let here = (z * EDGE + y) * EDGE + x;
        let mut best = (levels[here], key(brick, v));
        if best.0 == 0 {
            continue;
        }
        for dz in 0..3 {
            for dy in 0..3 {
                for dx in 0..3 {
                    let i = here + (dz * EDGE + dy) * EDGE + dx - (EDGE * EDGE + EDGE + 1);
                    if levels[i] >= best.0 {
                        best = best.max((levels[i], key_at(i)));
                    }
                }
            }
        }
        *target = best.1;
    }
    let mut ends: Vec<u64> = Vec::new();
    let mut choice = [OCCUPIED; CELLS];
    let mut path = Vec::new();
    for v in (0..CELLS).filter(|&v| !grid.is_occupied(detail, v)) {
        let mut at = v;
        let end = loop {
            if choice[at] != OCCUPIED {
                break choice[at];
            }
            path.push(at);
            let t = target[at];
            if t >> 9 != brick as u64 || t == key(brick, at) {
                const LAST: usize = OCCUPIED as usize - 1;
                let found = ends.iter().position(|&e| e == t).unwrap_or_else(|| {
                    if ends.len() <= LAST {
                        ends.push(if ends.len() < LAST { t } else { key(brick, at) });
                    }
                    ends.len() - 1
                });
                break found as u8;
            }
            at = (t & 511) as usize;
        };
        path.drain(..).for_each(|p| choice[p] = end);
    }
    let mut walls = vec![0; ends.len()];
    for v in (0..CELLS).filter(|&v| choice[v] != OCCUPIED) {
        let [x, y, z] = place_of(v).map(|c| c + 1);
        let here = (z * EDGE + y) * EDGE + x;
        let beside = [1, EDGE, EDGE * EDGE].iter().flat_map(|s| [here - s, here + s]);
        walls[choice[v] as usize] += beside.filter(|&i| levels[i] == 0).count() as u32;
    }
    Ways { ends, walls, choice }
}

/// The highest element beside an undivided brick, or itself.
fn above_brick(grid: &Grid, distance: &Distance, brick: usize) -> u64 {
    let mut best = (distance.bricks[brick], key(brick, 0));
    for axis in 0..3 {
        for up in [false, true] {
            let mut step = [0i64; 3];
            step[axis] = if up { 1 } else { -1 };
            let Some(other) = grid.beside(brick, step) else { continue };
            match grid.detail(other) {
                None => best = best.max((distance.bricks[other], key(other, 0))),
                Some(d) => {
                    for k in 0..SIDE * SIDE {
                        let mut place = [0; 3];
                        place[axis] = if up { 0 } else { SIDE - 1 };
                        place[(axis + 1) % 3] = k % SIDE;
                        place[(axis + 2) % 3] = k / SIDE;
                        let v = voxel(place[0], place[1], place[2]);
                        best = best.max((distance.voxels[d][v], key(other, v)));
                    }
                }
            }
        }
    }
    best.1
}

/// The highest way from one basin to another, and by how many faces of voxels they meet.
struct Saddle {
    pair: (u32, u32),
    level: u8,
    faces: f64,
}

/// Ordered by pair.
fn saddles(grid: &Grid, distance: &Distance, labels: &Labels) -> Vec<Saddle> {
    const CHUNK: usize = 4096;
    let merge = |mut found: Vec<(u32, u32, u8, u32)>| {
        found.sort_unstable();
        found.dedup_by(|b, a| {
            let same = (a.0, a.1) == (b.0, b.1);
            if same {
                (a.2, a.3) = (a.2.max(b.2), a.3 + b.3);
            }
            same
        });
        found
    };
    let of_chunk = |chunk: usize| {
        let mut found: Vec<(u32, u32, u8, u32)> = Vec::new();
        for brick in chunk * CHUNK..((chunk + 1) * CHUNK).min(grid.len()) {
            labels.contacts(grid, Some(distance), brick, &mut |c: VoxelFace| {
                let [a, b] = c.labels;
                if a != NONE && b != NONE {
                    found.push((a.min(b), a.max(b), c.level, 1));
                }
            });
            if found.len() > 1 << 16 {
                found = merge(std::mem::take(&mut found));
            }
        }
        merge(found)
    };
    let chunks: Vec<_> = (0..grid.len().div_ceil(CHUNK)).into_par_iter().map(of_chunk).collect();
    let all = merge(chunks.into_iter().flatten().collect());
    all.into_iter().map(|(a, b, level, faces)| Saddle { pair: (a, b), level, faces: f64::from(faces) }).collect()
}

/// Disjoint sets; the lower number stands for a set.
pub struct Union {
    parent: Vec<u32>,
}

impl Union {
    /// Each by itself.
    pub fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect() }
    }

    /// Who stands for the set of `i`.
    pub fn find(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i
    }

    /// Joins two sets.
    pub fn join(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
        a.min(b)
    }
}
