//! Counts of tubes, and their savings.

use super::Scene;
use serde::Serialize;
use std::fmt;

/// Sides of the reference mesh, as in the studies of tubes.
const SIDES: u32 = 18;
/// Bytes per triangle of the reference mesh: three corners with position and shading data, as in the viewer.
const TRIANGLE: u64 = 48;

/// Tubes of a scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct TubeCount {
    /// Tubes.
    pub tubes: usize,
    /// Their sections.
    pub sections: usize,
    /// Objects that are parts of tubes.
    pub objects: usize,
    /// Bytes of the sections.
    pub section_bytes: u64,
    /// Triangles of a mesh with 18 sides.
    pub triangles_of_18_sides: u64,
    /// Bytes of this mesh, 48 per triangle.
    pub triangle_bytes: u64,
}

impl Scene {
    /// The counts; `None` without tubes.
    pub fn tube_count(&self) -> Option<TubeCount> {
        let all = &self.tubes;
        let triangles: u64 = all.tubes.iter().map(|tube| tube.triangles(SIDES)).sum();
        (!all.tubes.is_empty()).then(|| TubeCount {
            tubes: all.tubes.len(),
            sections: all.sections.len(),
            objects: self.objects.iter().filter(|object| object.is_tube()).count(),
            section_bytes: size_of_val(all.sections.as_slice()) as u64,
            triangles_of_18_sides: triangles,
            triangle_bytes: TRIANGLE * triangles,
        })
    }
}

/// One line.
impl fmt::Display for TubeCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tubes, sections, objects, section_bytes, triangles_of_18_sides, triangle_bytes } = self;
        write!(
            f,
            "{tubes} tubes of {sections} sections in {objects} objects: {section_bytes} bytes; with {SIDES} sides {triangles_of_18_sides} \
             triangles of {triangle_bytes} bytes"
        )
    }
}
