//! Basins of the distance field, and the saddles between them.
//!
//! Every voxel (and every undivided brick) goes to its highest neighbour until there is none: the basins of a flood from the
//! maxima, but without an order, and so with any number of threads. Only a slab of the grid is looked at at a time: ways are
//! followed to their ends in it, and those that leave it upwards go on when the next slab is done. So levels and ways of single
//! voxels are held for one slab, labels for all.

use super::distance::{Distance, Levels, voxels_of};
use super::grid::{CELLS, Grid, SIDE, place_of, voxel};
use super::labels::{Labels, NONE, VoxelFace};
use crate::parallel;
use std::ops::Range;

/// Bricks of a slab, about; a layer on either side is looked at besides.
const SLAB: usize = 1 << 19;
/// A voxel that has no way, as it is occupied.
const OCCUPIED: u8 = u8::MAX;
/// So many places where parts meet are looked through for what is there twice.
const MANY: usize = 1 << 16;

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
    pub walls: f64,
}

impl Region {
    const EMPTY: Self = Self { outside: false, volume: 0.0, width: 0.0, walls: 0.0 };

    /// Both together.
    pub fn with(self, other: Self) -> Self {
        Self {
            outside: self.outside || other.outside,
            volume: self.volume + other.volume,
            width: self.width.max(other.width),
            walls: self.walls + other.walls,
        }
    }
}

/// The highest way from one basin to another, and by how many faces of voxels they meet.
pub struct Saddle {
    /// The basins, the lower number first.
    pub pair: (u32, u32),
    /// The level of the highest face.
    pub level: u8,
    /// Number of faces.
    pub faces: f64,
}

/// What ways lead to.
pub struct Basins {
    /// The basin of each voxel.
    pub labels: Labels,
    /// Basins.
    pub regions: Vec<Region>,
    /// Between them, ordered by pair.
    pub saddles: Vec<Saddle>,
}

/// Of saddles: the basins, the level, faces.
type Met = (u32, u32, u8, u32);

/// What is known after some slabs: parts of basins, each where all ways of a slab come to one end.
struct Slabs<'g> {
    grid: &'g Grid,
    labels: Labels,
    parts: Vec<Region>,
    /// The part that each part's way leads to; itself at a peak, and where that isn't known yet.
    next: Vec<u32>,
    /// Of the last slab, parts whose ways leave it upwards, and as a key, where.
    pending: Vec<(u32, u64)>,
    met: Vec<Met>,
    /// When that many are looked through.
    limit: usize,
}

/// Where the ways of a slab end. Nodes are the ends in each brick with details, then bricks, then what lies outside the slab.
struct Slab {
    bricks: Range<usize>,
    /// The first brick with details, by its place among those.
    first_detail: usize,
    /// The ways in each brick with details, and the node of its first end.
    ways: Vec<Ways>,
    start: Vec<u32>,
    /// The node of the first brick, and of the first place beyond.
    first_brick: u32,
    known: u32,
    /// Places outside the slab that ways lead to, as keys, ascending.
    beyond: Vec<u64>,
    /// The node that each node's way ends at.
    root: Vec<u32>,
}

