//! Archives of games: `.pak` of Quake and Quake 2, and `.pk3` of Quake 3, which is a zip. What is damaged, packed in other ways or too
//! long is skipped: appearance never makes an import fail.

use flate2::read::DeflateDecoder;
use std::collections::BTreeMap;
use std::io::{Read, Seek, SeekFrom};

/// Most bytes of a directory, and of an unpacked file.
const MOST_BYTES: u64 = 1 << 26;
/// Most bytes of an unpacked file for each packed one. Scripts and pictures of games have twenty at most.
const MOST_FOLD: u64 = 64;
/// Bytes of an entry of a `.pak`, which begins with a name; of that name.
const PAK_ENTRY: usize = 64;
const PAK_NAME: usize = 56;
/// Bytes of a zip's end, of the longest comment behind it, of an entry without its names, and of what stands before a file.
const ZIP_END: usize = 22;
const ZIP_COMMENT: u64 = 0xffff;
const ZIP_ENTRY: usize = 46;
const ZIP_HEAD: usize = 30;

/// Where a file of an archive is.
#[derive(Clone, Copy)]
struct Entry {
    at: u64,
    length: u64,
    is_packed: bool,
}

/// An archive, opened.
pub(super) struct Archive<R> {
    file: R,
    /// By name, in lower case.
    entries: BTreeMap<String, Entry>,
    is_zip: bool,
}

impl<R: Read + Seek> Archive<R> {
    /// Reads the directory of an archive; `None` if it has none.
    pub fn open(mut file: R) -> Option<Self> {
        let head = part(&mut file, 0, 12)?;
        let is_zip = !head.starts_with(b"PACK");
        let entries = if is_zip { zip(&mut file)? } else { pak(&mut file, &head)? };
        Some(Self { file, entries, is_zip })
    }

    /// Names of the files of a folder that end so, in lower case, in order.
    pub fn names<'a>(&'a self, folder: &'a str, ending: &'a str) -> impl Iterator<Item = &'a String> {
        let is_one = move |name: &&String| {
            let own = name.strip_prefix(folder).and_then(|own| own.strip_prefix('/'));
            own.is_some_and(|own| !own.contains('/') && own.ends_with(ending))
        };
        self.entries.keys().filter(is_one)
    }

    /// A file by its name, in lower case.
    pub fn read(&mut self, name: &str) -> Option<Vec<u8>> {
        let mut entry = *self.entries.get(name)?;
        if self.is_zip {
            let head = part(&mut self.file, entry.at, ZIP_HEAD as u64).filter(|head| head.starts_with(b"PK\x03\x04"))?;
            entry.at += ZIP_HEAD as u64 + short(&head, 26) + short(&head, 28);
        }
        if !entry.is_packed {
            return part(&mut self.file, entry.at, entry.length);
        }
        self.file.seek(SeekFrom::Start(entry.at)).ok()?;
        let most = entry.length.saturating_mul(MOST_FOLD).min(MOST_BYTES);
        let mut bytes = Vec::new();
        let packed = (&mut self.file).take(entry.length);
        DeflateDecoder::new(packed).take(most + 1).read_to_end(&mut bytes).ok()?;
        (bytes.len() as u64 <= most).then_some(bytes)
    }
}

/// Bytes of a file, if it has them all. Grows as they are read.
fn part<R: Read + Seek>(file: &mut R, at: u64, length: u64) -> Option<Vec<u8>> {
    file.seek(SeekFrom::Start(at)).ok()?;
    let mut bytes = Vec::new();
    file.take(length.min(MOST_BYTES)).read_to_end(&mut bytes).ok()?;
    (bytes.len() as u64 == length).then_some(bytes)
}

fn short(bytes: &[u8], at: usize) -> u64 {
    u64::from(bytes[at]) | u64::from(bytes[at + 1]) << 8
}

fn word(bytes: &[u8], at: usize) -> u64 {
    short(bytes, at) | short(bytes, at + 2) << 16
}

