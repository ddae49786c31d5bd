//! Whether a model lies on its side: floors are few large planes, walls are many small ones.

use super::{Scene, triangle_area};
use crate::geom::newell;
use std::collections::HashMap;

/// A triangle faces along an axis if its normal's cosine with it is above this (8 degrees).
const ALONG: f64 = 0.99;
/// Planes of an axis are told apart by this share of the diagonal. Less: floors with a step fall apart. More: storeys run into each other.
const PLANE: f64 = 1.0 / 2000.0;
/// Planes of an axis that are compared: the floors and ceilings of two storeys.
const PLANES: usize = 4;
/// The largest planes that face along Z hold so many times the area of those along X and along Y. In a dozen buildings and levels those
/// along Y hold at least 1.26 times as much as others.
const MORE: f64 = 1.25;
/// All that faces along Z is at least this share of all that faces along Y: the front of a slab of flats is its largest plane, but its
/// floors are more.
const SHARE: f64 = 0.9;

/// A note where a scene whose +Y is taken to be up seems to lie on its side; `None` elsewhere.
pub(super) fn note(scene: &Scene) -> Option<String> {
    is_on_its_side(scene).then(|| "its largest planes face along Z: where +Z is up in the model, give --up z".to_owned())
}

/// Whether a scene has its floors along Z.
pub(crate) fn is_on_its_side(scene: &Scene) -> bool {
    let plane = scene.bounds().diagonal() * PLANE;
    let mut planes: [HashMap<i64, f64>; 3] = Default::default();
    let mut ours = [0.0; 3];
    for t in 0..scene.triangles.len() {
        let corners = scene.corners(t);
        let area = triangle_area(corners);
        let normal = newell(&corners.map(|p| p - corners[0])).normalize_or_zero();
        if let Some(k) = (0..3).find(|&k| normal[k].abs() > ALONG) {
            ours[k] += area;
            *planes[k].entry(((corners[0] + corners[1] + corners[2])[k] / 3.0 / plane).round() as i64).or_default() += area;
        }
    }
    let largest = |planes: &HashMap<i64, f64>| {
        let mut areas: Vec<f64> = planes.values().copied().collect();
        areas.sort_by(|a, b| b.total_cmp(a));
        areas.iter().take(PLANES).sum::<f64>()
    };
    let [x, y, z] = planes.each_ref().map(largest);
    // Walls and floors, not a lone wall.
    x.min(y) > 0.0 && z >= MORE * x.max(y) && ours[2] >= SHARE * ours[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};
    use glam::DVec3;

    /// Storeys of `size` (x, y, z) on each other, without furniture, +Y up.
    fn storeys(size: DVec3, count: usize, turned: bool) -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let turn = |p: DVec3| if turned { DVec3::new(p.x, -p.z, p.y) } else { p };
        for i in 0..count {
            let low = DVec3::Y * size.y * i as f64;
            let corner = |k: usize| low + size * DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
            let sides = [[0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
            let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
            let positions = (0..8).map(|k| turn(corner(k))).collect();
            let (node, role) = (format!("storey {i}"), Role::Unknown);
            builder.add(Mesh { node, role, opaque: true, positions, triangles }).unwrap();
        }
        builder.finish("storeys").unwrap()
    }

    #[test]
    fn a_house_on_its_side_is_noted_and_one_that_stands_is_not() {
        for (size, count) in [((12.0, 2.7, 9.0), 2), ((80.0, 4.0, 30.0), 1), ((60.0, 3.0, 14.0), 8), ((20.0, 3.0, 20.0), 12)]
        {
            let size = DVec3::from(size);
            assert_eq!(note(&storeys(size, count, false)), None, "{size}, {count}");
        }
        assert!(note(&storeys(DVec3::new(12.0, 2.7, 9.0), 2, true)).is_some());
        assert!(note(&storeys(DVec3::new(80.0, 4.0, 30.0), 1, true)).is_some());
    }
}