impl Slab {
    fn new(grid: &Grid, levels: &Levels<'_>, bricks: Range<usize>) -> Self {
        // 1. Within each brick, where the ways end: at a peak, or at a voxel of another brick.
        let details = grid.details(bricks.clone());
        let ways: Vec<Ways> = parallel::map_range(details.clone(), |d| ways(grid, levels, d));
        let above = |b: usize| if grid.detail(b).is_some() { key(b, 0) } else { above_brick(grid, levels, b) };
        let above: Vec<u64> = parallel::map_range(bricks.clone(), above);
        let mut start: Vec<u32> = Vec::with_capacity(ways.len());
        let mut first_brick = 0u32;
        for way in &ways {
            start.push(first_brick);
            first_brick += way.ends.len() as u32;
        }
        let leaves = |key: &u64| !bricks.contains(&brick_and_voxel(*key).0);
        let ends = |d: usize| ways[d].ends.iter().copied().filter(leaves);
        let mut beyond: Vec<u64> = parallel::flat_map_range(0..ways.len(), ends);
        beyond.extend(above.iter().copied().filter(leaves));
        parallel::sort(&mut beyond);
        beyond.dedup();
        let known = first_brick + bricks.len() as u32;
        let mut slab = Self {
            bricks: bricks.clone(),
            first_detail: details.start,
            ways,
            start,
            first_brick,
            known,
            beyond,
            root: Vec::new(),
        };
        // 2. From end to end.
        let node = |key: u64| slab.node(grid, key);
        let mut root: Vec<u32> =
            parallel::flat_map_range(0..slab.ways.len(), |d| slab.ways[d].ends.iter().map(|&e| node(e)));
        root.extend(parallel::map_range(bricks.clone(), |b| match grid.detail(b) {
            Some(_) => slab.node_of_brick(b),
            None => node(above[b - bricks.start]),
        }));
        root.extend(known..known + slab.beyond.len() as u32);
        to_roots(&mut root);
        slab.root = root;
        slab
    }

    fn node_of_brick(&self, brick: usize) -> u32 {
        self.first_brick + (brick - self.bricks.start) as u32
    }

    fn node(&self, grid: &Grid, key: u64) -> u32 {
        let (brick, v) = brick_and_voxel(key);
        if !self.bricks.contains(&brick) {
            return self.known + self.beyond.partition_point(|&b| b < key) as u32;
        }
        match grid.detail(brick) {
            Some(d) => self.start[d - self.first_detail] + u32::from(self.ways[d - self.first_detail].choice[v]),
            None => self.node_of_brick(brick),
        }
    }
}

/// All basins.
pub fn basins(grid: &Grid, distance: &Distance<'_>) -> Basins {
    by_slabs(grid, distance, (SLAB / (grid.bricks[0] * grid.bricks[1])).max(1))
}

/// The same whatever the number of layers of a slab.
fn by_slabs(grid: &Grid, distance: &Distance<'_>, of_slab: usize) -> Basins {
    let layers = grid.bricks[2];
    let labels = Labels::new(grid);
    let mut slabs =
        Slabs { grid, labels, parts: Vec::new(), next: Vec::new(), pending: Vec::new(), met: Vec::new(), limit: MANY };
    for low in (0..layers).step_by(of_slab) {
        let high = (low + of_slab).min(layers);
        let levels = distance.levels(grid.details(grid.layers(low.saturating_sub(1)..(high + 1).min(layers))));
        slabs.add(&levels, grid.layers(low..high));
        // The last layer's neighbours above aren't labelled yet.
        let last = if high == layers { high } else { high - 1 };
        slabs.meet(&levels, grid.layers(low.saturating_sub(1)..last));
    }
    slabs.finish()
}

