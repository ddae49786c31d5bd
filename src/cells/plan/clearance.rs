//! Gates: how wide and how high the openings between pieces are, and how wide and high the pieces themselves.
//!
//! Both are measured where people would: in plan, as twice the way to the nearest wall that stands at that height; upwards, from
//! floor to ceiling through whatever open cuts lie between. A gate that is nearly as wide and as high as what lies on both of its
//! sides parts nothing; a doorway is narrower, a window lower, and a slit under a roof is as wide as the room and lower.

use crate::cells::complex::HumanScale;
use crate::cells::complex::arrange::Plan;
use crate::cells::complex::bands::Cut;
use crate::cells::complex::columns::Columns;
use crate::cells::complex::coverage::{Open, points};
use crate::cells::complex::faces::{Face, Surface};
use crate::cells::complex::facets::Facets;
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::voids::{LEDGE, STANDING};
use crate::geom::Aabb;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// How far it is to the nearest wall.
pub(in crate::cells) struct Clearance {
    walls: Vec<Standing>,
    /// Walls by place in plan and by height, so that a tower's other storeys aren't looked at: those of cell `i` of the grid are
    /// `of_cell[first[i]..first[i + 1]]`.
    of_cell: Vec<u32>,
    first: Vec<u32>,
    low: [i64; 3],
    size: [i64; 3],
    cell: f64,
}

/// A closed face on a wall.
struct Standing {
    ends: (DVec2, DVec2),
    heights: (f64, f64),
}

impl Clearance {
    /// Walls farther than this many metres don't count.
    const FAR: i64 = 8;
    /// About as many cells of the grid at most, in plan. Fewer: in a campus a cell holds walls by the hundred; more: memory.
    const MOST: f64 = 512.0 * 512.0;

    pub(in crate::cells) fn new(faces: &[Face], facets: &Facets, human: HumanScale) -> Self {
        let (none, size) = (Vec::new(), [0; 3]);
        let across = Aabb::of(facets.wall_facets.iter().flat_map(|f| f.corners)).size().max(DVec3::ZERO);
        let cell = human.metre.max((across.x * across.z / Self::MOST).sqrt());
        let mut all = Self { walls: Vec::new(), of_cell: none.clone(), first: none, low: size, size, cell };
        let mut places: Vec<([i64; 3], u32)> = Vec::new();
        for f in faces {
            let Surface::Wall(w) = f.surface else {
                continue;
            };
            if f.open_area > 0.5 * f.area {
                continue;
            }
            let wall = &facets.walls[w as usize];
            let (lo, hi) = extent(&f.polygon);
            let ends = (wall.at(lo.x), wall.at(hi.x));
            let steps = (ends.0.distance(ends.1) / (0.5 * all.cell)).ceil().max(1.0) as usize;
            let mut cells: Vec<(i64, i64)> =
                (0..=steps).map(|s| all.cell_of(ends.0.lerp(ends.1, s as f64 / steps as f64))).collect();
            cells.dedup();
            for (x, y) in cells {
                places.extend(all.bins(lo.y, hi.y).map(|h| ([h, x, y], all.walls.len() as u32)));
            }
            all.walls.push(Standing { ends, heights: (lo.y, hi.y) });
        }
        if places.is_empty() {
            return all;
        }
        all.low = std::array::from_fn(|k| places.iter().map(|p| p.0[k]).min().unwrap_or_default());
        all.size = std::array::from_fn(|k| places.iter().map(|p| p.0[k] - all.low[k] + 1).max().unwrap_or_default());
        places.sort_unstable();
        all.first = vec![0; (all.size[0] * all.size[1] * all.size[2]) as usize + 1];
        for (place, wall) in places {
            if let Some(i) = all.index(place) {
                all.first[i + 1] += 1;
                all.of_cell.push(wall);
            }
        }
        for i in 1..all.first.len() {
            all.first[i] += all.first[i - 1];
        }
        all
    }

    /// The number of a cell of the grid, in the order of its place.
    fn index(&self, place: [i64; 3]) -> Option<usize> {
        let at: [i64; 3] = std::array::from_fn(|k| place[k] - self.low[k]);
        let inside = (0..3).all(|k| (0..self.size[k]).contains(&at[k]));
        inside.then(|| ((at[0] * self.size[1] + at[1]) * self.size[2] + at[2]) as usize)
    }

