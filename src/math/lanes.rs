//! Vectors of registers: as many points as a register has lanes. No closures: what they do would not be compiled for the registers.

use glam::DVec3;
use pulp::Simd;

/// The same point in every lane.
#[inline(always)]
pub(crate) fn splat<S: Simd>(simd: S, p: DVec3) -> [S::f64s; 3] {
    [simd.splat_f64s(p.x), simd.splat_f64s(p.y), simd.splat_f64s(p.z)]
}

/// Register `k` of values for groups of points.
#[inline(always)]
pub(crate) fn load<S: Simd, const N: usize>([x, y, z]: [&[f64; N]; 3], k: usize) -> [S::f64s; 3] {
    [S::as_simd_f64s(x).0[k], S::as_simd_f64s(y).0[k], S::as_simd_f64s(z).0[k]]
}

/// `a - b`.
#[inline(always)]
pub(crate) fn sub<S: Simd>(simd: S, a: [S::f64s; 3], b: [S::f64s; 3]) -> [S::f64s; 3] {
    [simd.sub_f64s(a[0], b[0]), simd.sub_f64s(a[1], b[1]), simd.sub_f64s(a[2], b[2])]
}

/// `a` times a number.
#[inline(always)]
pub(crate) fn scale<S: Simd>(simd: S, a: [S::f64s; 3], by: S::f64s) -> [S::f64s; 3] {
    [simd.mul_f64s(a[0], by), simd.mul_f64s(a[1], by), simd.mul_f64s(a[2], by)]
}

/// The dot product.
#[inline(always)]
pub(crate) fn dot<S: Simd>(simd: S, a: [S::f64s; 3], b: [S::f64s; 3]) -> S::f64s {
    let [x, y, z] = [simd.mul_f64s(a[0], b[0]), simd.mul_f64s(a[1], b[1]), simd.mul_f64s(a[2], b[2])];
    simd.add_f64s(simd.add_f64s(x, y), z)
}

/// The cross product.
#[inline(always)]
pub(crate) fn cross<S: Simd>(simd: S, a: [S::f64s; 3], b: [S::f64s; 3]) -> [S::f64s; 3] {
    [
        simd.sub_f64s(simd.mul_f64s(a[1], b[2]), simd.mul_f64s(a[2], b[1])),
        simd.sub_f64s(simd.mul_f64s(a[2], b[0]), simd.mul_f64s(a[0], b[2])),
        simd.sub_f64s(simd.mul_f64s(a[0], b[1]), simd.mul_f64s(a[1], b[0])),
    ]
}

/// `a` where a mask is set, otherwise `b`.
#[inline(always)]
pub(crate) fn select<S: Simd>(simd: S, mask: S::m64s, a: [S::f64s; 3], b: [S::f64s; 3]) -> [S::f64s; 3] {
    [simd.select_f64s(mask, a[0], b[0]), simd.select_f64s(mask, a[1], b[1]), simd.select_f64s(mask, a[2], b[2])]
}
