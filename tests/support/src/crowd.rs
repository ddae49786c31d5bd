//! Crowds of boxes, cameras among them, and what rays in `f64` say that those see.

use crate::meshes::TRIANGLES;
use crate::random::Places;
use enfilade::ObjectId;
use enfilade::geom::Aabb;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::view::View;
use enfilade::scene::{Hints, Object, Role, Scene, Source};
use glam::{DMat3, DQuat, DVec3};

impl Places {
    /// A box turned any way, its middle within `reach` of the origin along each axis, so long at most.
    pub fn bounds(&mut self, reach: f64, half: DVec3) -> Bounds {
        let (centre, axis, size) = (self.point() * reach, self.point(), self.point().abs());
        turned(centre, DQuat::from_scaled_axis(axis * 3.0), size * half)
    }

    /// A view from a place in the cube of 24 m around the origin that looks at one in that of 10 m.
    pub fn view(&mut self, near: f64) -> View {
        let (eye, target) = (self.point() * 12.0, self.point() * 5.0);
        View::look_at(eye, target, 0.4 + self.unit() * 1.4, 1.5, near)
    }
}

pub fn turned(centre: DVec3, turn: DQuat, half: DVec3) -> Bounds {
    let axes = DMat3::from_quat(turn);
    Bounds { centre, axes: [axes.x_axis, axes.y_axis, axes.z_axis], half }
}

/// A scene of boxes, each an opaque object of 12 triangles.
pub fn scene(boxes: &[Bounds]) -> Scene {
    of_meshes(boxes.iter().map(|b| (b.corners().to_vec(), TRIANGLES.to_vec())))
}

/// A scene of positions and triangles, each an opaque object.
pub fn of_meshes(meshes: impl IntoIterator<Item = (Vec<DVec3>, Vec<[u32; 3]>)>) -> Scene {
    let mut scene = Scene {
        name: String::new(),
        source: Source::default(),
        origin: DVec3::ZERO,
        positions: Vec::new(),
        triangles: Vec::new(),
        objects: Vec::new(),
        hints: Hints::default(),
    };
    for (positions, triangles) in meshes {
        let (first, start) = (scene.positions.len() as u32, scene.triangles.len() as u32);
        scene.triangles.extend(triangles.iter().map(|t| t.map(|i| first + i)));
        scene.objects.push(Object {
            node: String::new(),
            role: Role::Unknown,
            opaque: true,
            glass: false,
            triangles: start..scene.triangles.len() as u32,
            bounds: Aabb::of(positions.iter().copied()),
        });
        scene.positions.extend(positions);
    }
    scene
}

/// Boxes of all sizes, turned all ways, in a cube of 20 m; some of them large and flat, like walls.
pub fn crowd(count: usize, random: &mut Places) -> Vec<Bounds> {
    let half = |i: usize| if i.is_multiple_of(4) { DVec3::new(4.0, 4.0, 0.05) } else { DVec3::splat(0.8) };
    (0..count).map(|i| random.bounds(10.0, half(i))).collect()
}

/// The box of an object along the axes.
pub fn bounds(scene: &Scene, object: ObjectId) -> Bounds {
    Bounds::from(scene.objects[object.index()].bounds)
}

/// What the middle of each pixel shows: 1/w and the object, by trying every triangle on every ray.
pub struct Picture {
    rays: Vec<DVec3>,
    pixels: Vec<Option<(f64, ObjectId)>>,
}

impl Picture {
    /// Of some objects of a scene.
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

    /// Whether a pixel's middle shows a part of a box (one that doesn't reach the near plane) before what is drawn.
    pub fn shows(&self, view: &View, bounds: &Bounds) -> bool {
        let at = bounds.local(view.eye);
        self.rays.iter().zip(&self.pixels).any(|(ray, pixel)| {
            let (mut enter, mut leave) = (0.0, f64::INFINITY);
            for k in 0..3 {
                let along = bounds.axes[k].dot(*ray);
                let [a, b] = [-bounds.half[k] - at[k], bounds.half[k] - at[k]].map(|d| d / along);
                enter = f64::max(enter, a.min(b));
                leave = f64::min(leave, a.max(b));
            }
            enter <= leave && pixel.is_none_or(|shown| shown.0 * enter <= 1.0)
        })
    }
}
