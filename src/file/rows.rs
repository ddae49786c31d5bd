//! Visibility matrices in few bytes, any row of which can be read alone.
//!
//! Based on: Michiel van de Panne, A. James Stewart, *Effective compression techniques for precomputed visibility*, 1999
//! (equal rows merged, similar rows by their difference); Paolo Boldi, Sebastiano Vigna, *The WebGraph framework I: compression
//! techniques*, 2004 (a window of earlier rows to refer to, gaps and runs).
//! Deviations: lossless only (van de Panne and Stewart also merge rows that are nearly equal, which would break either side of
//! the guarantee); the difference is an exclusive or, so that a chain of references is undone by exclusive ors in any order and
//! no row of the chain is built; references stay within a block, so that one row costs one block.
//!
//! The bytes are drawn in docs/format.md. The same matrix gives the same bytes on any number of threads.

use super::bytes::{Cursor, Put};
use super::error::FileError;
use super::format::{SectionId, compressed};
use crate::{BitMatrix, bits};
use rayon::prelude::*;
use std::collections::HashMap;

/// First byte of a matrix without a set bit.
const ZEROS: usize = 0;
/// First byte of a matrix with every bit set.
const ONES: usize = 1;
/// First byte of any other.
const CODED: usize = 2;

/// How a row's difference to its reference is written: the shortest form is taken.
const SPARSE: u32 = 0;
const DENSE: u32 = 1;
const RUNS: u32 = 2;

/// Earlier rows that are tried as references: time grows with it, and cells that see much the same are mostly numbered close by.
const WINDOW: usize = 64;
/// Bits of unpacked rows in one block, where [`BLOCK_ROWS`] allows it.
const BLOCK_BITS: usize = 1 << 21;
/// Fewest and most rows of a block.
const BLOCK_ROWS: [usize; 2] = [32, 4096];
/// Bytes that a row may take in its block beyond those of its bits.
const ROW_OVERHEAD: usize = 16;

/// Bytes of the bits of a row.
fn dense_bytes(columns: usize) -> usize {
    columns.div_ceil(8)
}

/// Zero-order entropy of `pairs` bits of which `set` are set, bits a pair: what coding each bit alone costs at least. 0 for no
/// pairs.
pub fn entropy_bits_per_pair(set: u64, pairs: u64) -> f64 {
    [set, pairs - set].into_iter().filter(|&n| n > 0).map(|n| n as f64 / pairs as f64).map(|p| -p * p.log2()).sum()
}

/// Codes a matrix of fewer than 2^27 rows and columns.
pub fn encode_rows(matrix: &BitMatrix) -> Vec<u8> {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    let mut out = Vec::new();
    out.varint(rows as u32);
    out.varint(columns as u32);
    match matrix.count_ones() {
        0 => out.u8(ZEROS as u8),
        n if n == rows as u64 * columns as u64 => out.u8(ONES as u8),
        _ => {
            out.u8(CODED as u8);
            encode(matrix, &mut out);
        }
    }
    out
}

fn encode(matrix: &BitMatrix, out: &mut Vec<u8>) {
    // Equal rows once: 0 stands for a row not seen before, n + 1 for a copy of the n-th such row.
    let mut seen: HashMap<&[u64], u32> = HashMap::new();
    let (mut unique, mut map) = (Vec::new(), Vec::new());
    for row in 0..matrix.rows() {
        let next = unique.len() as u32;
        match *seen.entry(matrix.row(row)).or_insert(next) {
            first if first == next => {
                unique.push(matrix.row(row));
                map.varint(0);
            }
            copy => map.varint(copy + 1),
        }
    }
    let block_rows = (BLOCK_BITS / matrix.columns()).clamp(BLOCK_ROWS[0], BLOCK_ROWS[1]);
    let blocks: Vec<Vec<u8>> = unique.par_chunks(block_rows).map(|rows| encode_block(rows, matrix.columns())).collect();

    out.varint(unique.len() as u32);
    out.varint(block_rows as u32);
    let parts: Vec<(Option<Vec<u8>>, &Vec<u8>)> =
        std::iter::once(&map).chain(&blocks).map(|part| (compressed(part), part)).collect();
    for (zstd, part) in &parts {
        out.varint(zstd.as_ref().unwrap_or(part).len() as u32);
        out.varint(part.len() as u32);
    }
    for (zstd, part) in &parts {
        out.bytes(zstd.as_ref().unwrap_or(part));
    }
}

