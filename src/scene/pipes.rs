//! Tubes as a scene has them: in pieces that can be seen or hidden, with prisms around them; or as meshes, where there are few.

use super::{Mesh, Role};
use crate::tubes::{Tubes, part, prism, usual_sides};
use std::ops::Range;

/// Segments of tubes below which a scene has none: a few pipes are meshes.
pub(super) const FEWEST_SEGMENTS: usize = 64;

/// Of a prism around a segment.
const TRIANGLES_OF_SEGMENT: u32 = 12;

/// Prisms around tubes, by piece.
pub(super) struct Prisms {
    /// All of them, in the order of the pieces.
    pub mesh: Mesh,
    /// The tubes, with more sections where they are cut.
    pub tubes: Tubes,
    /// By piece: triangles of the mesh, and segments of the tubes.
    pub pieces: Vec<[Range<u32>; 2]>,
}

/// Cuts tubes into pieces of no more than `most` triangles, as far as segments allow.
pub(super) fn prisms(node: String, role: Role, tubes: &Tubes, most: u32) -> Prisms {
    let tubes = tubes.divided();
    let mut mesh = Mesh { node, role, opaque: true, positions: Vec::new(), triangles: Vec::new() };
    let mut pieces = Vec::new();
    for segments in tubes.pieces((most / TRIANGLES_OF_SEGMENT).max(1)) {
        let start = mesh.triangles.len() as u32;
        for (tube, segments) in tubes.parts(segments.clone()) {
            let prism = prism(&tubes, tube, segments);
            let base = mesh.positions.len() as u32;
            mesh.positions.extend(prism.positions.iter().map(|p| tube.origin + p));
            mesh.triangles.extend(prism.triangles.iter().map(|t| t.map(|i| i + base)));
        }
        pieces.push([start..mesh.triangles.len() as u32, segments]);
    }
    Prisms { mesh, tubes, pieces }
}

/// The mesh of tubes.
pub(super) fn mesh(node: String, role: Role, tubes: &Tubes) -> Mesh {
    let mut mesh = Mesh { node, role, opaque: true, positions: Vec::new(), triangles: Vec::new() };
    for tube in &tubes.tubes {
        let of = part(tubes, tube, tube.segments(), usual_sides(f64::from(tubes.of(tube)[0].radius())));
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(of.positions.iter().map(|p| tube.origin + p.as_dvec3()));
        mesh.triangles.extend(of.triangles.iter().map(|t| t.map(|i| i + base)));
    }
    mesh
}
