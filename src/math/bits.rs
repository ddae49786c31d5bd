//! A dense matrix of bits: rows of whole `u64` words, so that set algebra is a loop over words.

#[cfg(feature = "bake")]
use crate::math::parallel;
#[cfg(feature = "bake")]
use std::ops::Range;

/// `rows` x `columns` bits, row-major; a row starts on a word boundary and the bits past `columns` are zero. Unwritten pages take no memory
/// on systems with lazy zero pages; construction, copies and unions write no zeros over zeros.
#[derive(PartialEq, Eq, Debug, Default)]
pub struct BitMatrix {
    rows: usize,
    columns: usize,
    stride: usize,
    /// `rows * stride`.
    words: Vec<u64>,
}

/// Words of a block that is copied or skipped: half a page.
const BLOCK: usize = 256;

impl Clone for BitMatrix {
    fn clone(&self) -> Self {
        let mut clone = Self::new(self.rows, self.columns);
        copy(&mut clone.words, &self.words);
        clone
    }
}

/// Copies words, except zeros over zeros.
#[inline]
fn copy(to: &mut [u64], from: &[u64]) {
    let is_zero = |words: &[u64]| words.iter().all(|&word| word == 0);
    for (to, from) in to.chunks_mut(BLOCK).zip(from.chunks(BLOCK)) {
        if !is_zero(from) || !is_zero(to) {
            to.copy_from_slice(from);
        }
    }
}

impl BitMatrix {
    /// A zero matrix.
    pub fn new(rows: usize, columns: usize) -> Self {
        let stride = columns.div_ceil(64);
        Self { rows, columns, stride, words: vec![0; rows * stride] }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The bit at (`row`, `column`).
    #[inline]
    pub fn get(&self, row: usize, column: usize) -> bool {
        debug_assert!(column < self.columns);
        self.words[row * self.stride + column / 64] >> (column % 64) & 1 != 0
    }

    /// Sets the bit at (`row`, `column`), and returns whether it was clear before.
    #[inline]
    pub fn set(&mut self, row: usize, column: usize) -> bool {
        debug_assert!(column < self.columns);
        let at = row * self.stride + column / 64;
        let word = &mut self.words[at];
        let bit = 1u64 << (column % 64);
        let was_clear = *word & bit == 0;
        *word |= bit;
        was_clear
    }

    /// Clears the bit at (`row`, `column`).
    #[cfg(feature = "bake")]
    #[inline]
    pub fn clear(&mut self, row: usize, column: usize) {
        debug_assert!(column < self.columns);
        self.words[row * self.stride + column / 64] &= !(1 << (column % 64));
    }

    /// The words of a row.
    #[inline]
    pub fn row(&self, row: usize) -> &[u64] {
        &self.words[row * self.stride..(row + 1) * self.stride]
    }

    /// The words of a row, mutable. Bits past `columns` must stay zero.
    #[inline]
    pub fn row_mut(&mut self, row: usize) -> &mut [u64] {
        let range = row * self.stride..(row + 1) * self.stride;
        &mut self.words[range]
    }

    /// Replaces the words of a row. Bits past `columns` must be zero.
    pub(crate) fn assign_row(&mut self, row: usize, words: &[u64]) {
        assert_eq!(words.len(), self.stride, "a row's words");
        copy(self.row_mut(row), words);
    }

    /// All rows, mutable, for parallel writes. Bits past `columns` must stay zero.
    pub(crate) fn rows_mut(&mut self) -> Vec<&mut [u64]> {
        if self.stride == 0 {
            return (0..self.rows).map(|_| Default::default()).collect();
        }
        let stride = self.stride;
        self.words.chunks_exact_mut(stride).collect()
    }

    /// Ascending columns whose bit is set in `row`.
    #[inline]
    pub fn ones(&self, row: usize) -> impl Iterator<Item = usize> + '_ {
        ones(self.row(row))
    }

    /// Number of set bits in the whole matrix.
    pub fn count_ones(&self) -> u64 {
        self.words.iter().map(|w| u64::from(w.count_ones())).sum()
    }

    /// Number of set bits in one row.
    pub fn count_row(&self, row: usize) -> u64 {
        self.row(row).iter().map(|w| u64::from(w.count_ones())).sum()
    }

    /// `self |= other`; both must have the same shape.
    #[cfg(feature = "bake")]
    pub fn union_with(&mut self, other: &Self) {
        assert_eq!((self.rows, self.columns), (other.rows, other.columns), "matrices of one shape");
        for (a, b) in self.words.chunks_mut(BLOCK).zip(other.words.chunks(BLOCK)) {
            if b.iter().any(|&word| word != 0) {
                a.iter_mut().zip(b).for_each(|(a, b)| *a |= b);
            }
        }
    }

