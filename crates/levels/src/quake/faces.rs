//! The faces of a level as meshes with materials.

use super::texels::Textures;
use super::textures::{GLASS, material};
use super::uses::Use;
use crate::bsp::faces::Faces;
use enfilade::scene::{Mesh, Role, SceneBuilder};
use glam::DVec3;
use std::collections::HashMap;

impl Faces {
    /// Sets the material of a mesh of faces with one texture, and what they are used for.
    pub(super) fn look(&self, builder: &mut SceneBuilder, textures: &Textures, faces: &[usize], used: Use) {
        let Some(texture) = faces.first().map(|&face| self.faces[face].texture).filter(|_| builder.is_traced()) else {
            return;
        };
        let name = &self.infos.names[texture];
        let found = textures.get(name);
        let mut material = material(name, textures);
        if let (None, Some([r, g, b])) = (found, self.infos.colours[texture]) {
            material.colour = [r, g, b, material.colour[3]];
        }
        // Holes are in the picture.
        if used == Use::SeeThrough && material.cutoff.is_none() {
            material.colour[3] = GLASS;
        }
        let Some(projection) = self.infos.projections.get(texture) else { return builder.look(material, Vec::new()) };
        let size = found.map(|found| found.size.map(f64::from)).unwrap_or(projection.size);
        let coordinates = |vertex: u32| {
            let p = self.vertices[vertex as usize];
            [0, 1].map(|k| ((projection.axes[k].dot(p) + projection.offsets[k]) / size[k]) as f32)
        };
        let triangles = faces.iter().flat_map(|&face| self.faces[face].triangles()).map(|t| t.map(coordinates));
        builder.look(material, triangles.collect());
    }

    /// Faces as triangles.
    pub(super) fn mesh(
        &self,
        faces: &[usize],
        node: String,
        role: Role,
        opaque: bool,
        turned: &dyn Fn(DVec3) -> DVec3,
    ) -> Mesh {
        let (mut positions, mut triangles, mut known) = (Vec::new(), Vec::new(), HashMap::new());
        for triangle in faces.iter().flat_map(|&face| self.faces[face].triangles()) {
            triangles.push(triangle.map(|vertex| {
                *known.entry(vertex).or_insert_with(|| {
                    positions.push(turned(self.vertices[vertex as usize]));
                    positions.len() as u32 - 1
                })
            }));
        }
        Mesh { node, role, opaque, positions, triangles }
    }
}