/// Rows one after the other, each with its form, its reference and its difference to that.
fn encode_block(rows: &[&[u64]], columns: usize) -> Vec<u8> {
    let mut out = Vec::new();
    let (mut sparse, mut runs) = (Vec::new(), Vec::new());
    let mut difference = vec![0u64; columns.div_ceil(64)];
    let zeros = difference.clone();
    for (i, row) in rows.iter().enumerate() {
        // The nearest of the cheapest; 0 rows back is no reference.
        let mut best = (cost(row, &zeros, u32::MAX), 0);
        for back in 1..=i.min(WINDOW) {
            let cost = cost(row, rows[i - back], best.0);
            if cost < best.0 {
                best = (cost, back);
            }
        }
        let reference = if best.1 == 0 { &zeros[..] } else { rows[i - best.1] };
        for (d, (a, b)) in difference.iter_mut().zip(row.iter().zip(reference)) {
            *d = a ^ b;
        }
        sparse.clear();
        put_sparse(&difference, &mut sparse);
        runs.clear();
        put_runs(&difference, &mut runs);
        let (form, length) = [(SPARSE, sparse.len()), (DENSE, dense_bytes(columns)), (RUNS, runs.len())]
            .into_iter()
            .min_by_key(|&(_, length)| length)
            .unwrap_or((DENSE, 0));
        out.varint(form + 3 * best.1 as u32);
        match form {
            SPARSE => out.bytes(&sparse),
            RUNS => out.bytes(&runs),
            _ => out.extend(difference.iter().flat_map(|w| w.to_le_bytes()).take(length)),
        }
    }
    out
}

/// Bytes, about, of the difference of two rows: set bits, or twice the runs; given up above `limit`.
fn cost(a: &[u64], b: &[u64], limit: u32) -> u32 {
    let (mut ones, mut edges, mut carry) = (0, 0, 0);
    for (a, b) in a.iter().zip(b) {
        let d = a ^ b;
        ones += d.count_ones();
        edges += (d ^ (d << 1 | carry)).count_ones();
        carry = d >> 63;
        if ones.min(edges) > limit {
            break;
        }
    }
    ones.min(edges)
}

/// The number of set bits, then before each the number of clear bits since the one before.
fn put_sparse(words: &[u64], out: &mut Vec<u8>) {
    out.varint(bits::ones(words).count() as u32);
    let mut next = 0;
    for one in bits::ones(words) {
        out.varint((one - next) as u32);
        next = one + 1;
    }
}

/// The number of runs of set bits, then for each the clear bits since the one before (less one, but for the first) and its
/// length less one.
fn put_runs(words: &[u64], out: &mut Vec<u8>) {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for one in bits::ones(words) {
        match runs.last_mut() {
            Some([_, end]) if *end == one => *end += 1,
            _ => runs.push([one, one + 1]),
        }
    }
    out.varint(runs.len() as u32);
    let mut next = 0;
    for [start, end] in runs {
        out.varint((start - next) as u32);
        out.varint((end - start - 1) as u32);
        next = end + 1;
    }
}

/// Reads a coded matrix, row by row in any order, or all of it.
#[derive(Clone, Debug)]
pub struct RowReader<'a> {
    section: SectionId,
    rows: usize,
    columns: usize,
    code: Code<'a>,
}

#[derive(Clone, Debug)]
enum Code<'a> {
    Uniform(bool),
    Coded {
        /// Matrix row to distinct row.
        map: Vec<u32>,
        block_rows: usize,
        blocks: Vec<Block<'a>>,
    },
}

#[derive(Clone, Debug)]
struct Block<'a> {
    packed: Packed<'a>,
    rows: usize,
}

/// Bytes that are zstd if they are fewer than what they decode to.
#[derive(Clone, Debug)]
struct Packed<'a> {
    stored: &'a [u8],
    decoded: usize,
}

impl Packed<'_> {
    fn unpack(&self, section: SectionId) -> Result<Vec<u8>, FileError> {
        if self.stored.len() == self.decoded {
            return Ok(self.stored.to_vec());
        }
        match zstd::bulk::decompress(self.stored, self.decoded) {
            Ok(bytes) if bytes.len() == self.decoded => Ok(bytes),
            _ => Err(FileError::Malformed {
                section,
                offset: 0,
                what: format!("a block that doesn't decompress to {} bytes", self.decoded),
            }),
        }
    }
}

impl<'a> RowReader<'a> {
    /// Reads what stands before the blocks. `rows` and `columns` are what the matrix must have; `section` is for errors.
    ///
    /// Takes 4 bytes of memory a row; a row or a block takes no more than its bits unpacked and 16 bytes a row.
    pub fn new(section: SectionId, bytes: &'a [u8], rows: usize, columns: usize) -> Result<Self, FileError> {
        let mut c = Cursor::new(section, bytes);
        for (name, expected) in [("rows", rows), ("columns", columns)] {
            let found = c.varint()?;
            if found as usize != expected {
                return Err(c.error(format!("a matrix of {found} {name}, {expected} expected")));
            }
        }
        let code = match c.code(3, "matrix code")? {
            ZEROS => Code::Uniform(false),
            ONES => Code::Uniform(true),
            _ => Self::coded(&mut c, rows, columns)?,
        };
        c.end()?;
        Ok(Self { section, rows, columns, code })
    }

