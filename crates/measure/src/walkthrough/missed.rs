//! Missed pixels: a full picture shows an object there that the visible set leaves out.
//!
//! A pixel is missed if its frontmost opaque object, or the frontmost see-through object before it, is not in the set. (A second
//! pane of glass behind the first does not count.)
//!
//! Meshes leak: where a corner of one triangle lies on the edge of another, rounding opens cracks of no width that a pixel's
//! centre can see through. So each such pixel is tested again with rays in `f64` around its centre, [`SPREAD`] pixels away. It is
//! missed only if each of them first meets an object outside the set; otherwise it counts as a crack. The test cannot distinguish
//! a crack from an opening narrower than `2 * SPREAD` of a pixel. If each ray first meets a hole that counts as opaque, the
//! guarantee does not apply, and the pixel is counted separately.
//!
//! Models have coincident surfaces, such as a wall's end in another wall's face. Rounding decides which of the two an item buffer
//! names. So a surface is not missed if the set keeps another within the scene's clearance of it. An eye on a surface may see
//! through it, depending on rounding, so objects behind such a surface are not missed.

use super::raster::{IdBuffer, View};
use enfilade::ObjectId;
use enfilade::file::PvsFile;
use enfilade::math::parallel;
use enfilade::math::tolerance::single_precision;
use enfilade::scene::Scene;
use enfilade::scene::rays::{Hit, RayScene};
use glam::{DVec2, DVec3};

/// Distance of the test rays from a pixel's centre, in pixels. Larger: narrow real openings count as cracks. Smaller: cracks
/// widened by rounding count as misses.
pub const SPREAD: f64 = 0.02;

/// Offsets of the test rays around a pixel's centre.
pub(super) const AROUND: [DVec2; 8] = [
    DVec2::new(1.0, 0.0),
    DVec2::new(1.0, 1.0),
    DVec2::new(0.0, 1.0),
    DVec2::new(-1.0, 1.0),
    DVec2::new(-1.0, 0.0),
    DVec2::new(-1.0, -1.0),
    DVec2::new(0.0, -1.0),
    DVec2::new(1.0, -1.0),
];

/// Objects that a set leaves out of a picture.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Missed {
    /// Pixels with an object outside the set, ascending.
    pub pixels: Vec<u32>,
    /// Pixels where this happens only through a crack.
    pub cracks: u64,
    /// Pixels where this happens only through a hole that counts as opaque ([`RayScene::with_closed_holes`]).
    pub closed: u64,
    /// The most of [`pixels`](Self::pixels) that show one object.
    pub most_of_one: u64,
}

/// The scene with the file's closed holes as opaque ([`PvsFile::closed_holes`]).
pub(super) fn with_holes<'s>(scene: &'s Scene, file: &PvsFile) -> RayScene<'s> {
    let holes = file.closed_holes.iter().map(|hole| hole.iter().map(|p| p.as_dvec3()).collect());
    RayScene::with_closed_holes(scene, &holes.collect::<Vec<_>>())
}

/// Compares a picture of everything, which shows the objects `shown` ([`objects_shown`]), with a set.
pub fn missed_pixels(
    rays: &RayScene<'_>,
    view: &View,
    full: &IdBuffer,
    shown: &[ObjectId],
    kept: &(dyn Fn(ObjectId) -> bool + Sync),
) -> Missed {
    if shown.iter().all(|&object| kept(object)) {
        return Missed::default();
    }
    let scene = rays.scene();
    let leaves_out = |triangle: usize| !kept(scene.object_of(triangle));
    let doubtful: Vec<u32> = (0..view.width * view.height)
        .filter(|&pixel| full.opaque(pixel).is_some_and(leaves_out) || full.glass(pixel).is_some_and(leaves_out))
        .map(|pixel| pixel as u32)
        .collect();
    let settled = parallel::map(&doubtful, |&pixel| settle(rays, view, pixel as usize, kept));
    let is = |what: Doubt| settled.iter().zip(&doubtful).filter(move |(doubt, _)| **doubt == what).map(|(_, pixel)| *pixel);
    let pixels: Vec<u32> = is(Doubt::Missed).collect();
    // The front of a missed pixel: glass, if that is left out.
    let front = |&pixel: &u32| {
        let glass = full.glass(pixel as usize).filter(|&triangle| leaves_out(triangle));
        glass.or(full.opaque(pixel as usize)).map(|triangle| scene.object_of(triangle))
    };
    let mut objects: Vec<ObjectId> = pixels.iter().filter_map(front).collect();
    objects.sort_unstable();
    let most_of_one = objects.chunk_by(|a, b| a == b).map(<[_]>::len).max().unwrap_or(0) as u64;
    let count = |what: Doubt| is(what).count() as u64;
    Missed { cracks: count(Doubt::Crack), closed: count(Doubt::Closed), pixels, most_of_one }
}

