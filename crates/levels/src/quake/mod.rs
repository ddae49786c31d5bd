//! Levels as scenes: the faces of a compiled level ([`crate::bsp`]) with its leaves and portals, and maps (`.map`), the sources of
//! levels, with a tree over their brushes.
//!
//! Air and liquids are see-through (with or without translucent water in the game, nothing is missing). Solids are not, nor is
//! sky, behind which games draw nothing.

mod archives;
mod faces;
mod game_files;
mod map;
mod scripts;
mod texels;
mod textures;
mod uses;
mod wal;
mod world;

use crate::bsp::fences;
use crate::bsp::{Bsp, BspError};
use enfilade::scene::whole_file;
use enfilade::scene::{ImportError, ImportOptions, Scene};
use std::path::Path;

/// Reads a level: the faces of the world and of brush models, and the leaves as cells. A unit is 1/32 m unless the options
/// differ; +Z up becomes +Y up: `(x, y, z)` becomes `(x, z, -y)`.
///
/// Fails on files that cannot be read, are not such levels, or are damaged.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let bsp = Bsp::read(whole_file::model(path)?).map_err(malformed)?;
    let walls = bsp.fences_on_walls().map_err(malformed)?;
    if !walls.is_empty() && !are_compiled(path, &bsp) {
        return Err(malformed(BspError::Fences(walls.len())));
    }
    world::scene(&bsp, &name, Some(path), options, &walls)
}

/// Reads a map of an editor: its brushes, and the leaves of a tree over them as cells. Units and axes as in [`import`].
///
/// Fails on files that cannot be read, are not maps, are damaged, or leak.
pub fn import_map(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    map::scene(&whole_file::model(path)?, &name, Some(path), options)
}

/// As [`import_map`], for a map in memory.
pub fn import_map_bytes(bytes: &[u8], name: &str, options: &ImportOptions) -> Result<Scene, ImportError> {
    map::scene(bytes, name, None, options)
}

/// As [`import`], for a level in memory.
pub fn import_bytes(bytes: Vec<u8>, name: &str, options: &ImportOptions) -> Result<Scene, ImportError> {
    let bsp = Bsp::read(bytes).map_err(malformed)?;
    bsp.fences_on_walls().and_then(|walls| fences::refuse(&walls)).map_err(malformed)?;
    world::scene(&bsp, name, None, options, &[])
}

fn malformed(error: BspError) -> ImportError {
    ImportError::malformed(enfilade::scene::Place::File, error.to_string())
}

/// Whether a compiler's portals are beside a level, so that its solid brushes hide the space behind them with any texture.
fn are_compiled(path: &Path, bsp: &Bsp) -> bool {
    let portals = whole_file::read(&path.with_extension("prt")).ok().and_then(|bytes| crate::prt::read_prt(&bytes).ok());
    portals.is_some_and(|prt| bsp.fit(&prt).is_taken())
}
