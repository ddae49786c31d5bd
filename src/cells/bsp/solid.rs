//! Solid space: the sealed insides of walls and rock.
//!
//! From within a sealed part of space, triangles show their fronts if it is a room, and their backs if it is solid; parts as thin as a wall
//! are solid, too. A solid part is no cell; an eye there is in no cell, and draws everything in the frustum.

use super::adjacency::Contact;
use super::facing::Facing;
use super::tree::Bsp;
use crate::cells::disjoint_sets::DisjointSets;
use crate::math::geom::Aabb;
use std::collections::BTreeMap;

/// A sealed part larger than this share of the model's box is kept if the model shows its backs outside, too: it is a room of a level, or
/// the model is inside out.
const LARGE: f64 = 0.1;
/// A part thinner than this everywhere is solid, as a share of the smallest occluder.
const THIN: f64 = 0.4;
/// Rays from a part.
const RAYS: usize = 64;

/// Whether each leaf is solid; `bounds` is the model's box, and `slivers` are pairs of a sliver and its leaf.
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