/// Class of a pixel that shows an object outside the set.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Doubt {
    /// All rays around its middle agree.
    Missed,
    /// They do not agree.
    Crack,
    /// All of them first meet a closed hole.
    Closed,
}

/// Tests whether all rays around a pixel's centre first meet an object outside the set.
fn settle(rays: &RayScene<'_>, view: &View, pixel: usize, kept: &(dyn Fn(ObjectId) -> bool + Sync)) -> Doubt {
    let middle = DVec2::new((pixel % view.width) as f64 + 0.5, (pixel / view.width) as f64 + 0.5);
    let limit = 10.0 * (rays.bounds().diagonal() + view.camera.eye.as_dvec3().length());
    let (mut opaque_missed, mut glass_missed, mut closed) = (true, true, true);
    let mut glass: Vec<Hit> = Vec::new();
    for offset in AROUND {
        let along = view.camera.ray(view.ndc(middle + offset * SPREAD));
        // From the eye itself: objects before the near plane also hide those behind them.
        let from = view.camera.eye.as_dvec3();
        if stands_on_a_surface(rays, from, along) {
            return Doubt::Crack;
        }
        closed = closed && rays.ends_at_hole(from, along, limit);
        let hit = rays.first_opaque(from, along, limit);
        opaque_missed &= hit.is_some_and(|h| !kept(h.object) && !is_doubled(rays, from + along * h.t, kept));
        glass.clear();
        if glass_missed {
            rays.see_through(from, along, hit.map_or(limit, |h| h.t), &mut glass);
            glass_missed = glass.first().is_some_and(|h| !kept(h.object));
        }
        if !opaque_missed && !glass_missed && !closed {
            return Doubt::Crack;
        }
    }
    if opaque_missed || glass_missed { Doubt::Missed } else { Doubt::Closed }
}

/// Whether a ray starts on an opaque surface, within the precision of `f32`.
pub(super) fn stands_on_a_surface(rays: &RayScene<'_>, eye: DVec3, along: DVec3) -> bool {
    let rounding = along.normalize_or_zero() * single_precision(eye.abs().max_element());
    rays.first_opaque(eye - rounding, 2.0 * rounding, 1.0).is_some()
}

/// Whether an opaque object of the set is within the scene's clearance of a point.
fn is_doubled(rays: &RayScene<'_>, p: DVec3, kept: &(dyn Fn(ObjectId) -> bool + Sync)) -> bool {
    rays.is_near_opaque(p, rays.tolerance().clearance, kept)
}

