//! Writes visibility matrices; [`crate::file::rows`] reads them, and cites the papers.

use super::encoder::{Encoder, Meter};
use super::put::Put;
use crate::BitMatrix;
use crate::file::rows::row::{Guide, Known, Models, Walker};
use crate::file::rows::{CODED, ONES, SYMMETRIC, UNGUIDED, ZEROS};
use crate::math::bits::span;
use std::ops::Range;

/// Earlier rows considered as references.
const WINDOW: usize = 64;
/// How many of the nearest of them are coded on trial, besides no reference.
const TRIED: usize = 3;

/// Codes a matrix of fewer than 2^27 rows and columns.
pub fn encode_rows(matrix: &BitMatrix) -> Vec<u8> {
    encode_guided(matrix, &Guide::Plain)
}

/// The same with a context model; a reader needs the same guide.
pub(in crate::file) fn encode_guided(matrix: &BitMatrix, guide: &Guide<'_>) -> Vec<u8> {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    let mut out = Vec::new();
    out.varint(rows as u32);
    out.varint(columns as u32);
    match matrix.count_ones() {
        0 => out.u8(ZEROS as u8),
        n if n == rows as u64 * columns as u64 => out.u8(ONES as u8),
        _ => {
            out.u8(CODED as u8);
            let is_symmetric = || rows == columns && *matrix == matrix.transposed();
            let symmetric = if matches!(guide, Guide::Cells(_)) && is_symmetric() { SYMMETRIC } else { 0 };
            let coded = |guide, flags| code(matrix, guide, flags & SYMMETRIC != 0).map(|bytes| (flags, bytes));
            // Rows without a guide have no visits.
            let coded = coded(guide, symmetric).or_else(|| coded(&Guide::Plain, symmetric | UNGUIDED));
            let (flags, bytes) = coded.unwrap_or_default();
            out.u8(flags as u8);
            out.bytes(&bytes);
        }
    }
    out
}

/// Codes the rows; `None` if reading them would take too many visits.
fn code(matrix: &BitMatrix, guide: &Guide<'_>, is_symmetric: bool) -> Option<Vec<u8>> {
    let (mut encoder, mut models, mut walker) = (Encoder::new(), Models::new(guide), Walker::new(guide));
    let spans: Vec<Range<usize>> = (0..matrix.rows()).map(|row| span(matrix.row(row))).collect();
    let mut bits = vec![0; matrix.columns().div_ceil(64)];
    for row in 0..matrix.rows() {
        let given = if is_symmetric { row } else { 0 };
        let known = Known { row, columns: matrix.columns(), given, above: matrix };
        let start = |bits: &mut Vec<u64>| {
            bits.fill(0);
            (0..given).filter(|&c| matrix.get(row, c)).for_each(|c| bits[c / 64] |= 1 << (c % 64));
        };
        let references = references(matrix, &spans, row);
        let mut best = (u64::MAX, 0);
        match references.first() {
            Some(&(0, back)) => best.1 = back,
            _ => {
                for back in [0].into_iter().chain(references.iter().map(|&(_, back)| back)) {
                    start(&mut bits);
                    let mut meter = Meter::default();
                    let truth = Some((matrix.row(row), back));
                    walker.trial(&mut meter, &mut models.clone(), known, truth, &mut bits);
                    best = best.min((meter.cost, back));
                }
            }
        }
        start(&mut bits);
        walker.code(&mut encoder, &mut models, known, Some((matrix.row(row), best.1)), &mut bits).ok()?;
        debug_assert_eq!(bits, matrix.row(row));
    }
    Some(encoder.finish())
}

/// The most similar earlier rows: the number of different bits and the distance; among equals the nearest first.
fn references(matrix: &BitMatrix, spans: &[Range<usize>], row: usize) -> Vec<(u32, usize)> {
    let different = |other: usize| {
        let [a, b] = [row, other].map(|r| &spans[r]);
        let words = a.start.min(b.start)..a.end.max(b.end);
        let pairs = matrix.row(row)[words.clone()].iter().zip(&matrix.row(other)[words]);
        pairs.map(|(a, b)| (a ^ b).count_ones()).sum::<u32>()
    };
    let mut by: Vec<(u32, usize)> = (1..=row.min(WINDOW)).map(|back| (different(row - back), back)).collect();
    by.sort_unstable();
    by.truncate(TRIED);
    by
}
