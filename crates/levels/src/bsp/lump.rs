//! The visibility lump: run-length coded rows of leaves; the rest of the file stays unchanged.
//!
//! A row has a bit for each leaf of the world except the solid one, lowest bit first. A nonzero byte stands for itself; a zero is
//! followed by the number of zeros, 1 to 255. A leaf has the offset of its row, or -1: it sees everything.

use super::{Bsp, SOUNDS};
use crate::quake::BspError;
use crate::quake::layout::{HEADER, LEAVES, LUMPS, Lump, VISIBILITY};
use crate::quake::tree::Tree;
use enfilade::BitMatrix;
use qbsp::BspFormat;
use std::collections::HashMap;

/// Offset of the row's offset in a leaf, after its contents.
const VIS_OFFSET: usize = 4;
/// After the lumps: name, offset and length of each lump of an extension.
const BSPX_ENTRY: usize = 24 + 4 + 4;

/// Rows of all leaves.
pub(super) fn decode(lump: &[u8], tree: &Tree) -> Result<BitMatrix, BspError> {
    let n = tree.vis_leaves;
    let mut rows = BitMatrix::new(n, n);
    for cell in 0..n {
        let Ok(offset) = usize::try_from(tree.leaves[cell + 1].vis_offset) else {
            (0..n).for_each(|c| {
                rows.set(cell, c);
            });
            continue;
        };
        let row = lump.get(offset..).and_then(|row| expand(row, n.div_ceil(8)));
        let row = row.ok_or_else(|| BspError::Entry {
            lump: LUMPS[LEAVES],
            entry: cell + 1,
            what: format!("its row at byte {offset} goes on beyond lump {}", LUMPS[VISIBILITY]),
        })?;
        (0..n).filter(|c| row[c / 8] >> (c % 8) & 1 != 0).for_each(|c| {
            rows.set(cell, c);
        });
    }
    Ok(rows)
}

/// A row of `length` bytes; `None` if its code ends too early or counts no zeros.
fn expand(code: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut row = Vec::with_capacity(length);
    let mut code = code.iter();
    while row.len() < length {
        match *code.next()? {
            0 => match *code.next()? {
                0 => return None,
                zeros => row.resize((row.len() + usize::from(zeros)).min(length), 0),
            },
            byte => row.push(byte),
        }
    }
    Some(row)
}

/// Run-length codes a row.
fn compress(row: &[u8]) -> Vec<u8> {
    let mut code = Vec::new();
    for run in row.chunk_by(|a, b| *a == 0 && *b == 0) {
        match run {
            [0, ..] => run.chunks(255).for_each(|zeros| code.extend([0, zeros.len() as u8])),
            _ => code.extend_from_slice(run),
        }
    }
    code
}

/// Bytes of a leaf; the last ones are its ambient levels.
fn leaf_size(bsp: &Bsp) -> usize {
    if bsp.format == BspFormat::BSP2 { 44 } else { 28 }
}

/// The ambient levels of the leaves with rows.
pub(super) fn ambient(bsp: &Bsp) -> Vec<[u8; SOUNDS]> {
    let leaves = bsp.source().lump(LEAVES).chunks_exact(leaf_size(bsp));
    leaves.skip(1).take(bsp.leaves()).filter_map(|leaf| leaf.last_chunk().copied()).collect()
}

/// See [`Bsp::with_rows`].
pub(super) fn write(
    bsp: &Bsp,
    rows: &BitMatrix,
    clusters: &[u32],
    ambient: Option<&[[u8; SOUNDS]]>,
) -> Result<Vec<u8>, BspError> {
    // 1. A code for each cluster; clusters with equal rows share it.
    let (mut lump, mut known, mut offsets) = (Vec::new(), HashMap::new(), Vec::new());
    for cluster in 0..rows.rows() {
        let mut row = vec![0u8; clusters.len().div_ceil(8)];
        for (leaf, &other) in clusters.iter().enumerate() {
            row[leaf / 8] |= u8::from(rows.get(cluster, other as usize)) << (leaf % 8);
        }
        let offset = *known.entry(compress(&row)).or_insert_with_key(|code| {
            lump.extend_from_slice(code);
            lump.len() - code.len()
        });
        offsets.push(i32::try_from(offset).map_err(|_| BspError::TooLong)?);
    }

    // 2. The new lump, and the leaves' offsets and levels. Leaves outside the world have no row.
    let (mut bytes, lumps) = replace(&bsp.bytes, &bsp.lumps, &lump)?;
    let Lump { offset, length } = lumps[LEAVES];
    for (leaf, entry) in bytes[offset..offset + length].chunks_exact_mut(leaf_size(bsp)).enumerate() {
        let cell = leaf.checked_sub(1);
        let cluster = cell.and_then(|cell| clusters.get(cell));
        let vis_offset = cluster.map_or(-1, |&c| offsets[c as usize]);
        entry[VIS_OFFSET..VIS_OFFSET + 4].copy_from_slice(&vis_offset.to_le_bytes());
        let levels = cell.zip(ambient).and_then(|(cell, ambient)| ambient.get(cell));
        if let Some((levels, last)) = levels.zip(entry.last_chunk_mut()) {
            *last = *levels;
        }
    }
    Ok(bytes)
}