    fn coded(c: &mut Cursor<'a>, rows: usize, columns: usize) -> Result<Code<'a>, FileError> {
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
        Ok(Code::Coded { map, block_rows, blocks })
    }

    /// Most bytes that [`RowReader::matrix`] takes.
    pub(super) fn matrix_bytes(&self) -> u64 {
        let block = match &self.code {
            Code::Uniform(_) => 0,
            Code::Coded { blocks, .. } => blocks.iter().map(|b| b.packed.decoded).max().unwrap_or(0) + 4 * self.rows,
        };
        let words = self.columns.div_ceil(64) as u64;
        (words * 8).saturating_mul(self.rows as u64 + 1).saturating_add(block as u64)
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// One row, as words of 64 columns. Decompresses the block that it is in and nothing else.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, row: usize) -> Result<Vec<u64>, FileError> {
        assert!(row < self.rows, "row {row} of {}", self.rows);
        let mut out = vec![0; self.columns.div_ceil(64)];
        match &self.code {
            Code::Uniform(false) => {}
            Code::Uniform(true) => flip(&mut out, 0, self.columns),
            Code::Coded { map, block_rows, blocks } => {
                let unique = map[row] as usize;
                let bytes = blocks[unique / block_rows].packed.unpack(self.section)?;
                let mut c = Cursor::new(self.section, &bytes);
                // Where each row up to this one begins, and what it refers to.
                let mut chain: Vec<(Cursor<'_>, usize)> = Vec::new();
                for i in 0..=unique % block_rows {
                    let start = c.clone();
                    let back = difference(&mut c, i, self.columns, None)?;
                    chain.push((start, back));
                }
                let mut i = unique % block_rows;
                loop {
                    let (start, back) = &mut chain[i];
                    difference(start, i, self.columns, Some(&mut out))?;
                    if *back == 0 {
                        break;
                    }
                    i -= *back;
                }
            }
        }
        Ok(out)
    }

    /// The whole matrix: `rows * columns / 8` bytes, about, which the caller has agreed to. Checks every block to its end.
    pub fn matrix(&self) -> Result<BitMatrix, FileError> {
        let mut out = BitMatrix::new(self.rows, self.columns);
        let (map, blocks) = match &self.code {
            Code::Uniform(false) => return Ok(out),
            Code::Uniform(true) => {
                (0..self.rows).for_each(|row| flip(out.row_mut(row), 0, self.columns));
                return Ok(out);
            }
            Code::Coded { map, blocks, .. } => (map, blocks),
        };
        // Distinct rows are numbered as they first appear, so the map gives where each is built.
        let mut first = Vec::new();
        for (row, &unique) in map.iter().enumerate() {
            if unique as usize == first.len() {
                first.push(row);
            }
        }
        let mut done = 0;
        let mut words = vec![0; self.columns.div_ceil(64)];
        for block in blocks {
            let bytes = block.packed.unpack(self.section)?;
            let mut c = Cursor::new(self.section, &bytes);
            for i in 0..block.rows {
                words.fill(0);
                let back = difference(&mut c, i, self.columns, Some(&mut words))?;
                if back > 0 {
                    let reference = out.row(first[done + i - back]);
                    words.iter_mut().zip(reference).for_each(|(w, r)| *w ^= r);
                }
                out.row_mut(first[done + i]).copy_from_slice(&words);
            }
            c.end()?;
            done += block.rows;
        }
        for (row, &unique) in map.iter().enumerate() {
            let source = first[unique as usize];
            if source != row {
                words.copy_from_slice(out.row(source));
                out.row_mut(row).copy_from_slice(&words);
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

/// Reads the `i`-th row of a block: flips its difference into `out`, if there is one, and says how many rows back its reference
/// is (0: none).
fn difference(c: &mut Cursor<'_>, i: usize, columns: usize, mut out: Option<&mut [u64]>) -> Result<usize, FileError> {
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
        if let Some(out) = out {
            for (k, &byte) in bytes.iter().enumerate() {
                out[k / 8] ^= u64::from(byte) << (k % 8 * 8);
            }
        }
        return Ok(back);
    }
    let mut next = 0;
    for k in 0..c.varint()? {
        // Runs are apart by one clear bit at least, which isn't counted.
        let start = next + u64::from(c.varint()?) + u64::from(form == RUNS && k > 0);
        let end = start + 1 + if form == RUNS { u64::from(c.varint()?) } else { 0 };
        if end > columns as u64 {
            return Err(c.error(format!("column {}, of which there are {columns}", end - 1)));
        }
        if let Some(out) = &mut out {
            flip(out, start as usize, end as usize);
        }
        next = end;
    }
    Ok(back)
}

/// Flips the bits from `start` up to `end`.
fn flip(words: &mut [u64], start: usize, end: usize) {
    if start == end {
        return;
    }
    let (first, last) = (start / 64, (end - 1) / 64);
    for (i, word) in words[first..=last].iter_mut().enumerate() {
        let low = if i == 0 { start % 64 } else { 0 };
        let high = if first + i == last { (end - 1) % 64 } else { 63 };
        *word ^= (u64::MAX >> (63 - high)) & (u64::MAX << low);
    }
}
