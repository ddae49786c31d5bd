//! Which pieces make one cell: free space against solid, then rooms by the narrowings between them.
//!
//! A *gate* is an opening between two pieces. Gates are taken from the widest down, and two regions become one where the gate
//! is nearly as wide as the narrower of them; what stays apart at the end is joined by real narrowings: doors, windows,
//! passages. It is the watershed of clearance of Haumont, Debeir, Sillion (2003), on the triangles of the plan instead of on
//! voxels, so that boundaries fall on the lines of walls and doors.
//!
//! An author's rooms enter as labels that never merge with each other; the rest follows the same rule.

use super::complex::Human;
use super::complex::arrange::Plan;
use super::complex::columns::{Columns, Cut};
use super::complex::coverage::{Open, points};
use super::complex::faces::{Face, Surface};
use super::complex::facets::Facets;
use super::smooth::smooth;
use crate::geom::Aabb;
use glam::DVec2;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// What the author or the geometry calls a region.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Region {
    /// Index into [`crate::scene::Hints::rooms`].
    pub room: Option<u32>,
    /// The outside.
    pub outside: bool,
}

/// A region for every piece of free space.
#[derive(Debug)]
pub(super) struct Labels {
    /// Region of each piece; `None` in solid matter.
    pub of_piece: Vec<Option<u32>>,
    /// The regions, in the order of their first piece.
    pub regions: Vec<Region>,
}

/// A gate must be this share of the narrower region's width to be no narrowing. At 0.75 the Villa Rotonda's outer doors (1.6 m in
/// passages of 2.14 m) join its hall to the outside; from 0.9 on levels with ragged walls fall to pieces.
const WIDE_GATE: f64 = 0.8;
/// The same where a wall or lintel lies on part of the gate's face: people build those where rooms end.
const WIDE_FRAMED_GATE: f64 = 0.97;
/// Two regions are one space where this share of the smaller one's whole boundary is open to the other: a room's door is 2 % of
/// it, a wide window 6 %, half a hall 20 % and more.
const OPEN_SHARE: f64 = 0.2;
/// The same where the smaller region is itself as large as a hall (cubic metres): a level whose halls flow into one another
/// would end up as one cell.
const OPEN_SHARE_OF_HALLS: f64 = 0.35;
const HALL: f64 = 150.0;
/// Narrower than this (metres) or smaller (cubic metres) is a part of its neighbour: a door's reveal, a niche.
const LEAST_WIDTH: f64 = 0.6;
const LEAST_VOLUME: f64 = 1.5;
/// The same where the author named rooms: what has no name and is this small is a plenum, a shaft, the inside of a wall.
const LEAST_UNNAMED_VOLUME: f64 = 25.0;
/// Most cells, for each band of the plan; beyond it the least volume grows until it fits.
const MOST_CELLS: usize = 4_000;
/// Most planes with portals, a band or a cell, whichever is more; likewise.
const MOST_PORTALS: usize = 4_000;
const MOST_PORTALS_A_CELL: usize = 4;

struct Regions {
    parent: Vec<u32>,
}

impl Regions {
    fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect() }
    }

    fn find(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i
    }

    /// Joins two regions; the lower number stays.
    fn join(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.find(a), self.find(b));
        let (low, high) = (a.min(b), a.max(b));
        self.parent[high as usize] = low;
        low
    }
}

