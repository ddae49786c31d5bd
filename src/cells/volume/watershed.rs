//! Basins into regions, joined while what parts them is shallow.
//!
//! Based on: Haumont, Debeir, Sillion, *Volumetric cell-and-portal generation*, 2003: the watershed of the distance to the
//! surface; Najman, Schmitt, *Geodesic saliency of watershed contours*, 1996: all mergings from one tree of saddles. How shallow a
//! basin may be is a share of its width, as for the bottlenecks of [`plan`](crate::cells::plan): a narrowing is one whether the hall behind it is 3 or 30 m
//! wide.

use super::basins::{Basins, Region, Saddle, basins};
use super::distance::{Distance, voxels_of};
use super::grid::Grid;
use super::labels::{Labels, NONE, VOID};
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::scale::{HumanScale, LEAST_WIDTH};
use glam::DVec3;
use std::collections::BTreeMap;

/// A saddle must be this share of the narrower basin's width, less a voxel, to be no narrowing.
const WIDE_SADDLE: f64 = 0.9;
/// Two regions are one space where this share of the smaller one's whole boundary is open to the other. Much, because wide
/// openings still hide much in a level whose halls flow into one another.
const OPEN_BOUNDARY: f64 = 0.5;
/// What is smaller than this (cubic metres of a person), or too narrow for a person, is a part of its neighbour.
const LEAST_VOLUME: f64 = 3.0;
/// Matter is solid where this many times more triangles show it their backs than their fronts.
const BACKS_TO_FRONTS: f64 = 4.0;

/// Visits points near triangles, in voxels, with the area that shows them its front, and the area that shows them its back.
pub type Fronts<'f> = dyn Fn(&mut dyn FnMut(DVec3, [f64; 2])) + 'f;

/// Regions with their labels; `fronts` tells which matter is solid.
pub fn watershed(grid: &Grid, human: HumanScale, fronts: &Fronts<'_>) -> (Labels, Vec<Region>) {
    let Basins { mut labels, regions: basins, saddles } = basins(grid, &Distance::new(grid));
    let solid = solid(grid, &labels, basins.len(), &saddles, fronts);
    let mut merged = Merged { set: DisjointSets::new(basins.len()), regions: basins };
    merged.flood(&saddles);
    let metre = human.metre / grid.frame.voxel;
    while merged.join_open(&saddles, metre) {}
    let (number, regions) = merged.number(&solid, metre);
    labels.map(|l| number[l as usize]);
    (labels, regions)
}

/// For each of so many basins, whether all that hangs together with it is solid.
fn solid(grid: &Grid, labels: &Labels, basins: usize, saddles: &[Saddle], fronts: &Fronts<'_>) -> Vec<bool> {
    let mut whole = DisjointSets::new(basins);
    for s in saddles {
        whole.join(s.pair.0, s.pair.1);
    }
    let mut looks = vec![[0.0f64; 2]; basins];
    fronts(&mut |q, [front, back]| {
        if let Some((brick, v)) = grid.locate(q)
            && let label @ 0..VOID = labels.get(grid, brick, v)
        {
            let root = whole.find(label) as usize;
            looks[root][0] += front;
            looks[root][1] += back;
        }
    });
    let is_solid = |b: u32| {
        let [front, back] = looks[whole.find(b) as usize];
        back > BACKS_TO_FRONTS * front
    };
    (0..basins as u32).map(is_solid).collect()
}

/// Basins on their way to regions.
struct Merged {
    set: DisjointSets,
    /// What each region is, under the number of its first basin.
    regions: Vec<Region>,
}

impl Merged {
    /// The watershed: saddles join, highest first, where they are nearly as wide as the narrower side. The outside is one.
    fn flood(&mut self, saddles: &[Saddle]) {
        let first_outside = self.regions.iter().position(|r| r.outside);
        for b in 0..self.regions.len() {
            if self.regions[b].outside {
                self.unite(b as u32, first_outside.unwrap_or(b) as u32);
            }
        }
        let mut order: Vec<usize> = (0..saddles.len()).collect();
        order.sort_by_key(|&i| (std::cmp::Reverse(saddles[i].level), saddles[i].pair));
        for i in order {
            let s = &saddles[i];
            let (a, b) = (self.set.find(s.pair.0), self.set.find(s.pair.1));
            let narrower = self.regions[a as usize].width.min(self.regions[b as usize].width);
            let wide = 2.0 * voxels_of(s.level) + 1.0;
            if a != b && wide >= WIDE_SADDLE * narrower {
                self.unite(a, b);
            }
        }
    }

    /// One round: joins regions that are open to each other over much of their boundary, and what is too small; `metre` in voxels.
    /// False where there are none.
    fn join_open(&mut self, saddles: &[Saddle], metre: f64) -> bool {
        let mut open: BTreeMap<(u32, u32), f64> = BTreeMap::new();
        for s in saddles {
            let (a, b) = (self.set.find(s.pair.0), self.set.find(s.pair.1));
            if a != b {
                *open.entry((a.min(b), a.max(b))).or_default() += s.faces;
            }
        }
        let mut boundary: Vec<f64> = self.regions.iter().map(|r| r.walls).collect();
        for (&(a, b), faces) in &open {
            boundary[a as usize] += faces;
            boundary[b as usize] += faces;
        }
        let mut wishes: Vec<(f64, (u32, u32))> = Vec::new();
        for (&(a, b), &faces) in &open {
            let smaller = if self.regions[a as usize].volume <= self.regions[b as usize].volume { a } else { b };
            let share = faces / boundary[smaller as usize];
            let small = |r: u32| is_small(&self.regions[r as usize], metre);
            if small(a) || small(b) {
                wishes.push((1.0 + share, (a, b)));
            } else if share >= OPEN_BOUNDARY {
                wishes.push((share, (a, b)));
            }
        }
        wishes.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        let mut touched = vec![false; self.regions.len()];
        let mut joined = false;
        for (_, (a, b)) in wishes {
            if !touched[a as usize] && !touched[b as usize] {
                self.unite(a, b);
                (touched[a as usize], touched[b as usize], joined) = (true, true, true);
            }
        }
        joined
    }

    /// The label of each basin, and the regions. What is still too small has no neighbour: a gap between overlapping solids.
    fn number(mut self, solid: &[bool], metre: f64) -> (Vec<u32>, Vec<Region>) {
        let mut number = vec![NONE; self.regions.len()];
        let mut out = Vec::new();
        for b in 0..self.regions.len() as u32 {
            let root = self.set.find(b) as usize;
            if !solid[b as usize] && number[root] == NONE && !is_small(&self.regions[root], metre) {
                number[root] = out.len() as u32;
                out.push(self.regions[root]);
            }
        }
        let label = |b: u32| {
            let root = self.set.find(b) as usize;
            match (solid[b as usize], self.regions[root].outside) {
                (false, _) => number[root],
                (true, true) => VOID,
                (true, false) => NONE,
            }
        };
        ((0..solid.len() as u32).map(label).collect(), out)
    }

    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.set.find(a), self.set.find(b));
        if a != b {
            let both = self.regions[a as usize].with(self.regions[b as usize]);
            self.regions[self.set.join(a, b) as usize] = both;
        }
    }
}

/// Too small or too narrow for a cell; `metre` in voxels.
fn is_small(r: &Region, metre: f64) -> bool {
    !r.outside && (r.volume < LEAST_VOLUME * metre.powi(3) || r.width < LEAST_WIDTH * metre)
}
