//! A software rasteriser for triangle ids: the front triangle at each pixel's centre.
//!
//! Based on: J. Pineda, *A parallel algorithm for polygon rasterization*, 1988 (edge functions). Deviations: edge functions and
//! depth are `f64` on positions that are not snapped to a grid, so pixels are right within rounding. An edge function always
//! starts at the lesser end of its edge, so two triangles with a common edge get values of opposite sign and equal size; with the
//! top-left rule each pixel on it belongs to exactly one of them. Clipping (the near plane, and a guard band that limits
//! coordinates) cuts a shared edge at the same point from both sides.
//!
//! See-through objects hide nothing. They form a second layer: the frontmost of them before the opaque surface.
//!
//! Bands of rows are drawn independently, each in triangle order: ids do not depend on the number of threads.

use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::math::parallel;
use enfilade::runtime::Camera;
use enfilade::scene::Scene;
use glam::{DVec2, DVec3};

/// Rows of pixels per task.
const BAND: usize = 16;
/// Objects projected per task.
const CHUNK: usize = 64;
/// Triangles are clipped at this many half-sizes of the screen.
const GUARD: f64 = 8.0;

/// A camera and the size of its picture.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// Distance of the near plane along the view direction, metres, above 0.
    pub near: f64,
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
}

impl View {
    /// Normalised device coordinates of a point of the picture: pixels from the upper left corner, pixel centres at halves.
    pub fn ndc(&self, pixel: DVec2) -> DVec2 {
        DVec2::new(2.0 * pixel.x / self.width as f64 - 1.0, 1.0 - 2.0 * pixel.y / self.height as f64)
    }

    /// The pixels of a point in normalised device coordinates.
    pub fn pixel(&self, ndc: DVec2) -> DVec2 {
        DVec2::new((ndc.x + 1.0) * 0.5 * self.width as f64, (1.0 - ndc.y) * 0.5 * self.height as f64)
    }
}

/// A triangle number plus one; 0: none.
type Id = u32;

/// A layer of a picture: a triangle and a depth for each pixel.
#[derive(Clone, PartialEq, Debug)]
struct Layer {
    ids: Vec<Id>,
    /// 1 / w; 0 if empty.
    depths: Vec<f32>,
}

impl Layer {
    fn new(pixels: usize) -> Self {
        Self { ids: vec![0; pixels], depths: vec![0.0; pixels] }
    }
}

/// The front triangles of each pixel, row by row from the top.
#[derive(Clone, PartialEq, Debug)]
pub struct IdBuffer {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    opaque: Layer,
    glass: Layer,
}

impl IdBuffer {
    /// The frontmost opaque triangle at a pixel.
    pub fn opaque(&self, pixel: usize) -> Option<usize> {
        (self.opaque.ids[pixel] as usize).checked_sub(1)
    }

    /// The frontmost see-through triangle at a pixel, if it is before the opaque surface.
    pub fn glass(&self, pixel: usize) -> Option<usize> {
        (self.glass.ids[pixel] as usize).checked_sub(1)
    }

    /// Distance of the opaque surface along the view direction, metres; infinite if there is none.
    pub fn depth(&self, pixel: usize) -> f32 {
        1.0 / self.opaque.depths[pixel]
    }
}

/// A triangle on the screen: x and y in pixels, and 1/w.
#[derive(Clone, Copy)]
struct Projected {
    corners: [DVec3; 3],
    id: Id,
}

/// Projected triangles of some objects, with their first and last rows, so that a band can skip most of them.
#[derive(Default)]
struct Batch {
    rows: Vec<[u16; 2]>,
    triangles: Vec<Projected>,
}

