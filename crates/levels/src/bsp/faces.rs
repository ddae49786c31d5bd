//! The faces of a level, and the leaves that they are in.

use super::error::{BspError, entry};
use super::file::LevelFile;
use super::infos::Infos;
use super::layout::{Faces as Layouts, Lump};
use super::{chains, meshes};
use crate::FARTHEST;
use glam::DVec3;

/// What a face is made of.
pub(crate) enum Shape {
    /// A convex polygon: indices of vertices, counter-clockwise from the visible side.
    Polygon(Vec<u32>),
    /// Triangles, likewise.
    Mesh(Vec<[u32; 3]>),
}

/// A face.
pub(crate) struct Face {
    pub shape: Shape,
    /// Index of its texture info.
    pub texture: usize,
    /// Whether engines draw this surface from any distance. If not, it hides nothing.
    pub is_exact: bool,
}

impl Face {
    /// The corners of a polygon.
    pub fn corners(&self) -> &[u32] {
        if let Shape::Polygon(corners) = &self.shape { corners } else { &[] }
    }

    /// Its triangles; those of a polygon as a fan.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        let mesh: &[[u32; 3]] = if let Shape::Mesh(triangles) = &self.shape { triangles } else { &[] };
        let corners = self.corners();
        let fan = (2..corners.len()).map(|k| [corners[0], corners[k - 1], corners[k]]);
        fan.chain(mesh.iter().copied())
    }
}

/// The faces of a level.
pub(crate) struct Faces {
    pub vertices: Vec<DVec3>,
    pub faces: Vec<Face>,
    pub infos: Infos,
}

impl Faces {
    /// The faces of all models.
    pub fn read(file: &LevelFile) -> Result<Self, BspError> {
        match file.layout.faces {
            Layouts::Chains(versions) => chains::read(file, versions),
            Layouts::Meshes(record) => meshes::read(file, &record),
        }
    }
}

/// The lump with a level's faces.
pub(super) fn lump_of_faces(file: &LevelFile) -> Lump {
    if file.entry_of(Lump::Faces).length == 0 && file.layout.number(Lump::HdrFaces).is_some() {
        Lump::HdrFaces
    } else {
        Lump::Faces
    }
}

/// The vertices of a level.
pub(super) fn vertices(file: &LevelFile) -> Result<Vec<DVec3>, BspError> {
    let vertices = file.lump(Lump::Vertices)?;
    let vertices = file.records(Lump::Vertices, &vertices, file.layout.vertex)?;
    let vertices: Vec<DVec3> = (0..vertices.len()).map(|v| vertices.point(v, 0)).collect();
    match vertices.iter().position(|p| !is_near(p)) {
        Some(i) => Err(entry(Lump::Vertices, i, format!("is not within {FARTHEST:e} of the origin"))),
        None => Ok(vertices),
    }
}

/// Whether a point is within the greatest extent of a level.
pub(super) fn is_near(p: &DVec3) -> bool {
    p.abs().cmple(DVec3::splat(FARTHEST)).all()
}

/// Visits the faces of each leaf, leaf by leaf; `faces` is their number.
pub(crate) fn marked_faces(file: &LevelFile, faces: usize, mut visit: impl FnMut(usize, usize)) -> Result<(), BspError> {
    let mark = match file.layout.faces {
        Layouts::Chains(versions) => file.of_version(lump_of_faces(file), versions)?.mark,
        Layouts::Meshes(record) => record.mark,
    };
    let (leaves, marks) = (file.lump(Lump::Leaves)?, file.lump(Lump::MarkSurfaces)?);
    let record = file.of_version(Lump::Leaves, file.layout.leaves)?;
    let leaves = file.records(Lump::Leaves, &leaves, record.size)?;
    let marks = file.records(Lump::MarkSurfaces, &marks, mark.size())?;
    let mut all = 0usize;
    for leaf in 0..leaves.len() {
        let [from, count] = record.marks.map(|field| leaves.index(leaf, field));
        all = all.saturating_add(count);
        let end = from.saturating_add(count);
        if end > marks.len() || all > marks.len() {
            return Err(entry(Lump::Leaves, leaf, format!("its mark surfaces go beyond the {} of the file", marks.len())));
        }
        for at in from..end {
            let face = marks.index(at, mark);
            if face >= faces {
                return Err(entry(Lump::Leaves, leaf, format!("its face {face} doesn't exist")));
            }
            visit(leaf, face);
        }
    }
    Ok(())
}
