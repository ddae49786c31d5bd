//! Writes rows as differences; [`crate::file::rows::differences`] reads them and names the papers.

use super::container::compressed;
use super::put::Put;
use crate::bits::span;
use crate::file::rows::differences::{DENSE, RUNS, SPARSE, dense_bytes};
use crate::parallel;
use crate::{BitMatrix, bits};
use std::collections::HashMap;
use std::ops::Range;

/// Previous rows tried as references: the time is proportional to it, and cells with similar views usually have close numbers.
const WINDOW: usize = 64;
/// Most bytes of a compressed block: reading a row decompresses all of it.
const BLOCK_BYTES: usize = 4 << 10;
/// Rows of an uncompressed block.
const LONG: usize = 256;
/// Most steps of a row that serves as a reference; a byte is one step, and eight bytes of plain bits are one.
const STEPS: usize = 2048;
/// Encodes a matrix: distinct rows once, in blocks.
pub(super) fn encode(matrix: &BitMatrix, out: &mut Vec<u8>) {
    // Equal rows once: 0 is a new row, n + 1 is a copy of the n-th distinct row.
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
    let (block_rows, blocks) = blocks(&unique, matrix.columns());
    let map = Pack::new(map, true);
    out.varint(unique.len() as u32);
    out.varint(block_rows as u32);
    for part in std::iter::once(&map).chain(&blocks) {
        out.varint(part.stored().len() as u32);
        out.varint(part.plain.len() as u32);
    }
    for part in std::iter::once(&map).chain(&blocks) {
        out.bytes(part.stored());
    }
}

/// Bytes, and their zstd frame if that is shorter.
struct Pack {
    plain: Vec<u8>,
    zstd: Option<Vec<u8>>,
}

impl Pack {
    fn new(plain: Vec<u8>, compress: bool) -> Self {
        let zstd = if compress { compressed(&plain) } else { None };
        Self { plain, zstd }
    }

    fn stored(&self) -> &[u8] {
        self.zstd.as_ref().unwrap_or(&self.plain)
    }
}

/// The number of rows per block, and the blocks: few rows with compression, or many without, whichever is shorter.
fn blocks(rows: &[&[u64]], columns: usize) -> (usize, Vec<Pack>) {
    let of = |block_rows: usize| -> Vec<Pack> {
        let blocks: Vec<&[&[u64]]> = rows.chunks(block_rows).collect();
        parallel::map(&blocks, |rows| {
            let block = encode_block(rows, columns);
            let short = block.len() <= BLOCK_BYTES;
            Pack::new(block, short)
        })
    };
    let is_long = |blocks: &[Pack]| blocks.iter().any(|block| block.plain.len() > BLOCK_BYTES);
    let (mut short, mut short_blocks) = (WINDOW, of(WINDOW));
    while short > 1 && is_long(&short_blocks) {
        short = short * 3 / 4;
        short_blocks = of(short);
    }
    let long_blocks = of(LONG);
    let bytes = |blocks: &[Pack]| blocks.iter().map(|block| block.stored().len() + 4).sum::<usize>();
    if bytes(&long_blocks) < bytes(&short_blocks) { (LONG, long_blocks) } else { (short, short_blocks) }
}

/// The length of each row, then the rows: the form, the reference, and the difference to that.
fn encode_block(rows: &[&[u64]], columns: usize) -> Vec<u8> {
    let (mut lengths, mut out) = (Vec::new(), Vec::new());
    let (mut sparse, mut runs) = (Vec::new(), Vec::new());
    let mut difference = vec![0u64; columns.div_ceil(64)];
    let zeros = difference.clone();
    let spans: Vec<Range<usize>> = rows.iter().map(|row| span(row)).collect();
    // Steps to read each row, with all its references.
    let mut steps: Vec<usize> = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        // The nearest of the cheapest; 0 is no reference.
        let mut best = (cost(row, &zeros, &spans[i], u32::MAX), 0);
        for back in (1..=i.min(WINDOW)).filter(|back| steps[i - back] < STEPS) {
            let other = &spans[i - back];
            let words = spans[i].start.min(other.start)..spans[i].end.max(other.end);
            let cost = cost(row, rows[i - back], &words, best.0);
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
        let start = out.len();
        out.varint(form + 3 * best.1 as u32);
        match form {
            SPARSE => out.bytes(&sparse),
            RUNS => out.bytes(&runs),
            _ => out.extend(difference.iter().flat_map(|w| w.to_le_bytes()).take(length)),
        }
        lengths.varint((out.len() - start) as u32);
        let own = if form == DENSE { length / 8 } else { length };
        steps.push(own + if best.1 == 0 { 0 } else { steps[i - best.1] });
    }
    lengths.extend(out);
    lengths
}

/// Approximate bytes of the difference of two rows that are equal outside `words`: set bits, or twice the runs; stops above `limit`.
fn cost(a: &[u64], b: &[u64], words: &Range<usize>, limit: u32) -> u32 {
    let (mut ones, mut edges, mut carry) = (0, 0, 0);
    // A run may end at the start of the next word.
    let words = words.start..a.len().min(words.end + 1);
    for (a, b) in a[words.clone()].iter().zip(&b[words]) {
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

/// The number of set bits, then for each the number of clear bits since the previous one.
fn put_sparse(words: &[u64], out: &mut Vec<u8>) {
    out.varint(bits::ones(words).count() as u32);
    let mut next = 0;
    for one in bits::ones(words) {
        out.varint((one - next) as u32);
        next = one + 1;
    }
}

/// The number of runs of set bits, then for each the clear bits since the previous one (minus one, except for the first) and its length
/// minus one.
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
