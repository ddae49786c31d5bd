//! Contribution culling: leaves out objects with few pixels, by a conservative bound.
//!
//! The pixels of an object are at most those whose centres are in the rectangle around its box on the screen. An object is left out if that
//! number is certainly below the limit, so no object with at least that many pixels is left out. With a limit of 1, no pixel changes.

use super::boxes::{Boxes, LANES, SUM_ERROR};
use super::camera::Camera;
use super::culler::Culler;
use super::mode::Mode;
use super::scratch::Scratch;
use crate::ObjectId;
use crate::math::bits::ones;
use crate::math::simd::{Vectorize, vectorized};

/// Rounding error of a position on the screen, relative to the screen's size: a quotient and two sums, each with an error of 2^-24 of at
/// most 2. Larger: objects whose rectangle ends just beside a pixel centre are kept. Smaller: objects with one pixel more are left out.
const PLACE_ERROR: f32 = 1e-6;

/// A limit below which objects are left out.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct MinPixels {
    /// Objects with fewer pixels, judged by their boxes, are left out; 0: none.
    pub pixels: u32,
    /// Width and height of the picture, pixels, with one sample at each centre. Multiply by the samples if there are more per pixel.
    pub picture: [u32; 2],
}

impl Culler {
    /// Removes small objects from a frame, if the mode culls at all.
    pub(super) fn leave_out_small(&self, camera: &Camera, mode: Mode, scratch: &mut Scratch) {
        let limit = scratch.min_pixels;
        if limit.pixels > 0 && mode != Mode::None {
            let before = scratch.objects.len();
            vectorized(LeaveOut { boxes: &self.boxes, camera, limit, objects: &mut scratch.objects });
            scratch.stats.small = (before - scratch.objects.len()) as u64;
        }
    }
}

/// See [`Culler::leave_out_small`].
struct LeaveOut<'a> {
    boxes: &'a Boxes,
    camera: &'a Camera,
    limit: MinPixels,
    objects: &'a mut Vec<ObjectId>,
}

impl Vectorize for LeaveOut<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let Self { boxes, camera, limit, objects } = self;
        let screen = Screen::new(camera, limit);
        let mut kept = 0;
        for start in (0..objects.len()).step_by(LANES) {
            let count = LANES.min(objects.len() - start);
            let block: [ObjectId; LANES] = std::array::from_fn(|i| objects[start + i.min(count - 1)]);
            let large = !screen.small(boxes, &block) & (u32::MAX >> (32 - count));
            for i in ones(&[u64::from(large)]) {
                objects[kept] = block[i];
                kept += 1;
            }
        }
        objects.truncate(kept);
    }
}

/// A linear form of the position relative to the eye, with its rounding error.
struct Form {
    normal: [f32; 3],
    /// Factor on a box's half size for its range.
    reach: [f32; 3],
    /// Rounding error per metre of the box centre's distance from the eye (in the 1-norm).
    error: f32,
}

impl Form {
    fn new(normal: glam::Vec3) -> Self {
        let magnitude = normal.abs();
        let reach = (magnitude * (1.0 + SUM_ERROR)).to_array();
        Self { normal: normal.to_array(), reach, error: magnitude.max_element() * SUM_ERROR }
    }

    /// Its least and greatest value in each of some boxes.
    #[inline(always)]
    fn range(&self, at: &[[f32; LANES]; 3], half: &[[f32; LANES]; 3]) -> [[f32; LANES]; 2] {
        let mut range = [[0.0; LANES]; 2];
        for i in 0..LANES {
            let middle = self.normal[0] * at[0][i] + self.normal[1] * at[1][i] + self.normal[2] * at[2][i];
            let length = at[0][i].abs() + at[1][i].abs() + at[2][i].abs();
            let reach =
                self.reach[0] * half[0][i] + self.reach[1] * half[1][i] + self.reach[2] * half[2][i] + self.error * length;
            range[0][i] = middle - reach;
            range[1][i] = middle + reach;
        }
        range
    }
}

/// The screen in pixels.
struct Screen {
    eye: [f32; 3],
    axes: [Form; 2],
    w: Form,
    /// Added to `w`: 1 for an orthographic camera.
    constant: f32,
    size: [f32; 2],
    least: f32,
}

