//! Fences: faces of the world with see-through textures (`{...`).
//!
//! Some compilers give the space behind a fence a leaf (`func_detail_fence` in ericw-tools), so the tree decides visibility. For
//! all other compilers a brush of the world with such a texture is solid, so their rows hide what games show. Only the level's
//! `.prt` tells whether this was intended.

use super::faces::Faces;
use super::layout::*;
use super::portals::{sink, width};
use super::tree::{Tree, infos_with};
use enfilade::math::geom::{Plane, newell};
use glam::DVec3;
use qbsp::data::{BspFace, BspModel};

/// Greatest distance of vertices from their planes, in multiples of the file's rounding; narrower solids behind a face are
/// ignored. Larger: thin fences count as edges of walls. Smaller: leaves beside a fence's edge count as behind it.
const OFF_PLANE: f64 = 16.0;

/// Fences with solid matter behind, as indices of faces, ascending.
pub(super) fn on_walls(source: &Source<'_>, tree: &Tree) -> Result<Vec<usize>, BspError> {
    let infos = infos_with(source, |name| name.starts_with('{'))?;
    let models: Vec<BspModel> = source.entries(MODELS)?;
    let Some(world) = models.first() else { return Ok(Vec::new()) };
    let all: Vec<BspFace> = source.entries(FACES)?;
    let of_world = all.iter().enumerate().skip(world.first_face as usize).take(world.num_faces as usize);
    let is_fence = |face: &BspFace| infos.get(face.texture_info_idx.0 as usize) == Some(&true);
    let mut fences: Vec<usize> = of_world.filter(|(_, face)| is_fence(face)).map(|(i, _)| i).collect();
    if fences.is_empty() {
        return Ok(fences);
    }

    let (faces, off) = (Faces::read(source)?, OFF_PLANE * tree.rounding());
    fences.retain(|&face| {
        let winding: Vec<DVec3> = faces.faces[face].corners.iter().map(|&v| faces.vertices[v as usize]).collect();
        // The solid side is below the face.
        let Some(n) = newell(&winding).try_normalize() else { return false };
        let plane = Plane::through(winding[0], n);
        let behind = sink(tree, tree.root, winding, &plane, off, true);
        behind.iter().any(|piece| piece.leaf.is_none() && width(&piece.winding, n) > 2.0 * off)
    });
    Ok(fences)
}

/// The error for a level with undecided fences.
pub(super) fn refuse(walls: &[usize]) -> Result<(), BspError> {
    if walls.is_empty() { Ok(()) } else { Err(BspError::Fences(walls.len())) }
}
