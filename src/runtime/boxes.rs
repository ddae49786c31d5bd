//! Tests of boxes against half-spaces, many at a time: those of the frustum, of a rectangle of the screen, and of a portal.
//!
//! A box is outside a rectangle of the screen if all of it is on one side, which a plane through the eye decides without a division: its
//! outline on the screen is right of `x = r` exactly if all corners have `x - r w > 0`. That also holds for boxes that extend behind the
//! eye.

use super::camera::{Camera, Rect};
use glam::Vec3;

/// Boxes per test: a multiple of a register's lanes, so that loops need no remainder.
pub(super) const LANES: usize = 16;

/// Relative error of the `f32` sums below: each has under twelve roundings of 2^-24, those of its plane included, so at most 8e-7 of the
/// sum of the magnitudes of its terms. Larger: boxes just beside a rectangle pass. Smaller: boxes on its edge are lost.
pub(super) const SUM_ERROR: f32 = 1e-6;

/// Most half-spaces: four sides, in front of the eye, beyond a portal, and within its doorway.
const MOST: usize = 7;

/// `normal . (p - eye) + offset <= 0` inside.
#[derive(Clone, Copy, Debug, Default)]
struct HalfSpace {
    normal: [f32; 3],
    offset: f32,
    /// Factor on a box's half size that is subtracted from the distance of its centre: the normal's magnitude, plus the rounding error.
    reach: [f32; 3],
    /// Rounding error per metre of the centre's distance from the eye (in the 1-norm).
    error: f32,
}

/// The half-spaces of a rectangle of the screen and of portals.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfSpaces {
    eye: [f32; 3],
    planes: [HalfSpace; MOST],
    count: usize,
}

impl HalfSpaces {
    /// The half-spaces of a rectangle of a camera's screen.
    pub fn of(camera: &Camera, open: &Rect) -> Self {
        let Camera { eye, x, y, w } = *camera;
        let mut all = Self { eye: eye.to_array(), planes: [HalfSpace::default(); MOST], count: 0 };
        if camera.is_orthographic() {
            for (form, low, high) in [(x, open.min.x, open.max.x), (y, open.min.y, open.max.y)] {
                all.add(form, -high - SUM_ERROR * high.abs(), form.abs());
                all.add(-form, low - SUM_ERROR * low.abs(), form.abs());
            }
            return all;
        }
        all.between(x, w, [open.min.x, open.max.x], x.abs() + w.abs());
        all.between(y, w, [open.min.y, open.max.y], y.abs() + w.abs());
        all.add(-w, 0.0, w.abs());
        all
    }

    /// Restricts a form of the camera to a range of multiples of its `w`.
    fn between(&mut self, form: Vec3, w: Vec3, [low, high]: [f32; 2], magnitude: Vec3) {
        self.add(form - w * high, 0.0, magnitude);
        self.add(w * low - form, 0.0, magnitude);
    }

    /// Restricts to boxes with a part where `n . p >= d`.
    #[inline]
    pub fn go_beyond(&mut self, n: Vec3, d: f32) {
        self.add(-n, d - n.dot(Vec3::from(self.eye)), n.abs());
    }

    /// Allows for an eye that is up to `off` metres elsewhere.
    #[inline]
    pub fn grow(&mut self, off: f32) {
        if off > 0.0 {
            for plane in &mut self.planes[..self.count] {
                plane.offset -= off * plane.reach.iter().sum::<f32>();
            }
        }
    }

    #[inline]
    fn add(&mut self, normal: Vec3, offset: f32, magnitude: Vec3) {
        let reach = (normal.abs() + magnitude * SUM_ERROR).to_array();
        self.planes[self.count] =
            HalfSpace { normal: normal.to_array(), offset, reach, error: magnitude.max_element() * SUM_ERROR };
        self.count += 1;
    }

