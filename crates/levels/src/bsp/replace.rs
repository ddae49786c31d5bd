//! Puts a new visibility lump into a level's file; every other byte stays, but for offsets.
//!
//! Most games: the lump takes the place of the old one, or the place that an empty one names, and what is behind it moves by a multiple
//! of four. Source: lumps hold offsets into the file, so nothing moves. A longer lump goes to the end of the file.

use super::error::BspError;
use super::file::{Entry, LevelFile};
use super::layout::Lump;
use super::lzma;
use std::ops::Range;

/// After the lumps: name, offset and length of each lump of an extension.
const BSPX_ENTRY: usize = 24 + 4 + 4;
const BSPX_NAME: usize = 24;
/// After Half-Life's header: more lumps of Xash, 12 pairs of offset and length, after a version.
const XASH: &[u8] = b"XASH";
const XASH_LUMPS: usize = 12;
/// After Quake 3's header: q3map2's lump with the length of the file as offset, and a length of 0.
const TAIL: [u8; 4] = [0; 4];

/// A file with another visibility lump.
pub(super) struct Replaced {
    pub bytes: Vec<u8>,
    /// Its directory.
    pub entries: Vec<Entry>,
}

/// The file with `vis` as its visibility lump.
pub(super) fn replace(file: &LevelFile, vis: &[u8]) -> Result<Replaced, BspError> {
    let number = file.layout.number(Lump::Visibility).unwrap_or_default();
    let mut out = if file.layout.directory.entry == 16 { beside(file, number, vis) } else { within(file, number, vis)? };
    if i32::try_from(out.bytes.len()).is_err() {
        return Err(BspError::TooLong);
    }
    for (number, entry) in out.entries.iter().enumerate() {
        let [offset, length, _, unpacked] = file.entry_places(number);
        out.bytes[offset..offset + 4].copy_from_slice(&file.bytes_of(entry.offset as u32));
        out.bytes[length..length + 4].copy_from_slice(&file.bytes_of(entry.length as u32));
        if file.layout.directory.entry == 16 {
            out.bytes[unpacked..unpacked + 4].copy_from_slice(&file.bytes_of(entry.unpacked));
        }
    }
    Ok(out)
}