/// Labels every piece. `rooms[piece]` is the author's room that holds it; with `storeys_part`, levels always part cells.
#[allow(clippy::too_many_arguments)]
pub(super) fn label(
    plan: &Plan,
    columns: &Columns,
    faces: &[Face],
    facets: &Facets,
    human: Human,
    seal: f64,
    rooms: &[Option<u32>],
    storeys_part: bool,
) -> Labels {
    let n = columns.pieces();
    let rim = rim(plan, columns);
    let volumes: Vec<f64> = (0..n as u32).map(|p| volume(plan, columns, p)).collect();
    let clearance = Clearance::new(faces, facets, human);
    let widths = widths(plan, columns, &clearance);
    let free = free_space(n, faces, &rim, rooms, &widths, human);

    // 1. What belongs together whatever the gates say: the rim, and each of the author's rooms.
    let mut regions = Regions::new(n);
    let mut named: BTreeMap<i64, u32> = BTreeMap::new();
    let name_of = |p: usize| {
        if rim[p] { Some(-1) } else { rooms[p].map(i64::from) }
    };
    let mut name: Vec<Option<i64>> = (0..n).map(name_of).collect();
    fill_up(faces, &free, &widths, human, &mut name);
    let fixed: Vec<bool> = name.iter().map(Option::is_some).collect();
    for (p, label) in name.iter().enumerate() {
        if let Some(label) = *label {
            let first = *named.entry(label).or_insert(p as u32);
            regions.join(first, p as u32);
        }
    }
    let mut width = widths;
    let mut volume = volumes.clone();
    for p in 0..n as u32 {
        let r = regions.find(p);
        if r != p {
            width[r as usize] = width[r as usize].max(width[p as usize]);
            volume[r as usize] += volume[p as usize];
            name[r as usize] = name[r as usize].or(name[p as usize]);
        }
    }
    // The outside goes on beyond the rim.
    for r in (0..n).filter(|&r| name[r] == Some(-1)) {
        width[r] = f64::INFINITY;
    }
    let unite = |regions: &mut Regions, width: &mut [f64], volume: &mut [f64], name: &mut [Option<i64>], a: u32, b: u32| {
        let (a, b) = (regions.find(a), regions.find(b));
        let r = regions.join(a, b) as usize;
        width[r] = width[a as usize].max(width[b as usize]);
        volume[r] = volume[a as usize] + volume[b as usize];
        name[r] = name[a as usize].or(name[b as usize]);
    };

    // 2. Gates, widest first.
    let usable = |f: &&Face| f.open_area > 0.0 && free[f.a as usize] && free[f.b as usize];
    let gates = gates(faces, plan, columns, facets, &clearance, seal);
    let mut order: Vec<usize> = (0..faces.len()).filter(|&i| usable(&&faces[i]) && gates[i].width > 0.0).collect();
    order.sort_by(|&i, &j| gates[j].width.total_cmp(&gates[i].width).then(i.cmp(&j)));
    for i in order {
        let (a, b) = (regions.find(faces[i].a), regions.find(faces[i].b));
        let (na, nb) = (name[a as usize], name[b as usize]);
        if a == b || (na.is_some() && nb.is_some()) {
            continue;
        }
        let share = if gates[i].framed { WIDE_FRAMED_GATE } else { WIDE_GATE };
        let narrower = width[a as usize].min(width[b as usize]);
        if gates[i].width >= share * narrower {
            unite(&mut regions, &mut width, &mut volume, &mut name, a, b);
        }
    }

    // 3. Regions that are open to each other over much of their boundary are one space, whatever lies between them. In torn
    // columns what is open may not be, so those don't count.
    let trusted = |piece: u32| !columns.torn[columns.of_piece(piece).0];
    loop {
        let mut contact: BTreeMap<(u32, u32), f64> = BTreeMap::new();
        let mut boundary = vec![0.0f64; n];
        for f in faces {
            let (a, b) = (regions.find(f.a), regions.find(f.b));
            if a != b && trusted(f.a) && trusted(f.b) {
                boundary[a as usize] += f.area;
                boundary[b as usize] += f.area;
                let parted = storeys_part && matches!(f.surface, Surface::Cut(Cut::Level(_)));
                if usable(&f) && !parted {
                    *contact.entry((a.min(b), a.max(b))).or_default() += f.open_area;
                }
            }
        }
        let share = |&(a, b): &(u32, u32), open: f64| open / boundary[a as usize].min(boundary[b as usize]);
        let mut wishes: Vec<(f64, (u32, u32))> = (contact.iter())
            .filter(|((a, b), _)| name[*a as usize].is_none() || name[*b as usize].is_none())
            .map(|(pair, &open)| (share(pair, open), *pair))
            .filter(|&(share, (a, b))| {
                let hall = volume[a as usize].min(volume[b as usize]) >= HALL * human.metre.powi(3);
                share >= if hall { OPEN_SHARE_OF_HALLS } else { OPEN_SHARE }
            })
            .collect();
        wishes.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        let mut touched = vec![false; n];
        let mut joined = false;
        for (_, (a, b)) in wishes {
            if !touched[a as usize] && !touched[b as usize] {
                unite(&mut regions, &mut width, &mut volume, &mut name, a, b);
                (touched[a as usize], touched[b as usize], joined) = (true, true, true);
            }
        }
        if !joined {
            break;
        }
    }

    // 4. What is too small to be a room goes to the neighbour that it is most open to.
    let whole: f64 = volume.iter().sum();
    let authored = rooms.iter().any(Option::is_some);
    let mut least = if authored { LEAST_UNNAMED_VOLUME } else { LEAST_VOLUME } * human.metre.powi(3);
    loop {
        let mut best: BTreeMap<(u32, u32), f64> = BTreeMap::new();
        for f in faces.iter().filter(usable) {
            let (a, b) = (regions.find(f.a), regions.find(f.b));
            if a != b {
                *best.entry((a, b)).or_default() += f.open_area;
                *best.entry((b, a)).or_default() += f.open_area;
            }
        }
        let small = |r: u32| {
            name[r as usize].is_none() && (volume[r as usize] < least || width[r as usize] < LEAST_WIDTH * human.metre)
        };
        let mut wish: BTreeMap<u32, (u32, f64)> = BTreeMap::new();
        for (&(a, b), &open) in &best {
            if small(a) && wish.get(&a).is_none_or(|w| open > w.1) {
                wish.insert(a, (b, open));
            }
        }
        let mut wishes: Vec<(u32, u32)> = wish.into_iter().map(|(a, (b, _))| (a, b)).collect();
        wishes.sort_by(|x, y| volume[x.0 as usize].total_cmp(&volume[y.0 as usize]).then(x.0.cmp(&y.0)));
        let mut joined = false;
        for (a, b) in wishes {
            let (ra, rb) = (regions.find(a), regions.find(b));
            // A region that grew this round is looked at again in the next.
            if ra == a && rb == b {
                unite(&mut regions, &mut width, &mut volume, &mut name, a, b);
                joined = true;
            }
        }
        if !joined {
            let count = (0..n as u32).filter(|&p| free[p as usize] && regions.find(p) == p).count();
            let planes: BTreeSet<(u32, u32, [u32; 3])> = (faces.iter().filter(usable))
                .map(|f| (regions.find(f.a), regions.find(f.b), f.surface.key()))
                .filter(|(a, b, _)| a != b)
                .map(|(a, b, key)| (a.min(b), a.max(b), key))
                .collect();
            let bands = plan.bands.len();
            let portals = (MOST_PORTALS * bands).max(MOST_PORTALS_A_CELL * count);
            if (count <= MOST_CELLS * bands && planes.len() <= portals) || best.is_empty() || least > whole {
                break;
            }
            least *= 2.0;
        }
    }

    // 5. Numbers in the order of the first piece.
    let mut number: HashMap<u32, u32> = HashMap::new();
    let mut labels = Labels { of_piece: vec![None; n], regions: Vec::new() };
    for p in 0..n as u32 {
        if free[p as usize] {
            let r = regions.find(p);
            let next = labels.regions.len() as u32;
            let id = *number.entry(r).or_insert(next);
            if id == next {
                let name = name[r as usize];
                labels.regions.push(Region { room: name.and_then(|x| u32::try_from(x).ok()), outside: name == Some(-1) });
            }
            labels.of_piece[p as usize] = Some(id);
        }
    }

    // 6. Boundaries drawn tight.
    smooth(faces, &volumes, &fixed, &mut labels.of_piece, labels.regions.len());
    labels
}

