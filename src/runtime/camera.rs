//! The camera, and rectangles of its screen.
//!
//! Everything is relative to the eye, where a perspective projection is three linear forms: clip-space x, y and w. There is no cancellation
//! at any distance from the origin. The near and far planes are not used: culling by the eye's own plane (`w = 0`) keeps more, and makes
//! every convention of depth the same.

use crate::occlusion::view::View;
use glam::{DMat3, DVec3, Mat4, Vec2, Vec3};

/// A camera.
///
/// A point `p` has the clip coordinates `x . (p - eye)`, `y . (p - eye)` and `w . (p - eye)`, and is on the screen where
/// `|x| <= w` and `|y| <= w`. An orthographic camera has `w = 0`, and its points have the clip `w` of 1; its lines of sight do not start in one
/// cell, so all modes that cull take what is in the frustum.
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

/// The error for a matrix that is not finite, or shows nothing ([`Camera::from_view_proj`]).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NotACamera;

impl std::fmt::Display for NotACamera {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the matrix is no view times projection: it is not finite, or shows no area")
    }
}

impl std::error::Error for NotACamera {}

/// The axes of an engine's coordinates, metres. A file's are [`Axes::YUp`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Axes {
    /// Right-handed, +Y up: glTF, Bevy, Godot, OpenGL.
    YUp,
    /// Right-handed, +Z up: Blender, Quake, IFC. What was at +Y is at +Z, what was at -Z at +Y.
    ZUp,
    /// Left-handed, +Y up, with X turned round, as Unity's importers of glTF do.
    MirroredX,
    /// Left-handed, +Y up, with Z turned round: Direct3D.
    MirroredZ,
    /// Left-handed, +Z up, with Y and Z exchanged, as Unreal's importer of glTF does (in centimetres).
    LeftHandedZUp,
}

impl Axes {
    /// A point or a direction of the engine in a file's axes.
    pub fn to_file(self, p: Vec3) -> Vec3 {
        match self {
            Self::YUp => p,
            Self::ZUp => Vec3::new(p.x, p.z, -p.y),
            Self::MirroredX => Vec3::new(-p.x, p.y, p.z),
            Self::MirroredZ => Vec3::new(p.x, p.y, -p.z),
            Self::LeftHandedZUp => Vec3::new(p.x, p.z, p.y),
        }
    }
}

impl Camera {
    /// A perspective camera at `eye` that looks at `target` (metres, relative to the file's origin), upright while it can be.
    /// `fov_y` is the vertical opening angle in radians, in (0, pi); `aspect` is width over height.
    pub fn look_at(eye: DVec3, target: DVec3, fov_y: f64, aspect: f64) -> Self {
        let View { eye, x, y, w, .. } = View::look_at(eye, target, fov_y, aspect, 1.0);
        Self { eye: eye.as_vec3(), x: x.as_vec3(), y: y.as_vec3(), w: w.as_vec3() }
    }

    /// An orthographic camera, as of shadow maps and plans: it looks from `eye` to `target` (metres, relative to the file's origin), upright
    /// while it can be, and shows `width` by `height` metres, above 0, around the line between them, at any depth.
    pub fn orthographic(eye: DVec3, target: DVec3, width: f64, height: f64) -> Self {
        let View { x, y, .. } = View::look_at(eye, target, std::f64::consts::FRAC_PI_2, 1.0, 1.0);
        Self { eye: eye.as_vec3(), x: (x * (2.0 / width)).as_vec3(), y: (y * (2.0 / height)).as_vec3(), w: Vec3::ZERO }
    }

    /// The camera of any view-projection matrix, off-centre ones included, with depth as the engine wants it: to 1 or to -1, reversed,
    /// infinite. `eye` is the camera's position, metres, relative to the file's origin. Of a perspective matrix the translation is not used,
    /// because `eye` gives it more exactly.
    ///
    /// # Errors
    ///
    /// If the matrix is not finite, or is of an orthographic camera without area.
    pub fn from_view_proj(eye: Vec3, view_proj: &Mat4) -> Result<Self, NotACamera> {
        let [x, y, w] = [0, 1, 3].map(|row| view_proj.row(row).truncate());
        if !(x.is_finite() && y.is_finite() && w.is_finite()) {
            return Err(NotACamera);
        }
        if w != Vec3::ZERO {
            return Ok(Self { eye, x, y, w });
        }
        // All clip coordinates are over the same w. The eye moves to the middle of the screen.
        let [x, y, w] = [0, 1, 3].map(|row| view_proj.row(row).as_dvec4());
        let (x, y) = (x / w.w, y / w.w);
        let at = eye.as_dvec3().extend(1.0);
        let (x_axis, y_axis) = (x.truncate(), y.truncate());
        let n = x_axis.cross(y_axis);
        let off = (y_axis.cross(n) * x.dot(at) + n.cross(x_axis) * y.dot(at)) / n.length_squared();
        let camera = Self { eye: (eye.as_dvec3() - off).as_vec3(), x: x_axis.as_vec3(), y: y_axis.as_vec3(), w: Vec3::ZERO };
        if camera.eye.is_finite() && camera.x.is_finite() && camera.y.is_finite() { Ok(camera) } else { Err(NotACamera) }
    }

