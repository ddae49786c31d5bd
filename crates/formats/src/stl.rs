//! STL, binary and text: one mesh with equal corners merged. The format has neither a unit (metres are assumed) nor an up axis
//! (+Y, unless [`ImportOptions::z_up`] is set), nor materials.

use enfilade::scene::{ImportError, ImportOptions, Mesh, Place, Role, Scene, SceneBuilder, Source, whole_file};
use glam::DVec3;
use std::io::Cursor;
use std::path::Path;

/// Reads an `.stl` file; see [`self`].
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let bytes = whole_file::model(path)?;
    from_slice(&bytes, &path.file_stem().unwrap_or_default().to_string_lossy(), options)
}

/// Reads a model in memory.
pub fn from_slice(bytes: &[u8], name: &str, options: &ImportOptions) -> Result<Scene, ImportError> {
    let metres_per_unit = options.metres_per_unit.unwrap_or(1.0);
    let source = Source { format: "STL".into(), metres_per_unit, up: options.up(), notes: Vec::new() };
    let mut builder = SceneBuilder::new(options, source);
    // Binary STL may begin with any bytes.
    let is_text = bytes.starts_with(b"solid");
    let broken = |e: std::io::Error| {
        let why = if is_text { e.to_string() } else { format!("{}, and {e}", whole_file::nature(bytes)) };
        ImportError::malformed(Place::File, format!("not an STL file: {why}"))
    };
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(broken)?;
    let place = |p: &stl_io::Vertex| options.upright(DVec3::from(p.0.map(f64::from))) * metres_per_unit;
    let positions = mesh.vertices.iter().map(place).collect();
    let triangles = mesh.faces.iter().map(|face| face.vertices.map(|i| i as u32)).collect();
    builder.add(Mesh { node: name.to_owned(), role: Role::Unknown, opaque: true, positions, triangles })?;
    builder.finish(name)
}
