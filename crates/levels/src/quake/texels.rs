//! Texels of textures, as PNG: those in a level, those of WADs beside it (WAD2 of Quake, WAD3 of Half-Life), and those of Quake 2
//! (`textures/NAME.wal`).
//!
//! A WAD is a directory of lumps. A texture is a lump with a name, a width and a height, and its texels in four sizes, as indices
//! into a palette of 256 colours: Quake's own, or, in WAD3, one behind the texels. In textures whose names begin with `{`, the
//! last colour is a hole. Invalid data is skipped: appearance never makes an import fail.

use super::game_files::GameFiles;
use super::wal;
use crate::bsp::infos::{texture_entry, texture_name, word};
use enfilade::scene::sidecar::Sidecars;
use enfilade::scene::{ImportOptions, Picture};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Limit of texels of all textures. A file may use the same bytes for any number of textures.
const MOST_TEXELS: u64 = 1 << 26;
/// Maximum WADs of a level.
const MOST_WADS: usize = 32;
/// Bytes of an entry in a WAD's directory; of a name, there and in a texture; of a texture's header.
const DIRECTORY_ENTRY: usize = 32;
const NAME: usize = 16;
const HEAD: usize = 40;
/// Lump kinds of textures: Quake's and Half-Life's.
const KINDS: [u8; 2] = [0x44, 0x43];
/// Colours of a palette.
const COLOURS: usize = 256;
/// Quake's own palette, red, green and blue of each colour: its file `gfx/palette.lmp` (J. Carmack, 1996; public domain since 1999).
const QUAKE_PALETTE: &[u8] = include_bytes!("palette.lmp");

/// A texture that was found.
pub(super) struct Texture {
    /// Width and height, texels.
    pub size: [u32; 2],
    pub picture: Picture,
}

/// Textures by their names, in lower case.
#[derive(Default)]
pub(super) struct Textures {
    all: BTreeMap<String, Texture>,
    texels: u64,
}

impl Textures {
    /// Textures of a level's lump, then of WADs beside it; `named`: names of WADs, separated by semicolons.
    pub fn read(own: &[u8], path: Option<&Path>, named: &str, options: &ImportOptions) -> Self {
        let mut textures = Self::default();
        for texture in 0..(word(own, 0).unwrap_or(0) as usize).min(own.len() / 4) {
            if let (Some(name), Some(bytes)) = (texture_name(own, texture), texture_entry(own, texture)) {
                textures.add(name, bytes, false);
            }
        }
        let beside = Sidecars { folder: path.and_then(Path::parent), under: options.files_under.as_deref() };
        for name in named.split(';').map(str::trim).filter(|name| !name.is_empty()).take(MOST_WADS) {
            // Levels contain their author's folders; the file may be right beside the level.
            let last = name.rsplit(['/', '\\']).next().unwrap_or(name);
            if let Ok(wad) = beside.read(name).or_else(|_| beside.read(last)) {
                textures.add_wad(&wad);
            }
        }
        textures
    }

    /// Textures of Quake 2 by their names, which begin with `sky ` for those of skies; `None` if there are some, but not their palette.
    pub fn read_wals(names: &[String], files: &mut GameFiles<'_>) -> Option<Self> {
        let mut textures = Self::default();
        let mut palette = None;
        for name in names {
            let file = format!("textures/{}.wal", name.strip_prefix("sky ").unwrap_or(name));
            let Some(bytes) = files.read(&file).filter(|_| !textures.all.contains_key(name)) else { continue };
            let Some((size, texels)) = wal::texture(&bytes) else { continue };
            if palette.is_none() {
                palette = Some(files.read("pics/colormap.pcx").and_then(|picture| wal::palette(&picture))?);
            }
            palette.into_iter().for_each(|palette| textures.put(name.clone(), size, texels, palette));
        }
        Some(textures)
    }

    /// A texture by its name.
    pub fn get(&self, name: &str) -> Option<&Texture> {
        self.all.get(name)
    }

    fn add_wad(&mut self, wad: &[u8]) {
        let has_palettes = wad.starts_with(b"WAD3");
        let (true, Some(count), Some(at)) = (has_palettes || wad.starts_with(b"WAD2"), word(wad, 4), word(wad, 8)) else {
            return;
        };
        let directory = wad.get(at as usize..).unwrap_or_default().chunks_exact(DIRECTORY_ENTRY).take(count as usize);
        for entry in directory.filter(|entry| KINDS.contains(&entry[12])) {
            let name: Vec<u8> = entry[16..].iter().copied().take_while(|b| *b != 0).collect();
            let name = String::from_utf8_lossy(&name).to_lowercase();
            if let Some(bytes) = word(entry, 0).and_then(|at| wad.get(at as usize..)) {
                self.add(name, bytes, has_palettes);
            }
        }
    }

    /// Adds a texture from its bytes, unless the name exists.
    fn add(&mut self, name: String, bytes: &[u8], has_palette: bool) {
        if self.all.contains_key(&name) {
            return;
        }
        if let Some((size, texels, palette)) = texture(bytes, has_palette) {
            self.put(name, size, texels, palette);
        }
    }

    /// Adds a texture, unless all of them would have too many texels.
    fn put(&mut self, name: String, size: [u32; 2], texels: &[u8], palette: Palette) {
        let Some(sum) = self.texels.checked_add(texels.len() as u64).filter(|sum| *sum <= MOST_TEXELS) else { return };
        if let Some(png) = png(size, texels, palette, name.starts_with('{')) {
            self.texels = sum;
            self.all.insert(name, Texture { size, picture: Picture::Within(Arc::from(png)) });
        }
    }
}

/// Red, green and blue of each colour.
pub(super) type Palette = [[u8; 3]; COLOURS];

