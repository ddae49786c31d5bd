//! Visibility cubes: the view from a point in all directions, as the nearest triangle at each pixel of six faces.
//!
//! [`Raster`] draws the hierarchy from front to back and skips hidden boxes, so that its cost is output-sensitive. **Its cubes are the same
//! to the bit on every machine and for any number of threads.** [`Rays`] casts one ray per pixel, in `f64`: the reference. The two may
//! differ at a pixel only if
//!
//! * its centre is within [`EDGE`] pixels of the line through a projected edge of one of the two triangles (and within a tile, eight
//!   pixels, of the edge), or
//! * it covers both, and within [`EDGE`] pixels of its centre their depths agree to a relative error of [`DEPTH`]: overlapping coplanar
//!   triangles, or
//! * the eye is practically on one of the two: nearer to its plane than [`UNDERFOOT`] times the distance of its farthest corner times its
//!   longest edge over its least altitude.
//!
//! [`settle`] tests a single triangle exactly.
//!
//! [`CubeScene`] is built once per scene and shared by threads; an engine is scratch memory of one thread, and allocates nothing once it
//! and the [`Cube`] are warm (except for hits through glass, whose list grows to its maximum).

mod face;
mod raster;
mod rays;
mod tiles;
mod tree;

pub use raster::Raster;
pub use rays::Rays;

use crate::scene::Scene;
use crate::scene::rays::{Hit, RayScene};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;
use tree::Tree;

/// No triangle.
pub const NONE: u32 = u32::MAX;
/// Within this distance of a projected edge, pixels, rounding decides the side of a pixel centre: steps within a tile are `f32`. Four times
/// the rounding error; also the largest overdraw beyond a triangle's corners.
pub const EDGE: f64 = 1e-4;
/// Depths are equal within this relative error.
pub const DEPTH: f64 = 1e-6;
/// Relative distance from a plane (see above) below which rounding in `f64` decides the eye's side.
pub const UNDERFOOT: f64 = 1e-10;
/// Most pixels along a face's edge.
pub const MAX_SIZE: u32 = 4096;

/// The view of a cube: position and resolution.
///
/// Face `2 * k` looks along the frame's axis `k`, face `2 * k + 1` against it; columns follow axis `k + 1` and rows axis `k + 2` (both
/// modulo 3). Pixels are uniform in tangents. Pixel `(face * size + row) * size + column`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CubeView {
    /// Position in the scene's coordinates, metres.
    pub eye: DVec3,
    /// The cube's axes, orthonormal; the identity is the scene's own.
    pub frame: DMat3,
    /// Pixels along a face's edge: 1 to [`MAX_SIZE`].
    pub size: u32,
}

impl CubeView {
    /// An axis-aligned cube.
    pub fn new(eye: DVec3, size: u32) -> Self {
        Self { eye, frame: DMat3::IDENTITY, size }
    }

    /// Pixels of all faces.
    pub fn pixels(&self) -> usize {
        6 * (self.size as usize).pow(2)
    }

    /// Direction through a pixel's centre; of length 1 along the face's axis.
    pub fn direction(&self, pixel: usize) -> DVec3 {
        let (face, row, column) = self.place(pixel);
        let [x, y, w] = self.axes(face);
        x * self.tangent(column as f64 + 0.5) + y * self.tangent(row as f64 + 0.5) + w
    }

    /// A pixel's fraction of the sphere; all pixels add up to 1.
    pub fn solid_angle(&self, pixel: usize) -> f64 {
        let (_, row, column) = self.place(pixel);
        let corner = |x: f64, y: f64| (x * y).atan2((x * x + y * y + 1.0).sqrt());
        let [x0, x1] = [column, column + 1].map(|c| self.tangent(c as f64));
        let [y0, y1] = [row, row + 1].map(|r| self.tangent(r as f64));
        (corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)) / (4.0 * PI)
    }

    /// The opposite pixel: its direction is the negative, to the bit.
    pub fn opposite(&self, pixel: usize) -> usize {
        let (face, row, column) = self.place(pixel);
        let size = self.size as usize;
        ((face ^ 1) * size + size - 1 - row) * size + size - 1 - column
    }

    /// Face, row and column.
    fn place(&self, pixel: usize) -> (usize, usize, usize) {
        let size = self.size as usize;
        (pixel / (size * size), pixel / size % size, pixel % size)
    }

    fn tangent(&self, columns: f64) -> f64 {
        (2.0 * columns - f64::from(self.size)) / f64::from(self.size)
    }

    /// The axes along a face's columns, its rows, and into it.
    fn axes(&self, face: usize) -> [DVec3; 3] {
        let k = face / 2;
        let into = self.frame.col(k);
        [self.frame.col((k + 1) % 3), self.frame.col((k + 2) % 3), if face.is_multiple_of(2) { into } else { -into }]
    }
}

/// A see-through triangle in front of the opaque one.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct SeeThrough {
    /// Its pixel.
    pub pixel: u32,
    /// Index into [`Scene::triangles`]: the object's nearest there.
    pub triangle: u32,
}

/// The view from one point.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Cube {
    /// For each pixel the nearest opaque triangle, as an index into [`Scene::triangles`], or [`NONE`].
    pub triangles: Vec<u32>,
    /// See-through triangles that are no farther, each object at most once per pixel, in an arbitrary order (equal for all engines except
    /// [`Rays`]).
    pub see_through: Vec<SeeThrough>,
}

impl Cube {
    /// The nearest opaque triangle at a pixel.
    pub fn opaque(&self, pixel: usize) -> Option<u32> {
        Some(self.triangles[pixel]).filter(|&t| t != NONE)
    }

    /// Empties it and resizes it for a view. Panics if the size is out of bounds.
    pub fn clear(&mut self, view: &CubeView) {
        assert!((1..=MAX_SIZE).contains(&view.size), "a cube's faces are 1 to {MAX_SIZE} pixels wide");
        self.triangles.resize(view.pixels(), NONE);
        self.see_through.clear();
    }
}

/// Renders cubes; holds scratch memory, so each thread has its own.
pub trait CubeEngine {
    /// Renders `view` into `out`. A non-finite eye sees nothing. Panics if the size is out of bounds.
    fn cube(&mut self, view: &CubeView, out: &mut Cube);
}

/// A scene prepared for cubes.
pub struct CubeScene {
    opaque: Tree,
    see_through: Tree,
    /// The object of each leaf of `see_through`.
    objects: Vec<u32>,
}

impl CubeScene {
    /// Builds the hierarchies: opaque triangles, and see-through objects.
    pub fn new(scene: &Scene) -> Self {
        let opaque = scene.objects.iter().filter(|o| o.opaque);
        let triangles: Vec<u32> = opaque.flat_map(|o| o.triangles.clone()).collect();
        let clear: Vec<u32> = (0u32..).zip(&scene.objects).filter(|(_, o)| !o.opaque).map(|(i, _)| i).collect();
        let (see_through, objects) = Tree::of_objects(scene, &clear);
        Self { opaque: Tree::of_triangles(scene, &triangles), see_through, objects }
    }
}

/// Intersection of the ray through a pixel's centre with a triangle, in `f64`: an exact test of an engine's result for that triangle. The
/// unit of [`Hit::t`] is the length of [`CubeView::direction`]. Whether nothing is in front of it is a matter for [`RayScene::is_clear`].
pub fn settle(rays: &RayScene<'_>, view: &CubeView, pixel: usize, triangle: u32) -> Option<Hit> {
    rays.meets(view.eye, view.direction(pixel), triangle)
}
