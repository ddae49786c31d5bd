//! Rasterizes triangles into the depth buffer.
//!
//! Each edge is a plane through the eye. Two triangles with a common edge have planes of opposite sign and equal size, to the last bit, so
//! there are no cracks. A small triangle goes from tile to tile (`tile.rs`), a larger one from block to block (`whole.rs`).

use super::DepthBuffer;
use super::closed::Outside;
use super::lanes::SIDE;
use crate::math::simd::Vectorize;
use crate::occlusion::pixels::{Form, Rays};
use glam::DVec3;
use std::ops::Range;

/// Most tiles along the longer side that are drawn one by one.
const FEW: usize = 3;

/// Triangles to draw, for dispatch.
pub(super) struct Draw<'a, 's> {
    pub buffer: &'a mut DepthBuffer<'s>,
    pub triangles: Range<u32>,
    /// If set, only triangles with this side towards the eye.
    pub front: Option<Outside>,
}

impl Vectorize for Draw<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let eye = self.buffer.rays.view.eye;
        for t in self.triangles {
            let [a, b, c] = self.buffer.model.corners(t as usize);
            triangle(self.buffer, [a - eye, b - eye, c - eye], self.front);
        }
    }
}

/// Data for each tile.
pub(super) struct Drawn {
    /// Not below 0 inside; a unit is about a pixel's size from the edge.
    pub edges: [Form; 3],
    pub depth: Form,
    /// The depths of the nearest and the farthest corner.
    pub range: [f32; 2],
    /// Depths beyond this (nearer) are not drawn.
    pub near: f64,
    /// The pixels that it may cover, first and last by axis.
    pub pixels: [[usize; 2]; 2],
}

/// Draws a triangle, its corners relative to the eye.
#[inline(always)]
fn triangle(buffer: &mut DepthBuffer<'_>, corners: [DVec3; 3], front: Option<Outside>) {
    let rays = &buffer.rays;
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    // Six times the volume of the tetrahedron with the eye: of either sign if both sides are drawn.
    let volume = normal.dot(a);
    if volume == 0.0 || front.is_some_and(|front| !front.faces_eye(volume)) {
        return;
    }
    let Some(pixels) = extent(rays, corners) else { return };
    let edge = |n: DVec3| {
        let form = rays.form(n);
        form.scaled(volume.signum() / (form.x.abs() + form.y.abs()).max(f64::MIN_POSITIVE))
    };
    let edges = [edge(a.cross(b)), edge(b.cross(c)), edge(c.cross(a))];
    let w = [rays.view.w.dot(a), rays.view.w.dot(b), rays.view.w.dot(c)];
    let least = w[0].min(w[1]).min(w[2]);
    let near = 1.0 / rays.view.near;
    let nearest = if least > rays.view.near { 1.0 / least } else { near };
    let drawn = Drawn {
        edges,
        depth: rays.form(normal * (1.0 / volume)),
        // The rounding error is below this factor.
        range: [nearest as f32, if least > 0.0 { (1.0 / w[0].max(w[1]).max(w[2])) as f32 * (1.0 - 1e-6) } else { 0.0 }],
        near,
        pixels,
    };
    let [columns, rows] = pixels.map(|[first, last]| [first / SIDE, last / SIDE]);
    if (columns[1] - columns[0]).max(rows[1] - rows[0]) >= FEW {
        return drawn.blocks(buffer);
    }
    for y in rows[0]..=rows[1] {
        for x in columns[0]..=columns[1] {
            let index = buffer.index([x, y]);
            if drawn.range[0] > buffer.farthest(index) {
                drawn.tile(buffer, [x, y], index);
            }
        }
    }
}

/// The pixels that a triangle may cover, first and last by axis.
#[inline(always)]
fn extent(rays: &Rays, corners: [DVec3; 3]) -> Option<[[usize; 2]; 2]> {
    let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut grow = |v: DVec3| {
        let p = rays.project(v);
        for k in 0..2 {
            min[k] = min[k].min(p[k]);
            max[k] = max[k].max(p[k]);
        }
    };
    // Points in front of the near plane are not drawn; half of its distance is a safe place to clip.
    let near = rays.view.near * 0.5;
    let w = [rays.view.w.dot(corners[0]), rays.view.w.dot(corners[1]), rays.view.w.dot(corners[2])];
    for i in 0..3 {
        let j = (i + 1) % 3;
        if w[i] >= near {
            grow(corners[i]);
        }
        if (w[i] >= near) != (w[j] >= near) {
            grow(corners[i] + (corners[j] - corners[i]) * ((near - w[i]) / (w[j] - w[i])));
        }
    }
    rays.pixels(min, max)
}