    /// The walls of a cell of the grid.
    fn walls_at(&self, place: [i64; 3]) -> &[u32] {
        self.index(place).map_or(&[], |i| &self.of_cell[self.first[i] as usize..self.first[i + 1] as usize])
    }

    fn cell_of(&self, q: DVec2) -> (i64, i64) {
        let c = (q / self.cell).floor();
        (c.x as i64, c.y as i64)
    }

    /// The parts of the grid between two heights.
    fn bins(&self, low: f64, high: f64) -> std::ops::RangeInclusive<i64> {
        let bin = |y: f64| (y / (4.0 * self.cell)).floor() as i64;
        bin(low)..=bin(high)
    }

    /// Metres from a point of the plan to the nearest wall that stands between two heights.
    fn at(&self, q: DVec2, low: f64, high: f64) -> f64 {
        let (cx, cy) = self.cell_of(q);
        let mut best = Self::FAR as f64 * self.cell;
        for ring in 0..=Self::FAR {
            // A wall registered `ring` cells away is at least `ring - 1.5` cells off.
            if (ring as f64 - 1.5) * self.cell > best {
                break;
            }
            for x in cx - ring..=cx + ring {
                let step = if (x - cx).abs() == ring { 1 } else { (2 * ring).max(1) };
                let mut y = cy - ring;
                while y <= cy + ring {
                    for &w in self.bins(low, high).flat_map(|h| self.walls_at([h, x, y])) {
                        let w = &self.walls[w as usize];
                        if w.heights.0 < high && low < w.heights.1 {
                            let (a, d) = (w.ends.0, w.ends.1 - w.ends.0);
                            let t = ((q - a).dot(d) / d.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                            best = best.min(q.distance(a + d * t));
                        }
                    }
                    y += step;
                }
            }
        }
        best
    }
}

/// The middle half of a range: walls that only graze a height don't narrow what is there.
fn middle_half(low: f64, high: f64) -> (f64, f64) {
    (low + 0.25 * (high - low), low + 0.75 * (high - low))
}

/// For each piece, how wide the space around its middle is, metres: twice the way to the nearest wall that stands at its height,
/// at most twice its own height.
pub(in crate::cells) fn widths(plan: &Plan, columns: &Columns, clearance: &Clearance) -> Vec<f64> {
    (0..columns.pieces() as u32)
        .into_par_iter()
        .map(|p| {
            let (column, _) = columns.of_piece(p);
            let q = plan.triangles[column].map(|i| plan.points[i as usize]);
            // The middle of an edge that no wall is on may be the middle of the room, as in one of two triangles.
            let edges = (0..3).filter(|&e| !plan.constrained[column][e]).map(|e| (q[e] + q[(e + 1) % 3]) * 0.5);
            let (floor, ceiling) = columns.heights(p);
            let (low, high) = (floor.iter().sum::<f64>() / 3.0, ceiling.iter().sum::<f64>() / 3.0);
            let (a, b) = middle_half(low, high);
            let clear = edges.chain([(q[0] + q[1] + q[2]) / 3.0]).map(|p| clearance.at(p, a, b)).fold(0.0, f64::max);
            (2.0 * clear).min(2.0 * (high - low))
        })
        .collect()
}

/// What of each column is open from floor to ceiling.
pub(in crate::cells) struct Runs {
    /// The lowest piece of the run that each piece is part of.
    pub(in crate::cells) of_piece: Vec<u32>,
    /// How high the run of each piece is, metres.
    pub(in crate::cells) heights: Vec<f64>,
    /// Height of the floor under the run of each piece, metres.
    pub(in crate::cells) floors: Vec<f64>,
}

impl Runs {
    /// Runs end at closed cuts and at storeys' levels.
    pub(in crate::cells) fn new(columns: &Columns, faces: &[Face]) -> Self {
        let mut runs = DisjointSets::new(columns.pieces());
        let through = |f: &&Face| matches!(f.surface, Surface::Cut(Cut::Sheet(_))) && f.open_area > 0.5 * f.area;
        for f in faces.iter().filter(through) {
            runs.join(f.a, f.b);
        }
        let mut sums = vec![0.0; columns.pieces()];
        for p in 0..columns.pieces() as u32 {
            let (floor, ceiling) = columns.heights(p);
            sums[runs.find(p) as usize] += (0..3).map(|i| ceiling[i] - floor[i]).sum::<f64>() / 3.0;
        }
        let of_piece: Vec<u32> = (0..columns.pieces() as u32).map(|p| runs.find(p)).collect();
        let heights = of_piece.iter().map(|&r| sums[r as usize]).collect();
        let floors = of_piece.iter().map(|&r| columns.heights(r).0.iter().sum::<f64>() / 3.0).collect();
        Self { of_piece, heights, floors }
    }
}

/// An opening between two pieces.
#[derive(Clone, Copy, Debug)]
pub(in crate::cells) struct Gate {
    /// How wide the opening is that the face is part of, metres; 0: never a reason to merge.
    pub(in crate::cells) width: f64,
    /// How high, metres; infinite for those in floors.
    pub(in crate::cells) height: f64,
    /// A wall or lintel lies on part of the face.
    pub(in crate::cells) framed: bool,
    /// A leaf or a pane fills it: rooms end there, however wide it is.
    pub(in crate::cells) leaf: bool,
    /// It leads to the top of something that nobody gets onto: a plenum is as high as the gate over the wall of a room without
    /// a ceiling, and yet no part of that room.
    pub(in crate::cells) ledge: bool,
}

fn extent(polygon: &[DVec2]) -> (DVec2, DVec2) {
    polygon.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |a, p| (a.0.min(*p), a.1.max(*p)))
}

