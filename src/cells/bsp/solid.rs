//! What nobody can be in: the insides of walls and rock, closed off from everything else.
//!
//! A part of space that nothing leads into shows the fronts of its triangles if it is a room, and their backs if it is solid; what is as
//! thin as a wall is solid, too. A solid part is no cell; an eye that gets there all the same is in no cell, and draws what the frustum holds.

use super::adjacency::Contact;
use super::facing::Facing;
use super::tree::Bsp;
use crate::cells::disjoint_sets::DisjointSets;
use crate::geom::Aabb;
use std::collections::BTreeMap;

/// A part that is closed off and larger than this share of the model's box is kept where the model shows its backs from outside, too: then
/// it is a room of a level, or the model is turned inside out.
const LARGE: f64 = 0.1;
/// A part that is nowhere thicker than this, as a share of the smallest occluder, is solid.
const THIN: f64 = 0.4;
/// Rays from a part.
const RAYS: usize = 64;

/// Whether each leaf is solid; `bounds` is the model's box, and `slivers` are leaves and what each is a part of.
pub fn solid(
    facing: &Facing<'_>,
    bsp: &Bsp,
    contacts: &[Contact],
    slivers: &[(u32, u32)],
    bounds: Aabb,
    occluder: f64,
) -> Vec<bool> {
    let leaves = bsp.leaves.len() as u32;
    let mut sets = DisjointSets::new(leaves as usize);
    contacts.iter().filter(|c| c.wide).for_each(|c| _ = sets.join(c.leaves[0], c.leaves[1]));
    slivers.iter().for_each(|&(a, b)| _ = sets.join(a, b));
    // Volume of each part, its largest leaf, and whether it reaches the rim.
    let mut parts: BTreeMap<u32, (f64, (f64, u32), bool)> = BTreeMap::new();
    for (leaf, at_rim) in (0..).zip(bsp.leaves_at_rim()) {
        let volume = bsp.leaves[leaf as usize].poly.volume();
        let part = parts.entry(sets.find(leaf)).or_insert((0.0, (0.0, leaf), false));
        part.0 += volume;
        part.1 = if volume > part.1.0 { (volume, leaf) } else { part.1 };
        part.2 |= at_rim;
    }
    let size = bounds.size();
    let large = LARGE * size.x * size.y * size.z;
    let is_thin = |leaf: u32| bsp.leaves[leaf as usize].poly.bounds().size().min_element() < THIN * occluder;
    let shows_backs = |leaf: u32| {
        let [backs, fronts] = facing.around(bsp.leaves[leaf as usize].poly.middle(), RAYS, u64::from(leaf));
        backs >= fronts
    };
    let is_solid: BTreeMap<u32, bool> = parts
        .into_iter()
        .map(|(part, (volume, (_, leaf), at_rim))| {
            (part, !at_rim && (volume < large || facing.outside_in) && (is_thin(leaf) || shows_backs(leaf)))
        })
        .collect();
    (0..leaves).map(|leaf| is_solid[&sets.find(leaf)]).collect()
}
