//! Ambient sounds: the volume of water, sky, slime and lava in each leaf of a Quake level.
//!
//! A leaf that sees a face with such a texture has full volume; otherwise 0. The five levels of Quake in the tests have no other
//! values. Slime sounds like water, and the third value stays 0. Texture names decide by their prefix.

use super::faces::{Faces, marked_faces};
use super::layout::Lump;
use super::{Bsp, BspError};
use enfilade::BitMatrix;

/// Values of a leaf: water, sky, slime, lava.
pub const SOUNDS: usize = 4;
/// The greatest volume.
const FULL: u8 = 255;
/// Prefixes of names and the index of their value.
const NAMES: [(&str, usize); 5] = [("sky", 1), ("*water", 0), ("*04water", 0), ("*slime", 0), ("*lava", 3)];

/// The ambient levels in the leaves with rows.
pub(super) fn own(bsp: &Bsp) -> Result<Vec<[u8; SOUNDS]>, BspError> {
    let size = bsp.file.of_version(Lump::Leaves, bsp.file.layout.leaves)?.size;
    let lump = bsp.file.lump(Lump::Leaves)?;
    Ok(lump.chunks_exact(size).skip(1).take(bsp.cells()).filter_map(|leaf| leaf.last_chunk().copied()).collect())
}

/// The values of each leaf of the world, from rows of clusters and the cluster of each leaf; `None` in games without them.
pub(super) fn levels(bsp: &Bsp, rows: &BitMatrix, clusters: &[u32]) -> Result<Option<Vec<[u8; SOUNDS]>>, BspError> {
    if !bsp.file.layout.ambient {
        return Ok(None);
    }
    let sound_of = |name: &str| NAMES.iter().find(|(begin, _)| name.starts_with(begin)).map(|&(_, sound)| sound);
    let faces = Faces::read(&bsp.file)?;
    // 1. Sounds in each cluster.
    let mut sounds = vec![[0; SOUNDS]; rows.rows()];
    marked_faces(&bsp.file, faces.faces.len(), |leaf, face| {
        let cluster = leaf.checked_sub(1).and_then(|cell| clusters.get(cell));
        let sound = sound_of(&faces.infos.names[faces.faces[face].texture]);
        if let (Some(&cluster), Some(sound)) = (cluster, sound) {
            sounds[cluster as usize][sound] = FULL;
        }
    })?;
    // 2. Sounds heard from each cluster.
    let hear = |cluster: usize| {
        let seen = rows.ones(cluster).map(|other| sounds[other]);
        seen.fold([0; SOUNDS], |all, one| std::array::from_fn(|sound| u8::max(all[sound], one[sound])))
    };
    let of_cluster: Vec<[u8; SOUNDS]> = (0..rows.rows()).map(hear).collect();
    Ok(Some(clusters.iter().map(|&cluster| of_cluster[cluster as usize]).collect()))
}
