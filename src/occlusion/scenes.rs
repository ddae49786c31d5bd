//! Small scenes and reference pictures, for tests.

use crate::ObjectId;
use crate::math::geom::Aabb;
use crate::math::random::Prng;
use crate::occlusion::bounds::Bounds;
use crate::occlusion::hierarchy::{Divide, Hierarchy, Node};
use crate::occlusion::view::View;
use crate::types::scene::{Object, Role, Scene};
use glam::{DQuat, DVec3};

mod picture;

pub use picture::{Picture, turned};

use picture::{add_mesh, empty};

/// Adds a box as an object of 12 triangles per copy.
pub fn add(scene: &mut Scene, bounds: &Bounds, copies: usize) {
    const FACES: [[u32; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = FACES.repeat(copies).into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    add_mesh(scene, &bounds.corners(), triangles);
}

/// Cubes of half a metre along x, each of 12 triangles per copy.
pub fn row(cubes: &[(f64, usize)]) -> Scene {
    let mut scene = empty();
    for &(x, copies) in cubes {
        add(&mut scene, &turned(DVec3::X * x, DQuat::IDENTITY, DVec3::splat(0.25)), copies);
    }
    scene
}

/// Randomly rotated boxes of all sizes in a cube of 20 m; some of them large and flat, like walls.
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

/// A view from a random point in a cube of 24 m to a random point in a cube of 10 m.
pub fn random_view(rng: &mut Prng, near: f64) -> View {
    let mut point = |reach: f64| DVec3::new(rng.range(-reach, reach), rng.range(-reach, reach), rng.range(-reach, reach));
    let (eye, target) = (point(12.0), point(5.0));
    View::look_at(eye, target, rng.range(0.4, 1.8), 1.5, near)
}

/// The oriented bounding box of an object made by [`add`].
pub fn own_bounds(scene: &Scene, object: &Object) -> Bounds {
    let first = scene.triangles[object.triangles.start as usize][0] as usize;
    let corners = &scene.positions[first..first + 8];
    Bounds::along(corners, [1, 2, 4].map(|k| (corners[k] - corners[0]).normalize()))
}

/// A binary tree of oriented boxes over objects made by [`add`]: those of leaves have the axes of their object, those of inner nodes the
/// axes of one of their objects. A child's may extend beyond its parent's.
pub fn turned_tree(scene: &Scene) -> Hierarchy {
    struct Turned(Vec<Bounds>);
    impl Divide for Turned {
        fn divide(&mut self, node: &Node, objects: &mut [ObjectId]) -> Vec<usize> {
            let at = |o: &ObjectId| node.bounds.longest().dot(self.0[o.index()].centre);
            objects.sort_by(|a, b| at(a).total_cmp(&at(b)));
            vec![objects.len() / 2]
        }

        fn bounds(&mut self, objects: &[ObjectId], _: Bounds) -> Bounds {
            let of = |o: &ObjectId| self.0[o.index()];
            let corners: Vec<DVec3> = objects.iter().flat_map(|o| of(o).corners()).collect();
            Bounds::along(&corners, of(&objects[0]).axes)
        }
    }
    let boxes: Vec<Aabb> = scene.objects.iter().map(|o| o.bounds).collect();
    let triangles: Vec<u32> = scene.objects.iter().map(|o| o.triangles.len() as u32).collect();
    Hierarchy::divided(&boxes, &triangles, &mut Turned(scene.objects.iter().map(|o| own_bounds(scene, o)).collect()))
}
