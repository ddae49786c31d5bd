//! Which of the things that lie on each other shows: a rank for each object, different for those that touch, as far as there are ranks.

use enfilade::math::geom::Aabb;
use enfilade::scene::Scene;

/// Ranks there are. More: what lies on a wall sinks into it, see `scene.wgsl`. Fewer: things that touch share one, and flicker.
pub const RANKS: usize = 16;
/// Boxes that are so near to each other, as a share of the scene's size, touch: more than places are rounded to.
const NEAR: f64 = 1e-6;
/// Objects that each is compared with, at most: in a crowd, ranks come round.
const COMPARED: usize = 256;

/// By object, below [`RANKS`]; in the order of boxes along x, each the one that fewest of those have which it touches.
pub fn ranks(scene: &Scene) -> Vec<u8> {
    let near = NEAR * scene.bounds().diagonal();
    let boxes: Vec<Aabb> = scene.objects.iter().map(|o| o.bounds.inflated(near)).collect();
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|&a, &b| boxes[a].min.x.total_cmp(&boxes[b].min.x).then(a.cmp(&b)));
    let mut ranks = vec![0; boxes.len()];
    // Those before, that reach as far as the next one begins.
    let mut open: Vec<usize> = Vec::new();
    for next in order {
        open.retain(|&other| boxes[other].max.x >= boxes[next].min.x);
        let mut taken = [0u32; RANKS];
        let touch = |other: &&usize| {
            let (a, b) = (&boxes[**other], &boxes[next]);
            a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
        };
        open.iter().rev().take(COMPARED).filter(touch).for_each(|&other| taken[usize::from(ranks[other])] += 1);
        // A number to begin with, so that crowds don't share the first.
        let free = (0..RANKS).map(|k| (k + next) % RANKS).min_by_key(|&k| taken[k]);
        ranks[next] = free.unwrap_or(0) as u8;
        open.push(next);
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;
    use enfilade::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};
    use glam::DVec3;

    #[test]
    fn things_that_touch_differ() {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        // A floor, sixteen tiles on it in a row that touch their neighbours, and one far away.
        let mut flat = |x: f64, width: f64, node: &str| {
            let positions = [[x, 0.0], [x + width, 0.0], [x, 1.0]].map(|[x, z]| DVec3::new(x, 0.0, z)).to_vec();
            let triangles = vec![[0, 1, 2]];
            let mesh = Mesh { node: node.into(), role: Role::Structure, opaque: true, positions, triangles };
            builder.add(mesh).expect("a triangle");
        };
        flat(0.0, 16.0, "floor");
        (0..16).for_each(|i| flat(f64::from(i), 1.0, "tile"));
        flat(100.0, 1.0, "far");
        let ranks = ranks(&builder.finish("floor").expect("a scene"));
        assert!(ranks.iter().all(|rank| usize::from(*rank) < RANKS));
        for tile in 1..=16 {
            assert_ne!(ranks[tile], ranks[0], "tile {tile} and the floor");
            assert!(tile == 1 || ranks[tile] != ranks[tile - 1], "tile {tile} and the one before");
        }
    }
}
