//! Bounding volume hierarchies.
//!
//! obvhs builds them bottom up (Meister, Bittner, *Parallel locally-ordered clustering for bounding volume hierarchy construction*, 2018):
//! each pass merges mutually nearest boxes. In a row of equal boxes, the nearest of each is its left neighbour, so a pass finds one pair,
//! and the time is quadratic. So boxes are grown by different amounts.

use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

/// Largest growth of a box on each side, relative to its longest side. Larger: rays enter more boxes. Smaller: boxes stay equal in `f32`.
const GROWTH: f32 = 1e-3;

/// A hierarchy over boxes, with at most `most` in a leaf.
pub fn over(mut boxes: Vec<Aabb>, most: Option<u32>) -> Bvh2 {
    if boxes.is_empty() {
        return Bvh2::default();
    }
    for (i, b) in boxes.iter_mut().enumerate() {
        // Multiples of the golden ratio, modulo 1: neighbours get different values.
        let share = (i as u32).wrapping_mul(0x9e37_79b9) as f32 * (1.0 / u32::MAX as f32);
        // A box that is small relative to its coordinates grows by some rounding units.
        let place = b.min.abs().max(b.max.abs()).max_element();
        let by = (b.max - b.min).max_element() * GROWTH + place * 8.0 * f32::EPSILON;
        (b.min, b.max) = (b.min - by * share, b.max + by * share);
    }
    let usual = BvhBuildParams::medium_build();
    let params = BvhBuildParams { max_prims_per_leaf: most.unwrap_or(usual.max_prims_per_leaf), ..usual };
    build_bvh2(&boxes, params, &mut std::time::Duration::default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3A;

    /// The number of passes is not observable; the test is that the tree still contains every box.
    #[test]
    fn a_row_of_equal_boxes_is_a_tree_that_holds_them() {
        let at = |i: usize| Vec3A::new(i as f32, 0.0, 0.0);
        let boxes: Vec<Aabb> = (0..1 << 17).map(|i| Aabb::new(at(i), at(i) + 1.0)).collect();
        let tree = over(boxes.clone(), Some(4));
        let mut held = vec![false; boxes.len()];
        for node in tree.nodes.iter().filter(|node| node.is_leaf()) {
            let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            for &i in &tree.primitive_indices[range] {
                let (b, around) = (&boxes[i as usize], node.aabb());
                assert!(around.min.cmple(b.min).all() && around.max.cmpge(b.max).all());
                assert!(!std::mem::replace(&mut held[i as usize], true));
            }
        }
        assert!(held.iter().all(|&h| h) && over(Vec::new(), None).nodes.is_empty());
    }
}
