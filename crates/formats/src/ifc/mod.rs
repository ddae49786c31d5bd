//! IFC (2x3, 4 and 4.3, STEP files): elements become meshes, IfcSpace rooms, doors and windows openings.
//!
//! What goes where, in the order of an import:
//!
//! 1. `model`: the header, the records by kind, units, the offset of georeferenced models;
//! 2. `relations` and `styles`: who voids, fills, holds and bounds what; what is see-through;
//! 3. `geometry`: every product's triangles by ifc-lite, on several threads watched by `workers`; those of pipes by `tubes`;
//! 4. `spaces`, `openings` and `boundaries`: hints; and `cuts`: openings that ifc-lite left shut.
//!
//! What a file says of its elements beside their shape, [`elements()`] reads when somebody asks; an import doesn't.
//!
//! An import ends: an element whose geometry takes longer than `ELEMENT_LIMIT` is left out and named in the notes (one
//! occluder fewer errs towards visible), and one that panics likewise; a file whose geometry as a whole takes longer than
//! `TIME_LIMIT` and a share for its size is an error. Both limits hold however deep a library is in its loops, because
//! the geometry runs on threads of its own that are left behind, not waited for; such a thread ends with its element or with
//! the process.

use crate::elements::Elements;
use enfilade::scene::{ImportError, ImportOptions, Scene};
use std::path::Path;

mod boundaries;
mod cuts;
mod endless;
mod geometry;
mod model;
mod openings;
mod plan;
mod reader;
mod relations;
mod roles;
mod spaces;
mod styles;
mod told;
mod tubes;
mod workers;
mod zipped;

pub use reader::import_bytes;
pub use told::elements_of_bytes;

/// Reads an IFC file. Lengths become metres, +Z up becomes +Y up: `(x, y, z)` turns into `(x, z, -y)`.
///
/// Fails on files that can't be read, aren't IFC, are cut off, hold no element with geometry, or take too long.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    reader::import_bytes(bytes_of(path)?, &name, options)
}

/// The bytes of an `.ifc`, or of the one in an `.ifczip`.
fn bytes_of(path: &Path) -> Result<Vec<u8>, ImportError> {
    let bytes = enfilade::scene::whole_file::model(path)?;
    let is_zipped = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ifczip"));
    if is_zipped { zipped::unzipped(&bytes) } else { Ok(bytes) }
}

/// Reads what a file says of its elements and spaces. It takes about as long as reading the file's records, and no geometry is made.
///
/// Fails on files that can't be read, aren't IFC, are cut off, or take too long. References that lead nowhere are passed over and counted in
/// [`Elements::notes`].
pub fn elements(path: &Path) -> Result<Elements, ImportError> {
    elements_of_bytes(bytes_of(path)?)
}
