//! Objects with a closed surface, whose front hides the back.
//!
//! An object is closed if each edge of a triangle belongs to exactly one other triangle with the opposite direction; corners at one
//! position count as one. A ray from outside hits a front first, so backs need not be drawn. If a model is wrong (a shell turned inside
//! out), less is drawn and so less is hidden; nothing visible is lost.

use crate::occlusion::geometry::{Geometry, GeometryObject};
use glam::DVec3;
use std::collections::HashMap;

/// The outside of a closed object's triangles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Outside {
    /// The side from which corners are counter-clockwise.
    CounterClockwise,
    /// The side from which corners are clockwise.
    Clockwise,
}

impl Outside {
    /// The outside of an object; `None` if it is not closed.
    pub fn of(model: &Geometry<'_>, object: &GeometryObject) -> Option<Self> {
        let mut places: HashMap<[u64; 3], u32> = HashMap::new();
        let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
        let origin = object.bounds.min;
        let mut volume = 0.0;
        for t in object.triangles.clone() {
            let corners = model.corners(t as usize);
            let ids = corners.map(|p| {
                let next = places.len() as u32;
                // -0.0 and 0.0 are one position.
                *places.entry((p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(next)
            });
            for k in 0..3 {
                let [a, b] = [ids[k], ids[(k + 1) % 3]];
                if a != b {
                    *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { 1 << 16 };
                }
            }
            let [a, b, c] = corners.map(|p| p - origin);
            volume += a.dot(b.cross(c));
        }
        let is_closed = edges.values().all(|&count| count == (1 << 16) + 1);
        match is_closed && volume != 0.0 {
            true => Some(if volume > 0.0 { Self::CounterClockwise } else { Self::Clockwise }),
            false => None,
        }
    }

    /// Whether a triangle's outside faces the eye, given the volume of the tetrahedron of its corners relative to the eye.
    #[inline(always)]
    pub fn faces_eye(self, volume: f64) -> bool {
        (volume < 0.0) == (self == Self::CounterClockwise)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::scenes::{crowd, row};
    use super::*;
    use crate::types::scene::Scene;

    fn of(scene: &Scene, object: usize) -> Option<Outside> {
        let model = Geometry::from(scene);
        Outside::of(&model, &model.objects[object])
    }

    #[test]
    fn boxes_are_closed_and_a_box_without_a_triangle_is_not() {
        let mut scene = crowd(10, 1);
        let first = of(&scene, 0);
        assert!(first.is_some() && (0..scene.objects.len()).all(|o| of(&scene, o) == first));
        for triangle in &mut scene.triangles[..12] {
            triangle.swap(0, 1);
        }
        let turned = of(&scene, 0);
        assert!(turned.is_some() && turned != first);
        // One triangle reversed, one missing, and all of them twice.
        scene.triangles[3].swap(0, 1);
        assert_eq!(of(&scene, 0), None);
        scene.objects[1].triangles.end -= 1;
        assert_eq!(of(&scene, 1), None);
        let doubled = row(&[(0.0, 2)]);
        assert_eq!(of(&doubled, 0), None);
    }

    /// A triangle of a closed box faces the eye if the eye is on the side of its plane opposite to the box.
    #[test]
    fn the_front_is_what_is_seen_from_outside() {
        let scene = row(&[(0.0, 1)]);
        let outside = of(&scene, 0).unwrap();
        let eye = DVec3::new(3.0, 0.1, 0.2);
        let faces: Vec<bool> = (0..12)
            .map(|t| {
                let [a, b, c] = scene.corners(t).map(|p| p - eye);
                outside.faces_eye((b - a).cross(c - a).dot(a))
            })
            .collect();
        let at_front = |t: usize| scene.corners(t).iter().all(|p| p.x > 0.2);
        assert!((0..12).all(|t| faces[t] == at_front(t)), "{faces:?}");
    }
}
