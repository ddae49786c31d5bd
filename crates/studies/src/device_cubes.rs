//! Cubes by a graphics processor: item buffers drawn by compute shaders.
//!
//! Based on: Weghorst, Hooper, Greenberg, *Improved computational methods for ray tracing*, 1984 (item buffers: what is nearest, by
//! drawing its id); Laine, Karras, *High-performance software rasterization on GPUs*, 2011 (a rasteriser of compute shaders, which cuts
//! large triangles into blocks of pixels); Greene, Kass, Miller, *Hierarchical z-buffer visibility*, 1993 (what is farther than
//! all pixels of a tile is left out); Olano, Greer, *Triangle scan conversion using 2D homogeneous coordinates*, 1997 (edges are
//! planes through the eye, so that nothing is clipped); and Reed, *Depth precision visualized*, 2015 (a float depth that falls towards
//! the distance loses no precision there). Deviations:
//!
//! * A triangle goes over all six faces at once. Large ones are drawn first, since they hide most.
//! * No 64-bit atomics: depths are drawn first; then triangles that were the nearest anywhere, when their turn came, are drawn once more, and of
//!   those that have a pixel's depth the least id stays.
//! * Depth is not interpolated between corners but worked out at each pixel from the triangle's plane, so that it is as good for a floor
//!   that passes under the eye as for a chair.
//! * See-through triangles that are no farther than the opaque one are appended to a list, of which the nearest of each object stays.
//!
//! The device's own rasteriser isn't used: cards made for computing have few of them, and that depth would keep them from leaving
//! anything out early.
//!
//! **Positions** are relative to the eye before anything is rounded: see [`enfilade::gpu`].
//!
//! **Tolerance.** A cube may differ from [`Rays`](enfilade::pvs::cubes::Rays) at a pixel only where
//!
//! * its middle is within [`EDGE`] pixels, and what moving corners by [`CORNERS`] makes of it, of the line through a projected edge of
//!   one of the two triangles (and within eight pixels of the edge), or
//! * it meets both, and their depths agree to within [`DEPTH`](enfilade::pvs::cubes::DEPTH) of themselves, and what moving corners by [`CORNERS`]
//!   and the pixel by [`enfilade::pvs::cubes::EDGE`] makes of it, or
//! * one of the two is nearer than [`NEAR`] there.
//!
//! Drivers and adapters differ within that, so unlike the other engines' these cubes are not the same on every machine. Proofs don't rest
//! on them.

mod batch;
mod hits;
mod scene;

pub use enfilade::gpu::GpuError;
pub use scene::GpuScene;

use batch::{Batch, Face};
use enfilade::pvs::cubes::{Cube, CubeEngine, CubeScene, CubeView, MAX_SIZE, NONE, Raster, SeeThrough};
use hits::Hits;
use std::sync::Arc;

/// Within this distance (pixels) of a projected edge a pixel may fall to either side: edges are widened by 0.0005 pixels on the largest faces, so that
/// no pixel falls between two triangles, and rounding may take as much again. With less, sound drivers would be blamed there; with
/// much more, a gap between triangles wouldn't be found.
pub const EDGE: f64 = 1e-3;
/// Corners may be off by this fraction of the distance of the triangle's farthest corner: what is rounded to `f32` on the way, eight
/// times by 6e-8, from the subtraction to cutting triangles at the sides of what is drawn. Less would blame sound drivers, on faces of a
/// thousand pixels and more and for surfaces seen at a grazing angle; ten times more would hide positions that are relative to something
/// farther away than the eye.
pub const CORNERS: f64 = 5e-7;
/// What is nearer than this along a face's axis, metres, isn't drawn, so that an eye as near as that to a surface looks through it. With much
/// less, corners that are cut off there are farther off the picture than `f32` can tell; with much more, eyes a tenth of a millimetre
/// off a wall, where rays still find it, would look through it.
pub const NEAR: f32 = 1e-6;

/// What a cube shows of an object.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Share {
    /// Pixels at which the object is the nearest opaque one.
    pub pixels: u32,
    /// Fraction of the sphere that they take up, to within 1e-9 of itself for each of them.
    pub solid_angle: f64,
}

/// Makes cubes on a graphics processor; where it can't, by [`Raster`].
pub struct GpuCubes<'s> {
    scene: Arc<GpuScene>,
    batch: Option<Batch>,
    instead: Raster<'s>,
    hits: Hits,
}

impl<'s> GpuCubes<'s> {
    /// For one thread; `instead` is the same scene.
    pub fn new(scene: Arc<GpuScene>, instead: &'s CubeScene) -> Self {
        Self { scene, batch: None, instead: Raster::new(instead), hits: Hits::default() }
    }

