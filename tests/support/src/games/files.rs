//! Files of games by hand: textures, palettes and archives.

use flate2::Compression;
use flate2::write::DeflateEncoder;
use std::io::Write;

/// A texture of Quake 2 (`.wal`), all of one colour.
pub fn wal(name: &str, size: [u32; 2], texel: u8) -> Vec<u8> {
    let mut bytes = name.as_bytes().to_vec();
    bytes.resize(32, 0);
    let areas = [1, 2, 4, 8].map(|cut| (size[0] / cut) * (size[1] / cut));
    bytes.extend(size.map(u32::to_le_bytes).concat());
    let mut at = 100;
    for area in areas {
        bytes.extend(u32::to_le_bytes(at));
        at += area;
    }
    bytes.resize(100, 0);
    bytes.resize(at as usize, texel);
    bytes
}

/// A picture (PCX) with the palette of Quake 2's size: colour `i` is `colour(i)`.
pub fn colormap(colour: impl Fn(u8) -> [u8; 3]) -> Vec<u8> {
    // A pixel, and its palette.
    let mut bytes = vec![10, 5, 1, 8];
    bytes.resize(129, 0);
    bytes.push(12);
    bytes.extend((0..=255).flat_map(colour));
    bytes
}

/// An archive of Quake and Quake 2.
pub fn pak(files: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = b"PACK\0\0\0\0\0\0\0\0".to_vec();
    let mut directory = Vec::new();
    for (name, content) in files {
        let mut entry = name.as_bytes().to_vec();
        entry.resize(56, 0);
        entry.extend([bytes.len() as u32, content.len() as u32].map(u32::to_le_bytes).concat());
        directory.extend(entry);
        bytes.extend(content);
    }
    let place = [bytes.len() as u32, directory.len() as u32].map(u32::to_le_bytes).concat();
    bytes[4..12].copy_from_slice(&place);
    bytes.extend(directory);
    bytes
}

/// An archive of Quake 3: a zip, with a comment. Files whose names begin with `raw` are not packed.
pub fn pk3(files: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in files {
        let is_raw = name.starts_with("raw");
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(content).unwrap();
        let packed = if is_raw { content.clone() } else { encoder.finish().unwrap() };
        let method: u16 = if is_raw { 0 } else { 8 };
        let sizes = [0, packed.len() as u32, content.len() as u32].map(u32::to_le_bytes).concat();
        let shared =
            [&[20, 0, 0, 0][..], &method.to_le_bytes(), &[0; 4], &sizes, &(name.len() as u16).to_le_bytes()].concat();
        // An extra field of three bytes before the file, of two in the directory, and a comment of one.
        let at = (bytes.len() as u32).to_le_bytes();
        bytes.extend([b"PK\x03\x04", &shared[..], &[3, 0], name.as_bytes(), b"xyz", &packed].concat());
        let own = [&[2, 0, 1, 0][..], &[0; 8], &at, name.as_bytes(), b"xyc"].concat();
        directory.extend([b"PK\x01\x02\x14\0", &shared[..], &own[..]].concat());
    }
    let place = [directory.len() as u32, bytes.len() as u32].map(u32::to_le_bytes).concat();
    bytes.extend(directory);
    // Its comment looks like an end.
    bytes.extend([b"PK\x05\x06", &[0; 8][..], &place, &[4, 0], b"PK\x05\x06"].concat());
    bytes
}