/// Where an upright face begins and ends in plan.
pub(in crate::cells) fn ends(f: &Face, plan: &Plan, facets: &Facets) -> Option<(DVec2, DVec2)> {
    let (lo, hi) = extent(&f.polygon);
    match f.surface {
        Surface::Wall(w) => Some((facets.walls[w as usize].at(lo.x), facets.walls[w as usize].at(hi.x))),
        Surface::Edge { triangle, edge } => {
            let t = plan.triangles[triangle as usize];
            let [a, b] = [t[edge as usize], t[(edge as usize + 1) % 3]].map(|i| plan.points[i as usize]);
            let along = (b - a).normalize_or_zero();
            Some((a + along * lo.x, a + along * hi.x))
        }
        Surface::Cut(_) => None,
    }
}

/// The box around the largest open part of a face.
fn open_extent(f: &Face) -> (DVec2, DVec2) {
    match &f.open {
        Open::Whole => extent(&f.polygon),
        Open::Parts(parts) => {
            let boxes = parts.iter().filter_map(|s| s.first()).map(|outer| extent(&points(outer)));
            let size = |e: &(DVec2, DVec2)| (e.1 - e.0).x * (e.1 - e.0).y;
            boxes.max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or((DVec2::ZERO, DVec2::ZERO))
        }
    }
}

