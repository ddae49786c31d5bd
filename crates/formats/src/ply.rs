//! PLY, binary and text: all faces as one mesh. The format has neither a unit (metres are assumed) nor an up axis (+Y, unless
//! [`ImportOptions::z_up`] is set). Colours and normals are ignored; points without faces are no model.

use super::obj::polygon;
use enfilade::scene::{ImportError, ImportOptions, Mesh, Place, Role, Scene, SceneBuilder, Source, whole_file};
use enfilade::types::note::Note;
use glam::DVec3;
use ply_rs_bw::parser::{ParseError, Parser};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};
use std::path::Path;

/// Reads a `.ply` file; see [`self`].
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let bytes = whole_file::model(path)?;
    from_slice(&bytes, &path.file_stem().unwrap_or_default().to_string_lossy(), options)
}

/// The needed properties of a vertex or a face.
#[derive(Default)]
struct Element {
    position: [f64; 3],
    /// `None` if an index is not a whole number from 0 on.
    corners: Option<Vec<u32>>,
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let number = match property {
            Property::Float(x) => Some(f64::from(x)),
            Property::Double(x) => Some(x),
            Property::Int(x) => Some(f64::from(x)),
            Property::Short(x) => Some(f64::from(x)),
            _ => None,
        };
        match (name, number) {
            ("x" | "y" | "z", Some(x)) => self.position[usize::from(name.as_bytes()[0] - b'x')] = x,
            ("vertex_indices" | "vertex_index", _) => self.corners = property.to_u32_list(),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

/// Reads a model in memory.
pub fn from_slice(mut bytes: &[u8], name: &str, options: &ImportOptions) -> Result<Scene, ImportError> {
    let metres_per_unit = options.metres_per_unit.unwrap_or(1.0);
    let source = Source { format: "PLY".into(), metres_per_unit, up: options.up(), notes: Vec::new() };
    let mut builder = SceneBuilder::new(options, source);
    let broken = |what: String| ImportError::malformed(Place::File, what);
    if !bytes.starts_with(b"ply") {
        return Err(broken(format!("not a PLY file: {}", whole_file::nature(bytes))));
    }
    // The crate's messages have further lines that quote the file.
    let malformed = |e: ParseError| broken(format!("not a PLY file: {}", e.to_string().lines().next().unwrap_or_default()));
    let ply = Parser::<Element>::new().read_ply(&mut bytes).map_err(malformed)?;
    let elements = |name: &str| ply.payload.get(name).map(Vec::as_slice).unwrap_or_default();
    let place = |vertex: &Element| options.upright(DVec3::from(vertex.position)) * metres_per_unit;
    let positions: Vec<DVec3> = elements("vertex").iter().map(place).collect();
    let (mut triangles, mut cut) = (Vec::new(), Vec::new());
    for (i, face) in elements("face").iter().enumerate() {
        let corners = face.corners.as_deref().ok_or_else(|| broken(format!("face {i} has no list of vertices")))?;
        if let Some(bad) = corners.iter().find(|&&c| c as usize >= positions.len()) {
            return Err(broken(format!("face {i}: vertex {bad} of {} does not exist", positions.len())));
        }
        if corners.len() >= 3 {
            polygon::triangulate(&positions, corners, &mut cut);
            triangles.extend(cut.drain(..).map(|t| t.map(|k| corners[k])));
        }
    }
    for (kind, list) in ply.payload.iter().filter(|(kind, _)| !["vertex", "face"].contains(&kind.as_str())) {
        builder.source.notes.push(Note::detail(format!("{} elements of the kind {kind} left out", list.len())));
    }
    builder.add(Mesh { node: name.to_owned(), role: Role::Unknown, opaque: true, positions, triangles })?;
    builder.finish(name)
}
