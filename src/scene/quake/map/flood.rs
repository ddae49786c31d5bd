//! The inside of a map: what a flood from its point entities reaches.

use super::super::portals::{Between, derive};
use super::super::tree::Tree;
use crate::geom::middle;
use glam::DVec3;
use std::collections::VecDeque;

/// A point entity.
pub(super) struct Origin {
    pub class: String,
    pub at: DVec3,
}

/// Where a map leaks: from an entity, through these points, to the outside.
pub(super) struct Leak<'o> {
    pub from: &'o Origin,
    pub way: Vec<DVec3>,
}

/// Leaves open only those that the inside has. Entities in solid matter do not count; of a map without others, all stays that is not
/// joined to the outside.
///
/// # Errors
///
/// The shortest way out by the number of leaves, of the first entity that has one.
pub(super) fn keep_inside<'o>(tree: &mut Tree, origins: &'o [Origin]) -> Result<(), Leak<'o>> {
    let Between { portals, .. } = derive(tree, false);
    let mut next: Vec<Vec<(usize, usize)>> = vec![Vec::new(); tree.leaves.len()];
    for (i, portal) in portals.iter().enumerate() {
        let [a, b] = portal.cells.map(|cell| cell as usize + 1);
        next[a].push((b, i));
        next[b].push((a, i));
    }
    // 1. The outside, from a point beyond the map.
    let beyond = tree.bounds.max + 1.0;
    let outside = flood(&next, tree.leaf_at(beyond));
    // 2. The inside.
    let mut inside = vec![false; tree.leaves.len()];
    let placed = origins.iter().map(|origin| (origin, tree.leaf_at(origin.at))).filter(|&(_, leaf)| tree.leaves[leaf].open);
    let placed: Vec<(&Origin, usize)> = placed.collect();
    for &(from, leaf) in &placed {
        if outside[leaf].is_some() {
            let mut way = Vec::new();
            let mut at = leaf;
            while let Some(Some((before, portal))) = outside[at] {
                way.push(middle(&portals[portal].winding));
                at = before;
            }
            way.push(beyond);
            return Err(Leak { from, way });
        }
        if !inside[leaf] {
            flood(&next, leaf).iter().zip(&mut inside).for_each(|(reached, inside)| *inside |= reached.is_some());
        }
    }
    for (i, leaf) in tree.leaves.iter_mut().enumerate() {
        leaf.open &= if placed.is_empty() { outside[i].is_none() } else { inside[i] };
    }
    Ok(())
}

/// For each leaf that is reached, the one before it with the portal between the two; `Some(None)` for the first.
fn flood(next: &[Vec<(usize, usize)>], first: usize) -> Vec<Option<Option<(usize, usize)>>> {
    let mut before = vec![None; next.len()];
    before[first] = Some(None);
    let mut queue = VecDeque::from([first]);
    while let Some(leaf) = queue.pop_front() {
        for &(other, portal) in &next[leaf] {
            if before[other].is_none() {
                before[other] = Some(Some((leaf, portal)));
                queue.push_back(other);
            }
        }
    }
    before
}