impl Screen {
    fn new(camera: &Camera, limit: MinPixels) -> Self {
        let (axes, w) = ([Form::new(camera.x), Form::new(camera.y)], Form::new(camera.w));
        let size = limit.picture.map(|side| side as f32);
        let constant = f32::from(u8::from(camera.is_orthographic()));
        Self { eye: camera.eye.to_array(), axes, w, constant, size, least: limit.pixels as f32 }
    }

    /// A bit for each box that certainly has fewer pixels than the limit. Never set for a box that extends behind the eye or has NaN.
    #[inline(always)]
    fn small(&self, boxes: &Boxes, objects: &[ObjectId; LANES]) -> u32 {
        let (mut at, mut half) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for i in 0..LANES {
            let (centre, size) = boxes.get(objects[i].index());
            for axis in 0..3 {
                at[axis][i] = centre[axis] - self.eye[axis];
                half[axis][i] = size[axis];
            }
        }
        let [nearest, farthest] = self.w.range(&at, &half).map(|ends| ends.map(|w| w + self.constant));
        let mut pixels = [1.0; LANES];
        for (form, size) in self.axes.iter().zip(self.size) {
            let [low, high] = form.range(&at, &half);
            for i in 0..LANES {
                let left = low[i] / if low[i] < 0.0 { nearest[i] } else { farthest[i] };
                let right = high[i] / if high[i] > 0.0 { nearest[i] } else { farthest[i] };
                // Pixel k has its centre at k + 0.5.
                let first = ((left * 0.5 + (0.5 - PLACE_ERROR)) * size - 0.5).ceil();
                let last = ((right * 0.5 + (0.5 + PLACE_ERROR)) * size - 0.5).floor();
                let count = last - first + 1.0;
                pixels[i] *= if count < 0.0 { 0.0 } else { count };
            }
        }
        (0..LANES).fold(0, |bits, i| bits | u32::from(nearest[i] > 0.0 && pixels[i] < self.least) << i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Prng;
    use glam::{DVec2, DVec3, Vec3};

    fn left_out(camera: &Camera, boxes: &[[Vec3; 2]], pixels: u32, picture: [u32; 2]) -> Vec<bool> {
        let mut objects: Vec<ObjectId> = (0..boxes.len() as u32).map(ObjectId).collect();
        let (boxes, limit) = (Boxes::new(boxes.iter().copied()), MinPixels { pixels, picture });
        let all = objects.clone();
        vectorized(LeaveOut { boxes: &boxes, camera, limit, objects: &mut objects });
        assert!(objects.is_sorted(), "what is kept keeps its order");
        all.iter().map(|o| !objects.contains(o)).collect()
    }

    /// Vertical walls one metre in front of an eye with a view of 45 degrees to each side, 100 pixels: centres are at 0.01, 0.03 ...
    /// metres.
    #[test]
    fn pixels_are_counted_by_their_middles() {
        let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, 90f64.to_radians(), 1.0);
        let count = |x: [f32; 2], y: [f32; 2], z: [f32; 2]| {
            let wall = [Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1])];
            let is_left_out = |&n: &u32| left_out(&camera, &[wall], n, [100, 100])[0];
            (0..20_000).find(|n| is_left_out(&(n + 1)))
        };
        let wall = [-1.0, -1.0];
        assert_eq!(count([0.005, 0.035], [0.005, 0.015], wall), Some(2));
        assert_eq!(count([-0.015, 0.035], [-0.055, 0.015], wall), Some(3 * 4));
        assert_eq!(count([0.011, 0.029], [0.005, 0.015], wall), Some(0), "between two middles");
        assert_eq!(count([0.01, 0.01], [0.01, 0.01], wall), Some(1), "on a middle");
        assert_eq!(count([0.022, 0.068], [0.022, 0.068], [-2.0, -2.0]), Some(1), "twice as far");
        // Front and back count together.
        assert_eq!(count([0.005, 0.035], [0.005, 0.015], [-1.6, -1.0]), Some(2));
        // Around the eye, beside it, behind it, and NaN: for any limit.
        for (x, z) in [([-0.01, 0.01], [-0.01, 0.01]), ([0.01, 0.02], [-1.0, 0.0]), ([0.0, 0.01], [1.0, 2.0])] {
            assert_eq!(count(x, [0.0, 0.01], z), None);
        }
        assert_eq!(count([f32::NAN, f32::NAN], [0.0, 0.01], wall), None);
        assert_eq!(count([f32::NEG_INFINITY, f32::INFINITY], [0.0, 0.01], wall), None);
        assert!(!left_out(&camera, &[[Vec3::splat(5.0), Vec3::splat(6.0)]], 0, [100, 100])[0], "0 is no limit");
    }

    /// A screen of 100 by 50 pixels, each of 2 cm.
    #[test]
    fn pixels_of_an_orthographic_camera_are_the_same_at_any_depth() {
        let camera = Camera::orthographic(DVec3::ZERO, DVec3::NEG_Z, 2.0, 1.0);
        for z in [-100.0, 0.0, 100.0] {
            let wall = [Vec3::new(0.005, 0.005, z), Vec3::new(0.035, 0.055, z)];
            let counts: Vec<u32> = (0..20).filter(|n| left_out(&camera, &[wall], n + 1, [100, 50])[0]).take(1).collect();
            assert_eq!(counts, [2 * 3], "{z}");
        }
    }

    /// Pixels whose centres show a box, by rays.
    fn exact(camera: &Camera, [min, max]: [Vec3; 2], picture: [u32; 2]) -> u32 {
        let eye = camera.eye.as_dvec3();
        let (min, max) = (min.as_dvec3() - eye, max.as_dvec3() - eye);
        let [width, height] = picture;
        let hits = |pixel: u32| {
            let at = DVec2::new(f64::from(pixel % width) + 0.5, f64::from(pixel / width) + 0.5);
            let along = camera.ray(at / DVec2::new(width.into(), height.into()) * 2.0 - 1.0);
            let (mut enter, mut leave) = (0f64, f64::INFINITY);
            for axis in 0..3 {
                let ends = [min[axis] / along[axis], max[axis] / along[axis]];
                enter = enter.max(ends[0].min(ends[1]));
                leave = leave.min(ends[0].max(ends[1]));
            }
            u32::from(enter <= leave)
        };
        (0..width * height).map(hits).sum()
    }

    /// Boxes of up to some pixels, of all scales, far from the origin, with narrow and wide lenses.
    #[test]
    fn nothing_with_as_many_pixels_is_left_out_and_most_with_few_is() {
        let mut rng = Prng::new(5, 0);
        let (mut few, mut found, mut many) = (0, 0, 0);
        for round in 0..600 {
            let fov = [1e-5f64, 1.0, 60.0, 120.0, 179.9][round % 5].to_radians();
            let picture = [[40, 24], [16, 33]][round % 2];
            let scale = 10f64.powf(rng.range(-4.0, 5.0));
            let mut point = || DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
            let (eye, target) = (point() * scale * [0.0, 1.0, 100.0][round % 3], point());
            let (aspect, half) = (f64::from(picture[0]) / f64::from(picture[1]), (fov * 0.5).tan());
            let camera = Camera::look_at(eye, eye + target * scale, fov, aspect);
            let boxes: Vec<[Vec3; 2]> = (0..21)
                .map(|i| {
                    let away = scale * (1.5 + point().x);
                    let pixel = 2.0 * half * away / f64::from(picture[1]);
                    let along = camera.ray(point().truncate() * 1.02);
                    let centre = camera.eye.as_dvec3() + along * away;
                    let size = (point() * pixel * [0.3, 1.0, 4.0][i % 3]).abs();
                    [(centre - size).as_vec3(), (centre + size).as_vec3()]
                })
                .collect();
            let counts: Vec<u32> = boxes.iter().map(|&b| exact(&camera, b, picture)).collect();
            for limit in [1, 2, 5, 30] {
                let left_out = left_out(&camera, &boxes, limit, picture);
                for (i, (&count, left_out)) in counts.iter().zip(left_out).enumerate() {
                    assert!(!left_out || count < limit, "round {round}, box {i}: {count} pixels, limit {limit}");
                    many += usize::from(count >= limit);
                    // A lens of 1e-5 degrees is below the resolution of `f32`, and a wide one gives large rectangles for slanted boxes.
                    if limit > 1 && count * 3 < limit && (1..4).contains(&(round % 5)) {
                        few += 1;
                        found += usize::from(left_out);
                    }
                }
            }
        }
        assert!(found * 100 >= few * 85 && few > 5_000 && many > 5_000, "{found} of {few} found; {many} kept");
    }
}
