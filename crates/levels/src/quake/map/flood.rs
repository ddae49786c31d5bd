//! The inside of a map: the leaves that a flood from its point entities reaches.

use super::brush::ON;
use crate::bsp::portals::{Between, derive, width};
use crate::bsp::tree::Tree;
use enfilade::math::geom::{middle, newell};
use glam::DVec3;
use std::collections::VecDeque;

/// Greatest width of a hole that counts as closed, in the map's units: level compilers ignore a portal unless three of its edges
/// are longer. Larger: holes that one can see through count as closed. Smaller: maps that compile leak.
pub(super) const SMALLEST_HOLE: f64 = 0.2;

/// A point entity.
pub(super) struct Origin {
    pub class: String,
    pub at: DVec3,
}

/// Whether a map is closed.
pub(super) enum Inside<'o> {
    /// Closed: leaves outside are no longer open.
    Closed {
        /// Portals to the outside that are too narrow to count.
        holes: usize,
    },
    /// Open to the outside.
    Leaks(Leak<'o>),
    /// Neither entities nor closed spaces.
    None,
}

/// A leak: a line from an entity to the outside.
pub(super) struct Leak<'o> {
    pub from: &'o Origin,
    pub way: Vec<DVec3>,
}

/// Closes all leaves outside; if the map has no inside, all stay open. Entities in solid matter are ignored; without other
/// entities, all leaves that are not connected to the outside stay open. A leak is the way out through the fewest leaves, from
/// the first entity with one, through portals wider than `hole`.
pub(super) fn keep_inside<'o>(tree: &mut Tree, origins: &'o [Origin], hole: f64) -> Inside<'o> {
    let Between { portals, .. } = derive(tree, false);
    let mut next: Vec<Vec<(usize, usize)>> = vec![Vec::new(); tree.leaves.len()];
    for (i, portal) in portals.iter().enumerate() {
        let [a, b] = portal.cells.map(|cell| cell as usize + 1);
        next[a].push((b, i));
        next[b].push((a, i));
    }
    let placed =
        origins.iter().map(|origin| (origin, tree.leaf_at(origin.at))).filter(|&(_, leaf)| tree.leaves[leaf].cell.is_some());
    let placed: Vec<(&Origin, usize)> = placed.collect();
    // 1. The outside, from a point beyond the map. Without an entity it is unknown which side of a crack is inside.
    let hole = if placed.is_empty() { 0.0 } else { hole + ON };
    let is_wide = |w: &[DVec3]| width(w, newell(w).normalize()) > hole;
    let wide: Vec<bool> = portals.iter().map(|portal| is_wide(&portal.winding)).collect();
    let beyond = tree.bounds.max + 1.0;
    let outside = flood(&next, tree.leaf_at(beyond), |_, portal| wide[portal]);
    // 2. The inside. Narrow portals within it stay open.
    let mut inside = vec![false; tree.leaves.len()];
    for &(from, leaf) in &placed {
        if outside[leaf].is_some() {
            let mut way = Vec::new();
            let mut at = leaf;
            while let Some(Some((before, portal))) = outside[at] {
                way.push(middle(&portals[portal].winding));
                at = before;
            }
            way.push(beyond);
            return Inside::Leaks(Leak { from, way });
        }
        if !inside[leaf] {
            let reached = flood(&next, leaf, |leaf, _| outside[leaf].is_none());
            reached.iter().zip(&mut inside).for_each(|(reached, inside)| *inside |= reached.is_some());
        }
    }
    let stays_open = |i: usize| if placed.is_empty() { outside[i].is_none() } else { inside[i] };
    if placed.is_empty() && !(0..tree.leaves.len()).any(|i| tree.leaves[i].cell.is_some() && stays_open(i)) {
        return Inside::None;
    }
    for (i, leaf) in tree.leaves.iter_mut().enumerate() {
        leaf.cell = leaf.cell.filter(|_| stays_open(i));
    }
    let leads_out = |[a, b]: [bool; 2]| a != b;
    let holes = portals.iter().filter(|portal| leads_out(portal.cells.map(|cell| stays_open(cell as usize + 1)))).count();
    Inside::Closed { holes }
}

/// For each reached leaf, its predecessor and the portal between the two; `Some(None)` for the first. `enters` decides whether to
/// enter a leaf through a portal.
fn flood(
    next: &[Vec<(usize, usize)>],
    first: usize,
    enters: impl Fn(usize, usize) -> bool,
) -> Vec<Option<Option<(usize, usize)>>> {
    let mut before = vec![None; next.len()];
    before[first] = Some(None);
    let mut queue = VecDeque::from([first]);
    while let Some(leaf) = queue.pop_front() {
        for &(other, portal) in &next[leaf] {
            if before[other].is_none() && enters(other, portal) {
                before[other] = Some(Some((leaf, portal)));
                queue.push_back(other);
            }
        }
    }
    before
}
