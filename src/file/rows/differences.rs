//! Rows coded as differences, in blocks compressed by zstd.
//!
//! Based on: Michiel van de Panne, A. James Stewart, *Effective compression techniques for precomputed visibility*, 1999 (equal rows
//! merged, similar rows by their difference); Paolo Boldi, Sebastiano Vigna, *The WebGraph framework I: compression techniques*, 2004 (a
//! window of earlier rows to refer to, gaps and runs). Deviations: lossless only (van de Panne and Stewart also merge nearly equal rows,
//! which would break both bounds); the difference is an exclusive or, so that a chain of references is resolved by exclusive ors in any
//! order without building intermediate rows; references stay within a block, so that reading one row costs one block.

use super::flip;
use crate::BitMatrix;
use crate::file::bytes::Cursor;
use crate::file::error::FileError;
use crate::file::format::SectionId;
use crate::file::frame;
use std::borrow::Cow;

/// Forms of a row's difference to its reference: the shortest is used.
#[cfg(feature = "bake")]
pub(in crate::file) const SPARSE: u32 = 0;
pub(in crate::file) const DENSE: u32 = 1;
pub(in crate::file) const RUNS: u32 = 2;

/// Fewest and most rows of a block.
const BLOCK_ROWS: [usize; 2] = [1, 4096];
/// Largest overhead of a row in its block, bytes.
const ROW_OVERHEAD: usize = 16;

/// Bytes of the bits of a row.
pub(in crate::file) fn dense_bytes(columns: usize) -> usize {
    columns.div_ceil(8)
}

/// A coded matrix.
#[derive(Clone, Debug)]
pub(super) struct Differences<'a> {
    section: SectionId,
    columns: usize,
    /// Matrix row to distinct row.
    map: Vec<u32>,
    blocks: Vec<Block<'a>>,
}

#[derive(Clone, Debug)]
struct Block<'a> {
    packed: Packed<'a>,
    rows: usize,
}

/// Bytes compressed by zstd if they are fewer than the decoded length.
#[derive(Clone, Debug)]
struct Packed<'a> {
    stored: &'a [u8],
    decoded: usize,
}

impl Packed<'_> {
    fn unpack(&self, section: SectionId) -> Result<Cow<'_, [u8]>, FileError> {
        if self.stored.len() == self.decoded {
            return Ok(Cow::Borrowed(self.stored));
        }
        match frame::decompress(self.stored, self.decoded) {
            Ok(bytes) => Ok(Cow::Owned(bytes)),
            Err(_) => Err(FileError::Malformed {
                section,
                offset: 0,
                what: format!("a block that doesn't decompress to {} bytes", self.decoded),
            }),
        }
    }
}

impl<'a> Differences<'a> {
    /// Reads the head.
    pub fn new(c: &mut Cursor<'a>, rows: usize, columns: usize) -> Result<Self, FileError> {
        let unique = c.varint()? as usize;
        if unique == 0 || unique > rows {
            return Err(c.error(format!("{unique} distinct rows of {rows}")));
        }
        let block_rows = c.varint()? as usize;
        if !(BLOCK_ROWS[0]..=BLOCK_ROWS[1]).contains(&block_rows) {
            return Err(c.error(format!("blocks of {block_rows} rows")));
        }
        let rows_of = |block: usize| block_rows.min(unique - block * block_rows);
        let mut part = |most: usize| -> Result<[usize; 2], FileError> {
            let (stored, decoded) = (c.varint()? as usize, c.varint()? as usize);
            if stored > decoded || decoded > most {
                return Err(c.error(format!("a part of {stored} bytes that decodes to {decoded}, at most {most} expected")));
            }
            Ok([stored, decoded])
        };
        let map_lengths = part(rows.saturating_mul(5))?;
        let count = unique.div_ceil(block_rows);
        let mut lengths = Vec::new();
        for block in 0..count {
            lengths.push(part(rows_of(block).saturating_mul(dense_bytes(columns) + ROW_OVERHEAD))?);
        }
        let map = Packed { stored: c.take(map_lengths[0])?, decoded: map_lengths[1] };
        let mut blocks = Vec::new();
        for (block, [stored, decoded]) in lengths.into_iter().enumerate() {
            blocks.push(Block { packed: Packed { stored: c.take(stored)?, decoded }, rows: rows_of(block) });
        }
        let map = read_map(c.section(), &map.unpack(c.section())?, rows, unique)?;
        Ok(Self { section: c.section(), columns, map, blocks })
    }