/// Draws the objects for which `shown` is true. Pictures are at most 16384 pixels wide and high.
pub fn draw(scene: &Scene, view: &View, shown: &(dyn Fn(ObjectId) -> bool + Sync)) -> IdBuffer {
    assert!(view.width.max(view.height) <= 16384, "pictures are at most 16384 pixels wide and high");
    let batch = |chunk: usize| {
        let mut batches = <[Batch; 2]>::default();
        for (i, object) in scene.objects.iter().enumerate().skip(chunk * CHUNK).take(CHUNK) {
            if shown(ObjectId(i as u32)) && may_be_on_screen(view, &object.bounds) {
                for triangle in object.triangles.clone() {
                    project(scene, view, triangle, &mut batches[usize::from(!object.opaque)]);
                }
            }
        }
        batches
    };
    let batches: Vec<[Batch; 2]> = parallel::map_range(0..scene.objects.len().div_ceil(CHUNK), batch);
    let pixels = view.width * view.height;
    let (mut opaque, mut glass) = (Layer::new(pixels), Layer::new(pixels));
    let band = BAND * view.width.max(1);
    let bands = opaque.ids.chunks_mut(band).zip(opaque.depths.chunks_mut(band));
    let glass_bands = glass.ids.chunks_mut(band).zip(glass.depths.chunks_mut(band));
    let mut bands: Vec<_> = bands.zip(glass_bands).collect();
    parallel::for_each_mut(&mut bands, |b, ((ids, depths), (glass_ids, glass_depths))| {
        let mut rows = Rows { width: view.width, first: b * BAND, ids, depths };
        batches.iter().for_each(|batch| rows.draw(&batch[0]));
        // Opaque surfaces hide glass, so its layer starts with their depths.
        glass_depths.copy_from_slice(rows.depths);
        let mut rows = Rows { width: view.width, first: b * BAND, ids: glass_ids, depths: glass_depths };
        batches.iter().for_each(|batch| rows.draw(&batch[1]));
    });
    IdBuffer { width: view.width, height: view.height, opaque, glass }
}

fn clip_coordinates(camera: &Camera, p: DVec3) -> DVec3 {
    let v = p - camera.eye.as_dvec3();
    DVec3::new(camera.x.as_dvec3().dot(v), camera.y.as_dvec3().dot(v), camera.w.as_dvec3().dot(v))
}

/// The clip planes as forms that are at least 0 inside: near, then the four sides of `guard` screens.
fn inside(near: f64, guard: f64, p: DVec3) -> [f64; 5] {
    [p.z - near, guard * p.z - p.x, guard * p.z + p.x, guard * p.z - p.y, guard * p.z + p.y]
}

/// Whether a box may be on the screen; conservative.
fn may_be_on_screen(view: &View, bounds: &Aabb) -> bool {
    let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
        // Slightly wider than the screen, so that rounding does not matter.
        inside(view.near, 1.0 + 1e-9, clip_coordinates(&view.camera, DVec3::new(pick(0), pick(1), pick(2))))
    });
    (0..5).all(|plane| corners.iter().any(|c| c[plane] >= 0.0))
}

/// Projects a triangle onto the screen, clipped if necessary.
fn project(scene: &Scene, view: &View, triangle: u32, out: &mut Batch) {
    let clip = scene.corners(triangle as usize).map(|p| clip_coordinates(&view.camera, p));
    let on_screen = clip.map(|p| inside(view.near, 1.0, p));
    if (0..5).any(|plane| on_screen.iter().all(|c| c[plane] < 0.0)) {
        return;
    }
    let guarded = clip.map(|p| inside(view.near, GUARD, p));
    if guarded.iter().flatten().all(|&d| d >= 0.0) {
        emit(view, clip, triangle, out);
        return;
    }
    // Five planes add at most a corner each.
    let (mut polygon, mut next) = ([DVec3::ZERO; 8], [DVec3::ZERO; 8]);
    polygon[..3].copy_from_slice(&clip);
    let mut len = 3;
    for plane in 0..5 {
        let mut kept = 0;
        for i in 0..len {
            let (a, b) = (polygon[i], polygon[(i + 1) % len]);
            let (da, db) = (inside(view.near, GUARD, a)[plane], inside(view.near, GUARD, b)[plane]);
            if da >= 0.0 {
                next[kept] = a;
                kept += 1;
            }
            if (da >= 0.0) != (db >= 0.0) {
                // From the inner end to the outer, for either winding.
                let (inner, outer, di, d_o) = if da >= 0.0 { (a, b, da, db) } else { (b, a, db, da) };
                next[kept] = inner + (outer - inner) * (di / (di - d_o));
                kept += 1;
            }
        }
        std::mem::swap(&mut polygon, &mut next);
        len = kept;
    }
    for i in 2..len {
        emit(view, [polygon[0], polygon[i - 1], polygon[i]], triangle, out);
    }
}

fn emit(view: &View, clip: [DVec3; 3], triangle: u32, out: &mut Batch) {
    let mut corners = clip.map(|p| view.pixel(p.truncate() / p.z).extend(1.0 / p.z));
    let area = (corners[1] - corners[0]).truncate().perp_dot((corners[2] - corners[0]).truncate());
    if area < 0.0 {
        corners.swap(1, 2);
    }
    let least = corners[0].min(corners[1]).min(corners[2]);
    let most = corners[0].max(corners[1]).max(corners[2]);
    // The pixels whose centres are within its box.
    let (first, last) = ((least - 0.5).ceil().max(DVec3::ZERO), (most - 0.5).floor());
    let last = last.min(DVec3::new(view.width as f64 - 1.0, view.height as f64 - 1.0, f64::INFINITY));
    if area != 0.0 && first.x <= last.x && first.y <= last.y {
        out.rows.push([first.y as u16, last.y as u16]);
        out.triangles.push(Projected { corners, id: triangle + 1 });
    }
}