/// Nothing moves: the lump is written over the old one, or at the end.
fn beside(file: &LevelFile, number: usize, vis: &[u8]) -> Replaced {
    let (mut bytes, mut entries) = (file.bytes.clone(), file.entries.clone());
    let old = entries[number];
    let is_packed = lzma::is_packed(&bytes[old.offset..old.end()]);
    let (lump, unpacked) = if is_packed { (lzma::pack(vis), vis.len() as u32) } else { (vis.to_vec(), 0) };
    let is_shared =
        entries.iter().enumerate().any(|(i, e)| i != number && e.length > 0 && e.offset < old.end() && old.offset < e.end());
    let is_own = !is_shared && old.length > 0 && old.offset >= file.layout.header();
    let offset = if lump.len() <= old.length && is_own {
        bytes[old.offset..old.end()].fill(0);
        bytes[old.offset..old.offset + lump.len()].copy_from_slice(&lump);
        old.offset
    } else {
        // The last lump, as an earlier run may have left it, makes room.
        if is_own && old.end() == bytes.len() {
            bytes.truncate(old.offset);
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes.extend(&lump);
        bytes.len() - lump.len()
    };
    entries[number] = Entry { offset, length: lump.len(), unpacked, ..old };
    Replaced { bytes, entries }
}

/// What is behind the lump moves.
fn within(file: &LevelFile, number: usize, vis: &[u8]) -> Result<Replaced, BspError> {
    let (bytes, header) = (&file.bytes, file.layout.header());
    let cut = place(file, number);
    let start = cut.start.next_multiple_of(4);
    let mut out = bytes[..cut.start].to_vec();
    out.resize(start, 0);
    out.extend_from_slice(vis);
    while !(out.len() - start).wrapping_sub(cut.len()).is_multiple_of(4) {
        out.push(0);
    }
    let new_end = out.len();
    out.extend_from_slice(&bytes[cut.end..]);
    let moved = |offset: usize| if offset >= cut.end { offset - cut.end + new_end } else { offset };

    // 1. The directory.
    let mut entries: Vec<Entry> = file.entries.iter().map(|e| Entry { offset: moved(e.offset), ..*e }).collect();
    entries[number] = Entry { offset: start, length: vis.len(), ..file.entries[number] };

    // 2. Other directories.
    let mut shift = |at: usize| {
        let offset = moved(word(&out, at)) as u32;
        out[at..at + 4].copy_from_slice(&offset.to_le_bytes());
    };
    if bytes[header..].starts_with(XASH) && bytes.len() >= header + 8 + 8 * XASH_LUMPS && cut.start >= header + 8 {
        (0..XASH_LUMPS).for_each(|lump| shift(header + 8 + 8 * lump));
    }
    let is_tail = bytes.len() >= header + 8 && word(bytes, header) == bytes.len() && bytes[header + 4..header + 8] == TAIL;
    if is_tail && cut.start >= header + 8 {
        shift(header);
    }
    if let Some(extension) = extension(file) {
        let at = moved(extension);
        let count = out.get(at + 4..at + 8).map_or(0, |b| word(b, 0));
        let table = at + 8..(at + 8).saturating_add(count.saturating_mul(BSPX_ENTRY));
        if table.end > out.len() {
            return Err(BspError::Lump { lump: "BSPX".into(), what: format!("lists {count} lumps and ends before") });
        }
        for at in table.step_by(BSPX_ENTRY).map(|entry| entry + BSPX_NAME) {
            let offset = moved(word(&out, at)) as u32;
            out[at..at + 4].copy_from_slice(&offset.to_le_bytes());
        }
    }
    Ok(Replaced { bytes: out, entries })
}

/// The bytes that the lump replaces: the old lump with its padding, or none, where an empty lump points between two others, or else
/// after the last one.
fn place(file: &LevelFile, number: usize) -> Range<usize> {
    let (old, header, length) = (file.entries[number], file.layout.header(), file.bytes.len());
    let others = || file.entries.iter().enumerate().filter(|&(i, e)| i != number && e.length > 0).map(|(_, e)| *e);
    let last = file.entries.iter().filter(|e| e.length > 0).map(Entry::end).max().unwrap_or(0).max(header);
    let extension = extension(file);
    let is_shared = others().any(|e| e.offset < old.end() && old.offset < e.end());
    if old.length == 0 {
        let is_between =
            others().any(|e| e.offset == old.offset) && !others().any(|e| (e.offset + 1..e.end()).contains(&old.offset));
        let at = if is_between && old.offset >= header && old.offset.is_multiple_of(4) {
            old.offset
        } else {
            last.next_multiple_of(4)
        };
        let at = at.min(length);
        return at..at;
    }
    if is_shared || old.offset < header {
        let at = last.next_multiple_of(4).min(length);
        return at..at;
    }
    let next = others().map(|e| e.offset).filter(|&o| o >= old.end()).chain([length]);
    let next = next.chain(extension.filter(|&e| e >= old.end())).min().unwrap_or(length);
    // A larger gap is data of an unknown kind.
    old.offset..if next - old.end() < 4 { next } else { old.end() }
}

/// Where an extension's directory begins, after the last lump.
fn extension(file: &LevelFile) -> Option<usize> {
    let last = file.entries.iter().filter(|e| e.length > 0).map(Entry::end).max().unwrap_or(0).max(file.layout.header());
    let at = last.next_multiple_of(4);
    (file.bytes.get(at..at + 4) == Some(b"BSPX")).then_some(at)
}

fn word(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes([0, 1, 2, 3].map(|i| bytes[at + i])) as usize
}
