//! Spatial index of a scene's opaque triangles. Tubes are left out, because their triangles are only bounding prisms.

use crate::math::box_tree::BoxTree;
use crate::math::geom::Aabb;
use crate::scene::Scene;
use glam::DVec3;

/// Opaque triangles, with a bounding volume hierarchy.
pub(super) struct Opaque {
    triangles: Vec<[DVec3; 3]>,
    tree: BoxTree,
}

impl Opaque {
    pub(super) fn new(scene: &Scene) -> Self {
        let objects = scene.objects.iter().filter(|o| o.opaque && !o.is_tube());
        let triangles: Vec<_> = objects.flat_map(|o| o.triangles.clone()).map(|t| scene.corners(t as usize)).collect();
        let boxes: Vec<Aabb> = triangles.iter().map(|corners| Aabb::of(*corners)).collect();
        Self { tree: BoxTree::over(&boxes), triangles }
    }

    /// Triangles whose box intersects another, in no order.
    pub(super) fn in_box(&self, bounds: &Aabb) -> Vec<[DVec3; 3]> {
        let mut found = Vec::new();
        self.tree.in_box(bounds, &mut |i| found.push(self.triangles[i as usize]));
        found
    }
}