/// The objects in a picture of everything, ascending: the set of a perfect culler.
pub fn objects_shown(scene: &Scene, full: &IdBuffer) -> Vec<ObjectId> {
    let mut shown = vec![false; scene.objects.len()];
    // Neighbouring pixels mostly show the same triangle.
    let mut last = [None; 2];
    for pixel in 0..full.width * full.height {
        for (layer, triangle) in [full.opaque(pixel), full.glass(pixel)].into_iter().enumerate() {
            if let Some(triangle) = triangle.filter(|_| triangle != last[layer]) {
                shown[scene.object_of(triangle).index()] = true;
            }
            last[layer] = triangle;
        }
    }
    (0..shown.len()).filter(|&i| shown[i]).map(|i| ObjectId(i as u32)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::raster::draw;
    use super::*;
    use enfilade::runtime::Camera;
    use enfilade::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};

    /// A square of 4 m, facing +z, at a given z.
    fn square(z: f64) -> Mesh {
        let positions = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)].map(|(x, y)| DVec3::new(x, y, z)).to_vec();
        Mesh { node: "wall".into(), role: Role::Structure, opaque: true, positions, triangles: vec![[0, 1, 2], [0, 2, 3]] }
    }

    #[test]
    fn who_stands_on_a_wall_may_look_through_it_and_who_stands_behind_it_does() {
        for (off, misses) in [(0.0, false), (-0.01, true), (0.01, false)] {
            let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
            builder.add(square(0.0)).unwrap();
            builder.add(square(-1.0)).unwrap();
            let scene = builder.finish("walls").unwrap();
            let eye = DVec3::new(0.3, 0.2, off) - scene.origin;
            let camera = Camera::look_at(eye, eye - DVec3::Z, 1.0, 1.0);
            let view = View { camera, near: 0.05, width: 16, height: 16 };
            let full = draw(&scene, &view, &|_| true);
            let shown = objects_shown(&scene, &full);
            // The near plane is beyond the first wall.
            assert_eq!(shown.len(), 1, "{off}");
            let behind = shown[0];
            let missed = missed_pixels(&RayScene::new(&scene), &view, &full, &shown, &|o| o != behind);
            assert_eq!(missed.pixels.len(), if misses { 256 } else { 0 }, "{off}");
        }
    }

    /// Half of the picture shows the wall through a hole that counts as opaque.
    #[test]
    fn what_shows_through_a_closed_hole_is_counted_apart() {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        builder.add(square(0.0)).unwrap();
        let scene = builder.finish("wall").unwrap();
        let eye = DVec3::new(0.0, 0.0, 2.0) - scene.origin;
        let camera = Camera::look_at(eye, eye - DVec3::Z, 1.0, 1.0);
        let view = View { camera, near: 0.05, width: 16, height: 16 };
        let full = draw(&scene, &view, &|_| true);
        let shown = objects_shown(&scene, &full);
        let hole = [(0.0, -2.0), (2.0, -2.0), (2.0, 2.0), (0.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 1.0) - scene.origin);
        let rays = RayScene::with_closed_holes(&scene, &[hole.to_vec()]);
        let none = missed_pixels(&rays, &view, &full, &shown, &|_| false);
        assert_eq!((none.pixels.len(), none.cracks, none.closed), (128, 0, 128));
        let all = missed_pixels(&rays, &view, &full, &shown, &|_| true);
        assert_eq!(all, Missed::default());
    }

    #[test]
    fn of_two_surfaces_in_one_place_one_is_enough() {
        // Distance of the second wall before the first, and whether leaving it out shows.
        for (before, shows) in [(0.0, false), (0.01, true)] {
            let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
            builder.add(square(0.0)).unwrap();
            builder.add(square(before)).unwrap();
            let scene = builder.finish("walls").unwrap();
            let eye = DVec3::new(0.0, 0.0, 3.0) - scene.origin;
            let camera = Camera::look_at(eye, eye - DVec3::Z, 1.0, 1.0);
            let view = View { camera, near: 0.05, width: 16, height: 16 };
            let full = draw(&scene, &view, &|_| true);
            // Either wall may be the one that shows.
            let shown = objects_shown(&scene, &full);
            let missed = |left_out: u32| {
                let kept = move |o: ObjectId| o != ObjectId(left_out);
                missed_pixels(&RayScene::new(&scene), &view, &full, &shown, &kept).pixels.len()
            };
            assert_eq!((missed(0), missed(1)), (0, if shows { 256 } else { 0 }), "{before}");
            let none = missed_pixels(&RayScene::new(&scene), &view, &full, &shown, &|_| false);
            assert_eq!(none.pixels.len(), 256, "nothing kept");
        }
    }
}
