//! Cameras.

use crate::numbers::number;
use enfilade::runtime::{Camera, NotACamera};
use glam::{DMat4, DVec3};

/// The camera of a view-projection matrix, column by column, and an eye, both in the model's coordinates. Both are moved to the file's origin before
/// they lose digits.
///
/// # Errors
///
/// As [`Camera::from_view_proj`].
pub fn camera(view_projection: &[f64; 16], eye: DVec3, origin: DVec3) -> Result<Camera, NotACamera> {
    let moved = DMat4::from_cols_array(view_projection) * DMat4::from_translation(origin);
    Camera::from_view_proj((eye - origin).as_vec3(), &moved.as_mat4())
}

/// The camera that the caller has written: a matrix, then an eye.
pub fn given(origin: DVec3) -> Result<Camera, NotACamera> {
    camera(&std::array::from_fn(number), DVec3::new(number(16), number(17), number(18)), origin)
}
