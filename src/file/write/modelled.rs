//! Writes rows coded bit by bit; [`crate::file::rows::modelled`] reads them and names the papers.

use super::encoder::{Encoder, Meter};
use super::put::Put;
use crate::BitMatrix;
use crate::bits::span;
use crate::file::rows::coder::Coder;
use crate::file::rows::guide::{Guide, Known, Models, STEPS, Scratch};
use std::ops::Range;

/// Previous rows considered as references.
const WINDOW: usize = 64;
/// Number of references with the fewest different bits that are actually coded.
const TRIED: usize = 3;

/// Encodes a matrix; `None` if one of its rows would take too long to read.
pub(in crate::file) fn encode(matrix: &BitMatrix, guide: &Guide) -> Option<Vec<u8>> {
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

/// The coded part of a block, and the cost of reading it.
struct Block {
    first: usize,
    rows: usize,
    encoder: Encoder,
    models: Models,
    needs: Needs,
}

/// The rows that a reader needs for a row, including itself, ascending, with the steps of each.
type Needs = Vec<(usize, usize)>;

impl Block {
    fn new(first: usize, guide: &Guide) -> Self {
        Self { first, rows: 0, encoder: Encoder::new(), models: Models::new(guide), needs: Vec::new() }
    }
}

struct Writer<'m> {
    matrix: &'m BitMatrix,
    guide: &'m Guide,
    /// Whether the matrix is symmetric: then a bit is coded once in a block.
    symmetric: bool,
    /// Span of each row.
    spans: Vec<Range<usize>>,
}

impl Writer<'_> {
    /// Rows and bytes of each block; `most`: limit of steps for a row that refers only to its own block.
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

    /// Distances to the most similar previous rows, the nearest first among equals.
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

    /// Adds a row to a block with the cheapest reference, unless reading it would take too long.
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

    /// Codes a row; returns its steps, or `None` if they are too many.
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
