//! Reads model files and sidecar files as bytes, and recognizes files of other kinds.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The byte order mark that some editors write.
pub const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Placeholders of files that were not fetched: their first bytes, in lower case, and a description.
const STAND_INS: [(&[u8], &str); 3] = [
    (b"version https://git-lfs.github.com/spec/", "a Git LFS pointer, not the file itself; fetch it with `git lfs pull`"),
    (b"<!doctype html", WEB_PAGE),
    (b"<html", WEB_PAGE),
];
const WEB_PAGE: &str = "a web page (HTML), not the file itself; download the raw file instead";

/// Bytes sufficient to recognize these, after a few blanks.
const START: u64 = 256;

/// First bytes of files of other kinds, with a description.
const KINDS: [(&[u8], &str); 10] = [
    (b"PK\x03\x04", "a zip archive: unpack it"),
    (b"\x1F\x8B", "packed with gzip: unpack it"),
    (b"\xFF\xFE", "text in UTF-16: save it as UTF-8"),
    (b"\xFE\xFF", "text in UTF-16: save it as UTF-8"),
    (b"glTF", "binary glTF: rename it to .glb"),
    (b"ISO-10303-21", "a STEP file: if it is IFC, rename it to .ifc"),
    (b"ply", "PLY: rename it to .ply"),
    (b"solid ", "STL: rename it to .stl"),
    (b"Kaydara FBX", "FBX: export it as glTF"),
    (b"BLENDER", "a file of Blender: export it as glTF"),
];

/// Most characters of a text in a message.
const TOLD: usize = 40;
/// Most bytes of a binary file in a message.
const TOLD_BYTES: usize = 8;

/// Reads a whole model.
///
/// # Errors
///
/// As [`read`], and if it is empty.
pub fn model(path: &Path) -> io::Result<Vec<u8>> {
    let bytes = read(path)?;
    if bytes.is_empty() { Err(io::Error::other("the file is empty")) } else { Ok(bytes) }
}

/// Reads a whole file.
///
/// # Errors
///
/// If it cannot be read, or is only a pointer to the real file, or a web page.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let absent = |e: io::Error| match e.kind() {
        io::ErrorKind::NotFound => io::Error::new(e.kind(), "there is no such file"),
        _ => e,
    };
    let bytes = std::fs::read(path).map_err(absent)?;
    match stand_in(&bytes) {
        Some(what) => Err(io::Error::other(what)),
        None => Ok(bytes),
    }
}

/// Whether a file can be read and is not empty, a pointer or a web page.
pub(super) fn holds_something(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(START).read_to_end(&mut start));
    read.is_ok() && !start.is_empty() && stand_in(&start).is_none()
}

fn stand_in(bytes: &[u8]) -> Option<&'static str> {
    let start = text_of(bytes);
    let starts_with = |this: &[u8]| start.len() >= this.len() && start[..this.len()].eq_ignore_ascii_case(this);
    STAND_INS.iter().find(|(this, _)| starts_with(this)).map(|(_, what)| *what)
}

/// A text without the byte order mark and leading blanks.
pub fn text_of(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes).trim_ascii_start()
}

/// Description of a file of the wrong kind, as the end of a sentence: its kind, or its first characters.
pub fn nature(bytes: &[u8]) -> String {
    if let Some((_, what)) = KINDS.iter().find(|(start, _)| bytes.starts_with(start)) {
        return format!("it is {what}");
    }
    let start = text_of(bytes);
    let line = start.split(|&b| b == b'\n' || b == b'\r').next().unwrap_or_default();
    let is_text = |text: &&str| !text.is_empty() && !text.chars().any(char::is_control);
    // A cut within a character is not an error.
    let whole = |line: &[u8]| line.utf8_chunks().next().map(|chunk| chunk.valid().to_owned());
    match whole(&line[..line.len().min(4 * TOLD)]).as_deref().map(|text| text.replace('\t', " ")).as_deref().filter(is_text)
    {
        Some(text) => {
            let told: String = text.chars().take(TOLD).collect();
            let more = if told.len() < line.len() { "..." } else { "" };
            format!("it begins with the text `{told}{more}`")
        }
        None if start.is_empty() => "it has only white space".to_owned(),
        None => {
            let told: Vec<String> = bytes.iter().take(TOLD_BYTES).map(|b| format!("{b:02x}")).collect();
            format!("it begins with the bytes {}", told.join(" "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_another_kind_is_told_in_one_clause() {
        assert_eq!(nature(b"PK\x03\x04rest"), "it is a zip archive: unpack it");
        assert_eq!(nature(b"glTF\x02\0\0\0"), "it is binary glTF: rename it to .glb");
        assert_eq!(nature(b"\xEF\xBB\xBF\n Model goes here.\nlater"), "it begins with the text `Model goes here.`");
        let long = "wörter ".repeat(20);
        assert_eq!(
            nature(long.as_bytes()),
            format!("it begins with the text `{}...`", long.chars().take(40).collect::<String>())
        );
        assert_eq!(nature(b" \n\t"), "it has only white space");
        assert_eq!(nature(b"\0\x01\xFF"), "it begins with the bytes 00 01 ff");
    }
}
