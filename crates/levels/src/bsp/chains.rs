//! Faces as chains of edges: those of Quake, Half-Life, Quake 2 and Source.

use super::displacements::Displacements;
use super::error::{BspError, entry};
use super::faces::{Face, Faces, Shape, lump_of_faces, vertices};
use super::file::LevelFile;
use super::infos::Infos;
use super::layout::{Chain, Lump};
use super::record::{Records, i32};

/// The faces of all models; `versions`: records by the lump's version.
pub(super) fn read(file: &LevelFile, versions: &[(i32, Chain)]) -> Result<Faces, BspError> {
    let faces_of = lump_of_faces(file);
    let record = file.of_version(faces_of, versions)?;
    let [edges, surface_edges, faces] = [Lump::Edges, Lump::SurfaceEdges, faces_of].map(|lump| file.lump(lump));
    let (edges, surface_edges, faces) = (edges?, surface_edges?, faces?);
    let edges = file.records(Lump::Edges, &edges, 2 * record.ends[0].size())?;
    let surface_edges = file.records(Lump::SurfaceEdges, &surface_edges, 4)?;
    let faces = file.records(faces_of, &faces, record.size)?;
    let chains = Chains { record: &record, edges, surface_edges, faces, faces_of, vertices: vertices(file)? };

    let infos = Infos::of_chains(file, &record)?;
    let (mut all, mut corners_of_all) = (Vec::new(), 0usize);
    for i in 0..chains.faces.len() {
        let texture = chains.faces.index(i, record.texture_info);
        if texture >= infos.names.len() {
            let shown = chains.faces.int(i, record.texture_info);
            return Err(entry(faces_of, i, format!("its texture info {shown} doesn't exist")));
        }
        let corners = chains.corners(i, &mut corners_of_all)?;
        all.push(Face { shape: Shape::Polygon(corners), texture, is_exact: true });
    }
    let displaced = record.displacement.map(|record| chains.displaced(&record)).unwrap_or_default();
    let mut faces = Faces { vertices: chains.vertices, faces: all, infos };
    if let Some(record) = record.displacement.filter(|_| !displaced.is_empty()) {
        let mut displacements = Displacements::read(file, record)?;
        for (face, displacement) in displaced {
            displacements.displace(&mut faces, faces_of, face, displacement)?;
        }
    }
    Ok(faces)
}

/// The lumps of chains.
struct Chains<'b> {
    record: &'b Chain,
    edges: Records<'b>,
    surface_edges: Records<'b>,
    faces: Records<'b>,
    faces_of: Lump,
    vertices: Vec<glam::DVec3>,
}

impl Chains<'_> {
    /// The corners of a face, counter-clockwise. `corners_of_all`: of all faces so far.
    fn corners(&self, face: usize, corners_of_all: &mut usize) -> Result<Vec<u32>, BspError> {
        let [first, count] = self.record.edges.map(|field| self.faces.index(face, field));
        *corners_of_all = corners_of_all.saturating_add(count);
        if *corners_of_all > self.surface_edges.len() {
            let what = format!("ends beyond the {} surface edges; each belongs to one face", self.surface_edges.len());
            return Err(entry(self.faces_of, face, what));
        }
        // The file has them clockwise.
        (first..first.saturating_add(count)).rev().map(|at| self.corner(face, at)).collect()
    }

    fn corner(&self, face: usize, at: usize) -> Result<u32, BspError> {
        let missing = |what: String| entry(self.faces_of, face, what);
        if at >= self.surface_edges.len() {
            return Err(missing(format!("its surface edge {at} doesn't exist")));
        }
        let edge = self.surface_edges.int(at, i32(0));
        let index = edge.unsigned_abs() as usize;
        if index >= self.edges.len() {
            return Err(missing(format!("its edge {index} doesn't exist")));
        }
        let vertex = self.edges.index(index, self.record.ends[usize::from(edge < 0)]);
        if vertex < self.vertices.len() {
            Ok(vertex as u32)
        } else {
            Err(missing(format!("its vertex {vertex} doesn't exist")))
        }
    }

    /// Faces with displacements, and these.
    fn displaced(&self, record: &super::layout::Displacement) -> Vec<(usize, usize)> {
        let number = |face| usize::try_from(self.faces.int(face, record.of_face)).ok();
        (0..self.faces.len()).filter_map(|face| Some((face, number(face)?))).collect()
    }
}
