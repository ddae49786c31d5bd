//! Tubes in a scene: pieces with bounding prisms, each an object; or meshes, if there are few.

use super::{Mesh, Role};
use enfilade_tubes::{Prism, Tube, Tubes, part, prism, usual_sides};
use glam::DVec3;
use std::ops::Range;

/// Least number of segments for tubes: fewer pipes become meshes.
pub const FEWEST_SEGMENTS: usize = 64;

/// Triangles per segment of a prism around a bend, where its lines replace some sections.
const TRIANGLES_OF_BEND: u32 = 4;

/// Prisms around tubes, by piece.
pub(super) struct Prisms {
    /// All of them, in the order of the pieces.
    pub mesh: Mesh,
    /// The tubes, with extra sections at cuts.
    pub tubes: Tubes,
    /// By piece: triangles of the mesh, and segments of the tubes.
    pub pieces: Vec<[Range<u32>; 2]>,
}

/// Cuts tubes into pieces of at most `most` triangles, at segments.
pub(super) fn prisms(node: String, role: Role, tubes: &Tubes, most: u32) -> Prisms {
    let tubes = tubes.divided();
    let mesh = Mesh { node, role, opaque: true, positions: Vec::new(), triangles: Vec::new() };
    let mut all = Prisms { mesh, tubes, pieces: Vec::new() };
    // The stack is taken from the end.
    let mut left = all.tubes.pieces((most / TRIANGLES_OF_BEND).max(1));
    left.reverse();
    while let Some(segments) = left.pop() {
        let made: Vec<(Prism, DVec3)> =
            all.tubes.parts(segments.clone()).map(|(tube, part)| (prism(&all.tubes, tube, part), tube.origin)).collect();
        let count: usize = made.iter().map(|(prism, _)| prism.triangles.len()).sum();
        let middle = segments.start + (segments.len() / 2) as u32;
        let halves = [segments.start..middle, middle..segments.end];
        let is_cut = count > most as usize && halves.iter().all(|half| all.tubes.parts(half.clone()).next().is_some());
        if is_cut {
            let [first, second] = halves;
            left.extend([second, first]);
            continue;
        }
        let start = all.mesh.triangles.len() as u32;
        for (prism, origin) in made {
            let base = all.mesh.positions.len() as u32;
            all.mesh.positions.extend(prism.positions.iter().map(|p| origin + p));
            all.mesh.triangles.extend(prism.triangles.iter().map(|t| t.map(|i| i + base)));
        }
        all.pieces.push([start..all.mesh.triangles.len() as u32, segments]);
    }
    all
}

/// Triangles of the mesh of tubes.
pub(super) fn triangles(tubes: &Tubes) -> usize {
    let count = tubes.tubes.iter().map(|tube| tube.triangles(sides(tubes, tube))).fold(0, u64::saturating_add);
    usize::try_from(count).unwrap_or(usize::MAX)
}

/// Sides of a tube's rings in that mesh.
fn sides(tubes: &Tubes, tube: &Tube) -> u32 {
    usual_sides(f64::from(tubes.of(tube)[0].radius()))
}

/// The mesh of tubes.
pub(super) fn mesh(node: String, role: Role, tubes: &Tubes) -> Mesh {
    let mut mesh = Mesh { node, role, opaque: true, positions: Vec::new(), triangles: Vec::new() };
    for tube in &tubes.tubes {
        let of = part(tubes, tube, tube.segments(), sides(tubes, tube));
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(of.positions.iter().map(|p| tube.origin + p.as_dvec3()));
        mesh.triangles.extend(of.triangles.iter().map(|t| t.map(|i| i + base)));
    }
    mesh
}
