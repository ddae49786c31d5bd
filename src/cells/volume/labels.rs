//! A label for each voxel, packed: bricks of one label take one number, others a palette and as few bits a voxel as it needs.

use super::distance::Levels;
use super::grid::{CELLS, Grid, SIDE, place_of, voxel};
use crate::parallel;
use glam::DVec3;

/// No region: occupied, or inside solid matter.
pub const NONE: u32 = u32::MAX;
/// Solid matter that reaches the rim: what lies around a level that has no outside.
pub const VOID: u32 = u32::MAX - 1;

/// Labels of all voxels.
pub struct Labels {
    /// Of bricks that aren't detailed.
    bricks: Vec<u32>,
    /// Of detailed bricks, in order.
    parts: Vec<Packed>,
}

/// Consecutive detailed bricks.
struct Packed {
    /// The first.
    first: usize,
    /// Where the palette of each begins in `data`, and the end of the last.
    start: Vec<u32>,
    /// Palettes, each followed by the choices of its brick's voxels; those of occupied ones mean nothing.
    data: Vec<u32>,
}

/// The palette of each of some bricks, and the choices of its voxels.
type Brick<'b> = dyn Fn(usize) -> (Vec<u32>, [u8; CELLS]) + Sync + 'b;

impl Packed {
    /// From a palette for each of `count` bricks and the choice of each voxel; [`u8::MAX`] for none.
    fn new(first: usize, count: usize, brick: &Brick<'_>) -> Self {
        const CHUNK: usize = 64;
        let pack_all = |chunk: usize| {
            let (mut ends, mut data) = (Vec::new(), Vec::new());
            for i in chunk * CHUNK..((chunk + 1) * CHUNK).min(count) {
                let (palette, choice) = brick(i);
                pack(&palette, &choice, &mut data);
                ends.push(data.len() as u32);
            }
            (ends, data)
        };
        let mut out = Self { first, start: vec![0], data: Vec::new() };
        for (ends, data) in parallel::map_range(0..count.div_ceil(CHUNK), pack_all) {
            let base = out.data.len() as u32;
            out.start.extend(ends.into_iter().map(|e| base + e));
            out.data.extend(data);
        }
        out.data.shrink_to_fit();
        out
    }

    /// The palette of one, and the choices.
    #[inline]
    fn get(&self, i: usize) -> (&[u32], &[u32]) {
        let all = &self.data[self.start[i] as usize..self.start[i + 1] as usize];
        all.split_at(palette_of(all.len()))
    }

    /// Other labels in place of these.
    fn map(&mut self, of: &(impl Fn(u32) -> u32 + Sync)) {
        let unpack = |i: usize| {
            let (palette, choices) = self.get(i);
            let of = |&l: &u32| if l == NONE { NONE } else { of(l) };
            (palette.iter().map(of).collect(), std::array::from_fn(|v| choice(palette, choices, v) as u8))
        };
        *self = Self::new(self.first, self.start.len() - 1, &unpack);
    }
}

/// A face between two free voxels of different labels.
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

/// Bits that a choice from a palette takes.
fn bits(palette: usize) -> usize {
    match palette {
        0..=1 => 0,
        2 => 1,
        3..=4 => 2,
        5..=16 => 4,
        _ => 8,
    }
}

/// How long the palette is, of a palette and its choices.
fn palette_of(length: usize) -> usize {
    match length {
        0..=1 => length,
        2..=18 => length - 16,
        19..=36 => length - 32,
        37..=80 => length - 64,
        _ => length - 128,
    }
}

/// A palette and its choices, appended; each label is kept once. Choices of [`u8::MAX`] are none.
fn pack(palette: &[u32], choice: &[u8; CELLS], data: &mut Vec<u32>) {
    let first = data.len();
    let place: Vec<u32> = palette
        .iter()
        .map(|l| {
            let at = data[first..].iter().position(|k| k == l).unwrap_or(data.len() - first);
            if first + at == data.len() {
                data.push(*l);
            }
            at as u32
        })
        .collect();
    let bits = bits(data.len() - first);
    let words = data.len();
    data.resize(words + CELLS * bits / 32, 0);
    if let Some(each) = 32usize.checked_div(bits) {
        for (v, &c) in choice.iter().enumerate().filter(|(_, c)| **c != u8::MAX) {
            data[words + v / each] |= place[c as usize] << (v % each * bits);
        }
    }
}

impl Labels {
    /// No brick is labelled yet.
    pub fn new(grid: &Grid) -> Self {
        Self { bricks: vec![NONE; grid.len()], parts: Vec::new() }
    }

    /// Labels a brick that isn't detailed.
    pub fn set_brick(&mut self, brick: usize, label: u32) {
        self.bricks[brick] = label;
    }

    /// Labels the next `count` detailed bricks: the choice of each voxel from a palette of its brick; [`u8::MAX`] for none.
    pub fn append(&mut self, count: usize, brick: &Brick<'_>) {
        let first = self.parts.last().map_or(0, |p| p.first + p.start.len() - 1);
        self.parts.push(Packed::new(first, count, brick));
    }

    /// The palette of a detailed brick, and the choices.
    #[inline]
    fn of_detail(&self, detail: usize) -> (&[u32], &[u32]) {
        let part = &self.parts[self.parts.partition_point(|p| p.first <= detail) - 1];
        part.get(detail - part.first)
    }

    /// The label of a voxel.
    #[inline]
    pub fn get(&self, grid: &Grid, brick: usize, voxel: usize) -> u32 {
        match grid.detail(brick) {
            Some(d) if grid.is_occupied(d, voxel) => NONE,
            Some(d) => {
                let (palette, choices) = self.of_detail(d);
                palette[choice(palette, choices, voxel)]
            }
            None => self.bricks[brick],
        }
    }