    /// Largest decompressed size of a block, bytes.
    pub fn block_bytes(&self) -> usize {
        self.blocks.iter().map(|b| b.packed.decoded).max().unwrap_or(0)
    }

    /// All rows. Checks every block to its end.
    pub fn matrix(&self) -> Result<BitMatrix, FileError> {
        let mut out = BitMatrix::new(self.map.len(), self.columns);
        // Distinct rows are numbered by first appearance, so the map gives the place of each.
        let mut first = Vec::new();
        for (row, &unique) in self.map.iter().enumerate() {
            if unique as usize == first.len() {
                first.push(row);
            }
        }
        let mut done = 0;
        let mut words = vec![0; self.columns.div_ceil(64)];
        for block in &self.blocks {
            let bytes = block.packed.unpack(self.section)?;
            let mut c = Cursor::new(self.section, &bytes);
            for (i, mut row) in rows_of(&mut c, block.rows)?.into_iter().enumerate() {
                words.fill(0);
                let back = difference(&mut row, i, self.columns, &mut words)?;
                row.end()?;
                if back > 0 {
                    let reference = out.row(first[done + i - back]);
                    words.iter_mut().zip(reference).for_each(|(w, r)| *w ^= r);
                }
                out.assign_row(first[done + i], &words);
            }
            c.end()?;
            done += block.rows;
        }
        for (row, &unique) in self.map.iter().enumerate() {
            let source = first[unique as usize];
            if source != row {
                words.copy_from_slice(out.row(source));
                out.assign_row(row, &words);
            }
        }
        Ok(out)
    }
}

/// Matrix rows to distinct rows.
fn read_map(section: SectionId, bytes: &[u8], rows: usize, unique: usize) -> Result<Vec<u32>, FileError> {
    let mut c = Cursor::new(section, bytes);
    let (mut map, mut seen) = (Vec::with_capacity(rows), 0u32);
    for _ in 0..rows {
        match c.varint()? {
            0 => {
                map.push(seen);
                seen += 1;
            }
            n if n <= seen => map.push(n - 1),
            n => return Err(c.error(format!("a copy of distinct row {}, of which {seen} came before", n - 1))),
        }
    }
    if seen as usize != unique {
        return Err(c.error(format!("{seen} distinct rows, {unique} declared")));
    }
    c.end()?;
    Ok(map)
}

/// The rows of a block.
fn rows_of<'b>(c: &mut Cursor<'b>, rows: usize) -> Result<Vec<Cursor<'b>>, FileError> {
    let mut lengths = Vec::with_capacity(rows);
    for _ in 0..rows {
        lengths.push(c.varint()? as usize);
    }
    lengths.into_iter().map(|length| c.part(length)).collect()
}

/// Reads the `i`-th row of a block: flips its difference in `out`, and returns the distance to its reference in rows (0: none).
fn difference(c: &mut Cursor<'_>, i: usize, columns: usize, out: &mut [u64]) -> Result<usize, FileError> {
    let head = c.varint()?;
    let (form, back) = (head % 3, (head / 3) as usize);
    if back > i {
        return Err(c.error(format!("a reference {back} rows back from row {i} of a block")));
    }
    if form == DENSE {
        let bytes = c.take(dense_bytes(columns))?;
        if !columns.is_multiple_of(8) && bytes.last().is_some_and(|b| b >> (columns % 8) != 0) {
            return Err(c.error("bits beyond the last column"));
        }
        for (word, bytes) in out.iter_mut().zip(bytes.chunks(8)) {
            let mut whole = [0; 8];
            whole[..bytes.len()].copy_from_slice(bytes);
            *word ^= u64::from_le_bytes(whole);
        }
        return Ok(back);
    }
    let mut next = 0;
    for k in 0..c.varint()? {
        // Runs are separated by at least one clear bit, which is not counted.
        let start = next + u64::from(c.varint()?) + u64::from(form == RUNS && k > 0);
        let end = start + 1 + if form == RUNS { u64::from(c.varint()?) } else { 0 };
        if end > columns as u64 {
            return Err(c.error(format!("column {}, of which there are {columns}", end - 1)));
        }
        flip(out, start as usize, end as usize);
        next = end;
    }
    Ok(back)
}
