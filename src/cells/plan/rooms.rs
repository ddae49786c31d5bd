//! Which pieces make one cell: free space against solid, then rooms by the narrowings between them.
//!
//! A *gate* is an opening between two pieces. Gates are taken from the widest down, and two regions become one where the gate
//! is nearly as wide as the narrower of them; what stays apart at the end is joined by real narrowings: doors, windows,
//! passages. It is the watershed of clearance of Haumont, Debeir, Sillion (2003), on the triangles of the plan instead of on
//! voxels, so that boundaries fall on the lines of walls and doors.
//!
//! An author's rooms enter as labels that never merge with each other; the rest follows the same rule.

use crate::cells::authored::Claims;
use crate::cells::complex::HumanScale;
use crate::cells::complex::arrange::Plan;
use crate::cells::complex::assemble::has_portal;
use crate::cells::complex::bands::Cut;
use crate::cells::complex::columns::Columns;
use crate::cells::complex::faces::{Face, Surface};
use crate::cells::complex::facets::Facets;
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::adjacency::Contacts;
use crate::cells::plan::boundaries::smooth;
use crate::cells::plan::clearance::{Clearance, Runs, gates, widths};
use crate::cells::plan::free_space::free_space;
use crate::cells::plan::voids::Voids;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// What the author or the geometry calls a region.
#[derive(Clone, PartialEq, Debug)]
pub(in crate::cells) struct Region {
    /// Index into [`crate::scene::Hints::rooms`].
    pub room: Option<u32>,
    /// The outside.
    pub outside: bool,
    /// A part of the outside among wings.
    pub court: bool,
}

/// A region for every piece of free space.
#[derive(Debug)]
pub(in crate::cells) struct Labels {
    /// Region of each piece; `None` in solid matter.
    pub of_piece: Vec<Option<u32>>,
    /// The regions, in the order of their first piece.
    pub regions: Vec<Region>,
}

/// A gate must be this share of the narrower region's width to be no narrowing. At 0.75 the Villa Rotonda's outer doors (1.6 m in
/// passages of 2.14 m) join its hall to the outside; from 0.9 on levels with ragged walls fall to pieces.
const WIDE_GATE: f64 = 0.79;
/// The same where a wall or lintel lies on part of the gate's face: people build those where rooms end.
const WIDE_FRAMED_GATE: f64 = 0.97;
/// The same for openings wider than people build doors (metres): those are narrowings only where much is missing. None of these
/// numbers is a round one: those are what people build, and rounding would decide.
const WIDE_PASSAGE: f64 = 0.64;
const DOORWAY: f64 = 1.65;
/// And this share of the lower region's height: a door of 2.1 m in a room of 2.4 m is 0.875, a beam of 0.2 m under a ceiling of
/// 2.5 m leaves 0.92.
pub(in crate::cells) const HIGH_GATE: f64 = 0.89;
/// Narrower than this (metres) or smaller (cubic metres) is a part of its neighbour: a door's reveal, a niche.
pub(in crate::cells) const LEAST_WIDTH: f64 = 0.6;
const LEAST_VOLUME: f64 = 1.5;
/// The same where the author named rooms: what has no name and is this small is a plenum, a shaft, the inside of a wall.
const LEAST_UNNAMED_VOLUME: f64 = 25.0;
/// An author's room takes in space that its author didn't draw (over a ceiling, in a bay) up to this share of what he drew, and
/// so many cubic metres besides: through a wall of glass it would take in the outside.
const GROWTH: f64 = 0.5;
const LEAST_GROWTH: f64 = 5.0;
/// Most cells, for each band of the plan; beyond it the least volume grows until it fits.
const MOST_CELLS: usize = 4_000;
/// Most planes with portals, a band or a cell, whichever is more; likewise.
const MOST_PORTALS: usize = 4_000;
const MOST_PORTALS_A_CELL: usize = 4;

