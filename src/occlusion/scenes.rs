//! Small scenes and the truth about them, for tests.

use crate::ObjectId;
use crate::geom::Aabb;
use crate::occlusion::bounds::Bounds;
use crate::occlusion::view::View;
use crate::random::Prng;
use crate::types::hints::Hints;
use crate::types::scene::{Object, Role, Scene, Source};
use glam::{DMat3, DQuat, DVec3};

/// An empty scene.
fn empty() -> Scene {
    Scene {
        name: String::new(),
        source: Source::default(),
        origin: DVec3::ZERO,
        positions: Vec::new(),
        triangles: Vec::new(),
        objects: Vec::new(),
        hints: Hints::default(),
    }
}

/// Adds a box as an object of 12 triangles a copy.
pub fn add(scene: &mut Scene, bounds: &Bounds, copies: usize) {
    const FACES: [[u32; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let (first, start) = (scene.positions.len() as u32, scene.triangles.len() as u32);
    scene.positions.extend(bounds.corners());
    for [a, b, c, d] in FACES.repeat(copies) {
        scene.triangles.extend([[a, b, c], [a, c, d]].map(|t| t.map(|i| first + i)));
    }
    scene.objects.push(Object {
        node: String::new(),
        role: Role::Unknown,
        opaque: true,
        glass: false,
        triangles: start..scene.triangles.len() as u32,
        bounds: Aabb::of(bounds.corners()),
    });
}

pub fn turned(centre: DVec3, turn: DQuat, half: DVec3) -> Bounds {
    let axes = DMat3::from_quat(turn);
    Bounds { centre, axes: [axes.x_axis, axes.y_axis, axes.z_axis], half }
}

/// Cubes of half a metre along x, each of 12 triangles a copy.
pub fn row(cubes: &[(f64, usize)]) -> Scene {
    let mut scene = empty();
    for &(x, copies) in cubes {
        add(&mut scene, &turned(DVec3::X * x, DQuat::IDENTITY, DVec3::splat(0.25)), copies);
    }
    scene
}

/// Boxes of all sizes, turned all ways, in a cube of 20 m; some of them large and flat, like walls.
pub fn crowd(count: usize, seed: u64) -> Scene {
    let mut rng = Prng::new(seed, 0);
    let mut scene = empty();
    for i in 0..count {
        let mut point = || DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
        let (centre, axis, size) = (point() * 10.0, point(), point().abs());
        let half = match i % 4 {
            0 => DVec3::new(size.x * 4.0, size.y * 4.0, 0.05),
            _ => size * 0.8 + 0.05,
        };
        let turn =
            if i % 3 == 0 { DQuat::IDENTITY } else { DQuat::from_axis_angle(axis.normalize_or(DVec3::X), size.z * 6.0) };
        add(&mut scene, &turned(centre, turn, half), 1);
    }
    scene
}

/// What the middle of each pixel shows: the reciprocal of the distance along the view direction and the object, found by trying every
/// triangle on every ray in `f64`. Rows from the top.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<Option<(f64, ObjectId)>>,
}

/// The direction through the middle of a pixel, 1 m along the view direction.
pub fn ray(view: &View, [width, height]: [usize; 2], x: usize, y: usize) -> DVec3 {
    let unproject = DMat3::from_cols(view.x, view.y, view.w).transpose().inverse();
    let middle = |i: usize, n: usize| (i as f64 + 0.5) * 2.0 / n as f64 - 1.0;
    unproject * DVec3::new(middle(x, width), -middle(y, height), 1.0)
}

impl Picture {
    /// Of some objects of a scene.
    pub fn new(scene: &Scene, objects: &[ObjectId], view: &View, size: [usize; 2]) -> Self {
        let mut pixels = vec![None::<(f64, ObjectId)>; size[0] * size[1]];
        let rays: Vec<DVec3> = (0..pixels.len()).map(|p| ray(view, size, p % size[0], p / size[0])).collect();
        for &object in objects {
            for t in scene.objects[object.index()].triangles.clone() {
                let [a, b, c] = scene.corners(t as usize).map(|p| p - view.eye);
                let (normal, edges) = ((b - a).cross(c - a), [a.cross(b), b.cross(c), c.cross(a)]);
                for (ray, pixel) in rays.iter().zip(&mut pixels) {
                    let sides = edges.map(|e| e.dot(*ray));
                    let depth = normal.dot(*ray) / normal.dot(a);
                    let inside = sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0);
                    if inside && depth > 0.0 && depth <= 1.0 / view.near && pixel.is_none_or(|p| p.0 < depth) {
                        *pixel = Some((depth, object));
                    }
                }
            }
        }
        Self { width: size[0], height: size[1], pixels }
    }

    /// Every object that has a pixel.
    pub fn objects(&self) -> Vec<ObjectId> {
        let mut objects: Vec<ObjectId> = self.pixels.iter().flatten().map(|p| p.1).collect();
        objects.sort_unstable();
        objects.dedup();
        objects
    }

    /// Whether a pixel's middle shows a part of a box (one that doesn't reach the near plane) before what is drawn.
    pub fn shows(&self, view: &View, bounds: &Bounds) -> bool {
        let at = bounds.local(view.eye);
        (0..self.pixels.len()).any(|p| {
            let ray = ray(view, [self.width, self.height], p % self.width, p / self.width);
            let (mut enter, mut leave) = (0.0, f64::INFINITY);
            for k in 0..3 {
                let along = bounds.axes[k].dot(ray);
                let [a, b] = [-bounds.half[k] - at[k], bounds.half[k] - at[k]].map(|d| d / along);
                enter = f64::max(enter, a.min(b));
                leave = f64::min(leave, a.max(b));
            }
            enter <= leave && self.pixels[p].is_none_or(|shown| shown.0 * enter <= 1.0)
        })
    }
}

/// A view from a random place in the cube of 24 m that looks at one in that of 10 m.
pub fn random_view(rng: &mut Prng, near: f64) -> View {
    let mut point = |reach: f64| DVec3::new(rng.range(-reach, reach), rng.range(-reach, reach), rng.range(-reach, reach));
    let (eye, target) = (point(12.0), point(5.0));
    View::look_at(eye, target, rng.range(0.4, 1.8), 1.5, near)
}
