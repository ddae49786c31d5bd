//! Shafts: whether portals inside the convex hull of two cells' portals join the cells.
//!
//! Based on: Haines, Wallace, *Shaft culling for efficient ray-traced radiosity*, 1991: planes around the hull of two boxes, each parallel to
//! an axis. Here a shaft is crossed by a flood from portal to portal. If it does not reach the other cell, no line joins the two. If it
//! does, the portals of both cells that it used have a narrower shaft, and so on. That hides more than nine in ten of a game level's
//! hidden pairs, at a microsecond each.

use super::bundle::{LANES, Lanes, are_cut_off};
use super::might_see::{MightSee, from_rows, get, set};
use super::net::Net;
use crate::BitMatrix;
use crate::math::geom::Aabb;
use crate::math::simd::dispatch;
use pulp::Simd;

/// Most floods for one pair. More: pairs that are hidden only by more than one corner take longer, and few of them end here.
const TURNS: usize = 4;

/// Growth of a portal's box, in [`super::window::Slack::strict`]. Smaller than 2: a portal in a face of the shaft would count as outside.
const GROWTH: f64 = 4.0;

/// Planes around the hull of two boxes: four for each axis that they are parallel to, one for each diagonal across it. A diagonal without
/// a plane has one at infinity.
type Planes = [Lanes; 3];

/// Cells x directed portals: the portals that may come before one that leads into the cell, for the cells of `goals`, a row of bits.
pub(super) fn before_cells(net: &Net, might_see: &MightSee, goals: &[u64]) -> BitMatrix {
    let fill = |(): &mut (), cell: usize, row: &mut [u64]| {
        for p in net.out(cell).filter(|_| get(goals, cell)) {
            row.iter_mut().zip(might_see.before(net.twin[p] as usize)).for_each(|(a, b)| *a |= b);
        }
    };
    from_rows(net.cells, net.portals(), || (), fill)
}

/// Most words of 64 portals for the ways from one cell. More: memory of each thread. Fewer: searches go where no goal is.
const MOST_WORDS: usize = 1 << 21;

/// The portals on the ways from one cell to others.
#[derive(Default)]
pub struct Ways {
    words: usize,
    rows: Vec<u64>,
    /// For each cell, the number of its row, from 1 on; 0: unknown.
    row: Vec<u32>,
    /// The cells with rows.
    cells: Vec<u32>,
}

impl Ways {
    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.cells.drain(..).for_each(|cell| self.row[cell as usize] = 0);
        self.rows.clear();
    }

    /// Adds what the shafts found to `goal`.
    pub(super) fn add(&mut self, shafts: &Shafts<'_>, goal: usize) {
        self.words = shafts.allowed.len();
        self.row.resize(shafts.net.cells, 0);
        if self.rows.len() + self.words <= MOST_WORDS {
            self.rows.extend_from_slice(&shafts.allowed);
            self.cells.push(goal as u32);
            self.row[goal] = self.cells.len() as u32;
        }
    }

    /// The portals on the way to a cell, as bits.
    #[inline(always)]
    pub(super) fn of(&self, cell: usize) -> Option<&[u64]> {
        let row = (*self.row.get(cell)? as usize).checked_sub(1)?;
        self.rows.get(row * self.words..(row + 1) * self.words)
    }
}

/// Scratch memory of shafts from one cell.
pub(super) struct Shafts<'n> {
    net: &'n Net,
    might_see: &'n MightSee,
    before: &'n BitMatrix,
    cell: usize,
    /// Portals that may come after one that leads out of the cell, as bits.
    after: Vec<u64>,
    /// Portals that may be crossed, as bits; those that the current flood has not tested yet, and those that it has crossed.
    allowed: Vec<u64>,
    left: Vec<u64>,
    crossed: Vec<u64>,
    queue: Vec<u32>,
    /// Portals of the cell, and portals into the other one, that lines between the two may cross.
    pub ends: [Vec<u32>; 2],
}

/// A question, compiled for several vector units and dispatched at run time.
struct Question<'s, 'n> {
    shafts: &'s mut Shafts<'n>,
    goal: usize,
}