/// The least width at which an opening is no narrowing beside a region of width `narrower`; metres.
pub(in crate::cells) fn least_width(width: f64, narrower: f64, human: HumanScale) -> f64 {
    if width >= DOORWAY * human.metre { WIDE_PASSAGE * narrower } else { WIDE_GATE * narrower }
}

/// Regions, each with what it measures under the number of its first piece.
pub(in crate::cells) struct Space {
    pub(in crate::cells) regions: DisjointSets,
    /// How wide, metres.
    pub(in crate::cells) width: Vec<f64>,
    /// How high, metres.
    pub(in crate::cells) height: Vec<f64>,
    /// Cubic metres.
    pub(in crate::cells) volume: Vec<f64>,
    /// -1 for the outside, below it plenums, from 0 the author's rooms.
    pub(in crate::cells) name: Vec<Option<i64>>,
    /// How much each of the author's rooms may measure with what has no name, cubic metres.
    pub(in crate::cells) most: BTreeMap<i64, f64>,
}

impl Space {
    pub(in crate::cells) fn named(&self, region: u32) -> bool {
        self.name[region as usize].is_some()
    }

    /// True where an author's room would take in more than it may.
    pub(in crate::cells) fn outgrown(&self, a: u32, b: u32) -> bool {
        let (a, b) = (a as usize, b as usize);
        let most = self.name[a].xor(self.name[b]).and_then(|room| self.most.get(&room));
        most.is_some_and(|most| self.volume[a] + self.volume[b] > *most)
    }

    /// Region `r` gets what `other` measures.
    fn take(&mut self, r: usize, other: usize) {
        self.width[r] = self.width[r].max(self.width[other]);
        self.height[r] = self.height[r].max(self.height[other]);
        self.volume[r] += self.volume[other];
        self.name[r] = self.name[r].or(self.name[other]);
    }

    /// Two regions become one.
    pub(in crate::cells) fn unite(&mut self, a: u32, b: u32) {
        let r = self.regions.join(a, b) as usize;
        self.take(r, a as usize + b as usize - r);
    }
}

