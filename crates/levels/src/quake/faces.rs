//! The faces of a level as meshes with materials.

use super::texels::Textures;
use super::textures::material;
use crate::bsp::faces::{Face, Faces};
use enfilade::scene::{Mesh, Role, SceneBuilder};
use glam::DVec3;
use std::collections::HashMap;

impl Faces {
    /// Sets the material of a mesh of faces with one texture.
    pub(super) fn look(&self, builder: &mut SceneBuilder, textures: &Textures, faces: &[usize]) {
        if !builder.is_traced() {
            return;
        }
        let coordinates = |face: &Face, vertex: u32| {
            let projection = &self.projections[face.texture];
            let found = textures.get(&self.textures[face.texture]).map(|found| found.size.map(f64::from));
            let size = found.unwrap_or(projection.size);
            let p = self.vertices[vertex as usize];
            [0, 1].map(|k| ((projection.axes[k].dot(p) + projection.offsets[k]) / size[k]) as f32)
        };
        let all = faces.iter().map(|&face| &self.faces[face]);
        let triangles = all.clone().flat_map(|face| fan(&face.corners).map(|t| t.map(|vertex| coordinates(face, vertex))));
        let texture = all.map(|face| self.textures[face.texture].as_str()).next().unwrap_or_default();
        builder.look(material(texture, textures), triangles.collect());
    }

    /// Faces as triangle fans.
    pub(super) fn mesh(
        &self,
        faces: &[usize],
        node: String,
        role: Role,
        opaque: bool,
        turned: &dyn Fn(DVec3) -> DVec3,
    ) -> Mesh {
        let (mut positions, mut triangles, mut known) = (Vec::new(), Vec::new(), HashMap::new());
        for &face in faces {
            let corners: Vec<u32> = self.faces[face]
                .corners
                .iter()
                .map(|&vertex| {
                    *known.entry(vertex).or_insert_with(|| {
                        positions.push(turned(self.vertices[vertex as usize]));
                        positions.len() as u32 - 1
                    })
                })
                .collect();
            triangles.extend(fan(&corners));
        }
        Mesh { node, role, opaque, positions, triangles }
    }
}

/// The triangles of a convex polygon.
fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    (2..corners.len()).map(|k| [corners[0], corners[k - 1], corners[k]])
}
