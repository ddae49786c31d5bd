//! The camera, rectangles on the screen, and boxes against both.
//!
//! Everything is relative to the eye, where a perspective projection is three linear forms: clip-space x, y and w. Nothing
//! cancels, whatever the distance of the eye from the origin. The near and far planes are not used: culling by the eye's own
//! plane (`w = 0`) keeps more, and holds for reversed and infinite depth as well.

use crate::online::view::View;
use glam::{DMat3, DVec3, Mat4, Vec2, Vec3};

/// A perspective camera.
///
/// A point `p` has the clip coordinates `x . (p - eye)`, `y . (p - eye)` and `w . (p - eye)`, and is on the screen where
/// `|x| <= w` and `|y| <= w`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Camera {
    /// Metres, relative to the file's origin.
    pub eye: Vec3,
    /// First row of projection times rotation.
    pub x: Vec3,
    /// Second row; up on the screen.
    pub y: Vec3,
    /// Fourth row; along the view direction.
    pub w: Vec3,
}

impl Camera {
    /// A camera at `eye` that looks at `target` (metres, relative to the file's origin), upright while it can be.
    /// `fov_y` is the vertical opening angle in radians, in (0, pi); `aspect` is width over height.
    pub fn look_at(eye: DVec3, target: DVec3, fov_y: f64, aspect: f64) -> Self {
        let forward = (target - eye).normalize_or(DVec3::NEG_Z);
        let up = if forward.y.abs() > 1.0 - 1e-9 { DVec3::Z } else { DVec3::Y };
        let right = forward.cross(up).normalize();
        let focal = 1.0 / (0.5 * fov_y).tan();
        Self {
            eye: eye.as_vec3(),
            x: (right * (focal / aspect)).as_vec3(),
            y: (right.cross(forward) * focal).as_vec3(),
            w: forward.as_vec3(),
        }
    }

    /// The camera of any perspective view-projection matrix, off-centre ones included. Its translation is not read: it is
    /// implied by `eye`, more exactly.
    pub fn from_view_proj(eye: Vec3, view_proj: &Mat4) -> Self {
        Self { eye, x: view_proj.row(0).truncate(), y: view_proj.row(1).truncate(), w: view_proj.row(3).truncate() }
    }

    /// The direction from the eye through a point of the screen (normalised device coordinates), with `w = 1`. Not finite
    /// where the three rows are dependent.
    pub fn ray(&self, ndc: glam::DVec2) -> DVec3 {
        self.unproject() * DVec3::new(ndc.x, ndc.y, 1.0)
    }

    /// The same for online culling, with a near plane at `near` metres, above 0.
    pub fn view(&self, near: f64) -> View {
        let Self { eye, x, y, w } = *self;
        View { eye: eye.as_dvec3(), x: x.as_dvec3(), y: y.as_dvec3(), w: w.as_dvec3(), near, far: f64::INFINITY }
    }

    /// From clip-space (x, y, w) to directions.
    pub fn unproject(&self) -> DMat3 {
        DMat3::from_cols(self.x.as_dvec3(), self.y.as_dvec3(), self.w.as_dvec3()).transpose().inverse()
    }
}

/// An axis-aligned rectangle on the screen: normalised device coordinates, +Y up.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Rect {
    /// Left, bottom.
    pub min: Vec2,
    /// Right, top.
    pub max: Vec2,
}

impl Rect {
    /// The whole screen.
    pub const FULL: Self = Self { min: Vec2::NEG_ONE, max: Vec2::ONE };
    /// Nothing.
    pub const EMPTY: Self = Self { min: Vec2::INFINITY, max: Vec2::NEG_INFINITY };

    /// True while no point is inside.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// What both cover.
    pub fn intersection(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// The smallest rectangle that covers both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// True where `other` lies inside.
    pub fn covers(&self, other: &Self) -> bool {
        self.min.cmple(other.min).all() && other.max.cmple(self.max).all()
    }
}

/// A convex region of the screen with at most eight sides: across, upright and along both diagonals.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Octagon {
    /// Between its upright and its level sides.
    pub rect: Rect,
    /// Between its slanted sides: in the coordinates x + y and x - y.
    pub diagonals: Rect,
}

impl Octagon {
    /// The slanted sides of the whole screen.
    pub const ALL_DIAGONALS: Rect = Rect { min: Vec2::splat(-2.0), max: Vec2::splat(2.0) };
    /// The whole screen.
    pub const FULL: Self = Self { rect: Rect::FULL, diagonals: Self::ALL_DIAGONALS };
    /// Nothing.
    pub const EMPTY: Self = Self { rect: Rect::EMPTY, diagonals: Rect::EMPTY };