/// Width and height, texels and palette of a texture.
fn texture(bytes: &[u8], has_palette: bool) -> Option<([u32; 2], &[u8], Palette)> {
    let size = [word(bytes, NAME)?, word(bytes, NAME + 4)?];
    let count = size[0].checked_mul(size[1]).filter(|count| *count > 0)? as usize;
    let [first, _, _, smallest] = [0, 1, 2, 3].map(|mip| word(bytes, NAME + 8 + 4 * mip).unwrap_or(0) as usize);
    if first < HEAD {
        return None;
    }
    let texels = bytes.get(first..first.checked_add(count)?)?;
    let own = || {
        // Behind the smallest size, an eighth of both sides, and the number of colours.
        let at = smallest.checked_add((size[0] / 8) as usize * (size[1] / 8) as usize + 2)?;
        bytes.get(at..)?.as_chunks::<3>().0.get(..COLOURS)?.try_into().ok()
    };
    Some((size, texels, if has_palette { own()? } else { QUAKE_PALETTE.as_chunks::<3>().0.try_into().ok()? }))
}

fn png([width, height]: [u32; 2], texels: &[u8], palette: Palette, has_holes: bool) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette.as_flattened().to_vec());
    if has_holes {
        let mut opacity = vec![u8::MAX; COLOURS];
        opacity[COLOURS - 1] = 0;
        encoder.set_trns(opacity);
    }
    encoder.write_header().and_then(|mut writer| writer.write_image_data(texels)).ok()?;
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A texture in file format: `size` texels of one index, with each side divided by 2, 4 and 8.
    fn entry(name: &str, size: [u32; 2], texel: u8, palette: Option<[u8; 3]>) -> Vec<u8> {
        let mut bytes = name.as_bytes().to_vec();
        bytes.resize(NAME, 0);
        bytes.extend(size.iter().flat_map(|side| side.to_le_bytes()));
        let areas = [1, 2, 4, 8].map(|cut| (size[0] / cut) * (size[1] / cut));
        let mut at = HEAD as u32;
        for area in areas {
            bytes.extend(at.to_le_bytes());
            at += area;
        }
        bytes.extend(vec![texel; areas.iter().sum::<u32>() as usize]);
        if let Some(colour) = palette {
            bytes.extend(256u16.to_le_bytes());
            bytes.extend([colour; COLOURS].as_flattened());
        }
        bytes
    }

    fn wad(magic: &str, textures: &[(&str, Vec<u8>)]) -> Vec<u8> {
        let mut bytes = magic.as_bytes().to_vec();
        bytes.extend((textures.len() as u32).to_le_bytes());
        let all: usize = textures.iter().map(|(_, texture)| texture.len()).sum();
        bytes.extend((12 + all as u32).to_le_bytes());
        let mut at = 12;
        let mut directory = Vec::new();
        for (name, texture) in textures {
            bytes.extend(texture);
            let mut entry = [at, texture.len() as u32, texture.len() as u32].map(u32::to_le_bytes).concat();
            entry.extend([if magic == "WAD3" { KINDS[1] } else { KINDS[0] }, 0, 0, 0]);
            entry.extend(name.as_bytes());
            entry.resize(DIRECTORY_ENTRY, 0);
            directory.extend(entry);
            at += texture.len() as u32;
        }
        bytes.extend(directory);
        bytes
    }

    /// Red, green, blue and opacity of the first texel.
    fn first(textures: &Textures, name: &str) -> Option<[u8; 4]> {
        let Picture::Within(bytes) = &textures.get(name)?.picture else { panic!("not within") };
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::ALPHA);
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        pixels.first_chunk().copied()
    }

    #[test]
    fn texels_have_the_colours_of_their_palettes_and_holes_are_holes() {
        let mut textures = Textures::default();
        let stone = [("STONE", entry("stone", [16, 8], 15, None)), ("{net", entry("{net", [16, 16], 255, None))];
        textures.add_wad(&wad("WAD2", &stone));
        textures.add_wad(&wad("WAD3", &[("brass", entry("brass", [16, 16], 7, Some([200, 150, 20])))]));
        // A second texture with that name is ignored.
        textures.add_wad(&wad("WAD3", &[("brass", entry("brass", [16, 16], 7, Some([1, 2, 3])))]));
        assert_eq!(textures.get("stone").unwrap().size, [16, 8]);
        // The sixteenth grey of Quake is the lightest one.
        let [r, g, b, a] = first(&textures, "stone").unwrap();
        assert!(r == g && g == b && r > 220 && a == 255, "{r} {g} {b} {a}");
        assert_eq!(first(&textures, "brass"), Some([200, 150, 20, 255]));
        assert_eq!(first(&textures, "{net").unwrap()[3], 0);
    }

    #[test]
    fn what_makes_no_sense_is_left_out() {
        let whole = wad("WAD3", &[("brass", entry("brass", [16, 16], 7, Some([200, 150, 20])))]);
        for cut in 0..whole.len() {
            let mut textures = Textures::default();
            textures.add_wad(&whole[..cut]);
            assert!(textures.all.is_empty(), "{cut} of {} bytes", whole.len());
        }
        let mut huge = entry("huge", [16, 16], 0, None);
        huge[NAME..NAME + 8].fill(0xff);
        let mut none = entry("none", [16, 16], 0, None);
        none[NAME..NAME + 4].fill(0);
        let mut textures = Textures::default();
        textures.add_wad(&wad("WAD2", &[("huge", huge), ("none", none)]));
        textures.add_wad(b"PACK00000000");
        assert!(textures.all.is_empty());
        // The same bytes for any number of textures.
        let large = entry("large", [1024, 1024], 3, None);
        (0..100).for_each(|i| textures.add(format!("large {i}"), &large, false));
        assert_eq!(textures.all.len(), 64);
    }
}
