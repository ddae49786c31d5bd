//! Rows coded bit by bit with a model of what they are expected to hold, in blocks of a few rows.
//!
//! Based on: Glen G. Langdon, Jorma Rissanen, *Compression of black-white images with arithmetic coding*, 1981 (adaptive
//! contexts of bits nearby; here a bit's neighbours are the bits of a row much like its own, and what [`Guide`] knows);
//! Boldi and Vigna, *WebGraph*, 2004 (references among the rows before).
//! Deviations: models start anew with each block, and a block ends where reading one of its rows, with all that the row refers
//! to, would take more steps than [`STEPS`].

use super::coder::{Coder, Decoder};
use super::guide::{Guide, Known, Models, Scratch};
use crate::BitMatrix;
use crate::bits::ones;
use crate::file::bytes::Cursor;
use crate::file::error::FileError;
use crate::file::format::SectionId;
use std::collections::HashMap;

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

/// A block on its way to be read.
struct Reading<'a> {
    decoder: Decoder<'a>,
    models: Models,
    first: usize,
    /// The block's rows; rows not yet read hold what is known of them.
    rows: BitMatrix,
    /// How many of them have been read.
    done: usize,
    /// How many rows back the reference of the next row is, where that has been read.
    back: Option<usize>,
}

impl Reading<'_> {
    fn back(&mut self) -> usize {
        let Self { decoder, models, .. } = self;
        *self.back.get_or_insert_with(|| decoder.number(&mut models.back, 0) as usize)
    }
}

impl<'a> Modelled<'a> {
    /// Reads what stands before the blocks.
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

    /// Which block a row is in.
    fn block_of(&self, row: usize) -> usize {
        self.blocks.partition_point(|&(first, _)| first <= row) - 1
    }

    fn open(&self, block: usize, guide: &Guide) -> Reading<'a> {
        let (first, bytes) = self.blocks[block];
        let end = self.blocks.get(block + 1).map_or(self.rows, |&(first, _)| first);
        let rows = BitMatrix::new(end - first, self.columns);
        Reading { decoder: Decoder::new(bytes), models: Models::new(guide), first, rows, done: 0, back: None }
    }

    /// Reads the next row of a block. The row that it refers to is `reference`, where that is in another block.
    fn next(
        &self,
        guide: &Guide,
        reading: &mut Reading<'_>,
        reference: Option<&[u64]>,
        scratch: &mut Scratch,
    ) -> Result<(), FileError> {
        let back = reading.back();
        let (first, row) = (reading.first, reading.first + reading.done);
        let given = if self.symmetric { [first, row] } else { [0, 0] };
        let mut out = reading.rows.row(reading.done).to_vec();
        let own = || reading.done.checked_sub(back).map(|row| reading.rows.row(row));
        let reference = if back == 0 { None } else { reference.or_else(own) };
        let known = Known { row, columns: self.columns, reference, given };
        let walk = guide.walk(&mut reading.decoder, &mut reading.models, known, None, &mut out, scratch);
        walk.map_err(|what| self.error(what))?;
        reading.rows.row_mut(reading.done).copy_from_slice(&out);
        if self.symmetric {
            // What this row says of later ones.
            let end = first + reading.rows.rows();
            for column in ones(&out).filter(|column| (row + 1..end).contains(column)) {
                reading.rows.set(column - first, row);
            }
        }
        (reading.done, reading.back) = (reading.done + 1, None);
        Ok(())
    }

    /// The row that the next row of a block refers to, itself if it refers to none.
    fn reference(&self, reading: &mut Reading<'_>) -> Result<usize, FileError> {
        let (row, back) = (reading.first + reading.done, reading.back());
        row.checked_sub(back).ok_or_else(|| self.error(format!("a reference {back} rows back from row {row}")))
    }

    /// One row: reads what it refers to, and of each block only up to there.
    pub fn row(&self, guide: &Guide, row: usize) -> Result<Vec<u64>, FileError> {
        let mut readings: HashMap<usize, Reading<'_>> = HashMap::new();
        let mut scratch = Scratch::default();
        // Each is before the one that needs it.
        let mut wanted = vec![row];
        while let Some(&row) = wanted.last() {
            let block = self.block_of(row);
            let mut reading = readings.remove(&block).unwrap_or_else(|| self.open(block, guide));
            while reading.done <= row - reading.first {
                let reference = self.reference(&mut reading)?;
                let other = readings.get(&self.block_of(reference)).filter(|other| reference - other.first < other.done);
                if reference < reading.first && other.is_none() {
                    wanted.push(reference);
                    break;
                }
                self.next(guide, &mut reading, other.map(|other| other.rows.row(reference - other.first)), &mut scratch)?;
            }
            if reading.done > row - reading.first {
                wanted.pop();
            }
            readings.insert(block, reading);
        }
        let reading = &readings[&self.block_of(row)];
        Ok(reading.rows.row(row - reading.first).to_vec())
    }

    /// All rows. Every block must end where its rows do.
    pub fn matrix(&self, guide: &Guide) -> Result<BitMatrix, FileError> {
        let mut out = BitMatrix::new(self.rows, self.columns);
        let mut scratch = Scratch::default();
        for block in 0..self.blocks.len() {
            let mut reading = self.open(block, guide);
            for i in 0..reading.rows.rows() {
                let reference = self.reference(&mut reading)?;
                let other = (reference < reading.first).then(|| out.row(reference));
                self.next(guide, &mut reading, other, &mut scratch)?;
                out.assign_row(reading.first + i, reading.rows.row(i));
            }
            if !reading.decoder.is_at_end() {
                return Err(self.error(format!("block {block} doesn't end with its last row")));
            }
        }
        Ok(out)
    }
}