impl Slabs<'_> {
    /// Labels the bricks of a slab.
    fn add(&mut self, levels: &Levels<'_>, bricks: Range<usize>) {
        let grid = self.grid;
        let slab = Slab::new(grid, levels, bricks.clone());
        // 1. Parts.
        let (number, pending) = self.number(&slab, levels);
        // 2. Labels.
        let label = |node: u32| number[slab.root[node as usize] as usize];
        for brick in bricks.clone().filter(|&b| grid.detail(b).is_none()) {
            self.labels.set_brick(brick, label(slab.node_of_brick(brick)));
        }
        let Slab { ways, start, .. } = &slab;
        let palette = |d: usize| ((start[d]..).take(ways[d].ends.len()).map(label).collect(), ways[d].choice);
        self.labels.append(ways.len(), &palette);
        // 3. What left the slab before came here.
        for (part, key) in std::mem::replace(&mut self.pending, pending) {
            self.next[part as usize] = label_at(grid, &self.labels, key);
        }
        self.labels.map_last_but_one(|l| root(&self.next, l));
    }

    /// Adds up the parts of a slab: the part of each root, and the parts whose ways leave the slab upwards, with where.
    fn number(&mut self, slab: &Slab, levels: &Levels<'_>) -> (Vec<u32>, Vec<(u32, u64)>) {
        let grid = self.grid;
        let mut number: Vec<u32> = vec![NONE; slab.root.len()];
        let mut pending: Vec<(u32, u64)> = Vec::new();
        let mut count = |node: u32, of: Region| {
            let root = slab.root[node as usize];
            let part = &mut number[root as usize];
            if *part == NONE {
                let end = root.checked_sub(slab.known).map(|i| slab.beyond[i as usize]);
                *part = match end {
                    Some(end) if end < key(slab.bricks.start, 0) => label_at(grid, &self.labels, end),
                    _ => {
                        let new = self.parts.len() as u32;
                        self.parts.push(Region::EMPTY);
                        self.next.push(new);
                        pending.extend(end.map(|end| (new, end)));
                        new
                    }
                };
            }
            self.parts[*part as usize] = self.parts[*part as usize].with(of);
        };
        for brick in slab.bricks.clone() {
            let outside = grid.at_rim(brick);
            match grid.detail(brick) {
                None => {
                    let width = 2.0 * voxels_of(levels.get(brick, None, 0));
                    count(slab.node_of_brick(brick), Region { outside, volume: CELLS as f64, width, walls: 0.0 });
                }
                Some(d) => {
                    let of = &slab.ways[d - slab.first_detail];
                    let mut found: Vec<Region> =
                        of.walls.iter().map(|&w| Region { outside, walls: f64::from(w), ..Region::EMPTY }).collect();
                    for (v, &c) in of.choice.iter().enumerate().filter(|(_, c)| **c != OCCUPIED) {
                        let f = &mut found[c as usize];
                        f.volume += 1.0;
                        f.width = f.width.max(2.0 * voxels_of(levels.get(brick, Some(d), v)));
                    }
                    (slab.start[d - slab.first_detail]..).zip(found).for_each(|(node, f)| count(node, f));
                }
            }
        }
        (number, pending)
    }

    /// Adds where parts meet, of bricks whose upper neighbours are labelled.
    fn meet(&mut self, levels: &Levels<'_>, bricks: Range<usize>) {
        const CHUNK: usize = 2048;
        let (grid, labels) = (self.grid, &self.labels);
        let of_chunk = |chunk: usize| {
            let (mut met, mut limit): (Vec<Met>, usize) = (Vec::new(), MANY);
            let first = bricks.start + chunk * CHUNK;
            for brick in first..(first + CHUNK).min(bricks.end) {
                labels.contacts(grid, Some(levels), brick, &mut |VoxelFace { labels: [a, b], level, .. }| {
                    met.push((a.min(b), a.max(b), level, 1));
                });
                if met.len() > limit {
                    merge(&mut met);
                    limit = limit.max(2 * met.len());
                }
            }
            merge(&mut met);
            met
        };
        let met: Vec<Met> = parallel::flat_map_range(0..bricks.len().div_ceil(CHUNK), of_chunk);
        self.met.extend(met);
        if self.met.len() > self.limit {
            self.settle();
            self.limit = MANY.max(2 * self.met.len());
        }
    }

    /// Keeps one entry for each pair of what parts lead to.
    fn settle(&mut self) {
        for m in &mut self.met {
            let (a, b) = (root(&self.next, m.0), root(&self.next, m.1));
            (m.0, m.1) = (a.min(b), a.max(b));
        }
        self.met.retain(|m| m.0 != m.1);
        merge(&mut self.met);
    }

    /// Numbers what is left.
    fn finish(mut self) -> Basins {
        to_roots(&mut self.next);
        self.settle();
        let Self { mut labels, parts, next, met, .. } = self;
        let mut number: Vec<u32> = vec![NONE; next.len()];
        let mut regions: Vec<Region> = Vec::new();
        for (i, &root) in next.iter().enumerate().filter(|(i, root)| *i == **root as usize) {
            number[root as usize] = regions.len() as u32;
            regions.push(parts[i]);
        }
        for (i, &root) in next.iter().enumerate().filter(|(i, root)| *i != **root as usize) {
            let basin = &mut regions[number[root as usize] as usize];
            *basin = basin.with(parts[i]);
        }
        let number = |part: u32| number[next[part as usize] as usize];
        labels.map(number);
        // Numbers ascend with their parts.
        let saddle = |(a, b, level, faces): Met| Saddle { pair: (number(a), number(b)), level, faces: f64::from(faces) };
        Basins { labels, regions, saddles: met.into_iter().map(saddle).collect() }
    }
}

