//! Visibility matrices in few bytes.
//!
//! A matrix is coded bit by bit with a context model ([`guide`], [`coder`]); a row may refer to a similar earlier one. docs/format.md
//! describes the bytes. The same matrix gives the same bytes on any number of threads.
//!
//! Based on: Glen G. Langdon, Jorma Rissanen, *Compression of black-white images with arithmetic coding*, 1981 (adaptive contexts of bits
//! nearby; here a bit's neighbours are the bits of the reference, and what [`Guide`] knows); Paolo Boldi, Sebastiano Vigna, *The WebGraph
//! framework I: compression techniques*, 2004 (references among the rows before); Michiel van de Panne, A. James Stewart, *Effective
//! compression techniques for precomputed visibility*, 1999 (equal rows are stored once). Deviation: lossless, since merging rows that are
//! nearly equal would break either side of the guarantee.

pub(super) mod arithmetic;
pub(super) mod row;

pub(super) use row::Guide;

use super::bytes::Cursor;
use super::error::Fault;
#[cfg(feature = "bake")]
use super::error::FileError;
use super::format::SectionId;
use crate::BitMatrix;
use crate::math::bits::ones;
use arithmetic::Decoder;
use row::{Known, Models, Walker};

/// First byte of a matrix without a set bit.
#[cfg(feature = "bake")]
pub(super) const ZEROS: usize = 0;
/// First byte of a matrix with every bit set.
pub(super) const ONES: usize = 1;
/// First byte of a coded matrix.
pub(super) const CODED: usize = 2;
/// Flag: the matrix is symmetric; each pair is coded once.
pub(super) const SYMMETRIC: usize = 1;
/// Flag: coded without a guide, because walking it would take too long.
pub(super) const UNGUIDED: usize = 2;

/// Zero-order entropy of `pairs` bits of which `set` are set, bits per pair: the least cost of coding each bit alone. 0 without pairs.
#[cfg(feature = "bake")]
pub fn entropy_bits_per_pair(set: u64, pairs: u64) -> f64 {
    [set, pairs - set].into_iter().filter(|&n| n > 0).map(|n| n as f64 / pairs as f64).map(|p| -p * p.log2()).sum()
}

/// Decodes the output of [`encode_rows`](super::encode_rows). `rows` and `columns` are the expected shape; `section` is for errors.
///
/// Takes the memory of the matrix and of some rows.
#[cfg(feature = "bake")]
pub fn decode_rows(section: SectionId, bytes: &[u8], rows: usize, columns: usize) -> Result<BitMatrix, FileError> {
    decode_guided(section, bytes, rows, columns, &Guide::Plain).map_err(|fault| *fault)
}

/// Upper bound of the memory of decoding, bytes.
pub(super) fn matrix_bytes(rows: usize, columns: usize) -> u64 {
    (columns.div_ceil(64) as u64 * 8).saturating_mul(rows as u64 + 8)
}

/// The same with a context model: `guide` has as many cells as there are rows, and as many objects as there are columns.
pub(super) fn decode_guided(
    section: SectionId,
    bytes: &[u8],
    rows: usize,
    columns: usize,
    guide: &Guide<'_>,
) -> Result<BitMatrix, Fault> {
    let mut c = Cursor::new(section, bytes);
    for (name, expected) in [("rows", rows), ("columns", columns)] {
        let found = c.varint()?;
        if found as usize != expected {
            return Err(c.error(format!("a matrix of {found} {name}, {expected} expected")));
        }
    }
    let code = c.code(3, "matrix code")?;
    if code == CODED {
        return coded(&mut c, rows, columns, guide);
    }
    c.end()?;
    let mut out = BitMatrix::new(rows, columns);
    if code == ONES {
        let mut all = vec![u64::MAX; columns.div_ceil(64)];
        if let Some(last) = all.last_mut() {
            *last >>= (64 - columns % 64) % 64;
        }
        (0..rows).for_each(|row| out.assign_row(row, &all));
    }
    Ok(out)
}

fn coded(c: &mut Cursor<'_>, rows: usize, columns: usize, guide: &Guide<'_>) -> Result<BitMatrix, Fault> {
    let flags = c.code(4, "flags")?;
    let is_symmetric = flags & SYMMETRIC != 0;
    if is_symmetric && !matches!(guide, Guide::Cells(_)) {
        return Err(c.error("a symmetric matrix, not of cells"));
    }
    let guide = if flags & UNGUIDED == 0 { guide } else { &Guide::Plain };
    let (mut decoder, mut models, mut walker) = (Decoder::new(c.rest()), Models::new(guide), Walker::new(guide));
    let mut out = BitMatrix::new(rows, columns);
    let mut bits = vec![0; columns.div_ceil(64)];
    for row in 0..rows {
        let given = if is_symmetric { row } else { 0 };
        bits.copy_from_slice(out.row(row));
        let known = Known { row, columns, given, above: &out };
        walker.code(&mut decoder, &mut models, known, None, &mut bits).map_err(|what| c.error(what))?;
        out.assign_row(row, &bits);
        if is_symmetric {
            ones(&bits).filter(|&column| column > row).for_each(|column| {
                out.set(column, row);
            });
        }
    }
    match decoder.is_at_end() {
        true => Ok(out),
        false => Err(c.error("a matrix that doesn't end with its last row")),
    }
}
