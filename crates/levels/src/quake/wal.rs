//! Textures of Quake 2 (`.wal`), and the palette of their texels (`pics/colormap.pcx`). As in [`super::texels`], what makes no sense is
//! skipped.

use super::texels::Palette;
use crate::bsp::infos::word;

/// Bytes of a texture's header: a name, a width and a height, places of four sizes, another name, three numbers.
const HEAD: usize = 100;
/// Where the width is, and the place of the texels.
const WIDTH: usize = 32;
const TEXELS: usize = 40;
/// Bytes of the palette at the end of a picture, after a mark.
const PALETTE: usize = 768;
const MARK: u8 = 12;

/// Width, height and texels of a texture.
pub(super) fn texture(bytes: &[u8]) -> Option<([u32; 2], &[u8])> {
    let size = [word(bytes, WIDTH)?, word(bytes, WIDTH + 4)?];
    let count = size[0].checked_mul(size[1]).filter(|count| *count > 0)? as usize;
    let first = word(bytes, TEXELS)? as usize;
    let texels = bytes.get(first..first.checked_add(count)?)?;
    (first >= HEAD).then_some((size, texels))
}

/// The palette of a picture (PCX, 256 colours).
pub(super) fn palette(picture: &[u8]) -> Option<Palette> {
    let (before, colours) = picture.split_last_chunk::<PALETTE>()?;
    let is_one = picture.first() == Some(&10) && before.last() == Some(&MARK);
    colours.as_chunks::<3>().0.try_into().ok().filter(|_| is_one)
}