/// The label of what a key stands for.
fn label_at(grid: &Grid, labels: &Labels, key: u64) -> u32 {
    let (brick, voxel) = brick_and_voxel(key);
    labels.get(grid, brick, voxel)
}

/// Where a way ends, as far as that is known.
fn root(next: &[u32], mut part: u32) -> u32 {
    while next[part as usize] != part {
        part = next[part as usize];
    }
    part
}

/// Follows each node's way to its end.
fn to_roots(next: &mut [u32]) {
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
}

/// One entry for each pair, in order.
fn merge(met: &mut Vec<Met>) {
    parallel::sort(met);
    met.dedup_by(|b, a| {
        let same = (a.0, a.1) == (b.0, b.1);
        if same {
            (a.2, a.3) = (a.2.max(b.2), a.3 + b.3);
        }
        same
    });
}

/// An element as a key: its brick, then its voxel (0 for an undivided brick).
fn key(brick: usize, voxel: usize) -> u64 {
    (brick as u64) << 9 | voxel as u64
}

/// The brick and the voxel of a key.
fn brick_and_voxel(key: u64) -> (usize, usize) {
    ((key >> 9) as usize, (key & 511) as usize)
}

/// Where the ways of a brick's voxels end.
struct Ways {
    /// The ends, as keys, and by how many faces the voxels that come to each touch occupied ones.
    ends: Vec<u64>,
    walls: Vec<u32>,
    /// Which end each voxel comes to.
    choice: [u8; CELLS],
}