impl pulp::WithSimd for Question<'_, '_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        self.shafts.ask(simd, self.goal)
    }
}

impl<'n> Shafts<'n> {
    /// Shafts over one net; `before` as [`before_cells`] of the same pairs, for all cells that are asked.
    pub fn new(net: &'n Net, might_see: &'n MightSee, before: &'n BitMatrix) -> Self {
        let (cell, after, allowed, left, crossed, queue, ends) = Default::default();
        Self { net, might_see, before, cell, after, allowed, left, crossed, queue, ends }
    }

    /// Begins the shafts from `cell`.
    pub fn start(&mut self, cell: usize) {
        self.cell = cell;
        self.after.clear();
        self.after.resize(self.net.portals().div_ceil(64), 0);
        for p in self.net.out(cell) {
            self.after.iter_mut().zip(self.might_see.row(p)).for_each(|(a, b)| *a |= b);
        }
    }

    /// False if no line goes from the cell to `goal`, which is no neighbour. Otherwise `ends` are set.
    pub fn reach(&mut self, goal: usize) -> bool {
        dispatch(Question { shafts: self, goal })
    }

    #[inline(always)]
    fn ask<S: Simd>(&mut self, simd: S, goal: usize) -> bool {
        let (net, before) = (self.net, self.before.row(goal));
        self.allowed.clear();
        self.allowed.extend(self.after.iter().zip(before).map(|(a, b)| a & b));
        let [mut here, mut there] = [Aabb::EMPTY; 2];
        for q in net.out(goal).map(|q| net.twin[q] as usize) {
            if get(&self.after, q) {
                set(&mut self.allowed, q);
                there = there.union(net.bounds(q).grown(GROWTH * net.slack.strict));
            }
        }
        for p in net.out(self.cell) {
            if get(before, p) {
                set(&mut self.allowed, p);
                here = here.union(net.bounds(p).grown(GROWTH * net.slack.strict));
            }
        }
        for _ in 0..TURNS {
            if here.is_empty() || there.is_empty() {
                return false;
            }
            self.flood(simd, &here.union(there), &hull(here, there));
            let last = [here, there];
            [here, there] = self.ends(goal);
            if last == [here, there] {
                break;
            }
        }
        !here.is_empty() && !there.is_empty()
    }

    /// Crosses allowed portals inside the shaft, from those of the cell on.
    #[inline(always)]
    fn flood<S: Simd>(&mut self, simd: S, around: &Aabb, planes: &Planes) {
        let net = self.net;
        self.left.clear();
        self.left.extend_from_slice(&self.allowed);
        self.crossed.clear();
        self.crossed.resize(self.left.len(), 0);
        for p in net.out(self.cell) {
            if get(&self.left, p) {
                self.left[p / 64] &= !(1 << (p % 64));
                set(&mut self.crossed, p);
                self.queue.push(p as u32);
            }
        }
        while let Some(last) = self.queue.pop() {
            for &(word, mask) in net.next(last as usize) {
                let word = word as usize;
                let mut ways = self.left[word] & mask;
                self.left[word] &= !mask; // once is enough
                while ways != 0 {
                    let p = word * 64 + ways.trailing_zeros() as usize;
                    ways &= ways - 1;
                    if !net.bounds(p).misses(around) && !are_cut_off(simd, planes, net.bounds(p), net.window(p)) {
                        set(&mut self.crossed, p);
                        self.queue.push(p as u32);
                    }
                }
            }
        }
    }

