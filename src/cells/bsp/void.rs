//! What lies behind the walls of a level: nobody is there, so that it is all outside, and takes none of the tiles.
//!
//! Models of one-sided walls show their backs from there, and nothing else. What shows a front anywhere is kept: there may be a room before it.

use super::facing::Facing;
use super::tiles::OUTSIDE;
use super::tree::{Bsp, Poly};
use glam::DVec3;
use std::collections::BTreeMap;

/// Points that are tried in a part, and rays from each.
const POINTS: usize = 12;
const RAYS: usize = 24;
/// A point behind walls may show fronts by this share of its rays: through cracks, and of what is shown from both sides.
const FRONTS: f64 = 0.02;

/// Whether a tile is of use to anyone: a front is seen from within, or nothing at all.
pub fn counts(facing: &Facing<'_>, tile: &Poly) -> bool {
    facing.outside_in || !is_behind(facing, &points(tile), 0)
}

/// Gives parts of space behind the walls to the outside; `labels` by leaf.
pub fn join_outside(facing: &Facing<'_>, bsp: &Bsp, labels: &mut [Option<u32>]) {
    if facing.outside_in {
        return;
    }
    let mut parts: BTreeMap<u32, Vec<(f64, u32)>> = BTreeMap::new();
    for (leaf, label) in (0u32..).zip(labels.iter()) {
        if let Some(label) = label.filter(|&label| label != OUTSIDE) {
            parts.entry(label).or_default().push((bsp.leaves[leaf as usize].poly.volume(), leaf));
        }
    }
    let behind = |(label, mut leaves): (u32, Vec<(f64, u32)>)| {
        leaves.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let middles: Vec<DVec3> =
            leaves.iter().take(POINTS).map(|&(_, leaf)| bsp.leaves[leaf as usize].poly.middle()).collect();
        is_behind(facing, &middles, u64::from(label)).then_some(label)
    };
    let behind: Vec<u32> = parts.into_iter().filter_map(behind).collect();
    let joined = |label: &&mut Option<u32>| label.is_some_and(|label| behind.binary_search(&label).is_ok());
    labels.iter_mut().filter(joined).for_each(|label| *label = Some(OUTSIDE));
}

/// Backs are seen from some of the points, and fronts from none.
fn is_behind(facing: &Facing<'_>, points: &[DVec3], seed: u64) -> bool {
    let mut any = false;
    for (point, seed) in points.iter().zip(seed..) {
        let [backs, fronts] = facing.around(*point, RAYS, seed);
        if fronts as f64 > FRONTS * (backs + fronts) as f64 {
            return false;
        }
        any |= backs > 0;
    }
    any
}

/// The middle of a part of space, and points halfway to its faces.
fn points(poly: &Poly) -> Vec<DVec3> {
    let middle = poly.middle();
    let towards = |points: &Vec<DVec3>| middle.midpoint(points.iter().sum::<DVec3>() / points.len().max(1) as f64);
    std::iter::once(middle).chain(poly.faces.iter().map(|face| towards(&face.points))).take(POINTS).collect()
}
