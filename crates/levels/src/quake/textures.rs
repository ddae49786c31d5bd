//! The meaning of texture names in games.

use super::texels::Textures;
use enfilade::scene::Material;

/// Textures of faces that games never draw.
const UNDRAWN: [&str; 8] = ["clip", "skip", "trigger", "hint", "hintskip", "origin", "aaatrigger", "null"];

/// The material of a texture: its texels if they were found. Otherwise liquids have fixed colours, and other textures a colour
/// from a hash of their name, so that they differ.
pub(super) fn material(texture: &str, textures: &Textures) -> Material {
    let opacity = if is_see_through(texture) { GLASS } else { 1.0 };
    if let Some(found) = textures.get(texture) {
        let has_holes = texture.starts_with('{');
        let colour = [1.0, 1.0, 1.0, if has_holes { 1.0 } else { opacity }];
        let (cutoff, picture) = (has_holes.then_some(0.5), Some(found.picture.clone()));
        return Material {
            cutoff,
            texture: picture.clone(),
            emissive: [LAMPS; 3],
            emissive_texture: picture,
            ..Material::matt(texture, colour)
        };
    }
    let liquid = LIQUIDS.iter().find(|(name, _)| texture.starts_with(name)).map(|(_, colour)| *colour);
    let [r, g, b] = liquid.unwrap_or_else(|| by_name(texture));
    Material::matt(texture, [r, g, b, opacity])
}

/// Opacity of see-through textures without texels.
pub(super) const GLASS: f32 = 0.5;

/// Emission of textures, as a multiple of their colour. A level's lamps are in its lightmaps, and the sun does not reach its
/// rooms: without emission they are nearly black.
const LAMPS: f32 = 1.5;

/// Liquids by prefixes of their names.
const LIQUIDS: [(&str, [f32; 3]); 5] = [
    ("*lava", [0.90, 0.22, 0.03]),
    ("*slime", [0.22, 0.36, 0.05]),
    ("*tele", [0.12, 0.08, 0.20]),
    ("*", [0.08, 0.20, 0.30]),
    ("sky", [0.45, 0.60, 0.85]),
];

/// Brownish to greyish.
fn by_name(texture: &str) -> [f32; 3] {
    let hash = xxhash_rust::xxh3::xxh3_64(texture.as_bytes());
    let part = |shift: u32| (hash >> shift & 0xff) as f32 / 255.0;
    let light = 0.30 + 0.22 * part(0);
    [light * (1.0 + 0.18 * part(8)), light * (0.94 + 0.12 * part(16)), light * (0.78 + 0.24 * part(24))]
}

pub(super) fn is_undrawn(texture: &str) -> bool {
    UNDRAWN.contains(&texture)
}

pub(super) fn is_see_through(texture: &str) -> bool {
    texture.starts_with(['{', '*', '!'])
}