/// The edge function of an edge: `a * (x - from.x) + b * (y - from.y)`, at least 0 inside.
struct Edge {
    from: DVec2,
    a: f64,
    b: f64,
    /// Whether a pixel exactly on the edge belongs to this triangle.
    owns: bool,
}

impl Edge {
    fn new(p: DVec2, q: DVec2) -> Self {
        let d = q - p;
        let forward = (p.x, p.y) <= (q.x, q.y);
        // The same numbers for both directions of the edge; only the signs differ.
        let (from, to) = if forward { (p, q) } else { (q, p) };
        let (a, b) = (from.y - to.y, to.x - from.x);
        let (a, b) = if forward { (a, b) } else { (-a, -b) };
        Self { from, a, b, owns: d.y < 0.0 || (d.y == 0.0 && d.x > 0.0) }
    }

    #[inline(always)]
    fn at(&self, p: DVec2) -> f64 {
        self.a * (p.x - self.from.x) + self.b * (p.y - self.from.y)
    }
}

/// A band of rows of a layer.
struct Rows<'b> {
    width: usize,
    first: usize,
    ids: &'b mut [Id],
    depths: &'b mut [f32],
}

impl Rows<'_> {
    fn draw(&mut self, batch: &Batch) {
        let last = self.first + self.ids.len() / self.width - 1;
        for (rows, triangle) in batch.rows.iter().zip(&batch.triangles) {
            let (from, to) = (self.first.max(rows[0] as usize), last.min(rows[1] as usize));
            if from <= to {
                self.draw_triangle(triangle, from, to);
            }
        }
    }

    fn draw_triangle(&mut self, triangle: &Projected, from: usize, to: usize) {
        let c = triangle.corners;
        let [p, q, r] = c.map(DVec3::truncate);
        // Each edge weighs the depth of the opposite corner.
        let edges = [Edge::new(q, r), Edge::new(r, p), Edge::new(p, q)];
        let left = p.x.min(q.x).min(r.x);
        let right = p.x.max(q.x).max(r.x);
        for y in from..=to {
            let middle = y as f64 + 0.5;
            // The row's range, one pixel wider: the edge functions decide.
            let (mut low, mut high) = (left, right);
            for edge in &edges {
                let x = edge.from.x - edge.b * (middle - edge.from.y) / edge.a;
                if edge.a > 0.0 {
                    low = low.max(x - 1.0);
                } else if edge.a < 0.0 {
                    high = high.min(x + 1.0);
                }
            }
            let start = (low - 0.5).ceil().max(0.0) as usize;
            let end = ((high - 0.5).floor() + 1.0).clamp(0.0, self.width as f64) as usize;
            let row = (y - self.first) * self.width;
            for x in start..end {
                let pixel = DVec2::new(x as f64 + 0.5, middle);
                let e = [edges[0].at(pixel), edges[1].at(pixel), edges[2].at(pixel)];
                if (0..3).all(|i| e[i] > 0.0 || (e[i] == 0.0 && edges[i].owns)) {
                    let depth = ((e[0] * c[0].z + e[1] * c[1].z + e[2] * c[2].z) / (e[0] + e[1] + e[2])) as f32;
                    if depth > self.depths[row + x] {
                        self.depths[row + x] = depth;
                        self.ids[row + x] = triangle.id;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use enfilade::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};

    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        fn point(&mut self, size: f64) -> DVec3 {
            (DVec3::new(self.next(), self.next(), self.next()) - 0.5) * size
        }
    }

    fn scene(meshes: Vec<(Vec<DVec3>, bool)>) -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        for (positions, opaque) in meshes {
            let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            builder.add(Mesh { node: String::new(), role: Role::Unknown, opaque, positions, triangles }).unwrap();
        }
        builder.finish("test").unwrap()
    }

    fn view(eye: DVec3, target: DVec3, near: f64, width: usize, height: usize) -> View {
        let camera = Camera::look_at(eye, target, 1.2, width as f64 / height as f64);
        View { camera, near, width, height }
    }

    /// Möller, Trumbore: t of the hit, and its barycentric distance from an edge.
    fn hit(corners: [DVec3; 3], from: DVec3, along: DVec3) -> Option<(f64, f64)> {
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
        let p = along.cross(e2);
        let inv = 1.0 / e1.dot(p);
        let s = from - corners[0];
        let (u, v) = (s.dot(p) * inv, along.dot(s.cross(e1)) * inv);
        let edge = u.min(v).min(1.0 - u - v);
        (edge > -1e-6).then(|| (e2.dot(s.cross(e1)) * inv, edge))
    }

    #[test]
    fn ids_are_those_that_rays_find() {
        let mut random = Random(7);
        let mut compared = 0;
        for round in 0..20 {
            let size = [0.5, 3.0, 30.0][round % 3];
            let meshes = (0..60).map(|i| {
                let middle = random.point(10.0);
                ((0..3).map(|_| middle + random.point(size)).collect(), i % 3 != 0)
            });
            let scene = scene(meshes.collect());
            let view = view(random.point(8.0), random.point(4.0), 0.2, 53, 41);
            let ids = draw(&scene, &view, &|_| true);
            let eye = view.camera.eye.as_dvec3();
            for pixel in 0..53 * 41 {
                let ndc = view.ndc(DVec2::new((pixel % 53) as f64 + 0.5, (pixel / 53) as f64 + 0.5));
                let along = view.camera.ray(ndc);
                let (mut nearest, mut glass, mut unsure) = ((f64::INFINITY, None), (f64::INFINITY, None), false);
                let mut depths = Vec::new();
                for t in 0..scene.triangles.len() {
                    let Some((at, edge)) = hit(scene.corners(t), eye, along) else { continue };
                    unsure |= edge.abs() <= 1e-6 || (at - view.near).abs() < 1e-6;
                    if at > view.near {
                        depths.push(at);
                        let front = if scene.objects[t].opaque { &mut nearest } else { &mut glass };
                        if at < front.0 {
                            *front = (at, Some(t));
                        }
                    }
                }
                depths.sort_by(f64::total_cmp);
                unsure |= depths.windows(2).any(|d| d[1] - d[0] < 1e-6 * d[1]);
                if !unsure {
                    compared += 1;
                    assert_eq!(ids.opaque(pixel), nearest.1, "round {round}, pixel {pixel}");
                    assert_eq!(ids.glass(pixel), glass.1.filter(|_| glass.0 < nearest.0), "round {round}, pixel {pixel}");
                }
            }
        }
        assert!(compared > 20 * 53 * 41 * 9 / 10, "only {compared} pixels were compared");
    }

    /// A fan whose edges pass through pixel centres, and one around the eye whose triangles are all clipped: every pixel is
    /// covered. There is nothing behind, so a gap would show.
    #[test]
    fn closed_surfaces_have_no_gaps() {
        let ring: Vec<DVec3> = (0..64)
            .map(|i| DVec3::new((f64::from(i) * 0.0981747704).cos(), (f64::from(i) * 0.0981747704).sin(), 0.0))
            .collect();
        for (scale, depth) in [(50.0, 4.0), (3e5, 0.3), (40.0, 0.011)] {
            let mut positions = Vec::new();
            for i in 0..64 {
                positions.extend([
                    DVec3::new(0.0, 0.0, -depth),
                    ring[i] * scale - DVec3::Z * depth,
                    ring[(i + 1) % 64] * scale - DVec3::Z * depth,
                ]);
            }
            let scene = scene(vec![(positions, true)]);
            let eye = -scene.origin;
            let ids = draw(&scene, &view(eye, eye - DVec3::Z, 0.01, 64, 64), &|_| true);
            assert!((0..64 * 64).all(|p| ids.opaque(p).is_some()), "scale {scale}");
        }
    }

    #[test]
    fn nothing_behind_the_near_plane_is_drawn() {
        let triangle = |z: f64| (vec![DVec3::new(-9.0, -9.0, z), DVec3::new(9.0, -9.0, z), DVec3::new(0.0, 9.0, z)], true);
        let scene = scene(vec![triangle(-0.5), triangle(1.0), triangle(-2.0)]);
        let eye = -scene.origin;
        let ids = draw(&scene, &view(eye, eye - DVec3::Z, 1.0, 9, 9), &|_| true);
        assert_eq!(ids.opaque(40), Some(2));
        assert!((ids.depth(40) - 2.0).abs() < 1e-5);
        let hidden = draw(&scene, &view(eye, eye - DVec3::Z, 1.0, 9, 9), &|o| o != ObjectId(2));
        assert_eq!((hidden.opaque(40), hidden.depth(40)), (None, f32::INFINITY));
    }
}
