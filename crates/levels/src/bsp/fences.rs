//! Fences: faces of the world with see-through textures (`{...`).
//!
//! Some compilers give the space behind a fence a leaf (`func_detail_fence` in ericw-tools), so the tree decides visibility. For
//! all other compilers a brush of the world with such a texture is solid, so their rows hide what games show. Only the level's
//! `.prt` tells whether this was intended.

use super::error::BspError;
use super::faces::Faces;
use super::file::LevelFile;
use super::layout::Lump;
use super::portals::{sink, width};
use super::tree::Tree;
use enfilade::math::geom::{Plane, newell};
use glam::DVec3;

/// Greatest distance of vertices from their planes, in multiples of the file's rounding; narrower solids behind a face are
/// ignored. Larger: thin fences count as edges of walls. Smaller: leaves beside a fence's edge count as behind it.
const OFF_PLANE: f64 = 16.0;

/// Fences with solid matter behind, as indices of faces, ascending.
pub(super) fn on_walls(file: &LevelFile, tree: &Tree) -> Result<Vec<usize>, BspError> {
    if !file.layout.has_fences {
        return Ok(Vec::new());
    }
    let faces = Faces::read(file)?;
    let models = file.lump(Lump::Models)?;
    let models = file.records(Lump::Models, &models, file.layout.model.size)?;
    let [first, count] = file.layout.model.faces.map(|field| models.index(0, field));
    let is_fence = |&face: &usize| faces.infos.names[faces.faces[face].texture].starts_with('{');
    let mut fences: Vec<usize> = (0..faces.faces.len()).skip(first).take(count).filter(is_fence).collect();
    let off = OFF_PLANE * tree.rounding();
    fences.retain(|&face| {
        let winding: Vec<DVec3> = faces.faces[face].corners().iter().map(|&v| faces.vertices[v as usize]).collect();
        // The solid side is below the face.
        let Some(n) = newell(&winding).try_normalize() else { return false };
        let plane = Plane::through(winding[0], n);
        let behind = sink(tree, tree.root, winding, &plane, off, true);
        behind.iter().any(|piece| piece.cell.is_none() && width(&piece.winding, n) > 2.0 * off)
    });
    Ok(fences)
}

/// The error for a level with undecided fences.
pub(crate) fn refuse(walls: &[usize]) -> Result<(), BspError> {
    if walls.is_empty() { Ok(()) } else { Err(BspError::Fences(walls.len())) }
}