    /// True where no point is inside, as far as two pairs of sides tell at a time.
    pub fn is_empty(&self) -> bool {
        let (low, high, cut) = (self.rect.min, self.rect.max, &self.diagonals);
        self.rect.is_empty()
            || cut.is_empty()
            || low.x + low.y > cut.max.x
            || high.x + high.y < cut.min.x
            || low.x - high.y > cut.max.y
            || high.x - low.y < cut.min.y
    }

    /// What both cover.
    pub fn intersection(self, other: Self) -> Self {
        Self { rect: self.rect.intersection(other.rect), diagonals: self.diagonals.intersection(other.diagonals) }
    }

    /// The smallest region with these sides that covers both.
    pub fn union(self, other: Self) -> Self {
        Self { rect: self.rect.union(other.rect), diagonals: self.diagonals.union(other.diagonals) }
    }

    /// True where `other` lies inside.
    pub fn covers(&self, other: &Self) -> bool {
        self.rect.covers(&other.rect) && self.diagonals.covers(&other.diagonals)
    }
}

/// Relative error of the `f32` sums below: each has under eight roundings of 2^-24, so at most 5e-7 of the sum of the
/// magnitudes of its terms. Larger: boxes just beside a rectangle pass. Smaller: boxes on its edge get lost.
const SUM_ERROR: f32 = 1e-6;

/// The pyramid from the eye through the screen, as half-spaces relative to the eye.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pyramid {
    camera: Camera,
    /// `n . v <= 0` inside: right, left, top, bottom, and not behind the eye.
    normals: [Vec3; 5],
    /// Per component, a bound of the terms that `normals` are sums of.
    magnitudes: [Vec3; 5],
}

impl Pyramid {
    pub fn new(camera: &Camera) -> Self {
        let Camera { x, y, w, .. } = *camera;
        let (across, along) = (x.abs() + w.abs(), y.abs() + w.abs());
        Self {
            camera: *camera,
            normals: [x - w, -x - w, y - w, -y - w, -w],
            magnitudes: [across, across, along, along, w.abs()],
        }
    }

    /// How far the box is outside the plane that it is farthest outside of, less what rounding may make of it: above 0, it is
    /// certainly outside. Never above 0 for a box or a camera that isn't a number.
    #[inline(always)]
    fn outside(&self, centre: [f32; 3], half: [f32; 3]) -> f32 {
        let eye = self.camera.eye.to_array();
        let mut outside = f32::NEG_INFINITY;
        for (n, magnitude) in self.normals.iter().zip(&self.magnitudes) {
            let (mut distance, mut error) = (0.0, 0.0);
            for axis in 0..3 {
                let at = centre[axis] - eye[axis];
                distance += n[axis] * at - n[axis].abs() * half[axis];
                error += magnitude[axis] * (at.abs() + half[axis]);
            }
            let by = distance - SUM_ERROR * error;
            outside = if by > outside { by } else { outside };
        }
        outside
    }

    /// True where the box is certainly outside one of the planes.
    #[inline]
    pub fn excludes(&self, centre: Vec3, half: Vec3) -> bool {
        self.outside(centre.to_array(), half.to_array()) > 0.0
    }

    /// What covers the box on the screen, slanted sides too where `octagons`; the whole screen for a box that reaches behind the eye. It
    /// depends on the box and the camera only, so a smaller opening never shows more.
    pub fn outline(&self, centre: Vec3, half: Vec3, octagons: bool) -> Octagon {
        let centre = centre - self.camera.eye;
        let reach = centre.abs() + half;
        // Eight corners at a time, in loops without branches.
        let corners = |form: Vec3, magnitude: Vec3| -> ([f32; 8], f32) {
            let (middle, step) = (form.dot(centre), form * half);
            let sign = |bit: usize, i: usize| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corner = |i| middle + (sign(0, i) * step.x + sign(1, i) * step.y + sign(2, i) * step.z);
            (std::array::from_fn(corner), SUM_ERROR * magnitude.dot(reach))
        };
        let (depth, error) = corners(self.camera.w, self.camera.w.abs());
        let nearest = depth.iter().copied().fold(f32::INFINITY, f32::min) - error;
        // The sums may be off by as much again before the quotients lose their sign.
        if nearest <= error || nearest.is_nan() {
            return Octagon::FULL;
        }
        let near: [f32; 8] = std::array::from_fn(|i| 1.0 / (depth[i] - error));
        let far: [f32; 8] = std::array::from_fn(|i| 1.0 / (depth[i] + error));
        let extent = |form: Vec3, magnitude: Vec3| {
            let (at, error) = corners(form, magnitude);
            let (mut min, mut max) = (f32::INFINITY, f32::NEG_INFINITY);
            for i in 0..8 {
                let (low, high) = (at[i] - error, at[i] + error);
                min = min.min(low * if low > 0.0 { far[i] } else { near[i] });
                max = max.max(high * if high > 0.0 { near[i] } else { far[i] });
            }
            // Quotients round by a few times 2^-24 of their size; only those within the screen matter.
            (min - 1e-6, max + 1e-6)
        };
        let Camera { x, y, .. } = self.camera;
        let between = |a: Vec3, b: Vec3, magnitudes: [Vec3; 2]| {
            let (a, b) = (extent(a, magnitudes[0]), extent(b, magnitudes[1]));
            Rect { min: Vec2::new(a.0, b.0), max: Vec2::new(a.1, b.1) }
        };
        // Where the rows nearly cancel, the sum is no more exact than they are.
        let both = [x.abs() + y.abs(); 2];
        let rect = between(x, y, [x.abs(), y.abs()]);
        Octagon { rect, diagonals: if octagons { between(x + y, x - y, both) } else { Octagon::ALL_DIAGONALS } }
    }
}