    /// Keeps the crossed portals from which `goal` is reached, as allowed ones, and the boxes around those of both cells.
    #[inline(always)]
    fn ends(&mut self, goal: usize) -> [Aabb; 2] {
        let net = self.net;
        let growth = GROWTH * net.slack.strict;
        let [mut here, mut there] = [Aabb::EMPTY; 2];
        self.ends.iter_mut().for_each(Vec::clear);
        self.allowed.fill(0);
        for q in net.out(goal).map(|q| net.twin[q] as usize) {
            if get(&self.crossed, q) {
                self.crossed[q / 64] &= !(1 << (q % 64));
                set(&mut self.allowed, q);
                there = there.union(net.bounds(q).grown(growth));
                self.ends[1].push(q as u32);
                self.queue.push(q as u32);
            }
        }
        // Lines can be reversed: what may follow the twin leads back.
        while let Some(last) = self.queue.pop() {
            for &(word, mask) in net.next(net.twin[last as usize] as usize) {
                let mut ways = mask;
                while ways != 0 {
                    let back = word as usize * 64 + ways.trailing_zeros() as usize;
                    ways &= ways - 1;
                    let p = net.twin[back] as usize;
                    if get(&self.crossed, p) {
                        self.crossed[p / 64] &= !(1 << (p % 64));
                        set(&mut self.allowed, p);
                        self.queue.push(p as u32);
                    }
                }
            }
        }
        for p in net.out(self.cell) {
            if get(&self.allowed, p) {
                here = here.union(net.bounds(p).grown(growth));
                self.ends[0].push(p as u32);
            }
        }
        [here, there]
    }
}

/// The planes around the hull of two boxes, apart from the faces of the box around both: through two corners, where along a diagonal of
/// two axes one box reaches farther on one axis and the other on the other.
#[inline(always)]
fn hull(a: Aabb, b: Aabb) -> Planes {
    let ends = [[a.min.to_array(), a.max.to_array()], [b.min.to_array(), b.max.to_array()]];
    let mut planes = [[[0.0; LANES]; 4]; 3];
    for (axis, group) in planes.iter_mut().enumerate() {
        let (i, k) = ((axis + 1) % 3, (axis + 2) % 3);
        group[3] = [f64::INFINITY; LANES];
        for (lane, [side_i, side_k]) in [[0, 0], [0, 1], [1, 0], [1, 1]].into_iter().enumerate() {
            let signs = [[-1.0, 1.0][side_i], [-1.0, 1.0][side_k]];
            let [from, to] = [[ends[0][side_i][i], ends[0][side_k][k]], [ends[1][side_i][i], ends[1][side_k][k]]];
            let farther = [(to[0] - from[0]) * signs[0], (to[1] - from[1]) * signs[1]];
            if farther[0] * farther[1] < 0.0 {
                let scale = 1.0 / (farther[0] * farther[0] + farther[1] * farther[1]).sqrt();
                let n = [signs[0] * farther[1].abs() * scale, signs[1] * farther[0].abs() * scale];
                (group[i][lane], group[k][lane]) = (n[0], n[1]);
                group[3][lane] = (n[0] * from[0] + n[1] * from[1]).max(n[0] * to[0] + n[1] * to[1]);
            }
        }
    }
    planes
}

#[cfg(test)]
mod tests {
    use super::super::might_see::tests::row;
    use super::super::net::NetPortal;
    use super::*;
    use crate::math::bits;
    use crate::math::geom::Plane;
    use crate::math::random::SplitMix;
    use glam::DVec3;

    /// The goals that shafts from a cell leave open, each with the portals on its ways.
    fn open(net: &Net, cell: usize) -> Vec<(usize, Vec<usize>)> {
        let might_see = MightSee::new(net);
        let before = before_cells(net, &might_see, &vec![u64::MAX; net.cells.div_ceil(64)]);
        let (mut shafts, mut ways) = (Shafts::new(net, &might_see, &before), Ways::default());
        shafts.start(cell);
        let apart = |goal: &usize| *goal != cell && net.out(cell).all(|p| net.target[p] as usize != *goal);
        let goals: Vec<usize> = (0..net.cells).filter(apart).filter(|&goal| shafts.reach(goal)).collect();
        for &goal in &goals {
            assert!(shafts.reach(goal));
            ways.add(&shafts, goal);
        }
        goals.into_iter().map(|goal| (goal, bits::ones(ways.of(goal).unwrap()).collect())).collect()
    }

    #[test]
    fn a_door_beside_the_hull_of_two_others_hides() {
        // Doors 1 m high in a row. From 0..1 at the first to 2.5..3.5 at the third, lines pass the second at 1.25..2.25.
        let goals = |low: &[f64]| open(&row(low), 0).into_iter().map(|(goal, _)| goal).collect::<Vec<_>>();
        assert_eq!(goals(&[0.0, 0.0, 2.5, 0.0]), [2]);
        assert_eq!(goals(&[0.0, 1.5, 2.5, 0.0]), [2, 3]);
        assert_eq!(goals(&[0.0, 0.0, 0.0, 0.0]), [2, 3, 4]);
    }

