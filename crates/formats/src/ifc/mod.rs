//! IFC (2x3, 4 and 4.3, STEP files): elements become meshes, IfcSpace rooms, doors and windows openings.
//!
//! What goes where, in the order of an import:
//!
//! 1. `model`: the header, the records by kind, units, the offset of georeferenced models;
//! 2. `relations` and `styles`: who voids, fills, holds and bounds what; what is see-through;
//! 3. `geometry`: every product's triangles by ifc-lite, on several threads watched by `workers`; those of pipes by `tubes`;
//! 4. `spaces`, `openings` and `boundaries`: hints; and `cuts`: openings that ifc-lite left shut.
//!
//! What a file says of its elements beside their shape, [`elements`] reads when somebody asks; an import doesn't.
//!
//! An import ends: an element whose geometry takes longer than `ELEMENT_LIMIT` is left out and named in the notes (one
//! occluder fewer errs towards visible), and one that panics likewise; a file whose geometry as a whole takes longer than
//! `TIME_LIMIT` and a share for its size is an error. Both limits hold however deep a library is in its loops, because
//! the geometry runs on threads of its own that are left behind, not waited for; such a thread ends with its element or with
//! the process.

use enfilade::scene::{ImportError, ImportOptions, Scene};
use std::path::Path;

#[cfg(feature = "ifc")]
mod boundaries;
#[cfg(feature = "ifc")]
mod cuts;
mod elements;
#[cfg(feature = "ifc")]
mod endless;
#[cfg(feature = "ifc")]
mod geometry;
#[cfg(feature = "ifc")]
mod model;
#[cfg(feature = "ifc")]
mod openings;
#[cfg(feature = "ifc")]
mod plan;
#[cfg(feature = "ifc")]
mod reader;
#[cfg(feature = "ifc")]
mod relations;
#[cfg(feature = "ifc")]
mod roles;
#[cfg(feature = "ifc")]
mod spaces;
#[cfg(feature = "ifc")]
mod styles;
#[cfg(feature = "ifc")]
mod told;
#[cfg(feature = "ifc")]
mod tubes;
#[cfg(feature = "ifc")]
mod workers;
#[cfg(feature = "ifc")]
mod zipped;

pub use elements::{Element, ElementType, Elements, Property, PropertySet, Value, elements};
#[cfg(feature = "ifc")]
pub use reader::import_bytes;
#[cfg(feature = "ifc")]
pub use told::elements_of_bytes;

/// Reads an IFC file. Lengths become metres, +Z up becomes +Y up: `(x, y, z)` turns into `(x, z, -y)`.
///
/// Fails on files that can't be read, aren't IFC, are cut off, hold no element with geometry, or take too long; without the
/// cargo feature `ifc`, always.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    #[cfg(feature = "ifc")]
    {
        let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        reader::import_bytes(bytes_of(path)?, &name, options)
    }
    #[cfg(not(feature = "ifc"))]
    {
        let _ = (path, options);
        Err(ImportError::MissingFeature { format: "IFC", feature: "ifc" })
    }
}

/// The bytes of an `.ifc`, or of the one in an `.ifczip`.
#[cfg(feature = "ifc")]
fn bytes_of(path: &Path) -> Result<Vec<u8>, ImportError> {
    let bytes = enfilade::scene::whole_file::model(path)?;
    let is_zipped = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ifczip"));
    if is_zipped { zipped::unzipped(&bytes) } else { Ok(bytes) }
}

#[cfg(all(test, not(feature = "ifc")))]
mod tests {
    use super::*;

    #[test]
    fn a_binary_without_the_feature_says_which_one_reads_ifc() {
        let error = import(Path::new("x.ifc"), &ImportOptions::default()).unwrap_err();
        assert_eq!(error.to_string(), "this binary reads no IFC; build it with `--features ifc`");
    }
}