/// Boxes as centre and half-size, one array a component, so that 64 of them against a pyramid are a loop without branches.
#[derive(Clone, Debug, Default)]
pub(super) struct Boxes {
    centre: [Vec<f32>; 3],
    half: [Vec<f32>; 3],
}

impl Boxes {
    /// From corners; rounded outwards.
    pub fn new(corners: impl Iterator<Item = [Vec3; 2]>) -> Self {
        let mut boxes = Self::default();
        for [min, max] in corners {
            let centre = (min + max) * 0.5;
            // Above the roundings of the middle, of this difference and of the product.
            let half = (max - centre).max(centre - min) + (centre.abs() + min.abs().max(max.abs())) * (2.0 * f32::EPSILON);
            for axis in 0..3 {
                boxes.centre[axis].push(centre[axis]);
                boxes.half[axis].push(half[axis]);
            }
        }
        // Whole words; the padding is masked off by the caller.
        let padded = boxes.centre[0].len().next_multiple_of(64);
        for column in boxes.centre.iter_mut().chain(&mut boxes.half) {
            column.resize(padded, 0.0);
        }
        boxes
    }

    /// Centre and half-size.
    #[inline]
    pub fn get(&self, i: usize) -> (Vec3, Vec3) {
        let at = |columns: &[Vec<f32>; 3]| Vec3::new(columns[0][i], columns[1][i], columns[2][i]);
        (at(&self.centre), at(&self.half))
    }