fn lower(name: &[u8]) -> String {
    String::from_utf8_lossy(name).to_lowercase().replace('\\', "/")
}

fn pak<R: Read + Seek>(file: &mut R, head: &[u8]) -> Option<BTreeMap<String, Entry>> {
    let directory = part(file, word(head, 4), word(head, 8))?;
    let entry = |entry: &[u8]| {
        let name = entry[..PAK_NAME].split(|&b| b == 0).next().unwrap_or_default();
        (lower(name), Entry { at: word(entry, PAK_NAME), length: word(entry, PAK_NAME + 4), is_packed: false })
    };
    Some(directory.chunks_exact(PAK_ENTRY).map(entry).collect())
}

fn zip<R: Read + Seek>(file: &mut R) -> Option<BTreeMap<String, Entry>> {
    let length = file.seek(SeekFrom::End(0)).ok()?;
    let tail = length.min(ZIP_END as u64 + ZIP_COMMENT);
    let tail = part(file, length - tail, tail)?;
    let end = tail.windows(ZIP_END).rposition(|end| end.starts_with(b"PK\x05\x06"))?;
    let directory = part(file, word(&tail, end + 16), word(&tail, end + 12))?;
    let (mut entries, mut rest) = (BTreeMap::new(), &directory[..]);
    while rest.len() >= ZIP_ENTRY && rest.starts_with(b"PK\x01\x02") {
        let [name, extra, comment] = [28, 30, 32].map(|at| short(rest, at) as usize);
        let Some(text) = rest.get(ZIP_ENTRY..ZIP_ENTRY + name) else { break };
        let (is_locked, method) = (short(rest, 8) & 1 == 1, short(rest, 10));
        if !is_locked && (method == 0 || method == 8) {
            entries.insert(lower(text), Entry { at: word(rest, 42), length: word(rest, 20), is_packed: method == 8 });
        }
        rest = rest.get(ZIP_ENTRY + name + extra + comment..).unwrap_or_default();
    }
    Some(entries)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;
    use testing::games::files::{pak, pk3};

    fn files() -> [(&'static str, Vec<u8>); 3] {
        let file = |name, text: &str| (name, text.as_bytes().to_vec());
        [file("Scripts/Base.shader", "a\n{\n}\n"), file("raw/b.shader", "b"), file("scripts/more/c.shader", "c")]
    }

    #[test]
    fn files_are_read_by_name() {
        for bytes in [pak(&files()), pk3(&files())] {
            let mut archive = Archive::open(Cursor::new(bytes)).unwrap();
            let names: Vec<&String> = archive.names("scripts", ".shader").collect();
            assert_eq!(names, ["scripts/base.shader"]);
            for (name, content) in files() {
                assert_eq!(archive.read(&name.to_lowercase()), Some(content), "{name}");
            }
            assert_eq!(archive.read("scripts/none.shader"), None);
        }
    }

    #[test]
    fn damaged_archives_are_read_as_far_as_they_go() {
        for whole in [pak(&files()), pk3(&files())] {
            for place in 0..whole.len() {
                for value in [0, 1, 0x7f, 0xff] {
                    let mut bytes = whole.clone();
                    bytes[place] = value;
                    // Neither panics nor reads more than there is.
                    for bytes in [bytes, whole[..place].to_vec()] {
                        let Some(mut archive) = Archive::open(Cursor::new(bytes)) else { continue };
                        let names: Vec<String> = archive.entries.keys().cloned().collect();
                        let read: usize = names.iter().filter_map(|name| archive.read(name)).map(|file| file.len()).sum();
                        assert!(read <= 64 * whole.len(), "{place} {value}: {read}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_unpacks_to_too_much_is_left_out() {
        let long = vec![0; 1 << 20];
        let mut archive = Archive::open(Cursor::new(pk3(&[("zeros", long.clone()), ("raw", long)]))).unwrap();
        assert_eq!(archive.read("zeros"), None);
        assert_eq!(archive.read("raw").map(|file| file.len()), Some(1 << 20));
    }
}
