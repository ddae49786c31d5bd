//! Rows coded bit by bit with a model of what they are expected to hold, in blocks of a few rows.
//!
//! Based on: Glen G. Langdon, Jorma Rissanen, *Compression of black-white images with arithmetic coding*, 1981 (adaptive
//! contexts of bits nearby; here a bit's neighbours are the bits of a row much like its own, and what [`Guide`] knows);
//! Boldi and Vigna, *WebGraph*, 2004 (references among the rows before).
//! Deviations: models start anew with each block, and a block ends where reading one of its rows, with all that the row refers
//! to, would take more steps than [`STEPS`].

use super::coder::{Coder, Decoder, Encoder, Meter};
use super::guide::{Guide, Known, Models, STEPS, Scratch};
use crate::BitMatrix;
use crate::bits::{ones, span};
use crate::file::bytes::{Cursor, Put};
use crate::file::error::FileError;
use crate::file::format::SectionId;
use std::collections::HashMap;
use std::ops::Range;

/// Earlier rows that are tried as references.
const WINDOW: usize = 64;
/// How many of those with the fewest different bits are tried in earnest.
const TRIED: usize = 3;

/// A matrix's rows, or `None` where one of them would take too long to read.
pub(super) fn encode(matrix: &BitMatrix, guide: &Guide) -> Option<Vec<u8>> {
    let is_symmetric = || matrix.rows() == matrix.columns() && *matrix == matrix.transposed();
    let symmetric = matches!(guide, Guide::Cells(_)) && is_symmetric();
    let writer = Writer { matrix, guide, symmetric, spans: (0..matrix.rows()).map(|row| span(matrix.row(row))).collect() };
    // Long blocks learn more; short ones can be referred to from other blocks.
    let coded = [STEPS, STEPS / 2].map(|most| writer.blocks(most));
    let bytes = |blocks: &Vec<(usize, Vec<u8>)>| blocks.iter().map(|(_, bytes)| bytes.len() + 2).sum::<usize>();
    let blocks = coded.into_iter().flatten().min_by_key(bytes)?;
    let mut out = vec![u8::from(symmetric)];
    for (rows, bytes) in &blocks {
        out.varint(*rows as u32);
        out.varint(bytes.len() as u32);
    }
    blocks.iter().for_each(|(_, bytes)| out.bytes(bytes));
    Some(out)
}

/// What has been coded of a block, and what is needed to read it.
struct Block {
    first: usize,
    rows: usize,
    encoder: Encoder,
    models: Models,
    needs: Needs,
}

/// The rows that a reader of a row reads, that row among them, ascending, and the steps of each.
type Needs = Vec<(usize, usize)>;

impl Block {
    fn new(first: usize, guide: &Guide) -> Self {
        Self { first, rows: 0, encoder: Encoder::new(), models: Models::new(guide), needs: Vec::new() }
    }
}

struct Writer<'m> {
    matrix: &'m BitMatrix,
    guide: &'m Guide,
    /// Of a symmetric matrix a bit is coded once in a block.
    symmetric: bool,
    /// Of each row.
    spans: Vec<Range<usize>>,
}

impl Writer<'_> {
    /// Rows and bytes of each block; `most`: the steps that a row may take which refers to its own block only.
    fn blocks(&self, most: usize) -> Option<Vec<(usize, Vec<u8>)>> {
        let mut out = Vec::new();
        let mut block = Block::new(0, self.guide);
        // For each row.
        let mut needs: Vec<Needs> = Vec::new();
        for row in 0..self.matrix.rows() {
            let references = self.references(row);
            if !self.append(&mut block, row, &references, &needs, most) {
                if block.rows > 0 {
                    let full = std::mem::replace(&mut block, Block::new(row, self.guide));
                    out.push((full.rows, full.encoder.finish()));
                }
                if !self.append(&mut block, row, &references, &needs, STEPS) {
                    return None;
                }
            }
            needs.push(block.needs.clone());
        }
        out.push((block.rows, block.encoder.finish()));
        Some(out)
    }

    /// How far back the rows before are that differ least, the nearest of equals first.
    fn references(&self, row: usize) -> Vec<usize> {
        let m = self.matrix;
        let different = |row: usize, other: usize| {
            let [a, b] = [row, other].map(|r| &self.spans[r]);
            let words = a.start.min(b.start)..a.end.max(b.end);
            let pairs = m.row(row)[words.clone()].iter().zip(&m.row(other)[words]);
            pairs.map(|(a, b)| (a ^ b).count_ones()).sum::<u32>()
        };
        let mut by: Vec<(u32, usize)> = (1..=row.min(WINDOW)).map(|back| (different(row, row - back), back)).collect();
        by.sort_unstable();
        by.into_iter().map(|(_, back)| back).collect()
    }

    /// Adds a row to a block with the reference that is cheapest, unless reading it would take too long.
    fn append(&self, block: &mut Block, row: usize, references: &[usize], needs: &[Needs], most: usize) -> bool {
        let mut best: Option<(u64, usize, Needs)> = None;
        let mut tried = 0;
        for &back in [0].iter().chain(references) {
            let mut all = block.needs.clone();
            let mut most = most;
            if back > 0 {
                all.extend(&needs[row - back]);
                all.sort_unstable();
                all.dedup();
                most = if row - back < block.first { STEPS } else { most };
            }
            let before: usize = all.iter().map(|&(_, steps)| steps).sum();
            if before >= most {
                continue;
            }
            let mut meter = Meter::default();
            let steps = self.code(block.first, row, back, &mut meter, &mut block.models.clone());
            if let Some(steps) = steps.filter(|steps| before + steps <= most)
                && best.as_ref().is_none_or(|b| meter.cost < b.0)
            {
                all.push((row, steps));
                best = Some((meter.cost, back, all));
            }
            tried += 1;
            if tried > TRIED {
                break;
            }
        }
        let Some((_, back, all)) = best else { return false };
        self.code(block.first, row, back, &mut block.encoder, &mut block.models);
        block.needs = all;
        block.rows += 1;
        true
    }

    /// Codes a row; gives its steps, `None` if they are too many.
    fn code<C: Coder>(&self, first: usize, row: usize, back: usize, coder: &mut C, models: &mut Models) -> Option<usize> {
        let Self { matrix, guide, symmetric, .. } = *self;
        coder.number(&mut models.back, back as u32);
        let given = if symmetric { [first, row] } else { [0, 0] };
        let mut out = vec![0; matrix.columns().div_ceil(64)];
        (given[0]..given[1]).filter(|&c| matrix.get(row, c)).for_each(|c| out[c / 64] |= 1 << (c % 64));
        let known = Known { row, columns: matrix.columns(), reference: (back > 0).then(|| matrix.row(row - back)), given };
        let steps = guide.walk(coder, models, known, Some(matrix.row(row)), &mut out, &mut Scratch::default()).ok()?;
        debug_assert_eq!(out, matrix.row(row));
        Some(steps)
    }
}

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
