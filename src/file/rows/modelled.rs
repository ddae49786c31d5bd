//! Rows coded bit by bit with a context model, in blocks of a few rows.
//!
//! Based on: Glen G. Langdon, Jorma Rissanen, *Compression of black-white images with arithmetic coding*, 1981 (adaptive contexts of
//! adjacent bits; here the context is a similar row and a [`Guide`]); Boldi and Vigna, *WebGraph*, 2004 (references to previous rows).
//! Deviations: models restart with each block, and a block ends where reading a row, with all its references, would take more than
//! [`STEPS`] steps.

use super::coder::{Coder, Decoder};
use super::guide::{Guide, Known, Models, Scratch};
use crate::BitMatrix;
use crate::bits::ones;
use crate::file::bytes::Cursor;
use crate::file::error::FileError;
use crate::file::format::SectionId;

/// A coded matrix.
#[derive(Clone, Debug)]
pub(super) struct Modelled<'a> {
    section: SectionId,
    columns: usize,
    symmetric: bool,
    /// First row and bytes of each block.
    blocks: Vec<(usize, &'a [u8])>,
    rows: usize,
}

/// The state of reading a block.
struct Reading<'a> {
    decoder: Decoder<'a>,
    models: Models,
    first: usize,
    /// The block's rows; unread rows hold their known bits.
    rows: BitMatrix,
    /// Number of rows read.
    done: usize,
}

impl<'a> Modelled<'a> {
    /// Reads the head.
    pub fn new(c: &mut Cursor<'a>, rows: usize, columns: usize, guide: &Guide) -> Result<Self, FileError> {
        let symmetric = c.code(2, "a flag")? == 1;
        if symmetric && !matches!(guide, Guide::Cells(_)) {
            return Err(c.error("a symmetric matrix, not of cells"));
        }
        let (mut first, mut lengths) = (0, Vec::new());
        while first < rows {
            let (count, length) = (c.varint()? as usize, c.varint()? as usize);
            if count == 0 || count > rows - first {
                return Err(c.error(format!("a block of {count} rows from row {first} of {rows}")));
            }
            lengths.push((first, length));
            first += count;
        }
        let blocks = lengths.into_iter().map(|(first, length)| c.take(length).map(|bytes| (first, bytes)));
        let blocks = blocks.collect::<Result<_, _>>()?;
        Ok(Self { section: c.section(), rows, columns, symmetric, blocks })
    }

    fn error(&self, what: String) -> FileError {
        FileError::Malformed { section: self.section, offset: 0, what }
    }

    fn open(&self, block: usize, guide: &Guide) -> Reading<'a> {
        let (first, bytes) = self.blocks[block];
        let end = self.blocks.get(block + 1).map_or(self.rows, |&(first, _)| first);
        let rows = BitMatrix::new(end - first, self.columns);
        Reading { decoder: Decoder::new(bytes), models: Models::new(guide), first, rows, done: 0 }
    }

    /// Reads the next row of a block. `above` are the rows of previous blocks.
    fn next(
        &self,
        guide: &Guide,
        reading: &mut Reading<'_>,
        above: &BitMatrix,
        scratch: &mut Scratch,
    ) -> Result<(), FileError> {
        let (first, row) = (reading.first, reading.first + reading.done);
        let back = reading.decoder.number(&mut reading.models.back, 0) as usize;
        let too_far = || self.error(format!("a reference {back} rows back from row {row}"));
        let reference = row.checked_sub(back).ok_or_else(too_far)?;
        let mut out = reading.rows.row(reading.done).to_vec();
        let reference = match reference {
            _ if back == 0 => None,
            other if other < first => Some(above.row(other)),
            own => Some(reading.rows.row(own - first)),
        };
        let given = if self.symmetric { [first, row] } else { [0, 0] };
        let known = Known { row, columns: self.columns, reference, given };
        let walk = guide.walk(&mut reading.decoder, &mut reading.models, known, None, &mut out, scratch);
        walk.map_err(|what| self.error(what))?;
        reading.rows.row_mut(reading.done).copy_from_slice(&out);
        if self.symmetric {
            // By symmetry, this row gives bits of later ones.
            let end = first + reading.rows.rows();
            for column in ones(&out).filter(|column| (row + 1..end).contains(column)) {
                reading.rows.set(column - first, row);
            }
        }
        reading.done += 1;
        Ok(())
    }

    /// All rows. Every block must end with its rows.
    pub fn matrix(&self, guide: &Guide) -> Result<BitMatrix, FileError> {
        let mut out = BitMatrix::new(self.rows, self.columns);
        let mut scratch = Scratch::default();
        for block in 0..self.blocks.len() {
            let mut reading = self.open(block, guide);
            for i in 0..reading.rows.rows() {
                self.next(guide, &mut reading, &out, &mut scratch)?;
                out.assign_row(reading.first + i, reading.rows.row(i));
            }
            if !reading.decoder.is_at_end() {
                return Err(self.error(format!("block {block} doesn't end with its last row")));
            }
        }
        Ok(out)
    }
}