/// At most 255 ends: beyond, the last stands for all that are left, which costs a better place of a portal.
fn ways(grid: &Grid, levels: &Levels<'_>, detail: usize) -> Ways {
    let brick = grid.brick_of[detail] as usize;
    let around: [Option<(usize, Option<usize>)>; 27] = std::array::from_fn(|k| {
        let by = [k as i64 % 3 - 1, k as i64 / 3 % 3 - 1, k as i64 / 9 - 1];
        grid.beside(brick, by).map(|b| (b, grid.detail(b)))
    });
    // With those of the neighbours around them.
    const EDGE: usize = SIDE + 2;
    let mut near = [0u8; EDGE * EDGE * EDGE];
    let split = |c: usize| (c.div_ceil(SIDE), (c + SIDE - 1) % SIDE);
    for (i, l) in near.iter_mut().enumerate() {
        let [(bx, x), (by, y), (bz, z)] = [i % EDGE, i / EDGE % EDGE, i / (EDGE * EDGE)].map(split);
        if let Some((b, d)) = around[(bz * 3 + by) * 3 + bx] {
            *l = levels.get(b, d, voxel(x, y, z));
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
        let mut best = (near[here], key(brick, v));
        if best.0 == 0 {
            continue;
        }
        for dz in 0..3 {
            for dy in 0..3 {
                for dx in 0..3 {
                    let i = here + (dz * EDGE + dy) * EDGE + dx - (EDGE * EDGE + EDGE + 1);
                    if near[i] >= best.0 {
                        best = best.max((near[i], key_at(i)));
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
        walls[choice[v] as usize] += beside.filter(|&i| near[i] == 0).count() as u32;
    }
    Ways { ends, walls, choice }
}

/// The highest element beside an undivided brick, or itself.
fn above_brick(grid: &Grid, levels: &Levels<'_>, brick: usize) -> u64 {
    let mut best = (levels.get(brick, None, 0), key(brick, 0));
    for axis in 0..3 {
        for up in [false, true] {
            let mut step = [0i64; 3];
            step[axis] = if up { 1 } else { -1 };
            let Some(other) = grid.beside(brick, step) else { continue };
            match grid.detail(other) {
                None => best = best.max((levels.get(other, None, 0), key(other, 0))),
                Some(d) => {
                    for k in 0..SIDE * SIDE {
                        let mut place = [0; 3];
                        place[axis] = if up { 0 } else { SIDE - 1 };
                        place[(axis + 1) % 3] = k % SIDE;
                        place[(axis + 2) % 3] = k / SIDE;
                        let v = voxel(place[0], place[1], place[2]);
                        best = best.max((levels.get(other, Some(d), v), key(other, v)));
                    }
                }
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec2, DVec3};
    use std::collections::BTreeMap;

    /// Two rooms, one behind the other along the axis that slabs are cut across, with a doorway; a pillar in one of them.
    fn rooms() -> Vec<[DVec3; 3]> {
        let mut out = Vec::new();
        let mut slab = |a: [f64; 3], b: [f64; 3]| {
            let (a, b) = (DVec3::from_array(a), DVec3::from_array(b));
            let flat = (0..3).min_by(|&i, &j| (b - a)[i].total_cmp(&(b - a)[j])).unwrap_or(0);
            let (u, v) = ((flat + 1) % 3, (flat + 2) % 3);
            let corner = |x: f64, y: f64| {
                let mut p = a;
                (p[u], p[v]) = (a[u] + x * (b - a)[u], a[v] + y * (b - a)[v]);
                p
            };
            out.push([corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0)]);
            out.push([corner(0.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)]);
        };
        for (a, b) in [
            ([0.0, 0.0, 0.0], [4.0, 0.0, 9.0]),
            ([0.0, 2.5, 0.0], [4.0, 2.5, 9.0]),
            ([0.0, 0.0, 0.0], [0.0, 2.5, 9.0]),
            ([4.0, 0.0, 0.0], [4.0, 2.5, 9.0]),
            ([0.0, 0.0, 0.0], [4.0, 2.5, 0.0]),
            ([0.0, 0.0, 9.0], [4.0, 2.5, 9.0]),
            ([0.0, 0.0, 4.1], [1.4, 2.5, 4.1]),
            ([2.3, 0.0, 4.1], [4.0, 2.5, 4.1]),
            ([1.4, 2.0, 4.1], [2.3, 2.5, 4.1]),
            ([1.2, 0.0, 6.5], [1.7, 2.5, 6.5]),
            ([1.2, 0.0, 6.5], [1.2, 2.5, 7.0]),
        ] {
            slab(a, b);
        }
        out
    }

    /// The same basins, volumes, widths and saddles, whatever the slabs.
    #[test]
    fn slabs_change_nothing() {
        let grid = Grid::new(&rooms(), DVec2::from_angle(0.2), 0.1);
        let distance = Distance::new(&grid);
        let all = by_slabs(&grid, &distance, grid.bricks[2]);
        assert!(all.regions.len() > 2 && !all.saddles.is_empty() && grid.bricks[2] > 10);
        for layers in [1, 2, 3, 7] {
            let found = by_slabs(&grid, &distance, layers);
            let mut pairs: BTreeMap<u32, u32> = BTreeMap::new();
            for brick in 0..grid.len() {
                for v in 0..CELLS {
                    let (a, b) = (all.labels.get(&grid, brick, v), found.labels.get(&grid, brick, v));
                    assert_eq!(*pairs.entry(a).or_insert(b), b, "{layers} layers");
                }
            }
            assert_eq!(found.regions.len(), all.regions.len());
            assert_eq!(pairs.remove(&NONE), Some(NONE));
            for (&a, &b) in &pairs {
                assert_eq!(all.regions[a as usize], found.regions[b as usize]);
            }
            let key = |(a, b): (u32, u32)| (a.min(b), a.max(b));
            let told = |s: &Saddle, of: &dyn Fn(u32) -> u32| (key((of(s.pair.0), of(s.pair.1))), s.level, s.faces as u64);
            let mut expected: Vec<_> = all.saddles.iter().map(|s| told(s, &|l| pairs[&l])).collect();
            expected.sort_unstable();
            let mut met: Vec<_> = found.saddles.iter().map(|s| told(s, &|l| l)).collect();
            met.sort_unstable();
            assert_eq!(met, expected, "{layers} layers");
        }
    }
}
