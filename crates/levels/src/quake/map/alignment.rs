//! Texture alignment of sides: explicit axes, or a rotation about the nearest axis of the map.

use super::brush::Side;
use glam::DVec3;

/// Texture coordinates of a point of a side, for a texture of `size` texels: 1 is its width, and its height downwards.
pub(super) fn texture_coordinates(side: &Side, p: DVec3, size: [u32; 2]) -> [f32; 2] {
    let alignment = &side.alignment;
    let axes = alignment.axes.map_or_else(|| rotated(side.plane.n, alignment.rotation), |axes| axes.map(DVec3::from));
    [0, 1].map(|k| {
        // Editors treat a scale of 0 as 1.
        let scale = if alignment.scale[k] == 0.0 { 1.0 } else { alignment.scale[k] };
        ((axes[k].dot(p) / scale + alignment.offset[k]) / f64::from(size[k])) as f32
    })
}

/// The axes of a side without its own. It is projected along the axis of the map nearest to its normal; of equally near ones the
/// first counts, floors first. The axes are rotated in that plane, degrees.
fn rotated(normal: DVec3, degrees: f64) -> [DVec3; 2] {
    let along = [normal.z.abs(), normal.x.abs(), normal.y.abs()];
    let nearest = (0..3).fold(0, |best, k| if along[k] > along[best] { k } else { best });
    // On floors u leads east and v south; on walls u leads east or north, and v down.
    let [u, v] = [[DVec3::X, -DVec3::Y], [DVec3::Y, -DVec3::Z], [DVec3::X, -DVec3::Z]][nearest];
    let (sin, cos) = degrees.to_radians().sin_cos();
    // Both turn counter-clockwise in the plane of u and against v.
    let turned = |axis: DVec3| {
        let (x, y) = (axis.dot(u), -axis.dot(v));
        u * (x * cos - y * sin) - v * (x * sin + y * cos)
    };
    [turned(u), turned(v)]
}

#[cfg(test)]
mod tests {
    use super::super::brush::tests::block;
    use super::*;
    use quake_map::Alignment;

    fn side(normal: DVec3, alignment: Alignment) -> Side {
        let block = block([0.0; 3], [8.0; 3]);
        let found = block.sides.into_iter().find(|side| side.plane.n.distance(normal) < 1e-9);
        Side { alignment, ..found.expect("a side") }
    }

    fn plain(rotation: f64) -> Alignment {
        Alignment { offset: [0.0; 2], rotation, scale: [1.0; 2], axes: None }
    }

    #[test]
    fn floors_and_walls_have_their_axes() {
        let at = |normal: DVec3, p: [f64; 3]| texture_coordinates(&side(normal, plain(0.0)), DVec3::from(p), [8, 4]);
        // East by the width, south by the height.
        assert_eq!(at(DVec3::Z, [4.0, 0.0, 8.0]), [0.5, 0.0]);
        assert_eq!(at(DVec3::Z, [0.0, 2.0, 8.0]), [0.0, -0.5]);
        // Up a wall is up the picture.
        assert_eq!(at(DVec3::X, [8.0, 4.0, 2.0]), [0.5, -0.5]);
        assert_eq!(at(DVec3::Y, [4.0, 8.0, 2.0]), [0.5, -0.5]);
    }

    #[test]
    fn rotation_scale_offset_and_axes_count() {
        let near = |found: [f32; 2], expected: [f32; 2]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?} is not {expected:?}");
        };
        // A quarter turn of a floor: u leads north.
        near(texture_coordinates(&side(DVec3::Z, plain(90.0)), DVec3::new(0.0, 8.0, 8.0), [8, 8]), [1.0, 0.0]);
        near(texture_coordinates(&side(DVec3::Z, plain(90.0)), DVec3::new(8.0, 0.0, 8.0), [8, 8]), [0.0, 1.0]);
        let scaled = Alignment { offset: [2.0, 4.0], scale: [2.0, 0.0], ..plain(0.0) };
        near(texture_coordinates(&side(DVec3::Z, scaled), DVec3::new(8.0, -4.0, 8.0), [8, 8]), [0.75, 1.0]);
        let own = Alignment { axes: Some([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]), ..plain(45.0) };
        near(texture_coordinates(&side(DVec3::Z, own), DVec3::new(4.0, 1.0, 8.0), [8, 8]), [1.0, 0.5]);
    }
}