    /// A bit for each of the boxes `64 * word ..`: set where the pyramid doesn't exclude it.
    pub fn word(&self, word: usize, pyramid: &Pyramid) -> u64 {
        let block = |column: &Vec<f32>| -> [f32; 64] { std::array::from_fn(|i| column[word * 64 + i]) };
        let (centre, half) = (self.centre.each_ref().map(block), self.half.each_ref().map(block));
        // Two loops, so that the first has no branch and no carry: the compiler makes it several boxes at a time.
        let mut outside = [0f32; 64];
        for i in 0..64 {
            outside[i] = pyramid.outside([centre[0][i], centre[1][i], centre[2][i]], [half[0][i], half[1][i], half[2][i]]);
        }
        (0..64).fold(0, |bits, i| bits | u64::from(outside[i] <= 0.0) << i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn looking_along_x(fov_y: f64) -> Camera {
        Camera::look_at(DVec3::ZERO, DVec3::X, fov_y, 2.0)
    }

    #[test]
    fn a_ray_projects_back_to_its_pixel_at_every_angle() {
        for fov in [1e-3f64, 1.0, 60.0, 120.0, 175.0] {
            let camera = Camera::look_at(DVec3::new(3.0, 1.0, 2.0), DVec3::new(9.0, -4.0, 5.0), fov.to_radians(), 1.7);
            for ndc in [DVec2::ZERO, DVec2::new(-1.0, 0.3), DVec2::new(0.9, 1.0)] {
                let v = camera.ray(ndc);
                let w = camera.w.as_dvec3().dot(v);
                let back = DVec2::new(camera.x.as_dvec3().dot(v), camera.y.as_dvec3().dot(v)) / w;
                assert!((w - 1.0).abs() < 1e-9 && (back - ndc).length() < 1e-6, "fov {fov}: {ndc} became {back}");
            }
        }
    }

    #[test]
    fn a_matrix_and_look_at_make_the_same_camera() {
        let (eye, target) = (Vec3::new(3.0, 1.0, 2.0), Vec3::new(9.0, -4.0, 5.0));
        let rotation = glam::camera::rh::view::look_at_quat(eye, target, Vec3::Y);
        let (near, focal, aspect) = (0.1f32, 1.0 / 0.5f32.tan(), 1.5f32);
        // Infinite reversed depth, written out: clip z is `near`, w is -z of the view.
        let projection = Mat4::from_cols_array(&[
            focal / aspect,
            0.0,
            0.0,
            0.0, //
            0.0,
            focal,
            0.0,
            0.0, //
            0.0,
            0.0,
            0.0,
            -1.0, //
            0.0,
            0.0,
            near,
            0.0,
        ]);
        let from_matrix =
            Camera::from_view_proj(eye, &(projection * Mat4::from_quat(rotation) * Mat4::from_translation(-eye)));
        let from_points = Camera::look_at(eye.as_dvec3(), target.as_dvec3(), 1.0, 1.5);
        for (a, b) in [(from_matrix.x, from_points.x), (from_matrix.y, from_points.y), (from_matrix.w, from_points.w)] {
            assert!((a - b).length() < 1e-6, "{a} and {b}");
        }
    }

    fn boxed(min: Vec3, max: Vec3) -> (Vec3, Vec3) {
        Boxes::new([[min, max]].into_iter()).get(0)
    }

    #[test]
    fn boxes_beside_behind_and_around_the_eye() {
        let pyramid = Pyramid::new(&looking_along_x(1.0));
        let excluded = |min: [f32; 3], max: [f32; 3]| {
            let (centre, half) = boxed(min.into(), max.into());
            pyramid.excludes(centre, half)
        };
        assert!(!excluded([5.0, -1.0, -1.0], [6.0, 1.0, 1.0]));
        assert!(excluded([-6.0, -1.0, -1.0], [-5.0, 1.0, 1.0]));
        assert!(excluded([5.0, 9.0, -1.0], [6.0, 10.0, 1.0]));
        assert!(!excluded([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]));
        // A huge floor that the eye stands on: its near edge is far outside, yet it is seen.
        assert!(!excluded([-1e4, -1.7, -1e4], [1e4, -1.6, 1e4]));
        assert!(!excluded([f32::NAN; 3], [1.0; 3]));
    }

    #[test]
    fn the_rectangle_of_a_box_is_that_of_its_corners() {
        let camera = looking_along_x(90f64.to_radians());
        let rect = |min: [f32; 3], max: [f32; 3]| {
            let (centre, half) = boxed(min.into(), max.into());
            Pyramid::new(&camera).outline(centre, half, false).rect
        };
        // 90 degrees upwards, aspect 2; +Z is to the right. At x = 2: y / 2 and z / 4.
        let r = rect([2.0, -1.0, 1.0], [4.0, 1.0, 2.0]);
        assert!((r.min - Vec2::new(0.125, -0.5)).abs().max_element() < 1e-4, "{r:?}");
        assert!((r.max - Vec2::new(0.5, 0.5)).abs().max_element() < 1e-4, "{r:?}");
        assert_eq!(rect([-1.0, 5.0, 5.0], [1.0, 6.0, 6.0]), Rect::FULL);
    }

    /// A point on the edge of a rectangle, at every scale and opening angle, is neither excluded nor outside it.
    #[test]
    fn rounding_never_loses_a_point_of_the_screen() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        for round in 0..20_000 {
            let fov = [1e-3f64, 5.0, 60.0, 175.0][round % 4].to_radians();
            let eye = DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5) * 10f64.powf(next() * 4.0);
            let camera = Camera::look_at(eye, eye + DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5), fov, 1.0 + next());
            let on_edge = [-1.0, 1.0][round / 4 % 2];
            let ndc = if round % 3 == 0 {
                DVec2::new(on_edge, next() * 2.0 - 1.0)
            } else {
                DVec2::new(next() * 2.0 - 1.0, on_edge)
            };
            let exact = camera.eye.as_dvec3() + camera.ray(ndc) * 10f64.powf(next() * 6.0 - 3.0);
            // The box that a file would hold around it: rounded outwards.
            let (centre, half) = boxed(exact.as_vec3().map(f32::next_down), exact.as_vec3().map(f32::next_up));
            let pyramid = Pyramid::new(&camera);
            let pixel = Rect { min: ndc.as_vec2(), max: ndc.as_vec2() };
            assert!(!pyramid.excludes(centre, half), "round {round}");
            let diagonals = Vec2::new(pixel.min.x + pixel.min.y, pixel.min.x - pixel.min.y);
            let pixel = Octagon { rect: pixel, diagonals: Rect { min: diagonals, max: diagonals } };
            for octagons in [false, true] {
                assert!(!pyramid.outline(centre, half, octagons).intersection(pixel).is_empty(), "round {round}");
            }
        }
    }
}
