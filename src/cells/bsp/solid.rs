//! What nobody can be in: the insides of walls and rock, closed off from everything else.
//!
//! A part of space that nothing leads into shows the fronts of its triangles if it is a room, and their backs if it is solid; what is as
//! thin as a wall is solid, too. A solid part is no cell; an eye that gets there all the same is in no cell, and draws what the frustum holds.

use super::adjacency::Contact;
use super::tree::Bsp;
use crate::cells::disjoint_sets::DisjointSets;
use crate::random::SplitMix;
use crate::scene::Scene;
use crate::scene::rays::RayScene;
use glam::DVec3;
use std::collections::BTreeMap;

/// A part that is closed off and larger than this share of the model's box is kept where the model shows its backs from outside, too: then
/// it is a room of a level, or the model is turned inside out.
const LARGE: f64 = 0.1;
/// A part that is nowhere thicker than this, as a share of the smallest occluder, is solid.
const THIN: f64 = 0.4;
/// Rays from a part.
const RAYS: usize = 64;

/// Whether each leaf is solid; `slivers` are leaves and what each is a part of.
pub fn solid(scene: &Scene, bsp: &Bsp, contacts: &[Contact], slivers: &[(u32, u32)], occluder: f64) -> Vec<bool> {
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
    let size = scene.bounds().size();
    let large = LARGE * size.x * size.y * size.z;
    let rays = RayScene::new(scene);
    // From far outside at the model.
    let mut random = SplitMix::new(0);
    let mut point = || DVec3::from_array(std::array::from_fn(|_| random.unit()));
    let bounds = scene.bounds();
    let outside: i32 = (0..RAYS)
        .map(|_| {
            let to = bounds.min + bounds.size() * point();
            let away = (point() * 2.0 - 1.0).normalize_or(DVec3::Y) * (2.0 * bounds.diagonal());
            shown(scene, &rays, to + away, -away)
        })
        .sum();
    let shows_fronts = outside < 0;
    let is_thin = |leaf: u32| bsp.leaves[leaf as usize].poly.bounds().size().min_element() < THIN * occluder;
    let shows_backs = |leaf: u32| {
        let from = bsp.leaves[leaf as usize].poly.middle();
        let mut random = SplitMix::new(u64::from(leaf));
        let balance: i32 = (0..RAYS)
            .map(|_| {
                let direction = DVec3::from_array(std::array::from_fn(|_| 2.0 * random.unit() - 1.0));
                shown(scene, &rays, from, direction)
            })
            .sum();
        balance >= 0
    };
    let is_solid: BTreeMap<u32, bool> = parts
        .into_iter()
        .map(|(part, (volume, (_, leaf), at_rim))| {
            (part, !at_rim && (volume < large || shows_fronts) && (is_thin(leaf) || shows_backs(leaf)))
        })
        .collect();
    (0..leaves).map(|leaf| is_solid[&sets.find(leaf)]).collect()
}

/// What a ray shows: 1 for a back, -1 for a front, 0 for nothing.
fn shown(scene: &Scene, rays: &RayScene<'_>, from: DVec3, direction: DVec3) -> i32 {
    let Some(hit) = rays.first_opaque(from, direction, f64::INFINITY) else { return 0 };
    let [a, b, c] = scene.corners(hit.triangle as usize);
    if (b - a).cross(c - a).dot(direction) > 0.0 { 1 } else { -1 }
}