/// Replaces the visibility lump by `vis`. Later data moves by a multiple of four, to keep lumps and extensions aligned.
fn replace(bytes: &[u8], lumps: &[Lump; LUMPS.len()], vis: &[u8]) -> Result<(Vec<u8>, [Lump; LUMPS.len()]), BspError> {
    // 1. The removed range: the old lump with its padding, or an empty range after the last lump if it has no space of its own.
    let old = lumps[VISIBILITY];
    let others = || lumps.iter().enumerate().filter(|&(i, l)| i != VISIBILITY && l.length > 0).map(|(_, l)| *l);
    let last = lumps.iter().filter(|l| l.length > 0).map(|l| l.end()).max().unwrap_or(0).max(HEADER);
    let extension = last.next_multiple_of(4);
    let has_extension = bytes.get(extension..extension + 4) == Some(b"BSPX");
    let shared = others().any(|l| l.offset < old.end() && old.offset < l.end());
    let cut = if old.length == 0 || shared || old.offset < HEADER {
        let at = extension.min(bytes.len());
        at..at
    } else {
        let next = others().map(|l| l.offset).filter(|&o| o >= old.end()).chain([bytes.len()]);
        let next = next.chain(has_extension.then_some(extension).filter(|&e| e >= old.end())).min().unwrap_or(bytes.len());
        // A larger gap is data of an unknown kind.
        old.offset..if next - old.end() < 4 { next } else { old.end() }
    };

    // 2. The rest of the file.
    let start = if cut.is_empty() { extension } else { cut.start };
    let mut out = bytes[..cut.start].to_vec();
    out.resize(start, 0);
    out.extend_from_slice(vis);
    while !(out.len() - start).wrapping_sub(cut.len()).is_multiple_of(4) {
        out.push(0);
    }
    let new_end = out.len();
    out.extend_from_slice(&bytes[cut.end..]);
    if i32::try_from(out.len()).is_err() {
        return Err(BspError::TooLong);
    }
    let moved = |offset: usize| if offset >= cut.end { offset - cut.end + new_end } else { offset };

    // 3. The directory, and that of the extension.
    let mut new = lumps.map(|l| Lump { offset: moved(l.offset), ..l });
    new[VISIBILITY] = Lump { offset: start, length: vis.len() };
    for (entry, lump) in out[4..HEADER].chunks_exact_mut(8).zip(new) {
        entry[..4].copy_from_slice(&(lump.offset as u32).to_le_bytes());
        entry[4..].copy_from_slice(&(lump.length as u32).to_le_bytes());
    }
    if has_extension {
        let at = moved(extension);
        let count = out.get(at + 4..at + 8).map_or(0, word);
        let table = at + 8..at + 8 + count.saturating_mul(BSPX_ENTRY);
        let damaged = || BspError::Lump { lump: "BSPX", what: format!("lists {count} lumps and ends before") };
        for entry in out.get_mut(table).ok_or_else(damaged)?.chunks_exact_mut(BSPX_ENTRY) {
            let offset = moved(word(&entry[24..28])) as u32;
            entry[24..28].copy_from_slice(&offset.to_le_bytes());
        }
    }
    Ok((out, new))
}

fn word(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0, |n, &b| n << 8 | usize::from(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_zeros_are_counted_to_255_and_no_further() {
        let mut row = vec![7, 0, 0, 9];
        row.extend([0; 600]);
        let code = compress(&row);
        assert_eq!(code, [7, 0, 2, 9, 0, 255, 0, 255, 0, 90]);
        assert_eq!(expand(&code, row.len()), Some(row));
        assert_eq!(expand(&code, 700), None);
        assert_eq!(expand(&[0, 0, 1], 1), None);
    }
}