    /// The same for an engine with other axes, in whose coordinates `eye` and the matrix are.
    ///
    /// # Errors
    ///
    /// As [`Camera::from_view_proj`].
    pub fn from_view_proj_in(axes: Axes, eye: Vec3, view_proj: &Mat4) -> Result<Self, NotACamera> {
        let Self { eye, x, y, w } = Self::from_view_proj(eye, view_proj)?;
        let [eye, x, y, w] = [eye, x, y, w].map(|v| axes.to_file(v));
        Ok(Self { eye, x, y, w })
    }

    /// Whether lines of sight are parallel.
    pub(super) fn is_orthographic(&self) -> bool {
        self.w == Vec3::ZERO
    }

    /// The direction from the eye through a point of the screen (normalised device coordinates), with `w = 1`. Not finite if the three rows
    /// are dependent, as those of an orthographic camera.
    pub fn ray(&self, ndc: glam::DVec2) -> DVec3 {
        self.unproject() * DVec3::new(ndc.x, ndc.y, 1.0)
    }

    /// The same perspective camera for online culling, with a near plane at `near` metres, above 0.
    pub fn view(&self, near: f64) -> View {
        let Self { eye, x, y, w } = *self;
        View { eye: eye.as_dvec3(), x: x.as_dvec3(), y: y.as_dvec3(), w: w.as_dvec3(), near, far: f64::INFINITY }
    }

    /// From clip-space (x, y, w) to directions.
    #[inline]
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
    pub(super) const EMPTY: Self = Self { min: Vec2::INFINITY, max: Vec2::NEG_INFINITY };

