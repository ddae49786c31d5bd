//! Free space that is no room: forecourts under the open sky, and voids too low to stand in.
//!
//! Between a ceiling and the slab above it lies a plenum. Sealed, it belongs to the room under it, of which authors take it for a
//! part; open to its neighbours or to the storey above, all of a storey's are one cell, since nobody walks from one to another
//! and a cell each would only cost rows.

use crate::cells::complex::HumanScale;
use crate::cells::complex::arrange::Plan;
use crate::cells::complex::bands::Cut;
use crate::cells::complex::columns::Columns;
use crate::cells::complex::faces::{Face, Surface};
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::clearance::Runs;
use crate::cells::plan::rooms::Space;
use std::collections::{BTreeMap, BTreeSet};

/// Lower than this nobody stands, metres.
pub(in crate::cells) const STANDING: f64 = 1.87;
/// Higher than this over a floor nobody steps, metres.
pub(in crate::cells) const LEDGE: f64 = 0.93;
/// What the sky is open to from above, and has this share of its sides open to the outside, is outside: three sides of a
/// forecourt in a U of buildings are 0.25, the open doors of a hall without a roof 0.05.
const OPEN_SIDES: f64 = 0.15;
/// Under a roof that is open over this share, what lies below is a yard, and outside, unless most of the building has none: a model
/// without slabs is not a courtyard.
const OPEN_SKY: f64 = 0.9;
const ROOFED: f64 = 0.5;
/// A void that people crawl into has more than this open, square metres, to a room at its side from whose floor it is no ledge.
const CRAWL: f64 = 0.2;

/// What voids are told by.
pub(in crate::cells) struct Voids<'v> {
    pub(in crate::cells) plan: &'v Plan,
    pub(in crate::cells) columns: &'v Columns,
    pub(in crate::cells) runs: &'v Runs,
    pub(in crate::cells) faces: &'v [Face],
    pub(in crate::cells) free: &'v [bool],
    pub(in crate::cells) human: HumanScale,
}

/// What a region's boundary is like, square metres.
#[derive(Clone, Copy, Default)]
struct Boundary {
    /// Ceiling; what of it is open to the outside; what is open.
    ceiling: [f64; 2],
    pierced: f64,
    /// Sides; what of them is open to the outside, leaves and panes apart.
    sides: [f64; 2],
}

