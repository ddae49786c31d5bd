//! Exports a model with the objects of a `.pvs` file, for engines: a `.glb` with one node per object, in the order of ids.
//!
//! Under `extras.enfilade` each node has `object`, its id, and `cells`, the ids of its cells, ascending. Positions are the
//! model's own: metres, +Y up. Materials depend on the source:
//!
//! | source | materials |
//! | --- | --- |
//! | glTF | all of the source, with all attributes of the vertices, pictures, animations, cameras and lights |
//! | OBJ | colours and pictures of its material library, texture coordinates |
//! | `.bsp` | one material per texture, with its name and without its picture; texture coordinates |
//! | `.map` | one material per texture, with its name |
//! | IFC, IndoorGML | two: opaque and glass |

mod plain;

use crate::gltf;
use enfilade::file::PvsFile;
use enfilade::scene::{ImportError, ImportOptions, Scene};
use enfilade_tubes::usual_sides;
use serde_json::json;
use std::path::Path;

/// An exported model.
#[derive(Clone, PartialEq, Debug)]
pub struct Exported {
    /// The bytes of the `.glb`.
    pub glb: Vec<u8>,
    /// Number of meshes. Objects of equal shape may share one.
    pub meshes: usize,
    /// Missing data, one line each.
    pub notes: Vec<String>,
}

/// Why a model cannot be exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The model cannot be read.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// The file is damaged: it has other objects than the model that it names.
    #[error("{found} objects in the model, {expected} in the file: the file is damaged")]
    OtherObjects {
        /// Of the model.
        found: usize,
        /// Of the file.
        expected: usize,
    },
    /// The file was baked for another model.
    #[error("not the file's model (hash {found:032x}, expected {expected:032x}); give the file's model, or bake this one")]
    OtherModel {
        /// [`Scene::hash`] of the model.
        found: u128,
        /// Of the file.
        expected: u128,
    },
}

/// Cuts a model into the objects of a file baked for it.
///
/// # Errors
///
/// If the model cannot be read, is a different one, or results in more than 4 GiB (for glTF, in more than 256 times its source).
pub fn export(model: &Path, options: &ImportOptions, file: &PvsFile) -> Result<Exported, ExportError> {
    let check = |scene: &Scene| match (scene.hash(), scene.objects.len()) {
        (found, _) if found != file.model_hash => Err(ExportError::OtherModel { found, expected: file.model_hash }),
        (_, found) if found != file.placement.columns() => {
            Err(ExportError::OtherObjects { found, expected: file.placement.columns() })
        }
        _ => Ok(()),
    };
    let cells = cells_of_objects(file);
    let extras = |object: usize| json!({ "object": object, "cells": cells[object] });
    let extension = model.extension().and_then(|e| e.to_str()).unwrap_or_default();
    if extension.eq_ignore_ascii_case("glb") || extension.eq_ignore_ascii_case("gltf") {
        let cut = gltf::cut_file(model, options, check, &extras)?;
        return Ok(Exported { glb: cut.glb, meshes: cut.meshes, notes: cut.notes });
    }
    let scene = crate::import(model, &ImportOptions { trace: true, ..options.clone() })?;
    check(&scene)?;
    Ok(plain::cut(&scene.meshed(usual_sides), model.parent(), options, &extras)?)
}

/// The cells of each object.
fn cells_of_objects(file: &PvsFile) -> Vec<Vec<usize>> {
    let mut cells = vec![Vec::new(); file.placement.columns()];
    for cell in 0..file.placement.rows() {
        file.placement.ones(cell).for_each(|object| cells[object].push(cell));
    }
    cells
}
