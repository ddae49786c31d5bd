//! Faces as triangles and patches: those of Quake 3.

use super::error::{BspError, entry, lump as fault};
use super::faces::{Face, Faces, Shape, vertices};
use super::file::LevelFile;
use super::infos::Infos;
use super::layout::{Lump, Mesh};
use super::patches::Patch;
use super::record::{Records, i32};
use glam::DVec3;

/// Most triangles of all faces: faces may share their vertices, so the file's size is no limit. More: a hostile file of a few
/// megabytes fills the memory. Fewer: large levels are refused.
const MOST_TRIANGLES: usize = 1 << 22;

/// Kinds of faces. Billboards have no surface of their own.
const POLYGON: i64 = 1;
const PATCH: i64 = 2;
const MESH: i64 = 3;
const BILLBOARD: i64 = 4;

/// The faces of all models.
pub(super) fn read(file: &LevelFile, record: &Mesh) -> Result<Faces, BspError> {
    let [corners, faces] = [Lump::MeshVertices, Lump::Faces].map(|lump| file.lump(lump));
    let (corners, faces) = (corners?, faces?);
    let corners = file.records(Lump::MeshVertices, &corners, 4)?;
    let faces = file.records(Lump::Faces, &faces, record.size)?;
    let infos = Infos::of_meshes(file, record)?;
    let vertices = vertices(file)?;
    let own = vertices.len();
    let mut lumps = Lumps { record, faces, corners, own, vertices, triangles: 0 };
    let mut all = Vec::new();
    for i in 0..lumps.faces.len() {
        let texture = lumps.faces.index(i, record.texture);
        if texture >= infos.names.len() {
            let shown = lumps.faces.int(i, record.texture);
            return Err(entry(Lump::Faces, i, format!("its texture {shown} doesn't exist")));
        }
        let (triangles, is_exact) = match lumps.faces.int(i, record.kind) {
            POLYGON | MESH => (lumps.mesh(i)?, true),
            PATCH => lumps.patch(i)?,
            BILLBOARD => (Vec::new(), true),
            kind => return Err(entry(Lump::Faces, i, format!("is of kind {kind}, which isn't known"))),
        };
        all.push(Face { shape: Shape::Mesh(triangles), texture, is_exact });
    }
    Ok(Faces { vertices: lumps.vertices, faces: all, infos })
}

/// The lumps of meshes.
struct Lumps<'b> {
    record: &'b Mesh,
    faces: Records<'b>,
    corners: Records<'b>,
    /// How many vertices the file has.
    own: usize,
    /// These, and those of patches.
    vertices: Vec<DVec3>,
    /// Of all faces so far.
    triangles: usize,
}

impl Lumps<'_> {
    /// The vertices of a face, as a range of the file's.
    fn range(&self, face: usize) -> Result<std::ops::Range<usize>, BspError> {
        let [first, count] = self.record.vertices.map(|field| self.faces.index(face, field));
        match first.saturating_add(count) {
            end if end <= self.own => Ok(first..end),
            _ => Err(entry(Lump::Faces, face, format!("ends beyond the {} vertices", self.own))),
        }
    }

    fn count(&mut self, triangles: usize) -> Result<(), BspError> {
        self.triangles = self.triangles.saturating_add(triangles);
        match self.triangles {
            ..=MOST_TRIANGLES => Ok(()),
            _ => Err(fault(Lump::Faces, format!("has more than {MOST_TRIANGLES} triangles"))),
        }
    }

    /// The triangles of a polygon or a mesh.
    fn mesh(&mut self, face: usize) -> Result<Vec<[u32; 3]>, BspError> {
        let missing = |what: String| entry(Lump::Faces, face, what);
        let vertices = self.range(face)?;
        let [first, count] = self.record.corners.map(|field| self.faces.index(face, field));
        let end = first.saturating_add(count);
        if end > self.corners.len() || !count.is_multiple_of(3) {
            let what =
                format!("its {count} mesh vertices from {first} on are no triangles, or beyond the {}", self.corners.len());
            return Err(missing(what));
        }
        self.count(count / 3)?;
        let corner = |at: usize| {
            let vertex = self.corners.index(at, i32(0));
            if vertex < vertices.len() {
                Ok((vertices.start + vertex) as u32)
            } else {
                Err(missing(format!("its vertex {} doesn't exist", self.corners.int(at, i32(0)))))
            }
        };
        // The file has them clockwise.
        (first..end).step_by(3).map(|at| Ok([corner(at)?, corner(at + 2)?, corner(at + 1)?])).collect()
    }

    /// The triangles of a patch, and whether it is flat.
    fn patch(&mut self, face: usize) -> Result<(Vec<[u32; 3]>, bool), BspError> {
        let vertices = self.range(face)?;
        let size = self.record.patch.map(|field| self.faces.index(face, field));
        let is_grid = size.iter().all(|side| *side >= 3 && side % 2 == 1);
        if !is_grid || size[0].checked_mul(size[1]) != Some(vertices.len()) {
            let shown = self.record.patch.map(|field| self.faces.int(face, field));
            let what = format!("is a patch of {} x {} control points, but has {}", shown[0], shown[1], vertices.len());
            return Err(entry(Lump::Faces, face, what));
        }
        let points = self.vertices[vertices].to_vec();
        let patch = Patch::new(&points, size[0]);
        self.count(patch.triangles())?;
        let first = self.vertices.len() as u32;
        let is_flat = patch.is_flat();
        let (points, triangles) = patch.tessellated();
        self.vertices.extend(points);
        Ok((triangles.into_iter().map(|t| t.map(|v| first + v)).collect(), is_flat))
    }
}