impl Voids<'_> {
    /// Regions under the open sky are outside: yards, and what is open to the outside at its sides, too.
    pub(in crate::cells) fn give_to_outside(&self, space: &mut Space) {
        loop {
            let mut boundary: BTreeMap<u32, Boundary> = BTreeMap::new();
            let outside: Vec<bool> = space.name.iter().map(|n| *n == Some(-1)).collect();
            for f in self.faces {
                let (a, b) = (space.regions.find(f.a), space.regions.find(f.b));
                if a == b {
                    continue;
                }
                for (own, other, below) in [(a, b, true), (b, a, false)] {
                    let of = boundary.entry(own).or_default();
                    let upright = !matches!(f.surface, Surface::Cut(_));
                    let kind = match (upright, below) {
                        (true, _) => &mut of.sides,
                        (false, true) => &mut of.ceiling,
                        (false, false) => continue,
                    };
                    kind[0] += f.area;
                    let pierced = if !upright && below { f.open_area } else { 0.0 };
                    if outside[other as usize] && !(upright && f.leaves > 0.5 * f.open_area) {
                        kind[1] += f.open_area;
                    }
                    of.pierced += pierced;
                }
            }
            let free = |r: u32| self.free[r as usize] && !space.named(r);
            let indoors = boundary.iter().filter(|(r, _)| self.free[**r as usize] && !outside[**r as usize]);
            let [ceilings, pierced] = indoors.fold([0.0; 2], |sum, (_, b)| [sum[0] + b.ceiling[0], sum[1] + b.pierced]);
            let roofed = ceilings - pierced >= ROOFED * ceilings;
            let airy = |b: &Boundary| {
                let yard = roofed && b.ceiling[1] >= OPEN_SKY * b.ceiling[0];
                yard || b.ceiling[1] >= 0.5 * b.ceiling[0] && b.sides[1] >= OPEN_SIDES * b.sides[0]
            };
            let found: Vec<u32> = boundary.iter().filter(|(r, b)| free(**r) && airy(b)).map(|(&r, _)| r).collect();
            let sky = (0..space.name.len() as u32).find(|&r| outside[r as usize] && space.regions.find(r) == r);
            let (Some(mut sky), false) = (sky, found.is_empty()) else { return };
            for r in found {
                space.unite(sky, r);
                sky = space.regions.find(sky);
            }
        }
    }

    /// Gives sealed voids to the rooms under them, and makes one region of the others of each storey.
    pub(in crate::cells) fn gather(&self, space: &mut Space) {
        let low = |space: &Space, r: u32| !space.named(r) && space.height[r as usize] < STANDING * self.human.metre;
        // 1. Which are open to anything that isn't one, and to rooms at their side.
        let both_free = self.faces.iter().filter(|f| self.free[f.a as usize] && self.free[f.b as usize]);
        let contacts: Vec<(u32, u32, &Face)> =
            both_free.map(|f| (space.regions.find(f.a), space.regions.find(f.b), f)).filter(|(a, b, _)| a != b).collect();
        let mut together = DisjointSets::new(space.name.len());
        let (mut open, mut beside): (BTreeSet<u32>, BTreeMap<u32, f64>) = Default::default();
        for &(a, b, f) in contacts.iter().filter(|c| c.2.open_area > 0.0) {
            match (low(space, a), low(space, b)) {
                (true, true) => {
                    together.join(a, b);
                }
                (false, false) => {}
                (is_a, _) => {
                    let (void, other) = if is_a { (a, b) } else { (b, a) };
                    open.insert(void);
                    let piece = |of: u32| if of == a { f.a } else { f.b };
                    let step = self.runs.floors[piece(void) as usize] - self.runs.floors[piece(other) as usize];
                    let sideways = !matches!(f.surface, Surface::Cut(_)) && step.abs() < LEDGE * self.human.metre;
                    if sideways && space.name[other as usize] != Some(-1) {
                        *beside.entry(void).or_default() += f.open_area;
                    }
                }
            }
        }
        let reached: BTreeSet<u32> = open.iter().map(|&r| together.find(r)).collect();
        // 2. Sealed ones go to what they share most of their floor with.
        let mut under: BTreeMap<u32, BTreeMap<u32, f64>> = BTreeMap::new();
        let mut storey: BTreeMap<Option<u32>, u32> = BTreeMap::new();
        let mut unions: Vec<(u32, u32)> = Vec::new();
        let crawl = CRAWL * self.human.metre * self.human.metre;
        for (column, pair) in self.columns.first_piece.windows(2).enumerate() {
            // Ceilings have a thickness, so the room is not next to the void.
            let free: Vec<u32> = (pair[0]..pair[1]).filter(|&p| self.free[p as usize]).collect();
            for pair in free.windows(2) {
                let (a, b) = (space.regions.find(pair[0]), space.regions.find(pair[1]));
                if low(space, b) && !low(space, a) && space.name[a as usize] != Some(-1) {
                    *under.entry(b).or_default().entry(a).or_default() += self.plan.area(column);
                }
            }
        }
        for r in (0..space.name.len() as u32).filter(|&r| self.free[r as usize]) {
            if space.regions.find(r) != r || !low(space, r) {
                continue;
            }
            if !reached.contains(&together.find(r)) {
                let floor = under.get(&r).and_then(|u| u.iter().max_by(|x, y| x.1.total_cmp(y.1).then(y.0.cmp(x.0))));
                if let Some((&room, _)) = floor {
                    unions.push((room, r));
                }
            } else if beside.get(&r).is_none_or(|&open| open <= crawl) {
                // 3. The others, by the level that they lie under.
                let (column, k) = self.columns.of_piece(r);
                let level = self.columns.slices[column][k..].iter().find_map(|s| match s.cut {
                    Cut::Level(l) => Some(l),
                    _ => None,
                });
                let first = *storey.entry(level).or_insert(r);
                unions.push((first, r));
            }
        }
        for (a, b) in unions {
            let (a, b) = (space.regions.find(a), space.regions.find(b));
            if a != b {
                space.unite(a, b);
            }
        }
    }
}