/// What lies over (or under) an author's room up to the next slab or level is the room's where no other room reaches it. Where
/// several do, as over walls that end below the slab, it is a plenum: one more region, that rooms don't merge with. Names below
/// -1 are plenums.
fn fill_up(faces: &[Face], free: &[bool], widths: &[f64], human: Human, name: &mut [Option<i64>]) {
    // 1. What rooms reach.
    let through = |f: &&Face| matches!(f.surface, Surface::Cut(Cut::Sheet(_))) && f.open_area > 0.9 * f.area;
    let authored = name.to_vec();
    let mut reached = authored.clone();
    loop {
        let mut grown = false;
        for f in faces.iter().filter(through) {
            for (from, to) in [(f.a, f.b), (f.b, f.a)] {
                let room = reached[from as usize].filter(|&r| r >= 0);
                if room.is_some() && reached[to as usize].is_none() {
                    reached[to as usize] = room;
                    grown = true;
                }
            }
        }
        if !grown {
            break;
        }
    }
    // 2. Which of it hangs together, over the tops of walls too.
    let narrow = |p: usize| authored[p].is_none() && free[p] && widths[p] < LEAST_WIDTH * human.metre;
    let over = |p: usize| authored[p].is_none() && (reached[p].is_some() || narrow(p));
    let mut parts = Regions::new(name.len());
    for f in faces.iter().filter(|f| f.open_area > 0.5 * f.area && !matches!(f.surface, Surface::Cut(Cut::Level(_)))) {
        if over(f.a as usize) && over(f.b as usize) {
            parts.join(f.a, f.b);
        }
    }
    // 3. Whose it is.
    let mut rooms: BTreeMap<u32, BTreeSet<i64>> = BTreeMap::new();
    for p in (0..name.len()).filter(|&p| over(p)) {
        rooms.entry(parts.find(p as u32)).or_default().extend(reached[p]);
    }
    for p in (0..name.len()).filter(|&p| over(p)) {
        let part = parts.find(p as u32);
        name[p] = if rooms[&part].len() > 1 { Some(-2 - i64::from(part)) } else { reached[p] };
    }
}