/// Labels every piece. `claims` are the author's rooms; with `storeys_part`, levels always part cells.
#[allow(clippy::too_many_arguments)]
pub(in crate::cells) fn label(
    plan: &Plan,
    columns: &Columns,
    faces: &[Face],
    facets: &Facets,
    human: HumanScale,
    seal: f64,
    claims: &Claims,
    storeys_part: bool,
) -> Labels {
    let n = columns.pieces();
    let rim = rim(plan, columns);
    let volumes: Vec<f64> = (0..n as u32).map(|p| volume(plan, columns, p)).collect();
    let clearance = Clearance::new(faces, facets, human);
    let widths = widths(plan, columns, &clearance);
    let free = free_space(faces, &rim, &claims.rooms, &widths, &volumes, human);

    // 1. What belongs together whatever the gates say: the rim, and each of the author's rooms.
    let mut regions = DisjointSets::new(n);
    let mut named: BTreeMap<i64, u32> = BTreeMap::new();
    let name_of = |p: usize| {
        let doorway = || claims.doorways[p].filter(|_| free[p]);
        if rim[p] { Some(-1) } else { claims.rooms[p].or_else(doorway).map(i64::from) }
    };
    let mut name: Vec<Option<i64>> = (0..n).map(name_of).collect();
    // How much each of the author's rooms may measure, cubic metres: what he drew, and some more.
    let mut drawn: BTreeMap<i64, f64> = BTreeMap::new();
    for (room, volume) in claims.rooms.iter().zip(&volumes) {
        if let Some(room) = *room {
            *drawn.entry(i64::from(room)).or_default() += volume;
        }
    }
    let growth = |drawn: f64| GROWTH * drawn + LEAST_GROWTH * human.metre.powi(3);
    let most = drawn.iter().map(|(&room, &drawn)| (room, drawn + growth(drawn))).collect();
    let more = drawn.into_iter().map(|(room, drawn)| (room, growth(drawn))).collect();
    fill_up(faces, &free, &widths, &volumes, more, human, &mut name);
    let fixed: Vec<bool> = name.iter().map(Option::is_some).collect();
    for (p, label) in name.iter().enumerate() {
        if let Some(label) = *label {
            let first = *named.entry(label).or_insert(p as u32);
            regions.join(first, p as u32);
        }
    }
    let runs = Runs::new(columns, faces);
    let mut space = Space { regions, width: widths, height: runs.heights.clone(), volume: volumes.clone(), name, most };
    for p in 0..n as u32 {
        let r = space.regions.find(p) as usize;
        if r != p as usize {
            space.take(r, p as usize);
        }
    }
    // The outside goes on beyond the rim.
    for r in (0..n).filter(|&r| space.name[r] == Some(-1)) {
        (space.width[r], space.height[r]) = (f64::INFINITY, f64::INFINITY);
    }

    // 2. Gates, widest first.
    let usable = |f: &&Face| f.open_area > 0.0 && free[f.a as usize] && free[f.b as usize];
    let gates = gates(faces, plan, columns, facets, &clearance, &runs, human, seal);
    let mut order: Vec<usize> = (0..faces.len()).filter(|&i| usable(&&faces[i]) && gates[i].width > 0.0).collect();
    order.sort_by(|&i, &j| gates[j].width.total_cmp(&gates[i].width).then(i.cmp(&j)));
    for i in order {
        let (a, b) = (space.regions.find(faces[i].a), space.regions.find(faces[i].b));
        let named = space.named(a) && space.named(b);
        if a == b || gates[i].leaf || gates[i].ledge || named || space.outgrown(a, b) {
            continue;
        }
        let narrower = space.width[a as usize].min(space.width[b as usize]);
        let least = if gates[i].framed { WIDE_FRAMED_GATE * narrower } else { least_width(gates[i].width, narrower, human) };
        let wide = gates[i].width >= least;
        if wide && gates[i].height >= HIGH_GATE * space.height[a as usize].min(space.height[b as usize]) {
            space.unite(a, b);
        }
    }

    // 3. Regions that are open to each other over much of their boundary, or through what is nearly as wide as they are.
    Contacts { plan, columns, facets, faces, gates: &gates, free: &free, human, seal, storeys_part }.join(&mut space);

    // 4. A forecourt is the outside's, a void too low to stand in is nobody's room.
    let voids = Voids { plan, columns, runs: &runs, faces, free: &free, human };
    voids.give_to_outside(&mut space);

    // 5. What is too small to be a room goes to the neighbour that it is most open to.
    let whole: f64 = space.volume.iter().sum();
    let authored = claims.rooms.iter().any(Option::is_some);
    let mut least = if authored { LEAST_UNNAMED_VOLUME } else { LEAST_VOLUME } * human.metre.powi(3);
    loop {
        let mut best: BTreeMap<(u32, u32), f64> = BTreeMap::new();
        for f in faces.iter().filter(usable) {
            let (a, b) = (space.regions.find(f.a), space.regions.find(f.b));
            if a != b {
                *best.entry((a, b)).or_default() += f.open_area;
                *best.entry((b, a)).or_default() += f.open_area;
            }
        }
        let small = |r: u32| {
            !space.named(r) && (space.volume[r as usize] < least || space.width[r as usize] < LEAST_WIDTH * human.metre)
        };
        let mut wish: BTreeMap<u32, (u32, f64)> = BTreeMap::new();
        for (&(a, b), &open) in &best {
            if small(a) && wish.get(&a).is_none_or(|w| open > w.1) {
                wish.insert(a, (b, open));
            }
        }
        let mut wishes: Vec<(u32, u32)> = wish.into_iter().map(|(a, (b, _))| (a, b)).collect();
        wishes.sort_by(|x, y| space.volume[x.0 as usize].total_cmp(&space.volume[y.0 as usize]).then(x.0.cmp(&y.0)));
        let mut joined = false;
        for (a, b) in wishes {
            let (ra, rb) = (space.regions.find(a), space.regions.find(b));
            // A region that grew this round is looked at again in the next.
            if ra == a && rb == b {
                space.unite(a, b);
                joined = true;
            }
        }
        if !joined {
            let count = (0..n as u32).filter(|&p| free[p as usize] && space.regions.find(p) == p).count();
            let planes: BTreeSet<(u32, u32, [u32; 3])> = (faces.iter().filter(usable))
                .map(|f| (space.regions.find(f.a), space.regions.find(f.b), f.surface.key()))
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

    voids.gather(&mut space);

    // 6. Numbers in the order of the first piece; a chink that nothing leads to, as between a slab and a wall that ends in it, has none.
    let narrow = |space: &Space, r: u32| !space.named(r) && space.width[r as usize] < LEAST_WIDTH * human.metre;
    let mut reached = vec![false; n];
    for f in faces.iter().filter(usable) {
        let (a, b) = (space.regions.find(f.a), space.regions.find(f.b));
        if a != b && (narrow(&space, a) || narrow(&space, b)) && has_portal(f, seal) {
            (reached[a as usize], reached[b as usize]) = (true, true);
        }
    }
    let mut number: HashMap<u32, u32> = HashMap::new();
    let mut labels = Labels { of_piece: vec![None; n], regions: Vec::new() };
    for p in 0..n as u32 {
        let r = space.regions.find(p);
        if free[p as usize] && (reached[r as usize] || !narrow(&space, r)) {
            let next = labels.regions.len() as u32;
            let id = *number.entry(r).or_insert(next);
            if id == next {
                let name = space.name[r as usize];
                let room = name.and_then(|x| u32::try_from(x).ok());
                labels.regions.push(Region { room, outside: name == Some(-1), court: false });
            }
            labels.of_piece[p as usize] = Some(id);
        }
    }

    // 7. Boundaries drawn tight.
    smooth(faces, &volumes, &fixed, &mut labels.of_piece, labels.regions.len());
    labels
}

/// What lies over (or under) an author's room up to the next slab or level is the room's where no other room reaches it. Where
/// several do, as over walls that end below the slab, it is a plenum: one more region, that rooms don't merge with. Names below
/// -1 are plenums.
///
/// A room gets no part that is larger than what is left of its `more`, cubic metres: of a hall he drew the lower storey.
fn fill_up(
    faces: &[Face],
    free: &[bool],
    widths: &[f64],
    volumes: &[f64],
    mut more: BTreeMap<i64, f64>,
    human: HumanScale,
    name: &mut [Option<i64>],
) {
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
    let mut parts = DisjointSets::new(name.len());
    for f in faces.iter().filter(|f| f.open_area > 0.5 * f.area && !matches!(f.surface, Surface::Cut(Cut::Level(_)))) {
        if over(f.a as usize) && over(f.b as usize) {
            parts.join(f.a, f.b);
        }
    }
    // 3. Whose it is.
    let mut rooms: BTreeMap<u32, (BTreeSet<i64>, f64)> = BTreeMap::new();
    for p in (0..name.len()).filter(|&p| over(p)) {
        let part = rooms.entry(parts.find(p as u32)).or_default();
        part.0.extend(reached[p]);
        part.1 += if free[p] { volumes[p] } else { 0.0 };
    }
    let whose: BTreeMap<u32, Option<i64>> = (rooms.into_iter())
        .map(|(part, (rooms, volume))| match (rooms.len(), rooms.first()) {
            (1, Some(room)) => {
                let left = more.entry(*room).or_default();
                let fits = volume <= *left;
                *left -= if fits { volume } else { 0.0 };
                (part, fits.then_some(*room))
            }
            (0, _) => (part, None),
            _ => (part, Some(-2 - i64::from(part))),
        })
        .collect();
    for p in (0..name.len()).filter(|&p| over(p)) {
        let whole = whose[&parts.find(p as u32)];
        name[p] = if whole.is_some_and(|w| w >= 0) { reached[p] } else { whole };
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
    plan.area(column) * (0..3).map(|i| ceiling[i] - floor[i]).sum::<f64>() / 3.0
}
