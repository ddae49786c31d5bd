//! Compression of visibility matrices.
//!
//! A matrix has the shorter of two codes: bit by bit with a context model ([`modelled`], [`guide`]), if a row takes few enough steps; and
//! by differences and zstd ([`differences`]), which is fast on long rows. docs/format.md describes the bytes. The same matrix gives the
//! same bytes on any number of threads.

pub(super) mod coder;
pub(super) mod differences;
pub(super) mod guide;
pub(super) mod modelled;

pub(super) use guide::Guide;

use super::bytes::Cursor;
use super::error::FileError;
use super::format::SectionId;
use crate::BitMatrix;
use differences::Differences;
use modelled::Modelled;

/// First byte of a matrix without a set bit.
pub(super) const ZEROS: usize = 0;
/// First byte of a matrix with every bit set.
pub(super) const ONES: usize = 1;
/// First byte of a matrix in blocks of differences.
pub(super) const DIFFERENCES: usize = 2;

/// Zero-order entropy of `pairs` bits of which `set` are set, bits per pair: the least cost of coding each bit alone. 0 without pairs.
pub fn entropy_bits_per_pair(set: u64, pairs: u64) -> f64 {
    [set, pairs - set].into_iter().filter(|&n| n > 0).map(|n| n as f64 / pairs as f64).map(|p| -p * p.log2()).sum()
}

/// Reads a coded matrix.
#[derive(Clone, Debug)]
pub struct RowReader<'a> {
    rows: usize,
    columns: usize,
    guide: Guide,
    code: Code<'a>,
}

#[derive(Clone, Debug)]
enum Code<'a> {
    Uniform(bool),
    Differences(Differences<'a>),
    Modelled(Modelled<'a>),
}

impl<'a> RowReader<'a> {
    /// Reads the head of the output of `encode_rows`. `rows` and `columns` are the expected shape; `section` is for errors.
    ///
    /// Takes 16 bytes of memory per row.
    pub fn new(section: SectionId, bytes: &'a [u8], rows: usize, columns: usize) -> Result<Self, FileError> {
        Self::guided(section, bytes, rows, columns, Guide::Plain)
    }

    /// The same for [`encode_guided`]: `guide` has as many cells as there are rows, and as many objects as there are columns.
    pub(super) fn guided(
        section: SectionId,
        bytes: &'a [u8],
        rows: usize,
        columns: usize,
        guide: Guide,
    ) -> Result<Self, FileError> {
        let mut c = Cursor::new(section, bytes);
        for (name, expected) in [("rows", rows), ("columns", columns)] {
            let found = c.varint()?;
            if found as usize != expected {
                return Err(c.error(format!("a matrix of {found} {name}, {expected} expected")));
            }
        }
        let code = match c.code(4, "matrix code")? {
            ZEROS => Code::Uniform(false),
            ONES => Code::Uniform(true),
            DIFFERENCES => Code::Differences(Differences::new(&mut c, rows, columns)?),
            _ => Code::Modelled(Modelled::new(&mut c, rows, columns, &guide)?),
        };
        c.end()?;
        Ok(Self { rows, columns, guide, code })
    }

    /// Upper bound of the memory of [`RowReader::matrix`], bytes.
    pub(super) fn matrix_bytes(&self) -> u64 {
        let rest = match &self.code {
            Code::Uniform(_) => 0,
            Code::Differences(d) => d.block_bytes() + 4 * self.rows,
            Code::Modelled(_) => 128 * self.rows,
        };
        let words = self.columns.div_ceil(64) as u64;
        (words * 8).saturating_mul(self.rows as u64 + 8).saturating_add(rest as u64)
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The whole matrix: about `rows * columns / 8` bytes, which the caller has reserved. Checks every block to its end.
    pub fn matrix(&self) -> Result<BitMatrix, FileError> {
        match &self.code {
            Code::Uniform(bit) => {
                let mut out = BitMatrix::new(self.rows, self.columns);
                let end = if *bit { self.columns } else { 0 };
                (0..self.rows).for_each(|row| flip(out.row_mut(row), 0, end));
                Ok(out)
            }
            Code::Differences(differences) => differences.matrix(),
            Code::Modelled(modelled) => modelled.matrix(&self.guide),
        }
    }
}

/// Flips the bits in `start..end`.
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