    /// A bit for each of [`LANES`] boxes from `start`: set if no half-space certainly excludes the box. Always set for NaN, and arbitrary
    /// beyond the last box.
    // Where there is one width, one copy: each is more than a kilobyte, and frames with one are as fast.
    #[cfg_attr(feature = "simd", inline(always))]
    #[cfg_attr(not(feature = "simd"), inline(never))]
    pub fn meet(&self, boxes: &Boxes, start: usize) -> u32 {
        let block = |column: &[Vec<f32>; 3], axis: usize| -> [f32; LANES] {
            column[axis][start..start + LANES].try_into().expect("padded to whole blocks")
        };
        let (mut at, half) = ([[0.0; LANES]; 3], [block(&boxes.half, 0), block(&boxes.half, 1), block(&boxes.half, 2)]);
        let mut length = [0.0; LANES];
        for (axis, at) in at.iter_mut().enumerate() {
            let centre = block(&boxes.centre, axis);
            for i in 0..LANES {
                at[i] = centre[i] - self.eye[axis];
                length[i] += at[i].abs();
            }
        }
        let mut outside = [0u32; LANES];
        for plane in &self.planes[..self.count] {
            for i in 0..LANES {
                let middle = plane.normal[0] * at[0][i] + plane.normal[1] * at[1][i] + plane.normal[2] * at[2][i];
                let reach = plane.reach[0] * half[0][i] + plane.reach[1] * half[1][i] + plane.reach[2] * half[2][i];
                outside[i] |= u32::from((middle + plane.offset) - (reach + plane.error * length[i]) > 0.0);
            }
        }
        (0..LANES).fold(0, |bits, i| bits | (outside[i] ^ 1) << i)
    }
}

/// Boxes as centre and half size, one array per component.
#[derive(Clone, Debug, Default)]
pub(super) struct Boxes {
    centre: [Vec<f32>; 3],
    half: [Vec<f32>; 3],
}

impl Boxes {
    /// From corners; rounded outwards.
    pub fn new(corners: impl Iterator<Item = [Vec3; 2]>) -> Self {
        let mut boxes = Self::default();
        for [centre, half] in corners.map(rounded) {
            for axis in 0..3 {
                boxes.centre[axis].push(centre[axis]);
                boxes.half[axis].push(half[axis]);
            }
        }
        boxes.resize(boxes.centre[0].len());
        boxes
    }

    /// Number of boxes.
    pub fn len(&self) -> usize {
        self.centre[0].len().saturating_sub(LANES)
    }

    /// Makes room for `count` boxes.
    pub fn resize(&mut self, count: usize) {
        // A block may start at any box.
        for column in self.centre.iter_mut().chain(&mut self.half) {
            column.resize(count + LANES, 0.0);
        }
    }

    /// Replaces a box.
    pub fn set(&mut self, i: usize, corners: [Vec3; 2]) {
        self.put(i, rounded(corners));
    }

    /// Replaces a box by centre and half size.
    #[inline(always)]
    pub fn put(&mut self, i: usize, [centre, half]: [Vec3; 2]) {
        for axis in 0..3 {
            self.centre[axis][i] = centre[axis];
            self.half[axis][i] = half[axis];
        }
    }

    /// Centre and half-size.
    #[inline]
    pub fn get(&self, i: usize) -> (Vec3, Vec3) {
        let at = |columns: &[Vec<f32>; 3]| Vec3::new(columns[0][i], columns[1][i], columns[2][i]);
        (at(&self.centre), at(&self.half))
    }
}