/// The gate of each face. What is open between two runs is one opening, over all the cuts between; openings of one wall that
/// touch along it are one opening; where nothing frames it, a gate is as wide as the space around its middle, however short the
/// edge of the triangulation that it lies on; but not in torn columns, where a vault may be open that isn't.
#[allow(clippy::too_many_arguments)]
pub(in crate::cells) fn gates(
    faces: &[Face],
    plan: &Plan,
    columns: &Columns,
    facets: &Facets,
    clearance: &Clearance,
    runs: &Runs,
    human: HumanScale,
    seal: f64,
) -> Vec<Gate> {
    let framed = |f: &Face| f.open_area < 0.98 * f.area;
    let extents: Vec<(DVec2, DVec2)> = faces.iter().map(open_extent).collect();
    let mut gates: Vec<Gate> = (faces.iter().zip(&extents))
        .map(|(f, (lo, hi))| {
            let leaf = f.leaves > 0.5 * f.open_area;
            match f.surface {
                Surface::Cut(cut) => {
                    let open = matches!(cut, Cut::Sheet(_)) && f.open_area > 0.8 * f.area;
                    let width = if open { f.open_area.sqrt() } else { 0.0 };
                    Gate { width, height: f64::INFINITY, framed: framed(f), leaf, ledge: false }
                }
                // Sloped faces are as high as they are on the mean.
                _ => {
                    let width = hi.x - lo.x;
                    let height = if width > 0.0 { (f.open_area / width).min(hi.y - lo.y) } else { 0.0 };
                    let [a, b] = [f.a as usize, f.b as usize];
                    let step = (runs.floors[a] - runs.floors[b]).abs();
                    let upper = if runs.floors[a] > runs.floors[b] { a } else { b };
                    let ledge = step > LEDGE * human.metre && runs.heights[upper] < STANDING * human.metre;
                    Gate { width, height, framed: framed(f), leaf, ledge }
                }
            }
        })
        .collect();
    // 1. One above the other, between the same two runs.
    let upright = |f: &Face| !matches!(f.surface, Surface::Cut(_));
    let mut stacks: HashMap<(u32, u32, u32, u32), Vec<usize>> = HashMap::new();
    for (i, f) in faces.iter().enumerate().filter(|(_, f)| upright(f) && f.open_area > 0.0) {
        let column = |p: u32| columns.of_piece(p).0 as u32;
        let key = (column(f.a), column(f.b), runs.of_piece[f.a as usize], runs.of_piece[f.b as usize]);
        stacks.entry(key).or_default().push(i);
    }
    for mut stack in stacks.into_values().filter(|s| s.len() > 1) {
        stack.sort_by(|&i, &j| extents[i].0.y.total_cmp(&extents[j].0.y).then(i.cmp(&j)));
        let touching = |pair: &[usize]| extents[pair[1]].0.y <= extents[pair[0]].1.y + 3.0 * seal;
        let mut from = 0;
        for to in 1..=stack.len() {
            if to == stack.len() || !touching(&stack[to - 1..=to]) {
                let height = stack[from..to].iter().map(|&i| gates[i].height).sum();
                stack[from..to].iter().for_each(|&i| gates[i].height = height);
                from = to;
            }
        }
    }
    // 2. Beside each other, along one wall.
    let mut by_wall: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (i, f) in faces.iter().enumerate() {
        if let (Surface::Wall(w), true) = (f.surface, f.open_area > 0.0) {
            by_wall.entry(w).or_default().push(i);
        }
    }
    for (_, mut list) in by_wall {
        list.sort_by(|&a, &b| extents[a].0.x.total_cmp(&extents[b].0.x).then(a.cmp(&b)));
        let mut groups = DisjointSets::new(list.len());
        let mut active: Vec<usize> = Vec::new();
        for k in 0..list.len() {
            let (lo, hi) = extents[list[k]];
            active.retain(|&j| extents[list[j]].1.x >= lo.x - 3.0 * seal);
            for &j in &active {
                let (l, h) = extents[list[j]];
                let alike = h.y.min(hi.y) - l.y.max(lo.y) > 0.5 * (h.y - l.y).max(hi.y - lo.y);
                if alike && gates[list[j]].leaf == gates[list[k]].leaf {
                    groups.join(j as u32, k as u32);
                }
            }
            active.push(k);
        }
        let mut whole: HashMap<u32, (f64, f64, bool)> = HashMap::new();
        for (k, &i) in list.iter().enumerate() {
            let (lo, hi) = extents[i];
            let entry = whole.entry(groups.find(k as u32)).or_insert((lo.x, hi.x, false));
            *entry = (entry.0.min(lo.x), entry.1.max(hi.x), entry.2 || gates[i].framed);
        }
        for (k, &i) in list.iter().enumerate() {
            let (low, high, framed) = whole[&groups.find(k as u32)];
            gates[i] = Gate { width: high - low, framed, ..gates[i] };
        }
    }
    // 3. As wide as the space around them.
    let whole = |piece: u32| !columns.torn[columns.of_piece(piece).0];
    let wide = |(gate, f): &(&mut Gate, &Face)| !gate.framed && f.open_area > 0.0 && whole(f.a) && whole(f.b);
    gates.par_iter_mut().zip(faces).filter(wide).for_each(|(gate, f)| {
        let (lo, hi) = extent(&f.polygon);
        let (low, high) = middle_half(lo.y, hi.y);
        if let Some((a, b)) = ends(f, plan, facets) {
            for q in [0.25, 0.5, 0.75].map(|t| a.lerp(b, t)) {
                gate.width = gate.width.max(2.0 * clearance.at(q, low, high));
            }
        }
    });
    gates
}