    /// What is seen from each of some views, into `out`, as many cubes: one answer of the device is waited for where engines of the trait
    /// wait for many. Views of one size should be next to each other. Panics where a size is out of bounds or a cube is missing.
    pub fn cubes(&mut self, views: &[CubeView], out: &mut [Cube]) -> Result<(), GpuError> {
        assert_eq!(views.len(), out.len(), "a cube for each view");
        for (view, cube) in views.iter().zip(&mut *out) {
            cube.clear(view);
            if !is_somewhere(view) {
                cube.triangles.fill(NONE);
            }
        }
        let scene = self.scene.clone();
        let mut first = 0;
        for same in views.chunk_by(|a, b| a.size == b.size) {
            let (size, out) = (same[0].size as usize, &mut out[first..][..same.len()]);
            first += same.len();
            let faces = faces(same);
            let hits = &mut self.hits;
            let batch = batch_for(&mut self.batch, &scene, same[0].size, faces.len())?;
            for faces in faces.chunks(batch.faces as usize) {
                let ids = |ids: &[u32]| {
                    for (face, ids) in faces.iter().zip(ids.chunks(size * size)) {
                        let to = &mut out[face.index].triangles[face.face * size * size..];
                        to.iter_mut().zip(ids).for_each(|(to, from)| *to = !from);
                    }
                };
                batch.draw(&scene, faces, ids, |list| hits.sort(list, size * size * faces.len()))?;
                hits.nearest(&scene.owners, |pixel, triangle| {
                    let face = &faces[pixel / (size * size)];
                    let pixel = (face.face * size * size + pixel % (size * size)) as u32;
                    out[face.index].see_through.push(SeeThrough { pixel, triangle });
                });
            }
        }
        Ok(())
    }

    /// What a cube at each of some views, of one size, shows of each object: added up on the device, so that nothing else is read back. What
    /// is see-through counts for nothing and hides nothing. Panics where a size is out of bounds.
    pub fn shares(&mut self, views: &[CubeView]) -> Result<Vec<Vec<Share>>, GpuError> {
        let scene = self.scene.clone();
        let mut all = Vec::with_capacity(views.len());
        for view in views {
            assert!((1..=MAX_SIZE).contains(&view.size), "a cube's faces are 1 to {MAX_SIZE} pixels wide");
        }
        for same in views.chunk_by(|a, b| a.size == b.size) {
            let mut sums = vec![vec![(0u32, 0u64); scene.objects]; same.len()];
            let faces = faces(same);
            let batch = batch_for(&mut self.batch, &scene, same[0].size, faces.len())?;
            for faces in faces.chunks(batch.faces as usize) {
                let weights = || weights(&same[0]);
                batch.count(&scene, faces, weights, |words| {
                    // Views that see nothing were left out.
                    let mut seen: Vec<usize> = faces.iter().map(|face| face.index).collect();
                    seen.dedup();
                    for (view, words) in seen.into_iter().zip(words.chunks(3 * scene.objects.max(1))) {
                        for (sum, words) in sums[view].iter_mut().zip(words.chunks_exact(3)) {
                            sum.0 += words[0];
                            sum.1 += u64::from(words[1]) | u64::from(words[2]) << 32;
                        }
                    }
                })?;
            }
            let unit = unit(same[0].size);
            let share = |&(pixels, sum): &(u32, u64)| Share { pixels, solid_angle: sum as f64 * unit };
            all.extend(sums.iter().map(|sums| sums.iter().map(share).collect::<Vec<_>>()));
        }
        Ok(all)
    }

    /// The same of a cube's ids, added up here: to the bit what [`shares`](Self::shares) says of the same cube.
    pub fn shares_of(&self, view: &CubeView, cube: &Cube) -> Vec<Share> {
        let weights = weights(view);
        let mut sums = vec![(0u32, 0u64); self.scene.objects];
        for (pixel, &triangle) in cube.triangles.iter().enumerate().filter(|(_, t)| **t != NONE) {
            let sum = &mut sums[self.scene.owners[triangle as usize] as usize];
            *sum = (sum.0 + 1, sum.1 + u64::from(weights[pixel % weights.len()]));
        }
        let unit = unit(view.size);
        sums.into_iter().map(|(pixels, sum)| Share { pixels, solid_angle: sum as f64 * unit }).collect()
    }
}

impl CubeEngine for GpuCubes<'_> {
    fn cube(&mut self, view: &CubeView, out: &mut Cube) {
        let made = self.cubes(std::slice::from_ref(view), std::slice::from_mut(out));
        if let Err(why) = made {
            self.scene.miss(why);
            self.instead.cube(view, out);
        }
    }
}

/// Whether an eye is finite, even in single precision.
fn is_somewhere(view: &CubeView) -> bool {
    view.eye.as_vec3().is_finite()
}

/// The faces of views from somewhere.
fn faces(views: &[CubeView]) -> Vec<Face<'_>> {
    let somewhere = views.iter().enumerate().filter(|(_, view)| is_somewhere(view));
    somewhere.flat_map(|(index, view)| (0..6).map(move |face| Face { index, view, face })).collect()
}

/// A batch of this size, with as much room as there is to be had for so many faces.
fn batch_for<'b>(
    batch: &'b mut Option<Batch>,
    scene: &GpuScene,
    size: u32,
    faces: usize,
) -> Result<&'b mut Batch, GpuError> {
    let old = batch.take().filter(|b| b.size == size && (b.is_full || b.faces as usize >= faces));
    let new = match old {
        Some(old) => old,
        None => Batch::new(scene, size, faces)?,
    };
    Ok(batch.insert(new))
}

/// The solid angle of each pixel of a face, in [`unit`]s: so that the largest, 1.91 times the mean, fits a word.
fn weights(view: &CubeView) -> Vec<u32> {
    let pixels = view.pixels() / 6;
    (0..pixels).map(|pixel| (view.solid_angle(pixel) / unit(view.size)).round() as u32).collect()
}

/// Fraction of the sphere.
fn unit(size: u32) -> f64 {
    1.0 / (6.0 * f64::from(size).powi(2) * f64::from(1u32 << 30))
}
