//! Lines of cells, to look at.

use super::PvsFile;
use crate::CellId;
use crate::math::geom::{Aabb, Plane};
use crate::math::polyhedron::faces;
use glam::{DVec3, Vec3, Vec4};

impl PvsFile {
    /// The edges of a cell's convex pieces, as far as the objects reach: metres, relative to [`PvsFile::origin`]. An edge of two faces is there
    /// twice.
    ///
    /// # Panics
    ///
    /// If there is no such cell.
    pub fn cell_lines(&self, cell: CellId) -> Vec<[Vec3; 2]> {
        let corners = self.objects.iter().flat_map(|object| object.bounds).map(|p| p.as_dvec3());
        let within = Aabb::of(corners.chain([DVec3::ZERO]));
        let mut lines = Vec::new();
        for piece in &self.cells[cell.index()].pieces {
            let plane = |plane: &Vec4| Plane { n: plane.truncate().as_dvec3(), d: f64::from(plane.w) };
            let planes: Vec<Plane> = piece.iter().map(plane).collect();
            for face in faces(&planes, &within).iter().take(planes.len()) {
                let next = face.iter().cycle().skip(1);
                lines.extend(face.iter().zip(next).map(|(a, b)| [a.as_vec3(), b.as_vec3()]));
            }
        }
        lines
    }
}
