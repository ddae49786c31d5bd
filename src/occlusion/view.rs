//! The camera of online culling, and its frustum as planes.
//!
//! Based on: Gribb, Hartmann, *Fast extraction of viewing frustum planes from the world-view-projection matrix*, 2001. Deviation: relative
//! to the eye, where a perspective projection is three linear forms without cancellation, at any distance from the origin.

use super::bounds::Bounds;
use glam::{DVec2, DVec3};

/// Least distance of a box outside a plane, relative to its distance and size. Larger: boxes beside the screen are drawn. Smaller:
/// rounding, some 2^-50, loses boxes on its edge.
const ROUNDING: f64 = 1e-12;

/// A perspective camera.
///
/// A point `p` has the clip coordinates `x . (p - eye)`, `y . (p - eye)` and `w . (p - eye)`; it is on the screen where `|x| <= w` and
/// `|y| <= w`, and drawn where `near <= w <= far`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct View {
    /// Metres.
    pub eye: DVec3,
    /// First row of projection times rotation.
    pub x: DVec3,
    /// Second row; up on the screen.
    pub y: DVec3,
    /// Fourth row: a unit vector along the view direction.
    pub w: DVec3,
    /// Distance of the near plane along `w`, metres, above 0.
    pub near: f64,
    /// Distance of the far plane along `w`, metres; infinite for none.
    pub far: f64,
}

impl View {
    /// A camera at `eye` that looks at `target`, upright while it can be, without a far plane. `fov_y` is the vertical opening angle in
    /// radians, in (0, pi); `aspect` is width over height; `near` is in metres, above 0.
    pub fn look_at(eye: DVec3, target: DVec3, fov_y: f64, aspect: f64, near: f64) -> Self {
        let w = (target - eye).normalize_or(DVec3::NEG_Z);
        let up = if w.y.abs() > 1.0 - 1e-9 { DVec3::Z } else { DVec3::Y };
        let right = w.cross(up).normalize();
        let focal = 1.0 / (0.5 * fov_y).tan();
        Self { eye, x: right * (focal / aspect), y: right.cross(w) * focal, w, near, far: f64::INFINITY }
    }
}

/// The planes of a frustum, in the order of tests: near, left, right, bottom, top, far (Ivson 2006: in a walkthrough, most of the model is
/// behind the camera).
pub const PLANES: usize = 6;

/// A bit for each plane that a box may cross.
pub type PlaneMask = u8;

/// Every plane.
pub const ALL_PLANES: PlaneMask = (1 << PLANES) - 1;

/// Position of a box relative to a frustum.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Side {
    /// Certainly outside of this plane.
    Outside(u8),
    /// Not certainly outside; inside all planes except these.
    Crosses(PlaneMask),
}

/// A view frustum.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Frustum {
    eye: DVec3,
    /// Outward unit normals.
    normals: [DVec3; PLANES],
    /// Distances of the planes from the eye, metres.
    offsets: [f64; PLANES],
}

impl Frustum {
    /// The frustum of the whole screen.
    pub fn new(view: &View) -> Self {
        Self::within(view, DVec2::NEG_ONE, DVec2::ONE)
    }

    /// The frustum of a rectangle of the screen, such as a portal's, in normalized device coordinates, +Y up.
    pub fn within(view: &View, min: DVec2, max: DVec2) -> Self {
        let View { eye, x, y, w, near, far } = *view;
        let sides = [min.x * w - x, x - max.x * w, min.y * w - y, y - max.y * w].map(DVec3::normalize);
        let normals = [-w, sides[0], sides[1], sides[2], sides[3], w];
        Self { eye, normals, offsets: [-near, 0.0, 0.0, 0.0, 0.0, far] }
    }