    /// The label of a whole brick, where it isn't detailed.
    pub fn whole(&self, grid: &Grid, brick: usize) -> Option<u32> {
        grid.detail(brick).is_none().then(|| self.bricks[brick])
    }

    /// The label of all free voxels of a brick, where they have but one.
    pub fn only(&self, grid: &Grid, brick: usize) -> Option<u32> {
        match grid.detail(brick) {
            Some(d) => match self.of_detail(d).0 {
                [] => Some(NONE),
                [only] => Some(*only),
                _ => None,
            },
            None => Some(self.bricks[brick]),
        }
    }

    /// Other labels in place of these.
    pub fn map(&mut self, of: impl Fn(u32) -> u32 + Sync) {
        parallel::for_each_mut(&mut self.bricks, |_, l| {
            if *l != NONE {
                *l = of(*l);
            }
        });
        self.parts.iter_mut().for_each(|part| part.map(&of));
    }

    /// The same for the detailed bricks that were labelled last but one time ago.
    pub fn map_last_but_one(&mut self, of: impl Fn(u32) -> u32 + Sync) {
        if let [.., part, _] = &mut self.parts[..] {
            part.map(&of);
        }
    }

    /// Visits the faces between a brick's free voxels of different labels, and those to the bricks on its upper sides (to all
    /// its sides where this brick has voxels and the other none).
    pub fn contacts(&self, grid: &Grid, levels: Option<&Levels<'_>>, brick: usize, visit: &mut impl FnMut(VoxelFace)) {
        let level = |b: usize, d: Option<usize>, v: usize| levels.map_or(0, |l| l.get(b, d, v));
        let corner = grid.corner(brick);
        let detail = grid.detail(brick);
        let only = self.only(grid, brick);
        for axis in 0..3 {
            if let (Some(d), None) = (detail, only) {
                let stride = SIDE.pow(axis as u32);
                for v in 0..CELLS {
                    let place = place_of(v);
                    if place[axis] + 1 == SIDE || grid.is_occupied(d, v) || grid.is_occupied(d, v + stride) {
                        continue;
                    }
                    let labels = [self.get(grid, brick, v), self.get(grid, brick, v + stride)];
                    if labels[0] != labels[1] && !labels.contains(&NONE) {
                        let mut at = corner + DVec3::from_array(place.map(|c| c as f64 + 0.5));
                        at[axis] += 0.5;
                        let level = level(brick, detail, v).min(level(brick, detail, v + stride));
                        visit(VoxelFace { labels, level, at, axis });
                    }
                }
            }
            for up in [true, false] {
                let mut step = [0i64; 3];
                step[axis] = if up { 1 } else { -1 };
                let Some(other) = grid.beside(brick, step) else { continue };
                let beyond = grid.detail(other);
                if (up && detail.is_none() && beyond.is_some()) || (!up && (detail.is_none() || beyond.is_some())) {
                    continue;
                }
                if only.is_some() && only == self.only(grid, other) {
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
                    if labels[0] != labels[1] && !labels.contains(&NONE) {
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

/// Which of the palette.
#[inline]
fn choice(palette: &[u32], choices: &[u32], voxel: usize) -> usize {
    match bits(palette.len()) {
        0 => 0,
        bits => {
            let each = 32 / bits;
            (choices[voxel / each] >> (voxel % each * bits)) as usize & ((1 << bits) - 1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    /// Whatever the palette's length, what is packed is what was given; mapped labels that are the same are kept once.
    #[test]
    fn what_is_packed_is_what_was_given() {
        // Many triangles in a row, each in bricks of its own.
        let triangle = |i: usize| [0.0, 0.3, 0.7].map(|x| DVec3::new(8.0 * i as f64 + x, x * x, 0.5 * x));
        let triangles: Vec<[DVec3; 3]> = (0..40).map(triangle).collect();
        let grid = Grid::new(&triangles, DVec2::X, 1.0);
        let count = grid.occupied.len();
        let lengths = [1usize, 2, 3, 4, 5, 16, 17, 80, 254];
        let given: Vec<(Vec<u32>, [u8; CELLS])> = (0..count)
            .map(|d| {
                let n = lengths[d % lengths.len()];
                let palette = (0..n as u32).map(|k| 1000 * d as u32 + k).collect();
                let choice = |v: usize| if grid.is_occupied(d, v) { u8::MAX } else { ((v * 7 + d) % n) as u8 };
                (palette, std::array::from_fn(choice))
            })
            .collect();
        let mut labels = Labels::new(&grid);
        let (first, rest) = given.split_at(count / 3);
        labels.append(first.len(), &|i| first[i].clone());
        labels.append(rest.len(), &|i| rest[i].clone());
        let expected = |d: usize, v: usize| match given[d].1[v] {
            u8::MAX => NONE,
            c => given[d].0[c as usize],
        };
        let all = || (0..count).flat_map(|d| (0..CELLS).map(move |v| (d, v)));
        assert!(count >= lengths.len());
        for (d, v) in all() {
            assert_eq!(labels.get(&grid, grid.brick_of[d] as usize, v), expected(d, v));
        }
        let words = |labels: &Labels| labels.parts.iter().map(|p| p.data.len()).sum::<usize>();
        let before = words(&labels);
        labels.map(|l| l % 3);
        assert!(words(&labels) < before);
        for (d, v) in all() {
            let was = expected(d, v);
            let is = if was == NONE { NONE } else { was % 3 };
            assert_eq!(labels.get(&grid, grid.brick_of[d] as usize, v), is);
        }
    }
}
