//! Crowds of boxes, cameras among them, and what rays in `f64` say that those see.

use crate::meshes::TRIANGLES;
use crate::random::Places;
use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::view::View;
use enfilade::scene::{Object, Role, Scene};
use glam::{DQuat, DVec3};

#[path = "../../../src/occlusion/scenes/picture.rs"]
mod picture;

pub use picture::{Picture, add_mesh, empty, turned};

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

/// A scene of boxes, each an opaque object of 12 triangles.
pub fn scene(boxes: &[Bounds]) -> Scene {
    of_meshes(boxes.iter().map(|b| (b.corners().to_vec(), TRIANGLES.to_vec())))
}

/// A scene of positions and triangles, each an opaque object.
pub fn of_meshes(meshes: impl IntoIterator<Item = (Vec<DVec3>, Vec<[u32; 3]>)>) -> Scene {
    let mut scene = empty();
    for (positions, triangles) in meshes {
        add_mesh(&mut scene, &positions, triangles);
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

/// The least box around an object of a crowd, along its own axes.
pub fn own_bounds(scene: &Scene, object: ObjectId) -> Bounds {
    let first = scene.triangles[scene.objects[object.index()].triangles.start as usize];
    let first = *first.iter().min().expect("three corners") as usize;
    let corners = &scene.positions[first..first + 8];
    Bounds::along(corners, [1, 2, 4].map(|k| (corners[k] - corners[0]).normalize()))
}

/// Every object.
pub fn all(scene: &Scene) -> Vec<ObjectId> {
    (0..scene.objects.len() as u32).map(ObjectId).collect()
}

/// A walk with a jump every fifth frame, a look back, and stops.
pub fn path(random: &mut Places, frames: usize) -> Vec<View> {
    let mut views: Vec<View> = Vec::new();
    for frame in 0..frames {
        let next = match (views.last(), frame % 5) {
            (Some(view), 1) => *view,
            (Some(view), 2) => View { eye: view.eye + view.w * 0.3, ..*view },
            (Some(view), 3 | 4) => View { x: -view.x, w: -view.w, ..*view },
            _ => random.view(0.05),
        };
        views.push(next);
    }
    views
}