/// Pieces that touch the rim of the domain: they are the outside.
fn rim(plan: &Plan, columns: &Columns) -> Vec<bool> {
    let mut out = Vec::with_capacity(columns.pieces());
    for (t, slices) in columns.slices.iter().enumerate() {
        let at_edge = plan.neighbours[t].iter().any(Option::is_none);
        out.extend(slices.windows(2).map(|w| at_edge || w[0].cut == Cut::Bottom || w[1].cut == Cut::Top));
    }
    out
}

fn volume(plan: &Plan, columns: &Columns, piece: u32) -> f64 {
    let (floor, ceiling) = columns.heights(piece);
    let (column, _) = columns.of_piece(piece);
    let corners = plan.triangles[column].map(|i| plan.points[i as usize]);
    super::complex::coverage::area(&corners) * (0..3).map(|i| ceiling[i] - floor[i]).sum::<f64>() / 3.0
}

/// How far it is to the nearest wall.
struct Clearance {
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
    /// Most cells of the grid along an axis.
    const MOST: f64 = 512.0;

    fn new(faces: &[Face], facets: &Facets, human: Human) -> Self {
        let (none, size) = (Vec::new(), [0; 3]);
        let across = Aabb::of(facets.wall_facets.iter().flat_map(|f| f.corners)).size().max_element();
        let cell = human.metre.max(across / Self::MOST);
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
fn widths(plan: &Plan, columns: &Columns, clearance: &Clearance) -> Vec<f64> {
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

/// Which pieces are free: those that open faces join to the rim or to an author's room, and sealed ones whose walls look inward
/// (or, where the model is wound both ways, that are as large as a room). A wrong answer costs culling, not correctness: no line
/// leaves a sealed piece.
fn free_space(n: usize, faces: &[Face], rim: &[bool], rooms: &[Option<u32>], widths: &[f64], human: Human) -> Vec<bool> {
    let mut parts = Regions::new(n);
    for f in faces.iter().filter(|f| f.open_area > 0.0) {
        parts.join(f.a, f.b);
    }
    let mut known = vec![false; n];
    let mut roomy = vec![false; n];
    let mut looks = vec![[0.0f64; 2]; n];
    for p in 0..n as u32 {
        let root = parts.find(p) as usize;
        known[root] |= rim[p as usize] || rooms[p as usize].is_some();
        roomy[root] |= widths[p as usize] >= 1.0 * human.metre;
    }
    for f in faces {
        for (piece, [inward, outward]) in [(f.a, [f.fronts[0], f.fronts[1]]), (f.b, [f.fronts[1], f.fronts[0]])] {
            let root = parts.find(piece) as usize;
            looks[root][0] += inward;
            looks[root][1] += outward;
        }
    }
    let free_part = |root: usize| {
        let [inward, outward] = looks[root];
        known[root] || inward > 1.5 * outward || (inward > 0.67 * outward && roomy[root])
    };
    (0..n as u32).map(|p| free_part(parts.find(p) as usize)).collect()
}

#[derive(Clone, Copy)]
struct Gate {
    /// Lesser of width and height of the opening that the face is part of, metres; 0: never a reason to merge.
    width: f64,
    /// A wall or lintel lies on part of the face.
    framed: bool,
}

fn extent(polygon: &[DVec2]) -> (DVec2, DVec2) {
    polygon.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |a, p| (a.0.min(*p), a.1.max(*p)))
}

/// The gate of each face. Openings of one wall that touch along it are one opening; where nothing frames it, a gate is as wide as
/// the space around its middle, however short the edge of the triangulation that it lies on; but not in torn columns, where a
/// vault may be open that isn't.
fn gates(faces: &[Face], plan: &Plan, columns: &Columns, facets: &Facets, clearance: &Clearance, seal: f64) -> Vec<Gate> {
    let open_extent = |f: &Face| match &f.open {
        Open::Whole => extent(&f.polygon),
        Open::Parts(parts) => {
            let boxes = parts.iter().filter_map(|s| s.first()).map(|outer| extent(&points(outer)));
            boxes
                .max_by(|a, b| {
                    let size = |e: &(DVec2, DVec2)| (e.1 - e.0).x * (e.1 - e.0).y;
                    size(a).total_cmp(&size(b))
                })
                .unwrap_or((DVec2::ZERO, DVec2::ZERO))
        }
    };
    let framed = |f: &Face| f.open_area < 0.98 * f.area;
    let mut gates: Vec<Gate> = faces
        .iter()
        .map(|f| {
            let (lo, hi) = open_extent(f);
            let size = hi - lo;
            let width = match f.surface {
                Surface::Cut(Cut::Sheet(_)) if f.open_area > 0.8 * f.area => f.open_area.sqrt(),
                Surface::Cut(_) => 0.0,
                // Without a frame there is no lintel either, and a room isn't narrow for being low.
                _ if !framed(f) => size.x,
                _ => size.x.min(size.y),
            };
            Gate { width, framed: framed(f) }
        })
        .collect();
    let mut by_wall: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (i, f) in faces.iter().enumerate() {
        if let (Surface::Wall(w), true) = (f.surface, f.open_area > 0.0) {
            by_wall.entry(w).or_default().push(i);
        }
    }
    for (_, mut list) in by_wall {
        let extents: HashMap<usize, (DVec2, DVec2)> = list.iter().map(|&i| (i, open_extent(&faces[i]))).collect();
        list.sort_by(|a, b| extents[a].0.x.total_cmp(&extents[b].0.x).then(a.cmp(b)));
        let mut groups = Regions::new(list.len());
        let mut active: Vec<usize> = Vec::new();
        for k in 0..list.len() {
            let (lo, hi) = extents[&list[k]];
            active.retain(|&j| extents[&list[j]].1.x >= lo.x - 3.0 * seal);
            for &j in &active {
                let (l, h) = extents[&list[j]];
                if h.y.min(hi.y) - l.y.max(lo.y) > 0.5 * (h.y - l.y).min(hi.y - lo.y) {
                    groups.join(j as u32, k as u32);
                }
            }
            active.push(k);
        }
        let mut whole: HashMap<u32, (DVec2, DVec2, bool)> = HashMap::new();
        for k in 0..list.len() {
            let (lo, hi) = extents[&list[k]];
            let entry = whole.entry(groups.find(k as u32)).or_insert((lo, hi, false));
            *entry = (entry.0.min(lo), entry.1.max(hi), entry.2 || gates[list[k]].framed);
        }
        for k in 0..list.len() {
            let (lo, hi, framed) = whole[&groups.find(k as u32)];
            gates[list[k]] = Gate { width: if framed { (hi - lo).min_element() } else { hi.x - lo.x }, framed };
        }
    }
    let whole = |piece: u32| !columns.torn[columns.of_piece(piece).0];
    let wide = |(gate, f): &(&mut Gate, &Face)| !gate.framed && f.open_area > 0.0 && whole(f.a) && whole(f.b);
    gates.par_iter_mut().zip(faces).filter(wide).for_each(|(gate, f)| {
        let (lo, hi) = extent(&f.polygon);
        let along = |x: f64| match f.surface {
            Surface::Wall(w) => Some(facets.walls[w as usize].at(x)),
            Surface::Edge { triangle, edge } => {
                let t = plan.triangles[triangle as usize];
                let [a, b] = [t[edge as usize], t[(edge as usize + 1) % 3]].map(|i| plan.points[i as usize]);
                Some(a + (b - a).normalize_or_zero() * x)
            }
            Surface::Cut(_) => None,
        };
        let (low, high) = middle_half(lo.y, hi.y);
        for x in [0.25, 0.5, 0.75].map(|t| lo.x + (hi.x - lo.x) * t) {
            gate.width = along(x).map_or(gate.width, |q| gate.width.max(2.0 * clearance.at(q, low, high)));
        }
    });
    gates
}
