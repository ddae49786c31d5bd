//! IFC (2x3, 4 and 4.3, STEP files): elements become meshes, spaces become rooms, doors and windows become openings.
//!
//! Modules in the order of an import:
//!
//! 1. `model`: the header, the records by kind, units, the offset of georeferenced models;
//! 2. `relations` and `styles`: relations of elements, openings and spaces; transparency;
//! 3. `geometry`: every product's triangles by ifc-lite, on several threads watched by `workers`; those of pipes by `tubes`;
//! 4. `spaces`, `openings` and `boundaries`: hints; `cuts`: openings that ifc-lite left closed.
//!
//! [`elements()`] reads names and properties of elements on demand; an import does not.
//!
//! An import always ends. An element whose geometry takes longer than `ELEMENT_LIMIT`, or panics, is left out and named in the
//! notes (a missing occluder errs towards visible). It is an error if the geometry of the whole file takes longer than
//! `TIME_LIMIT` plus a share for its size. Both limits hold even inside a library: the geometry runs on threads that are
//! abandoned and not waited for; such a thread ends with its element or with the process.

use crate::elements::Elements;
use enfilade::scene::{ImportError, ImportOptions, Scene};
use std::path::Path;

mod boundaries;
mod cuts;
mod endless;
mod geometry;
mod model;
mod openings;
mod properties;
mod reader;
mod rectangle;
mod relations;
mod roles;
mod spaces;
mod styles;
mod tubes;
mod workers;
mod zipped;

pub use properties::elements_of_bytes;
pub use reader::import_bytes;

/// Reads an IFC file. Lengths become metres, +Z up becomes +Y up: `(x, y, z)` becomes `(x, z, -y)`.
///
/// Fails on files that cannot be read, are not IFC, are truncated, hold no element with geometry, or take too long.
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

/// Reads names, types and properties of elements and spaces, without geometry. It takes about as long as reading records.
///
/// Fails on files that cannot be read, are not IFC, are truncated, or take too long. Dangling references are skipped and counted
/// in [`Elements::notes`].
pub fn elements(path: &Path) -> Result<Elements, ImportError> {
    elements_of_bytes(bytes_of(path)?)
}
