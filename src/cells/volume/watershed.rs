//! Basins into regions, joined while what parts them is shallow.
//!
//! Based on: Haumont, Debeir, Sillion, *Volumetric cell-and-portal generation*, 2003: the watershed of the distance to the
//! surface; Najman, Schmitt, *Geodesic saliency of watershed contours*, 1996: all mergings from one tree of saddles. How shallow a
//! basin may be is a share of its width, as for the gates of `rooms`: a narrowing is one whether the hall behind it is 3 or 30 m
//! wide.

use super::basins::{Basins, Region, basins};
use super::distance::{Distance, voxels_of};
use super::grid::Grid;
use super::labels::{Labels, NONE, VOID};
use crate::cells::complex::HumanScale;
use crate::cells::disjoint_sets::DisjointSets;
use glam::DVec3;
use std::collections::BTreeMap;

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

/// Visits points near triangles, in voxels, with the area that shows them its front, and the area that shows them its back.
pub type Fronts<'f> = dyn Fn(&mut dyn FnMut(DVec3, [f64; 2])) + 'f;

/// Regions with their labels; `fronts` tells which matter is solid.
pub fn watershed(grid: &Grid, human: HumanScale, fronts: &Fronts<'_>) -> (Labels, Vec<Region>) {
    let Basins { mut labels, regions: basins, saddles } = basins(grid, &Distance::new(grid));
    let mut set = DisjointSets::new(basins.len());

    // 1. What hangs together, and which of it is solid.
    let mut whole = DisjointSets::new(basins.len());
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

fn unite(set: &mut DisjointSets, regions: &mut [Region], a: u32, b: u32) {
    let (a, b) = (set.find(a), set.find(b));
    if a != b {
        let both = regions[a as usize].with(regions[b as usize]);
        regions[set.join(a, b) as usize] = both;
    }
}