    /// The transpose.
    #[cfg(feature = "bake")]
    pub(crate) fn transposed(&self) -> Self {
        let mut result = Self::new(self.columns, self.rows);
        if result.stride == 0 {
            return result;
        }
        // 64 columns of this are 64 rows of the result.
        let stride = result.stride;
        parallel::for_each_chunk(&mut result.words, 64 * stride, |k, result| {
            for (i, rows) in (0..self.rows).step_by(64).enumerate() {
                let word = |r: usize| if r < self.rows { self.words[r * self.stride + k] } else { 0 };
                let mut block: [u64; 64] = std::array::from_fn(|r| word(rows + r));
                if block.iter().any(|&word| word != 0) {
                    transpose(&mut block);
                    let stride = self.rows.div_ceil(64);
                    result.chunks_exact_mut(stride).zip(block).for_each(|(row, word)| row[i] = word);
                }
            }
        });
        result
    }

    /// The first (row, column) that is set here and not in `other`, if there is one.
    pub fn first_outside(&self, other: &Self) -> Option<(usize, usize)> {
        assert_eq!((self.rows, self.columns), (other.rows, other.columns), "matrices of one shape");
        (0..self.rows).find_map(|r| {
            self.row(r).iter().zip(other.row(r)).enumerate().find_map(|(i, (a, b))| {
                let only = a & !b;
                (only != 0).then(|| (r, i * 64 + only.trailing_zeros() as usize))
            })
        })
    }
}

/// Transposes 64 x 64 bits: swaps off-diagonal halves, then those of each quarter, and so on (after Warren, *Hacker's Delight*, 2002).
#[cfg(feature = "bake")]
fn transpose(block: &mut [u64; 64]) {
    let (mut half, mut mask) = (32, 0xffff_ffff_u64);
    while half != 0 {
        for low in (0..64).filter(|r| r & half == 0) {
            let high = low + half;
            let differ = (block[low] >> half ^ block[high]) & mask;
            block[low] ^= differ << half;
            block[high] ^= differ;
        }
        half /= 2;
        mask ^= mask << half;
    }
}

/// The range of words from the first nonzero one to the last; empty, at the end, if all are zero.
#[cfg(feature = "bake")]
pub fn span(words: &[u64]) -> Range<usize> {
    let first = words.iter().position(|&word| word != 0).unwrap_or(words.len());
    first..words.iter().rposition(|&word| word != 0).map_or(first, |last| last + 1)
}

/// Ascending positions of the set bits of a row of words.
#[inline]
pub fn ones(words: &[u64]) -> impl Iterator<Item = usize> + '_ {
    words.iter().enumerate().flat_map(|(i, &word)| {
        std::iter::successors((word != 0).then_some(word), |w| {
            let rest = w & (w - 1);
            (rest != 0).then_some(rest)
        })
        .map(move |w| i * 64 + w.trailing_zeros() as usize)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ones_lists_what_was_set() {
        let mut m = BitMatrix::new(2, 130);
        for c in [0, 63, 64, 129] {
            assert!(m.set(1, c));
            assert!(!m.set(1, c));
        }
        assert_eq!(m.ones(1).collect::<Vec<_>>(), [0, 63, 64, 129]);
        assert_eq!(m.ones(0).count(), 0);
        assert_eq!((m.count_ones(), m.count_row(0), m.count_row(1)), (4, 0, 4));
        m.clear(1, 64);
        assert!(!m.get(1, 64));
    }

    #[test]
    fn transposing_exchanges_rows_and_columns() {
        for (rows, columns) in [(1, 1), (3, 200), (130, 65), (64, 64), (0, 5)] {
            let mut m = BitMatrix::new(rows, columns);
            let mut x = 1u64;
            for r in 0..rows {
                for c in 0..columns {
                    x = x.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                    if x >> 62 == 0 {
                        m.set(r, c);
                    }
                }
            }
            let t = m.transposed();
            assert_eq!((t.rows(), t.columns(), t.count_ones()), (columns, rows, m.count_ones()));
            assert!((0..rows).all(|r| (0..columns).all(|c| m.get(r, c) == t.get(c, r))), "{rows} x {columns}");
        }
    }

    #[test]
    fn a_span_is_from_the_first_set_bit_to_the_last() {
        assert_eq!((span(&[0, 1, 0, 8, 0]), span(&[0, 0]), span(&[3]), span(&[])), (1..4, 2..2, 0..1, 0..0));
    }

    #[test]
    fn a_copy_and_a_union_are_what_they_were_made_of() {
        // Rows longer than a block, mostly zero.
        let mut m = BitMatrix::new(3, 64 * 700);
        for c in [0, 20_000, 44_799] {
            m.set(1, c);
        }
        assert_eq!(m.clone(), m);
        let mut other = BitMatrix::new(3, 64 * 700);
        other.set(2, 5);
        other.union_with(&m);
        assert_eq!((other.count_row(1), other.count_row(2), other.count_ones()), (3, 1, 4));
        let row = other.row(2).to_vec();
        other.assign_row(1, &row);
        assert_eq!((other.ones(1).collect::<Vec<_>>(), other.count_ones()), (vec![5], 2));
    }

    #[test]
    fn first_outside_finds_the_pair() {
        let (mut a, mut b) = (BitMatrix::new(3, 70), BitMatrix::new(3, 70));
        a.set(2, 69);
        assert_eq!(a.first_outside(&b), Some((2, 69)));
        b.union_with(&a);
        assert_eq!(a.first_outside(&b), None);
    }
}