    /// The eye.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Tests a box against the planes of `mask`, starting with `first`; adds the number of tests to `tests`.
    #[inline]
    pub fn side(&self, bounds: &Bounds, mask: PlaneMask, first: u8, tests: &mut u64) -> Side {
        let at = bounds.centre - self.eye;
        let error = ROUNDING * (at.abs() + bounds.half).element_sum();
        let mut crossed = 0;
        let mut left = mask;
        while left != 0 {
            let plane = if left >> first & 1 != 0 { first } else { left.trailing_zeros() as u8 };
            left &= !(1 << plane);
            *tests += 1;
            let k = usize::from(plane);
            let distance = self.normals[k].dot(at) - self.offsets[k];
            let reach = bounds.reach(self.normals[k]);
            if distance - reach > error {
                return Side::Outside(plane);
            }
            crossed |= u8::from(distance + reach > -error) << plane;
        }
        Side::Crosses(crossed)
    }

    /// Whether a box extends in front of the near plane, where an oracle cannot decide.
    #[inline]
    pub fn meets_near(&self, bounds: &Bounds) -> bool {
        self.normals[0].dot(bounds.centre - self.eye) - self.offsets[0] + bounds.reach(self.normals[0]) > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::geom::Aabb;

    fn boxed(min: [f64; 3], max: [f64; 3]) -> Bounds {
        Bounds::from(Aabb { min: min.into(), max: max.into() })
    }

    #[test]
    fn boxes_inside_across_and_outside() {
        // 90 degrees upwards, aspect 2: at distance z, x from -2z to 2z and y from -z to z.
        let view = View { far: 50.0, ..View::look_at(DVec3::ZERO, DVec3::NEG_Z, 90f64.to_radians(), 2.0, 1.0) };
        let frustum = Frustum::new(&view);
        let side = |b: &Bounds| frustum.side(b, ALL_PLANES, 0, &mut 0);
        assert_eq!(side(&boxed([-1., -1., -6.], [1., 1., -5.])), Side::Crosses(0));
        assert_eq!(side(&boxed([-1., -1., -60.], [1., 1., -55.])), Side::Outside(5));
        assert_eq!(side(&boxed([-1., -1., 5.], [1., 1., 6.])), Side::Outside(0));
        assert_eq!(side(&boxed([-30., -1., -6.], [-20., 1., -5.])), Side::Outside(1));
        assert_eq!(side(&boxed([20., -1., -6.], [30., 1., -5.])), Side::Outside(2));
        assert_eq!(side(&boxed([-1., 9., -6.], [1., 10., -5.])), Side::Outside(4));
        // Across the near plane and to the right of the screen's right edge.
        assert_eq!(side(&boxed([0., 0., -2.], [4.0, 0.1, -0.5])), Side::Crosses(0b000101));
        // Rotated by 45 degrees about the view direction: the oriented box extends in to 5.6, its axis-aligned box to 5.
        let turned =
            [DVec3::new(7., 0.7, -3.), DVec3::new(6.3, 0., -3.), DVec3::new(7.7, 0., -3.), DVec3::new(7., -0.7, -3.)];
        let diagonals = [DVec3::new(1., 1., 0.), DVec3::new(-1., 1., 0.), DVec3::Z].map(DVec3::normalize);
        assert_eq!(side(&Bounds::along(&turned, diagonals)), Side::Outside(2));
    }

    #[test]
    fn the_near_plane_and_a_rectangle_of_the_screen() {
        let view = View::look_at(DVec3::ONE, DVec3::ONE + DVec3::X, 90f64.to_radians(), 1.0, 0.5);
        let frustum = Frustum::new(&view);
        assert!(frustum.meets_near(&boxed([1.4, 0., 0.], [2., 1., 1.])));
        assert!(!frustum.meets_near(&boxed([1.6, 0., 0.], [2., 1., 1.])));
        // Looking along +X, right is +Z. The right half of the screen shows the space right of the eye.
        let right = Frustum::within(&view, DVec2::new(0.0, -1.0), DVec2::ONE);
        let outside = |b: &Bounds| matches!(right.side(b, ALL_PLANES, 0, &mut 0), Side::Outside(_));
        assert!(outside(&boxed([5., 0.5, 0.], [6., 1., 0.9])));
        assert!(!outside(&boxed([5., 0.5, 1.1], [6., 1., 2.])));
    }
}
