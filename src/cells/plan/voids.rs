//! Free space that is not a room: forecourts under the open sky, and voids too low to stand in.
//!
//! The void between a ceiling and the slab above is a plenum. A sealed one belongs to the room below, as in authored rooms. Open ones of a
//! storey are all one cell, because nobody walks there, and a cell each would only cost rows.

use crate::cells::complex::assemble::Complex;
use crate::cells::complex::bands::Cut;
use crate::cells::complex::faces::Surface;
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::bottlenecks::{Runs, is_filled};
use crate::cells::plan::space::{Claim, Input, Space, is_passage};
use std::collections::{BTreeMap, BTreeSet};

/// The inputs of this step.
pub(in crate::cells) struct Voids<'v> {
    /// The input of every step.
    pub input: &'v Input<'v>,
    /// The open runs of each column.
    pub runs: &'v Runs,
    /// Whether each piece is free space.
    pub free: &'v [bool],
}

/// Areas of a region's boundary, square metres.
#[derive(Clone, Copy, Default)]
struct Boundary {
    /// Ceiling, and its part open to the outside; its open part.
    ceiling: [f64; 2],
    pierced: f64,
    /// Sides, and their part open to the outside, without door leaves and panes.
    sides: [f64; 2],
}

impl Voids<'_> {
    /// Joins regions under the open sky to the outside: yards, and regions that are also open at their sides.
    pub(in crate::cells) fn give_to_outside(&self, space: &mut Space) {
        let options = self.input.options;
        loop {
            let outside: Vec<bool> = space.claim.iter().map(|c| *c == Some(Claim::Outside)).collect();
            let boundary = self.boundaries(space, &outside);
            let free = |r: u32| self.free[r as usize] && !space.is_claimed(r);
            let indoors = boundary.iter().filter(|(r, _)| self.free[**r as usize] && !outside[**r as usize]);
            let [ceilings, pierced] = indoors.fold([0.0; 2], |sum, (_, b)| [sum[0] + b.ceiling[0], sum[1] + b.pierced]);
            let roofed = ceilings - pierced >= options.most * ceilings;
            let airy = |b: &Boundary| {
                let yard = roofed && b.ceiling[1] >= options.nearly_all * b.ceiling[0];
                let under_sky = b.ceiling[1] >= options.most * b.ceiling[0];
                yard || under_sky && b.sides[1] >= options.open_sides * b.sides[0]
            };
            let found: Vec<u32> = boundary.iter().filter(|(r, b)| free(**r) && airy(b)).map(|(&r, _)| r).collect();
            let sky = (0..outside.len() as u32).find(|&r| outside[r as usize] && space.regions.find(r) == r);
            let (Some(mut sky), false) = (sky, found.is_empty()) else { return };
            for r in found {
                space.unite(sky, r);
                sky = space.regions.find(sky);
            }
        }
    }

    /// The boundary of each region; `outside` marks outside regions.
    fn boundaries(&self, space: &mut Space, outside: &[bool]) -> BTreeMap<u32, Boundary> {
        let mut boundary: BTreeMap<u32, Boundary> = BTreeMap::new();
        for f in self.input.complex.faces {
            let (a, b) = space.sides(f);
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
                if outside[other as usize] && !(upright && is_filled(f, self.input.options)) {
                    kind[1] += f.open_area;
                }
                of.pierced += pierced;
            }
        }
        boundary
    }

    /// True if it is unclaimed and too low to stand in.
    fn is_low(&self, space: &Space, r: u32) -> bool {
        let standing = self.input.human.metres(self.input.options.standing);
        !space.is_claimed(r) && space.height[r as usize] < standing
    }

    /// Joins sealed voids to the rooms below, and the other voids of each storey into one region.
    pub(in crate::cells) fn gather(&self, space: &mut Space) {
        let Complex { columns, .. } = self.input.complex;
        let Surroundings { reached, beside } = self.surroundings(space);
        let under = self.rooms_under(space);
        let crawl = self.input.human.square_metres(self.input.options.crawl);
        let mut storey: BTreeMap<Option<u32>, u32> = BTreeMap::new();
        let mut unions: Vec<(u32, u32)> = Vec::new();
        for r in (0..self.free.len() as u32).filter(|&r| self.free[r as usize]) {
            if space.regions.find(r) != r || !self.is_low(space, r) {
                continue;
            }
            if !reached[r as usize] {
                // Sealed ones join the region below most of their floor.
                let floor = under.get(&r).and_then(|u| u.iter().max_by(|x, y| x.1.total_cmp(y.1).then(y.0.cmp(x.0))));
                if let Some((&room, _)) = floor {
                    unions.push((room, r));
                }
            } else if beside.get(&r).is_none_or(|&open| open <= crawl) {
                // The others are grouped by the level above.
                let (column, k) = columns.of_piece(r);
                let level = columns.slices[column][k..].iter().find_map(|s| match s.cut {
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

    /// The openings of voids.
    fn surroundings(&self, space: &mut Space) -> Surroundings {
        let (human, options) = (self.input.human, self.input.options);
        let mut together = DisjointSets::new(self.free.len());
        let (mut open, mut beside): (BTreeSet<u32>, BTreeMap<u32, f64>) = Default::default();
        for f in self.input.complex.faces.iter().filter(|f| is_passage(f, self.free)) {
            let (a, b) = space.sides(f);
            if a == b {
                continue;
            }
            match (self.is_low(space, a), self.is_low(space, b)) {
                (true, true) => {
                    together.join(a, b);
                }
                (false, false) => {}
                (is_a, _) => {
                    let (void, other) = if is_a { (a, b) } else { (b, a) };
                    open.insert(void);
                    let piece = |of: u32| if of == a { f.a } else { f.b };
                    let step = self.runs.floors[piece(void) as usize] - self.runs.floors[piece(other) as usize];
                    let sideways = !matches!(f.surface, Surface::Cut(_)) && step.abs() < human.metres(options.ledge);
                    if sideways && !space.is_outside(other) {
                        *beside.entry(void).or_default() += f.open_area;
                    }
                }
            }
        }
        let open: BTreeSet<u32> = open.iter().map(|&r| together.find(r)).collect();
        let reached = (0..self.free.len() as u32).map(|r| open.contains(&together.find(r))).collect();
        Surroundings { reached, beside }
    }

    /// For each void, the regions below it, each with the area of the void's floor above it, square metres.
    fn rooms_under(&self, space: &mut Space) -> BTreeMap<u32, BTreeMap<u32, f64>> {
        let Complex { plan, columns, .. } = self.input.complex;
        let mut under: BTreeMap<u32, BTreeMap<u32, f64>> = BTreeMap::new();
        for (column, pair) in columns.first_piece.windows(2).enumerate() {
            // Ceilings have a thickness, so the room is not adjacent to the void.
            let free: Vec<u32> = (pair[0]..pair[1]).filter(|&p| self.free[p as usize]).collect();
            for pair in free.windows(2) {
                let (a, b) = (space.regions.find(pair[0]), space.regions.find(pair[1]));
                if self.is_low(space, b) && !self.is_low(space, a) && !space.is_outside(a) {
                    *under.entry(b).or_default().entry(a).or_default() += plan.area(column);
                }
            }
        }
        under
    }
}

/// The openings of voids.
struct Surroundings {
    /// For each void, whether its connected component is open to anything but voids.
    reached: Vec<bool>,
    /// Area of each void that is open to rooms at its side, square metres.
    beside: BTreeMap<u32, f64>,
}
