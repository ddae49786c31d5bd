//! Props of Source: models of other files, of which a level has only the places.

use super::file::LevelFile;
use super::layout::Lump;
use super::lzma;
use super::record::{Records, i32, u16, u32};

/// The game lump with static props: `sprp`.
const STATIC_PROPS: i64 = 0x7370_7270;
/// Bytes of an entry in the directory of game lumps: what it is, flags, a version, an offset and a length.
const ENTRY: usize = 16;
/// Bytes of a model's name.
const NAME: usize = 128;

/// Number of static props; `None` if there is no such list, or none that can be read.
pub(crate) fn static_props(file: &LevelFile) -> Option<usize> {
    let lump = file.lump(Lump::GameLumps).ok()?;
    let word = |bytes: &[u8], at: usize| {
        let bytes = bytes.get(at..at.checked_add(4)?)?;
        usize::try_from(Records::new(bytes, 4, file.big_endian).int(0, i32(0))).ok()
    };
    let directory = lump.get(4..)?;
    let entries = Records::new(directory, ENTRY, file.big_endian);
    let own = (0..entries.len().min(word(&lump, 0)?)).find(|&i| entries.int(i, u32(0)) == STATIC_PROPS)?;
    // Offsets count from the file's start; on consoles, from the lump's.
    let base = if file.big_endian { file.entry_of(Lump::GameLumps).offset } else { 0 };
    let list = file.bytes.get(base.checked_add(entries.index(own, i32(8)))?..)?;
    let is_packed = entries.int(own, u16(4)) & 1 == 1 && lzma::is_packed(list);
    let unpacked = if is_packed { Some(lzma::unpack(list, file.bytes.len()).ok()?) } else { None };
    let list = unpacked.as_deref().unwrap_or(list);

    // Names of models, then leaves that props are in, then the props.
    let names = word(list, 0)?.checked_mul(NAME)?.checked_add(4)?;
    let leaves = word(list, names)?.checked_mul(2)?.checked_add(4)?;
    word(list, names.checked_add(leaves)?)
}