    #[test]
    fn ways_are_the_portals_between() {
        let net = row(&[0.0; 4]);
        let forwards: Vec<usize> = (0..net.portals()).filter(|&p| net.source[p] < net.target[p]).collect();
        for (goal, ways) in open(&net, 0) {
            assert_eq!(ways, forwards[..goal], "{goal}");
        }
        let mut ways = Ways::default();
        assert!(ways.of(0).is_none() && ways.of(99).is_none());
        ways.clear();
    }

    /// Rooms of 1 m in a square, with a door of random size in most walls.
    fn rooms(side: u32, seed: u64) -> Net {
        let mut random = SplitMix::new(seed);
        let mut portals = Vec::new();
        for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
            for (dx, dy) in [(1, 0), (0, 1)] {
                let (low, size) = (random.unit() * 0.5, 0.1 + 0.4 * random.unit());
                if x + dx < side && y + dy < side && random.unit() < 0.9 {
                    let corner = |along: f64, z: f64| {
                        let along = low + size * along;
                        let (x, y) = (f64::from(x), f64::from(y));
                        if dx == 1 { DVec3::new(x + 1.0, y + along, z) } else { DVec3::new(x + 1.0 - along, y + 1.0, z) }
                    };
                    let n = if dx == 1 { DVec3::X } else { DVec3::Y };
                    let winding = [corner(0.0, low), corner(1.0, low), corner(1.0, low + size), corner(0.0, low + size)];
                    portals.push(([x * side + y, (x + dx) * side + y + dy], Plane { n, d: n.dot(winding[0]) }, winding));
                }
            }
        }
        let portals: Vec<NetPortal<'_>> =
            portals.iter().map(|(cells, plane, winding)| NetPortal { cells: *cells, plane: *plane, winding }).collect();
        Net::new((side * side) as usize, &portals, 1e-6)
    }

    /// What a random line passes is on the ways from each of its cells to each later one.
    #[test]
    fn no_line_is_lost() {
        let net = rooms(8, 3);
        let open: Vec<_> = (0..net.cells).map(|cell| open(&net, cell)).collect();
        let hidden = open.iter().map(|goals| net.cells - goals.len()).sum::<usize>();
        let (mut random, mut passed) = (SplitMix::new(7), 0);
        let mut unit = || DVec3::new(random.unit(), random.unit(), random.unit()) - 0.5;
        for first in (0..net.portals()).cycle().take(40_000) {
            let middle = net.window(first).middle() + 0.4 * unit();
            let line = [middle, middle + unit() * DVec3::new(1.0, 1.0, 0.2)];
            let hit = |p: usize| {
                let along = net.plane(p)?.n.dot(line[1] - line[0]);
                let at = net.window(p).met_by(line).filter(|_| along > 1e-6)?;
                Some(((at - line[0]).dot((line[1] - line[0]).normalize()), p))
            };
            let mut chain: Vec<(f64, usize)> = hit(first).into_iter().collect();
            while let Some(&(t, last)) = chain.last() {
                let next = net.out(net.target[last] as usize).filter_map(hit).filter(|&(s, _)| s > t + 1e-6);
                let Some(next) = next.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
                chain.push(next);
            }
            for (i, k) in (0..chain.len()).flat_map(|i| (i + 1..chain.len()).map(move |k| (i, k))) {
                let (from, to) = (net.source[chain[i].1] as usize, net.target[chain[k].1] as usize);
                let ways = open[from].iter().find(|(goal, _)| *goal == to).map(|(_, ways)| ways);
                assert!(ways.is_some_and(|ways| chain[i..=k].iter().all(|(_, p)| ways.contains(p))), "{from} {to}");
                passed += 1;
            }
        }
        assert!(passed > 1000 && hidden > 1000, "{passed} {hidden}");
    }
}
