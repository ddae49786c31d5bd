//! Space behind the walls of a level: no viewer is there, so it belongs to the outside, and takes no tiles.
//!
//! From there, models with one-sided walls show only backs. A part where any front is visible is kept: it may be a room.

use super::facing::Facing;
use super::tiles::OUTSIDE;
use super::tree::{Bsp, Poly};
use glam::DVec3;
use std::collections::BTreeMap;

/// Sample points in a part, and rays from each.
const POINTS: usize = 12;
const RAYS: usize = 24;
/// Largest share of rays from behind walls that hit fronts: through cracks, or on two-sided surfaces.
const FRONTS: f64 = 0.02;

/// Whether a tile may have viewers: from within, a front is visible, or nothing at all.
pub fn counts(facing: &Facing<'_>, tile: &Poly) -> bool {
    facing.outside_in || !is_behind(facing, &points(tile), 0)
}

/// Joins space behind walls to the outside; `labels` by leaf.
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

/// True if backs are visible from some of the points, and fronts from none.
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

/// The centre of a part of space, and points halfway to its faces.
fn points(poly: &Poly) -> Vec<DVec3> {
    let middle = poly.middle();
    let towards = |points: &Vec<DVec3>| middle.midpoint(points.iter().sum::<DVec3>() / points.len().max(1) as f64);
    std::iter::once(middle).chain(poly.faces.iter().map(|face| towards(&face.points))).take(POINTS).collect()
}
