//! The file of a level: checks the header, the lumps and the tree.

use super::fences;
use super::layout::*;
use super::portals::{self, Between};
use super::tree::Tree;
use enfilade::types::level::LevelPortal;
use qbsp::BspFormat;
use qbsp::reader::BspParseContext;

/// A level, whole, with its tree checked.
#[derive(Clone, Debug)]
pub struct Bsp {
    pub(crate) bytes: Vec<u8>,
    pub(crate) format: BspFormat,
    pub(crate) lumps: [Lump; LUMPS.len()],
    pub(crate) tree: Tree,
}

impl Bsp {
    /// Reads a file's bytes.
    ///
    /// # Errors
    ///
    /// Faults of the header, or of the lumps of the tree.
    pub fn read(bytes: Vec<u8>) -> Result<Self, BspError> {
        let format = format(&bytes)?;
        let lumps = directory(&bytes)?;
        let tree = Tree::read(&Source { bytes: &bytes, lumps: &lumps, context: BspParseContext { format } })?;
        Ok(Self { bytes, format, lumps, tree })
    }

    /// `bsp29` or `BSP2`.
    pub fn format(&self) -> &'static str {
        if self.format == BspFormat::BSP2 { "BSP2" } else { "bsp29" }
    }

    /// Number of the world's leaves with rows: those after leaf 0, without those of doors, lifts and so on.
    pub fn leaves(&self) -> usize {
        self.tree.vis_leaves
    }

    /// Error of points from the file's own rounding (planes in `f32`), in its units.
    pub fn rounding(&self) -> f64 {
        self.tree.rounding()
    }

    /// The portals between open leaves, derived from the tree, and the number of skipped slivers: portals narrower than
    /// [`Bsp::rounding`].
    ///
    /// # Errors
    ///
    /// [`BspError::Fences`] if the tree does not decide which faces are see-through.
    pub fn portals(&self) -> Result<(Vec<LevelPortal>, usize), BspError> {
        fences::refuse(&self.fences_on_walls()?)?;
        let found = self.between(false);
        Ok((found.portals, found.slivers))
    }

    /// Fences with solid matter behind, as indices of faces, ascending.
    pub(super) fn fences_on_walls(&self) -> Result<Vec<usize>, BspError> {
        fences::on_walls(&self.source(), &self.tree)
    }

    /// Portals and walls between leaves.
    pub(super) fn between(&self, with_walls: bool) -> Between {
        portals::derive(&self.tree, with_walls)
    }

    pub(crate) fn source(&self) -> Source<'_> {
        Source { bytes: &self.bytes, lumps: &self.lumps, context: BspParseContext { format: self.format } }
    }
}

fn format(bytes: &[u8]) -> Result<BspFormat, BspError> {
    let Some(magic) = bytes.first_chunk::<4>() else { return Err(BspError::Cut(bytes.len())) };
    let other = |name: &str| Err(BspError::Format(name.to_owned()));
    match magic {
        [29, 0, 0, 0] => Ok(BspFormat::BSP29),
        b"BSP2" => Ok(BspFormat::BSP2),
        [30, 0, 0, 0] => other("a Half-Life level (bsp30)"),
        b"2PSB" => other("a level in BSP2's first draft (2PSB)"),
        b"IBSP" | b"QBSP" => other("a Quake 2 or Quake 3 level"),
        b"VBSP" => other("a Source level"),
        _ => other("a file without the header of a level"),
    }
}

fn directory(bytes: &[u8]) -> Result<[Lump; LUMPS.len()], BspError> {
    let Some(header) = bytes.get(4..HEADER) else { return Err(BspError::Cut(bytes.len())) };
    if i32::try_from(bytes.len()).is_err() {
        return Err(BspError::TooLong);
    }
    let mut lumps = [Lump::default(); LUMPS.len()];
    for ((lump, entry), name) in lumps.iter_mut().zip(header.chunks_exact(8)).zip(LUMPS) {
        let word = |at: usize| entry[at..at + 4].iter().rev().fold(0usize, |n, &b| n << 8 | usize::from(b));
        *lump = Lump { offset: word(0), length: word(4) };
        // An empty lump may point anywhere.
        if lump.length == 0 {
            lump.offset = lump.offset.min(bytes.len());
        }
        if lump.end() > bytes.len() {
            let what = format!("ends at byte {}, the file at {}", lump.end(), bytes.len());
            return Err(BspError::Lump { lump: name, what });
        }
    }
    Ok(lumps)
}
