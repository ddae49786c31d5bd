//! The faces of a level: reads and checks them, and makes meshes with materials.

use super::layout::*;
use super::texels::Textures;
use super::textures::material;
use super::tree::{point, texture_name, texture_size};
use crate::FARTHEST;
use enfilade::scene::{Mesh, Role, SceneBuilder};
use glam::DVec3;
use qbsp::data::texture::PlanarTextureProjection;
use qbsp::data::{BspEdge, BspFace, BspTexInfo};
use std::collections::HashMap;

/// A convex face.
pub(super) struct Face {
    /// Indices of vertices, counter-clockwise from the visible side.
    pub corners: Vec<u32>,
    pub texture: usize,
}

/// The faces of a level.
pub(super) struct Faces {
    pub vertices: Vec<DVec3>,
    pub faces: Vec<Face>,
    /// Names in lower case.
    pub textures: Vec<String>,
    /// Projection of each texture, with width and height in texels.
    projections: Vec<(PlanarTextureProjection, [f64; 2])>,
}

/// Width and height of a missing texture, texels.
const USUAL_SIZE: u32 = 64;

impl Faces {
    /// The faces of all models.
    pub fn read(source: &Source<'_>) -> Result<Self, BspError> {
        let vertices: Vec<DVec3> = source.entries(VERTICES)?.into_iter().map(point).collect();
        let is_near = |p: &DVec3| p.abs().cmple(DVec3::splat(FARTHEST)).all();
        if let Some(i) = vertices.iter().position(|p| !is_near(p)) {
            return Err(entry(VERTICES, i, format!("is not within {FARTHEST:e} of the origin")));
        }
        let edges: Vec<BspEdge> = source.entries(EDGES)?;
        let surface_edges: Vec<i32> = source.entries(SURFACE_EDGES)?;
        let infos: Vec<BspTexInfo> = source.entries(TEXTURE_INFOS)?;
        let (mut textures, mut projections) = (Vec::new(), Vec::new());
        for (i, info) in infos.iter().enumerate() {
            let texture = info.texture_idx.0.unwrap_or(u32::MAX);
            let count = source.lump(TEXTURES).first_chunk().map_or(0, |&b| u32::from_le_bytes(b));
            if texture >= count {
                return Err(entry(TEXTURE_INFOS, i, format!("its texture {texture} doesn't exist")));
            }
            // A file without textures has no names, either.
            textures.push(texture_name(source, texture).unwrap_or_else(|| format!("texture {texture}")));
            let size = texture_size(source, texture).unwrap_or([USUAL_SIZE; 2]);
            projections.push((info.projection, size.map(f64::from)));
        }
        let corner = |face: usize, at: usize| -> Result<u32, BspError> {
            let missing = |what: String| entry(FACES, face, what);
            let edge = *surface_edges.get(at).ok_or_else(|| missing(format!("its surface edge {at} doesn't exist")))?;
            let index = edge.unsigned_abs() as usize;
            let ends = edges.get(index).ok_or_else(|| missing(format!("its edge {index} doesn't exist")))?;
            let vertex = if edge < 0 { ends.b.0 } else { ends.a.0 };
            match (vertex as usize) < vertices.len() {
                true => Ok(vertex),
                false => Err(missing(format!("its vertex {vertex} doesn't exist"))),
            }
        };
        let (mut faces, mut corners_of_all) = (Vec::new(), 0usize);
        for (i, face) in source.entries::<BspFace>(FACES)?.into_iter().enumerate() {
            let first = face.first_edge as usize;
            let last = first.saturating_add(face.num_edges.0 as usize);
            let texture = face.texture_info_idx.0 as usize;
            if texture >= textures.len() {
                return Err(entry(FACES, i, format!("its texture info {texture} doesn't exist")));
            }
            corners_of_all = corners_of_all.saturating_add(face.num_edges.0 as usize);
            if corners_of_all > surface_edges.len() {
                let what = format!("ends beyond the {} surface edges; each belongs to one face", surface_edges.len());
                return Err(entry(FACES, i, what));
            }
            // The file has them clockwise.
            let corners = (first..last).rev().map(|at| corner(i, at)).collect::<Result<Vec<_>, _>>()?;
            faces.push(Face { corners, texture });
        }
        Ok(Self { vertices, faces, textures, projections })
    }

    /// Sets the material of a mesh of faces with one texture.
    pub fn look(&self, builder: &mut SceneBuilder, textures: &Textures, faces: &[usize]) {
        if !builder.is_traced() {
            return;
        }
        let coordinates = |face: &Face, vertex: u32| {
            let (projection, own) = &self.projections[face.texture];
            let found = textures.get(&self.textures[face.texture]).map(|found| found.size.map(f64::from));
            let size = found.unwrap_or(*own);
            let p = self.vertices[vertex as usize];
            let along = |axis, offset: f32| point(axis).dot(p) + f64::from(offset);
            let texels = [along(projection.u_axis, projection.u_offset), along(projection.v_axis, projection.v_offset)];
            [0, 1].map(|k| (texels[k] / size[k]) as f32)
        };
        let all = faces.iter().map(|&face| &self.faces[face]);
        let triangles = all.clone().flat_map(|face| fan(&face.corners).map(|t| t.map(|vertex| coordinates(face, vertex))));
        let texture = all.map(|face| self.textures[face.texture].as_str()).next().unwrap_or_default();
        builder.look(material(texture, textures), triangles.collect());
    }

    /// Faces as triangle fans.
    pub fn mesh(&self, faces: &[usize], node: String, role: Role, opaque: bool, turned: &dyn Fn(DVec3) -> DVec3) -> Mesh {
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