/// Centre and half size of a box from its corners, rounded outwards.
#[inline]
pub(super) fn rounded([min, max]: [Vec3; 2]) -> [Vec3; 2] {
    let centre = (min + max) * 0.5;
    // Above the rounding errors of the centre, of this difference and of the product.
    let half = (max - centre).max(centre - min) + (centre.abs() + min.abs().max(max.abs())) * (2.0 * f32::EPSILON);
    [centre, half]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec2, DVec3, Vec2};

    fn looking_along_x(fov_y: f64) -> Camera {
        Camera::look_at(DVec3::ZERO, DVec3::X, fov_y, 2.0)
    }

    fn meets(spaces: &HalfSpaces, min: Vec3, max: Vec3) -> bool {
        spaces.meet(&Boxes::new([[min, max]].into_iter()), 0) & 1 == 1
    }

    fn at(x: [f32; 2], y: [f32; 2]) -> Rect {
        Rect { min: Vec2::new(x[0], y[0]), max: Vec2::new(x[1], y[1]) }
    }

    #[test]
    fn boxes_beside_behind_and_around_the_eye() {
        let screen = HalfSpaces::of(&looking_along_x(1.0), &Rect::FULL);
        let meets = |min: [f32; 3], max: [f32; 3]| meets(&screen, min.into(), max.into());
        assert!(meets([5.0, -1.0, -1.0], [6.0, 1.0, 1.0]));
        assert!(!meets([-6.0, -1.0, -1.0], [-5.0, 1.0, 1.0]));
        assert!(!meets([5.0, 9.0, -1.0], [6.0, 10.0, 1.0]));
        assert!(meets([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]));
        // A huge floor below the eye: its near edge is far outside, but it is visible.
        assert!(meets([-1e4, -1.7, -1e4], [1e4, -1.6, 1e4]));
        assert!(meets([f32::NAN; 3], [1.0; 3]));
    }

    #[test]
    fn a_box_meets_the_parts_of_the_screen_that_its_corners_reach() {
        let camera = looking_along_x(90f64.to_radians());
        // 90 degrees upwards, aspect 2; +Z is to the right. At x = 2: y / 2 and z / 4.
        let meets = |open: Rect| meets(&HalfSpaces::of(&camera, &open), Vec3::new(2.0, -1.0, 1.0), Vec3::new(4.0, 1.0, 2.0));
        let (left, right, bottom, top) = (0.125, 0.5, -0.5, 0.5);
        let sides = [
            ([-1.0, left], [-1.0, 1.0]),
            ([right, 1.0], [-1.0, 1.0]),
            ([-1.0, 1.0], [-1.0, bottom]),
            ([-1.0, 1.0], [top, 1.0]),
        ];
        for (side, (x, y)) in sides.into_iter().enumerate() {
            for by in [-1e-4f32, 1e-4] {
                let mut open = at(x, y);
                match side {
                    0 => open.max.x += by,
                    1 => open.min.x -= by,
                    2 => open.max.y += by,
                    _ => open.min.y -= by,
                }
                assert_eq!(meets(open), by > 0.0, "side {side}");
            }
        }
    }

    #[test]
    fn an_orthographic_screen_is_a_column_without_end() {
        // 4 m across along z, 2 m along y, looking along x.
        let screen = HalfSpaces::of(&Camera::orthographic(DVec3::ZERO, DVec3::X, 4.0, 2.0), &Rect::FULL);
        for x in [-1e3, 0.0, 1e3] {
            let meets = |y: f32, z: f32| meets(&screen, Vec3::new(x, y, z), Vec3::new(x + 1.0, y + 0.5, z + 0.5));
            assert!(meets(0.9, 1.9) && meets(-1.4, -2.4) && meets(1.0, 2.0), "{x}");
            assert!(!meets(1.1, 0.0) && !meets(-1.6, 0.0) && !meets(0.0, 2.1) && !meets(0.0, -2.6), "{x}");
        }
    }

    #[test]
    fn what_is_before_a_portal_is_not_seen_through_it() {
        let screen = HalfSpaces::of(&looking_along_x(1.0), &Rect::FULL);
        for (from, seen) in [(2.5, false), (3.5, true), (9.0, true)] {
            let mut beyond = screen;
            beyond.go_beyond(Vec3::X, 4.0);
            assert_eq!(meets(&beyond, Vec3::new(from, -1.0, -1.0), Vec3::new(from + 1.0, 1.0, 1.0)), seen);
            // In the doorway: from 4 to 4.6.
            let mut doorway = beyond;
            doorway.go_beyond(Vec3::NEG_X, -4.6);
            assert_eq!(meets(&doorway, Vec3::new(from, -1.0, -1.0), Vec3::new(from + 1.0, 1.0, 1.0)), from == 3.5);
        }
    }

    /// A point on the edge of the screen, at every scale and opening angle, is not excluded, by the screen or by that point of it.
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
            // The box around it in a file: rounded outwards.
            let (min, max) = (exact.as_vec3().map(f32::next_down), exact.as_vec3().map(f32::next_up));
            assert!(meets(&HalfSpaces::of(&camera, &Rect::FULL), min, max), "round {round}");
            let pixel = Rect { min: ndc.as_vec2(), max: ndc.as_vec2() };
            assert!(meets(&HalfSpaces::of(&camera, &pixel), min, max), "round {round}");
        }
    }
}
