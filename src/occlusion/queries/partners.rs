//! Adjacent triangles: a surface covers the pixels along its inner edges, and a rasterizer may assign these to either of the two triangles.

use crate::occlusion::geometry::{Geometry, GeometryObject};
use glam::DVec3;

/// No adjacent triangle.
pub(super) const NOBODY: u32 = u32::MAX;
/// Most candidates at one edge. More would be quadratic in fans of many triangles around one edge.
const TRIED: usize = 16;

/// For each edge of each triangle (from the first corner to the second, and so on), the third corner of the adjacent triangle of the same
/// object with the flattest angle. Corners are equal if their coordinates are.
pub(super) fn partners(model: &Geometry<'_>) -> Vec<[u32; 3]> {
    let names = names(model.positions);
    let mut partners = vec![[NOBODY; 3]; model.triangles.len()];
    let mut edges = Vec::new();
    for object in &model.objects {
        of_object(model, object, &names, &mut edges, &mut partners);
    }
    partners
}

/// An edge of a triangle: its two corners' names, the lesser first, the triangle, and the index of the edge.
type Edge = ([u32; 2], u32, usize);

fn of_object(
    model: &Geometry<'_>,
    object: &GeometryObject,
    names: &[u32],
    edges: &mut Vec<Edge>,
    partners: &mut [[u32; 3]],
) {
    edges.clear();
    for t in object.triangles.clone() {
        let corners = model.triangles[t as usize];
        edges.extend((0..3).map(|k| {
            let [a, b] = [k, (k + 1) % 3].map(|i| names[corners[i] as usize]);
            ([a.min(b), a.max(b)], t, k)
        }));
    }
    edges.sort_unstable();
    let apex = |&(_, t, k): &Edge| model.triangles[t as usize][(k + 2) % 3];
    for same in edges.chunk_by(|a, b| a.0 == b.0) {
        let [a, b] = same[0].0.map(|i| model.positions[i as usize]);
        let away = |edge: &Edge| away(a, b, model.positions[apex(edge) as usize]);
        for edge in same {
            // The one with the flattest angle.
            let others = same.iter().take(TRIED).filter(|other| other.1 != edge.1);
            let best = others.min_by(|x, y| away(edge).dot(away(x)).total_cmp(&away(edge).dot(away(y))));
            partners[edge.1 as usize][edge.2] = best.map_or(NOBODY, apex);
        }
    }
}

/// The direction from the line through `a` and `b` to a point beside it; zero if the point is on the line.
fn away(a: DVec3, b: DVec3, point: DVec3) -> DVec3 {
    let along = (b - a).normalize_or_zero();
    (point - a).reject_from_normalized(along).normalize_or_zero()
}

/// For each position, the first one with the same coordinates.
fn names(positions: &[DVec3]) -> Vec<u32> {
    // Also for -0.0.
    let key = |i: u32| (positions[i as usize] + 0.0).to_array().map(f64::to_bits);
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|&i| (key(i), i));
    let mut names = vec![0; positions.len()];
    for same in order.chunk_by(|&i, &j| key(i) == key(j)) {
        same.iter().for_each(|&i| names[i as usize] = same[0]);
    }
    names
}

#[cfg(test)]
mod tests {
    use super::super::super::scenes::{add, crowd, row, turned};
    use super::*;
    use glam::DQuat;

    /// Every edge of a closed box has an adjacent triangle; for the diagonal of a side, it is the other half.
    #[test]
    fn a_box_goes_on_beyond_every_edge() {
        let scene = crowd(20, 3);
        for (t, partners) in partners(&Geometry::from(&scene)).into_iter().enumerate() {
            let own = scene.triangles[t];
            assert!(partners.iter().all(|p| *p != NOBODY && !own.contains(p)), "triangle {t}: {partners:?}");
            let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize();
            let of_side = normal(scene.corners(t));
            // Two edges are of the box, one is a diagonal.
            let flat = (0..3).filter(|&k| {
                let [a, b] = [own[k], own[(k + 1) % 3]];
                let other = [b, a, partners[k]].map(|i| scene.positions[i as usize]);
                normal(other).dot(of_side) > 0.999
            });
            assert_eq!(flat.count(), 1, "triangle {t}");
        }
    }

    /// Duplicate triangles without shared corners: the neighbour is found, not the copy.
    #[test]
    fn copies_are_nobody_s_neighbours() {
        let mut scene = row(&[]);
        add(&mut scene, &turned(DVec3::ONE, DQuat::IDENTITY, DVec3::ONE), 2);
        let corners: Vec<DVec3> = (0..scene.triangles.len()).flat_map(|t| scene.corners(t)).collect();
        scene.triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        scene.positions = corners;
        for (t, partners) in partners(&Geometry::from(&scene)).into_iter().enumerate() {
            let own = scene.corners(t);
            assert!(partners.iter().all(|&p| p != NOBODY && !own.contains(&scene.positions[p as usize])), "triangle {t}");
        }
    }

    #[test]
    fn beyond_a_border_is_nobody() {
        let mut scene = row(&[(0.0, 1)]);
        scene.triangles.truncate(2);
        scene.objects[0].triangles = 0..2;
        let beyond: usize = partners(&Geometry::from(&scene)).iter().flatten().filter(|p| **p != NOBODY).count();
        assert_eq!(beyond, 2, "the diagonal, from both sides");
    }
}