    /// True if it contains no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// The intersection.
    pub(super) fn intersection(self, other: Self) -> Self {
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

    /// Whether a point of the file is on the screen of a camera, and where.
    fn on_screen(camera: &Camera, p: Vec3) -> Option<Vec2> {
        let v = p - camera.eye;
        let w = if camera.w == Vec3::ZERO { 1.0 } else { camera.w.dot(v) };
        let at = Vec2::new(camera.x.dot(v), camera.y.dot(v)) / w;
        (w > 0.0 && at.abs().max_element() <= 1.0).then_some(at)
    }

    /// The points of a grid, and where each is on the screen, for cameras that must be the same.
    fn assert_same(found: &Camera, expected: &Camera, what: &str) {
        let mut on = 0;
        for i in 0..8000 {
            let p = Vec3::new((i % 20) as f32, (i / 20 % 20) as f32, (i / 400) as f32) - 9.6;
            match (on_screen(found, p), on_screen(expected, p)) {
                (Some(a), Some(b)) => {
                    assert!(a.distance(b) < 1e-4, "{what}: {p} at {a}, not {b}");
                    on += 1;
                }
                (None, None) => {}
                (a, b) => {
                    let edge = a.or(b).map_or(0.0, |at| at.abs().max_element());
                    assert!(edge > 0.9999, "{what}: {p} at {a:?}, not {b:?}");
                }
            }
        }
        assert!(on > 100, "{what}: {on} points");
    }

    const EYE: Vec3 = Vec3::new(3.0, 1.0, 2.0);
    const TARGET: Vec3 = Vec3::new(-9.0, -4.0, 5.0);

    fn right_handed() -> Camera {
        Camera::look_at(EYE.as_dvec3(), TARGET.as_dvec3(), 1.0, 1.5)
    }

    /// Rotation and translation of a camera at [`EYE`], right-handed.
    fn view_matrix() -> Mat4 {
        let rotation = glam::camera::rh::view::look_at_quat(EYE, TARGET, Vec3::Y);
        Mat4::from_quat(rotation) * Mat4::from_translation(-EYE)
    }

    /// A projection that has these two numbers for depth, in the third row.
    fn projection(depth: [f32; 2]) -> Mat4 {
        let focal = 1.0 / 0.5f32.tan();
        let row = |x: f32, y: f32, z: f32, w: f32| glam::Vec4::new(x, y, z, w);
        let rows =
            [row(focal / 1.5, 0., 0., 0.), row(0., focal, 0., 0.), row(0., 0., depth[0], depth[1]), row(0., 0., -1., 0.)];
        Mat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose()
    }

    #[test]
    fn every_convention_of_depth_makes_the_same_camera() {
        let (near, far) = (0.1f32, 100.0f32);
        let conventions = [
            ("to one", [far / (near - far), near * far / (near - far)]),
            ("to minus one", [(far + near) / (near - far), 2.0 * near * far / (near - far)]),
            ("reversed", [near / (far - near), near * far / (far - near)]),
            ("infinite", [-1.0, -near]),
            ("reversed and infinite", [0.0, near]),
        ];
        for (name, depth) in conventions {
            let camera = Camera::from_view_proj(EYE, &(projection(depth) * view_matrix())).unwrap();
            assert_same(&camera, &right_handed(), name);
        }
    }

    #[test]
    fn engines_with_other_axes_have_the_same_camera() {
        // Each engine's coordinates of a file's point, written out.
        type OfFile = fn(Vec3) -> Vec3;
        let engines: [(Axes, OfFile); 5] = [
            (Axes::YUp, |p| p),
            (Axes::ZUp, |p| Vec3::new(p.x, -p.z, p.y)),
            (Axes::MirroredX, |p| Vec3::new(-p.x, p.y, p.z)),
            (Axes::MirroredZ, |p| Vec3::new(p.x, p.y, -p.z)),
            (Axes::LeftHandedZUp, |p| Vec3::new(p.x, p.z, p.y)),
        ];
        for (axes, of_file) in engines {
            assert_eq!(axes.to_file(of_file(TARGET)), TARGET, "{axes:?}");
            // The engine's own matrix: from its coordinates to the right-handed ones, and on from there.
            let to_file = Mat4::from_cols(
                axes.to_file(Vec3::X).extend(0.0),
                axes.to_file(Vec3::Y).extend(0.0),
                axes.to_file(Vec3::Z).extend(0.0),
                glam::Vec4::W,
            );
            let view_proj = projection([0.0, 0.1]) * view_matrix() * to_file;
            let camera = Camera::from_view_proj_in(axes, of_file(EYE), &view_proj).unwrap();
            assert_same(&camera, &right_handed(), &format!("{axes:?}"));
        }
        // A left-handed projection: clip w is +z of a view that is turned round.
        let turned = Mat4::from_scale(Vec3::new(1.0, 1.0, -1.0));
        let left = projection([0.0, 0.1]) * turned;
        assert!(left.w_axis.w == 0.0 && left.z_axis.w == 1.0);
        let mirrored = turned * view_matrix() * turned;
        let camera =
            Camera::from_view_proj_in(Axes::MirroredZ, EYE * Vec3::new(1.0, 1.0, -1.0), &(left * mirrored)).unwrap();
        assert_same(&camera, &right_handed(), "left-handed projection");
    }

    #[test]
    fn orthographic_cameras_show_their_rectangle_at_any_depth() {
        let camera = Camera::orthographic(DVec3::new(0.0, 9.0, 0.0), DVec3::ZERO, 4.0, 2.0);
        // Looking down, +Z of the file is up or down on the screen: half of the height is 1 m either way.
        for (x, z, is_on) in [(1.9, 0.9, true), (-1.9, -0.9, true), (2.1, 0.0, false), (0.0, 1.1, false)] {
            for y in [-50.0, 0.0, 50.0] {
                assert_eq!(on_screen(&camera, Vec3::new(x, y, z)).is_some(), is_on, "{x} {y} {z}");
            }
        }
        // The same by matrices, off-centre, and scaled by a common factor.
        let level = Camera::orthographic(EYE.as_dvec3(), TARGET.as_dvec3(), 6.0, 4.0);
        for (shift, factor) in [(Vec3::ZERO, 1.0), (Vec3::new(0.3, -0.2, 0.1), 2.5)] {
            let clip = Mat4::from_scale(Vec3::new(1.0 / 3.0, 0.5, 0.01));
            let to_screen = clip * Mat4::from_translation(-shift) * view_matrix() * factor;
            // The camera's position as an engine has it: not that of the shifted middle.
            let camera = Camera::from_view_proj(EYE, &to_screen).unwrap();
            let moved = view_matrix().inverse().transform_vector3(shift.with_z(0.0));
            assert_same(&camera, &Camera { eye: EYE + moved, ..level }, "off-centre");
        }
    }

    #[test]
    fn matrices_that_show_nothing_are_refused() {
        let flat = Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0));
        for matrix in [Mat4::ZERO, flat, Mat4::NAN, Mat4::from_scale(Vec3::INFINITY)] {
            assert_eq!(Camera::from_view_proj(Vec3::ONE, &matrix), Err(NotACamera));
        }
    }
}
