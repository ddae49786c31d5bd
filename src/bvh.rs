//! Hierarchies over boxes.
//!
//! obvhs builds them bottom up (Meister, Bittner, *Parallel locally-ordered clustering for bounding volume hierarchy construction*, 2018):
//! in each pass, boxes that are each other's nearest become one. In a row of equal boxes each has its left neighbour for its nearest, and a pass
//! finds one such pair: the time grows with the square of the row. So boxes are grown, each by another amount.

use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

/// Most that a box grows by on each side, in its longest side. More: rays enter more boxes. Less: in `f32` boxes stay equal.
const GROWTH: f32 = 1e-3;

/// A hierarchy over boxes, of which leaves hold `most` at most.
pub fn over(mut boxes: Vec<Aabb>, most: Option<u32>) -> Bvh2 {
    if boxes.is_empty() {
        return Bvh2::default();
    }
    for (i, b) in boxes.iter_mut().enumerate() {
        // Fractions of multiples of the golden ratio: neighbours differ, and so do their neighbours.
        let share = (i as u32).wrapping_mul(0x9e37_79b9) as f32 * (1.0 / u32::MAX as f32);
        // Where a box is small for its place, by some steps of its numbers.
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

    /// Passes can't be counted from outside; that every box is held is what growth must not change.
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
