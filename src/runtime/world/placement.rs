//! Where a module stands: turned and moved, and nothing else.

use super::super::camera::Camera;
use glam::{DMat3, DMat4, DQuat, DVec3};
use std::fmt;

/// Largest difference of a rotation from a rigid one, per component of its matrix. Larger: a module is stretched, and what is seen past its
/// edges is not what is drawn. Smaller: matrices of an engine in single precision are refused.
const RIGID: f64 = 1e-5;
/// Error of a camera's place in a module, as a share of the distance between them: its place and its three rows are rounded to `f32`, each
/// with an error of 2^-24 of three components. Larger: what is just off the screen is drawn. Smaller: what is on its edge is lost.
const ROUNDED: f64 = 2.0 * f32::EPSILON as f64;

/// A place of a module in a world: a rotation, then a translation in metres.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Placement {
    rotation: DMat3,
    at: DVec3,
}

/// The error for a placement that is not finite, or stretches, shears or mirrors.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NotRigid;

impl fmt::Display for NotRigid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the placement is not rigid: it is not finite, or it stretches, shears or mirrors")
    }
}

impl std::error::Error for NotRigid {}

impl Placement {
    /// Where the module's own coordinates are the world's.
    pub const IDENTITY: Self = Self { rotation: DMat3::IDENTITY, at: DVec3::ZERO };

    /// A rotation (of any length above 0), then a translation, metres.
    ///
    /// # Errors
    ///
    /// If one is not finite.
    pub fn new(rotation: DQuat, at: DVec3) -> Result<Self, NotRigid> {
        let length = rotation.length();
        let is_rotation = length > 0.0 && length.is_finite() && at.is_finite();
        let rotation = || DMat3::from_quat(DQuat::from_vec4(glam::DVec4::from(rotation) / length));
        is_rotation.then(|| Self { rotation: rotation(), at }).ok_or(NotRigid)
    }

    /// The placement of a matrix from the module's coordinates to the world's.
    ///
    /// # Errors
    ///
    /// If the matrix does more than turn and move, by more than 0.00001 in a component.
    pub fn from_matrix(matrix: &DMat4) -> Result<Self, NotRigid> {
        let axes = DMat3::from_mat4(*matrix);
        let is_affine = (matrix.row(3) - glam::DVec4::W).abs().max_element() <= RIGID;
        let turned = axes * axes.transpose() - DMat3::IDENTITY;
        let most = turned.to_cols_array().into_iter().fold(0.0, |most: f64, x| if x.abs() <= most { most } else { x.abs() });
        if !(is_affine && most <= RIGID && axes.determinant() > 0.0) {
            return Err(NotRigid);
        }
        Self::new(DQuat::from_mat3(&axes), matrix.w_axis.truncate())
    }

    /// A point of the module in the world.
    pub fn to_world(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.at
    }

    /// A point of the world in the module's coordinates.
    pub fn to_module(&self, p: DVec3) -> DVec3 {
        self.rotation.transpose() * (p - self.at)
    }

    /// A direction of the module in the world.
    pub(super) fn turn(&self, direction: DVec3) -> DVec3 {
        self.rotation * direction
    }

    /// A camera of the world in the coordinates of a module that reaches so far from its origin, metres, and the largest error of its place.
    pub(super) fn camera(&self, camera: &Camera, extent: f64) -> (Camera, f64) {
        let turned = |v: glam::Vec3| (self.rotation.transpose() * v.as_dvec3()).as_vec3();
        let eye = self.to_module(camera.eye.as_dvec3());
        let Camera { x, y, w, .. } = *camera;
        let moved = Camera { eye: eye.as_vec3(), x: turned(x), y: turned(y), w: turned(w) };
        (moved, ROUNDED * (eye.length() + extent))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_rigid_is_refused() {
        let turned = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, 1.0);
        let placement = Placement::new(turned * 3.0, DVec3::new(1.0, 2.0, 3.0)).unwrap();
        let matrix = DMat4::from_rotation_translation(turned, DVec3::new(1.0, 2.0, 3.0));
        let p = DVec3::new(0.3, -7.0, 2.0);
        for found in [placement, Placement::from_matrix(&matrix).unwrap()] {
            assert!(found.to_world(p).distance(matrix.transform_point3(p)) < 1e-12);
            assert!(found.to_module(found.to_world(p)).distance(p) < 1e-12);
        }
        // In single precision, too.
        assert!(Placement::from_matrix(&matrix.as_mat4().as_dmat4()).is_ok());
        let stretched = matrix * DMat4::from_scale(DVec3::new(1.0, 1.001, 1.0));
        let mirrored = matrix * DMat4::from_scale(DVec3::new(1.0, -1.0, 1.0));
        for bad in [stretched, mirrored, DMat4::ZERO, DMat4::NAN, matrix.transpose()] {
            assert_eq!(Placement::from_matrix(&bad), Err(NotRigid), "{bad}");
        }
        assert_eq!(Placement::new(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), DVec3::ZERO), Err(NotRigid));
        assert_eq!(Placement::new(DQuat::IDENTITY, DVec3::INFINITY), Err(NotRigid));
    }
}
