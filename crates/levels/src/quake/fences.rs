//! Fences: faces of the world with textures that games look through (`{...`).
//!
//! Compilers that know them give a leaf to what is behind (ericw-tools' `func_detail_fence`), and the tree tells what is seen. To every
//! compiler a brush of the world with such a texture is solid: its rows hide what games show, and whether that was meant only the level's
//! `.prt` tells.

use super::faces::Faces;
use super::layout::*;
use super::portals::{sink, width};
use super::tree::{Tree, infos_with};
use enfilade::geom::{Plane, newell};
use glam::DVec3;
use qbsp::data::{BspFace, BspModel};

/// Vertices lie this many of the file's roundings off their planes, at most; what is narrower behind a face is not asked about. Larger:
/// thin fences pass for walls' edges. Smaller: leaves beside a fence's edge count as behind it.
const OFF_PLANE: f64 = 16.0;

/// Fences with solid matter behind, as indices of faces, rising.
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

/// The error of a level of which nobody tells what such faces hide.
pub(super) fn refuse(walls: &[usize]) -> Result<(), BspError> {
    if walls.is_empty() { Ok(()) } else { Err(BspError::Fences(walls.len())) }
}
