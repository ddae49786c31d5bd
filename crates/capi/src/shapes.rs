//! Points, boxes and cameras as C has them.

use crate::fault::{EnfStatus, Fault, needed, status};
use runtime::glam::{DVec3, Mat4, Vec3};
use runtime::runtime::{Axes, Camera};
use std::mem::MaybeUninit;

/// A point or a direction, metres, relative to the building's origin.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EnfVec3 {
    pub x: f32,
    pub y: f32,
    pub z: f32,
}

/// A point in the model's own coordinates, metres.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EnfDVec3 {
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

/// A box.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EnfBox {
    pub min: EnfVec3,
    pub max: EnfVec3,
}

/// A half-space: `x * px + y * py + z * pz <= d` inside, with a normal of any length but 0.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EnfPlane {
    pub x: f32,
    pub y: f32,
    pub z: f32,
    pub d: f32,
}

/// A line of a drawing.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EnfLine {
    pub from: EnfVec3,
    pub to: EnfVec3,
}

/// A rectangle of the screen, from -1 to 1.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EnfRect {
    pub min_x: f32,
    pub min_y: f32,
    pub max_x: f32,
    pub max_y: f32,
}

/// A camera; `enf_camera_...` make one. A point is on the screen where the products of `x` and `y` with the way from the eye to it are at most
/// that of `w`, but for their sign. `w` of an orthographic camera is 0.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EnfCamera {
    pub eye: EnfVec3,
    pub x: EnfVec3,
    pub y: EnfVec3,
    pub w: EnfVec3,
}

/// The axes of an engine's coordinates, one of `ENF_AXES_...`.
pub type EnfAxes = u32;
/// Right-handed, +Y up: glTF, Godot, OpenGL. A building has these.
pub const ENF_AXES_Y_UP: EnfAxes = 0;
/// Right-handed, +Z up: Blender, Quake.
pub const ENF_AXES_Z_UP: EnfAxes = 1;
/// Left-handed, +Y up, with X turned round: Unity.
pub const ENF_AXES_MIRRORED_X: EnfAxes = 2;
/// Left-handed, +Y up, with Z turned round: Direct3D.
pub const ENF_AXES_MIRRORED_Z: EnfAxes = 3;
/// Left-handed, +Z up, with Y and Z exchanged: Unreal.
pub const ENF_AXES_LEFT_HANDED_Z_UP: EnfAxes = 4;

impl From<Vec3> for EnfVec3 {
    fn from(p: Vec3) -> Self {
        Self { x: p.x, y: p.y, z: p.z }
    }
}

impl From<EnfVec3> for Vec3 {
    fn from(p: EnfVec3) -> Self {
        Self::new(p.x, p.y, p.z)
    }
}

impl From<DVec3> for EnfDVec3 {
    fn from(p: DVec3) -> Self {
        Self { x: p.x, y: p.y, z: p.z }
    }
}

impl From<Camera> for EnfCamera {
    fn from(camera: Camera) -> Self {
        let [eye, x, y, w] = [camera.eye, camera.x, camera.y, camera.w].map(EnfVec3::from);
        Self { eye, x, y, w }
    }
}

impl From<EnfCamera> for Camera {
    fn from(camera: EnfCamera) -> Self {
        let [eye, x, y, w] = [camera.eye, camera.x, camera.y, camera.w].map(Vec3::from);
        Self { eye, x, y, w }
    }
}

fn point(p: EnfVec3) -> DVec3 {
    Vec3::from(p).as_dvec3()
}

/// A camera at `eye` that looks at `target`, upright while it can be. `fov_y` is the vertical angle in radians, in (0, pi); `aspect` is width
/// over height.
#[unsafe(no_mangle)]
pub extern "C" fn enf_camera_look_at(
    eye: EnfVec3,
    target: EnfVec3,
    fov_y: f32,
    aspect: f32,
    camera: Option<&mut MaybeUninit<EnfCamera>>,
) -> EnfStatus {
    status(|| {
        let camera = needed(camera, "the camera")?;
        if !(fov_y > 0.0 && fov_y < std::f32::consts::PI && aspect > 0.0 && aspect.is_finite()) {
            return Err(Fault::argument(format_args!("no camera has an angle of {fov_y} and an aspect of {aspect}")));
        }
        camera.write(Camera::look_at(point(eye), point(target), f64::from(fov_y), f64::from(aspect)).into());
        Ok(())
    })
}

/// An orthographic camera that looks from `eye` to `target` and shows `width` by `height` metres.
#[unsafe(no_mangle)]
pub extern "C" fn enf_camera_orthographic(
    eye: EnfVec3,
    target: EnfVec3,
    width: f32,
    height: f32,
    camera: Option<&mut MaybeUninit<EnfCamera>>,
) -> EnfStatus {
    status(|| {
        let camera = needed(camera, "the camera")?;
        if !(width > 0.0 && height > 0.0 && width.is_finite() && height.is_finite()) {
            return Err(Fault::argument(format_args!("no camera shows {width} by {height} metres")));
        }
        camera.write(Camera::orthographic(point(eye), point(target), f64::from(width), f64::from(height)).into());
        Ok(())
    })
}

/// The camera of an engine's matrix: view, then projection, 16 numbers, column by column, for columns of points. Depth is as the engine wants
/// it. `eye` is where the camera is; it and the matrix are in the engine's axes, relative to the building's origin.
///
/// # Safety
///
/// `view_projection` is null or has 16 numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_camera_from_matrix(
    axes: EnfAxes,
    eye: EnfVec3,
    view_projection: *const f32,
    camera: Option<&mut MaybeUninit<EnfCamera>>,
) -> EnfStatus {
    status(|| {
        let camera = needed(camera, "the camera")?;
        let all = [Axes::YUp, Axes::ZUp, Axes::MirroredX, Axes::MirroredZ, Axes::LeftHandedZUp];
        let axes = all.get(axes as usize).ok_or_else(|| Fault::argument(format_args!("no axes have number {axes}")))?;
        // SAFETY: what this function asks of its caller.
        let matrix = unsafe { crate::lists::list(view_projection, 16, "the matrix") }?;
        let made = Camera::from_view_proj_in(*axes, eye.into(), &Mat4::from_cols_slice(matrix));
        camera.write(made.map_err(Fault::argument)?.into());
        Ok(())
    })
}
