//! The camera, and rectangles of its screen.
//!
//! Everything is relative to the eye, where a perspective projection is three linear forms: clip-space x, y and w. There is no cancellation
//! at any distance from the origin. The near and far planes are not used: culling by the eye's own plane (`w = 0`) keeps more, and also
//! works for reversed and infinite depth.

use crate::occlusion::view::View;
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

/// The error for a matrix that is not a perspective projection ([`Camera::from_view_proj`]).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NotPerspective;

impl std::fmt::Display for NotPerspective {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the matrix is not a perspective projection (orthographic cameras can't be culled by portals or rows)")
    }
}

impl std::error::Error for NotPerspective {}

impl Camera {
    /// A camera at `eye` that looks at `target` (metres, relative to the file's origin), upright while it can be.
    /// `fov_y` is the vertical opening angle in radians, in (0, pi); `aspect` is width over height.
    pub fn look_at(eye: DVec3, target: DVec3, fov_y: f64, aspect: f64) -> Self {
        let View { eye, x, y, w, .. } = View::look_at(eye, target, fov_y, aspect, 1.0);
        Self { eye: eye.as_vec3(), x: x.as_vec3(), y: y.as_vec3(), w: w.as_vec3() }
    }

    /// The camera of any perspective view-projection matrix, off-centre ones included. Its translation is not used, because `eye` gives it
    /// more exactly.
    ///
    /// # Errors
    ///
    /// If lines of sight do not meet in an eye. An orthographic camera sees cells other than that of its position, so rows and portals of
    /// one cell would lack visible objects.
    pub fn from_view_proj(eye: Vec3, view_proj: &Mat4) -> Result<Self, NotPerspective> {
        let [x, y, w] = [0, 1, 3].map(|row| view_proj.row(row).truncate());
        if w == Vec3::ZERO || !(x.is_finite() && y.is_finite() && w.is_finite()) {
            return Err(NotPerspective);
        }
        Ok(Self { eye, x, y, w })
    }

    /// The direction from the eye through a point of the screen (normalised device coordinates), with `w = 1`. Not finite if the three rows
    /// are dependent.
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

    /// True if it contains no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// The intersection.
    pub fn intersection(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// The bounding rectangle of both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// True if it contains `other`.
    pub fn covers(&self, other: &Self) -> bool {
        self.min.cmple(other.min).all() && other.max.cmple(self.max).all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

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
    fn orthographic_matrices_are_refused() {
        for scale in [1e-3f32, 1.0, 50.0] {
            let ortho = Mat4::from_scale(Vec3::new(1.0 / scale, 1.0 / scale, 0.01)) * Mat4::from_rotation_y(0.4);
            assert_eq!(Camera::from_view_proj(Vec3::ONE, &ortho), Err(NotPerspective));
        }
        assert!(NotPerspective.to_string().contains("orthographic"));
    }

    #[test]
    fn a_matrix_and_look_at_make_the_same_camera() {
        let (eye, target) = (Vec3::new(3.0, 1.0, 2.0), Vec3::new(9.0, -4.0, 5.0));
        let rotation = glam::camera::rh::view::look_at_quat(eye, target, Vec3::Y);
        let (near, focal, aspect) = (0.1f32, 1.0 / 0.5f32.tan(), 1.5f32);
        // Infinite reversed depth: clip z is `near`, w is -z of the view.
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
            Camera::from_view_proj(eye, &(projection * Mat4::from_quat(rotation) * Mat4::from_translation(-eye))).unwrap();
        let from_points = Camera::look_at(eye.as_dvec3(), target.as_dvec3(), 1.0, 1.5);
        for (a, b) in [(from_matrix.x, from_points.x), (from_matrix.y, from_points.y), (from_matrix.w, from_points.w)] {
            assert!((a - b).length() < 1e-6, "{a} and {b}");
        }
    }
}
