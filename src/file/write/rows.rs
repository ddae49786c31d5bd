//! Writes visibility matrices in the shorter of two codes.

use super::put::Put;
use super::{differences, modelled};
use crate::BitMatrix;
use crate::file::rows::{DIFFERENCES, Guide, ONES, ZEROS};

/// Codes a matrix of fewer than 2^27 rows and columns.
pub fn encode_rows(matrix: &BitMatrix) -> Vec<u8> {
    encode_guided(matrix, &Guide::Plain)
}

/// The same with a context model; a reader needs the same guide.
pub(in crate::file) fn encode_guided(matrix: &BitMatrix, guide: &Guide) -> Vec<u8> {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    let mut out = Vec::new();
    out.varint(rows as u32);
    out.varint(columns as u32);
    match matrix.count_ones() {
        0 => out.u8(ZEROS as u8),
        n if n == rows as u64 * columns as u64 => out.u8(ONES as u8),
        _ => {
            let mut other = Vec::new();
            differences::encode(matrix, &mut other);
            let modelled = modelled::encode(matrix, guide).filter(|m| m.len() < other.len());
            out.u8(DIFFERENCES as u8 + u8::from(modelled.is_some()));
            out.bytes(&modelled.unwrap_or(other));
        }
    }
    out
}
