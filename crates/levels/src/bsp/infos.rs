//! Texture infos: what a face's texture is called, what its flags say, and how it lies on the face.

use super::error::{BspError, entry};
use super::file::LevelFile;
use super::layout::{Chain, Lump, Mesh, Texture};
use super::record::{Records, i32};
use glam::DVec3;

/// How a texture lies on faces: a texel is at `axes[k] . p + offsets[k]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    pub axes: [DVec3; 2],
    pub offsets: [f64; 2],
    /// Width and height of the texture, texels.
    pub size: [f64; 2],
}

/// By texture info.
#[derive(Default)]
pub(crate) struct Infos {
    /// Its texture's name in lower case; of sky, with `sky` before it.
    pub names: Vec<String>,
    /// The surface's flags, in games that have them; see [`super::layout::Flags`].
    pub flags: Vec<i64>,
    /// Red, green and blue, linear, in games that have them.
    pub colours: Vec<Option<[f32; 3]>>,
    /// None in games whose vertices have coordinates.
    pub projections: Vec<Projection>,
}

/// Bytes of a name in a texture info.
const LONG_NAME: usize = 32;
/// Most bytes of a name in a lump of names. More: one long name for many textures fills the memory.
const LONGEST_NAME: usize = 128;
/// Width and height of a missing texture, texels.
const USUAL_SIZE: u32 = 64;

/// What is known of a texture.
struct Named {
    name: String,
    flags: i64,
    size: Option<[u32; 2]>,
    colour: Option<[f32; 3]>,
}

impl Infos {
    /// Of faces that are chains of edges.
    pub fn of_chains(file: &LevelFile, record: &Chain) -> Result<Self, BspError> {
        let infos = file.lump(Lump::TextureInfos)?;
        let infos = file.records(Lump::TextureInfos, &infos, record.info)?;
        let [textures, data, offsets, names] =
            [Lump::Textures, Lump::TextureData, Lump::NameOffsets, Lump::Names].map(|lump| file.lump(lump));
        let (textures, data, offsets, names) = (textures?, data?, offsets?, names?);
        let offsets = file.records(Lump::NameOffsets, &offsets, 4)?;
        let mut all = Self::default();
        for i in 0..infos.len() {
            let missing = |texture: usize| {
                let shown = texture as isize;
                entry(Lump::TextureInfos, i, format!("its texture {shown} doesn't exist"))
            };
            let named = match record.texture {
                Texture::Named { name, flags } => {
                    let name = text(&infos.record(i)[name..name + LONG_NAME]);
                    Named { name, flags: infos.int(i, flags), size: None, colour: None }
                }
                Texture::Number(field) => numbered(&textures, infos.index(i, field)).map_err(missing)?,
                Texture::Data { data: field, flags, size, name } => {
                    let texture = infos.index(i, field);
                    let data = file.records(Lump::TextureData, &data, size)?;
                    if texture >= data.len() {
                        return Err(missing(texture));
                    }
                    let name = name_at(&names, &offsets, data.index(texture, name));
                    let name = name.unwrap_or_else(|| format!("texture {texture}"));
                    let colour = Some([0, 4, 8].map(|at| data.float(texture, at) as f32));
                    Named { name, flags: infos.int(i, flags), size: None, colour }
                }
            };
            all.projections.push(Projection {
                axes: [infos.point(i, 0), infos.point(i, 16)],
                offsets: [infos.float(i, 12), infos.float(i, 28)],
                size: named.size.unwrap_or([USUAL_SIZE; 2]).map(f64::from),
            });
            all.push(file, named);
        }
        Ok(all)
    }

    /// Of faces that are meshes.
    pub fn of_meshes(file: &LevelFile, record: &Mesh) -> Result<Self, BspError> {
        let infos = file.lump(Lump::Textures)?;
        let infos = file.records(Lump::Textures, &infos, record.info)?;
        let mut all = Self::default();
        for i in 0..infos.len() {
            let flags = infos.int(i, record.flags) & 0xffff_ffff | infos.int(i, record.contents) << 32;
            all.push(file, Named { name: text(&infos.record(i)[..record.name]), flags, size: None, colour: None });
        }
        Ok(all)
    }

    fn push(&mut self, file: &LevelFile, named: Named) {
        let is_sky = named.flags & file.layout.flags.sky != 0;
        self.names.push(if is_sky { format!("sky {}", named.name) } else { named.name });
        self.flags.push(named.flags);
        let is_colour = |c: &[f32; 3]| c.iter().all(|part| (0.0..=1.0).contains(part));
        self.colours.push(named.colour.filter(is_colour));
    }
}

/// A texture of [`Lump::Textures`]; an error is its number.
fn numbered(lump: &[u8], texture: usize) -> Result<Named, usize> {
    let count = lump.first_chunk().map_or(0, |&b| u32::from_le_bytes(b)) as usize;
    if texture >= count {
        return Err(texture);
    }
    // A file without textures has no names, either.
    let name = texture_name(lump, texture).unwrap_or_else(|| format!("texture {texture}"));
    Ok(Named { name, flags: 0, size: texture_size(lump, texture), colour: None })
}

/// A name of [`Lump::Names`] by its number.
fn name_at(names: &[u8], offsets: &Records<'_>, number: usize) -> Option<String> {
    let at = (number < offsets.len()).then(|| offsets.index(number, i32(0)))?;
    let rest = names.get(at..)?;
    Some(text(&rest[..rest.len().min(LONGEST_NAME)]))
}

/// Bytes of a texture's name, at the start of its entry.
pub(crate) const NAME: usize = 16;

/// A texture's name in lower case; `None` if it is missing. `lump`: [`Lump::Textures`].
pub(crate) fn texture_name(lump: &[u8], texture: usize) -> Option<String> {
    let entry = texture_entry(lump, texture)?;
    Some(text(&entry[..entry.len().min(NAME)]))
}

/// Letters up to a zero byte, in lower case.
fn text(bytes: &[u8]) -> String {
    bytes.iter().take_while(|&&b| b != 0).map(|&b| char::from(b.to_ascii_lowercase())).collect()
}

/// A texture's width and height, texels; `None` if it is missing or has no texels.
fn texture_size(lump: &[u8], texture: usize) -> Option<[u32; 2]> {
    let entry = texture_entry(lump, texture)?;
    let size = [word(entry, NAME)?, word(entry, NAME + 4)?];
    (!size.contains(&0)).then_some(size)
}

/// The lump of textures from the start of one of them.
pub(crate) fn texture_entry(lump: &[u8], texture: usize) -> Option<&[u8]> {
    let count = word(lump, 0)? as usize;
    let offset = word(lump, texture.checked_mul(4)?.checked_add(4)?).filter(|_| texture < count)?;
    lump.get(offset as usize..)
}

/// The number in four bytes.
pub(crate) fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at.checked_add(4)?).map(|b| b.iter().rev().fold(0u32, |n, &b| n << 8 | u32::from(b)))
}
