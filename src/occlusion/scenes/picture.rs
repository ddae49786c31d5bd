//! Scenes of oriented boxes, and reference pictures by rays in `f64`.
//!
//! Unit tests and `tests/support` both include this file, with different crate paths: each imports the names that it uses.

use super::{Aabb, Bounds, Object, ObjectId, Role, Scene, View};
use glam::{DMat3, DQuat, DVec3};

/// An empty scene.
pub fn empty() -> Scene {
    Scene::default()
}

/// Adds a mesh as an opaque object.
pub fn add_mesh(scene: &mut Scene, positions: &[DVec3], triangles: impl IntoIterator<Item = [u32; 3]>) {
    let (first, start) = (scene.positions.len() as u32, scene.triangles.len() as u32);
    scene.positions.extend_from_slice(positions);
    scene.triangles.extend(triangles.into_iter().map(|t| t.map(|i| first + i)));
    scene.objects.push(Object {
        node: String::new(),
        role: Role::Unknown,
        opaque: true,
        glass: false,
        triangles: start..scene.triangles.len() as u32,
        segments: 0..0,
        bounds: Aabb::of(positions.iter().copied()),
        reach: None,
    });
}

pub fn turned(centre: DVec3, turn: DQuat, half: DVec3) -> Bounds {
    let axes = DMat3::from_quat(turn);
    Bounds { centre, axes: [axes.x_axis, axes.y_axis, axes.z_axis], half }
}

/// The object at the centre of each pixel, with the reciprocal of its distance along the view direction, by brute force: every triangle and
/// every ray in `f64`. Rows from the top.
pub struct Picture {
    rays: Vec<DVec3>,
    pub pixels: Vec<Option<(f64, ObjectId)>>,
}

impl Picture {
    /// The picture of some objects of a scene.
    pub fn new(scene: &Scene, objects: &[ObjectId], view: &View, [width, height]: [usize; 2]) -> Self {
        let unproject = DMat3::from_cols(view.x, view.y, view.w).transpose().inverse();
        let middle = |i: usize, n: usize| (i as f64 + 0.5) * 2.0 / n as f64 - 1.0;
        let ray = |p: usize| unproject * DVec3::new(middle(p % width, width), -middle(p / width, height), 1.0);
        let rays: Vec<DVec3> = (0..width * height).map(ray).collect();
        let mut pixels = vec![None::<(f64, ObjectId)>; rays.len()];
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
        Self { rays, pixels }
    }

    /// Every object that has a pixel.
    pub fn objects(&self) -> Vec<ObjectId> {
        let mut objects: Vec<ObjectId> = self.pixels.iter().flatten().map(|p| p.1).collect();
        objects.sort_unstable();
        objects.dedup();
        objects
    }

    /// Number of pixels whose centres show a part of a box (beyond the near plane) in front of the picture.
    pub fn count(&self, view: &View, bounds: &Bounds) -> usize {
        let at = bounds.local(view.eye);
        let shows = |(ray, pixel): &(&DVec3, &Option<(f64, ObjectId)>)| {
            let (mut enter, mut leave) = (0.0, f64::INFINITY);
            for k in 0..3 {
                let along = bounds.axes[k].dot(**ray);
                let [a, b] = [-bounds.half[k] - at[k], bounds.half[k] - at[k]].map(|d| d / along);
                enter = f64::max(enter, a.min(b));
                leave = f64::min(leave, a.max(b));
            }
            enter <= leave && pixel.is_none_or(|shown| shown.0 * enter <= 1.0)
        };
        self.rays.iter().zip(&self.pixels).filter(shows).count()
    }
}
