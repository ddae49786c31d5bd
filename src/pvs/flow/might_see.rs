//! Might-see: for each directed portal, a cheap superset of the portals that a line through it can cross later.
//!
//! Based on: the "base" pass of level compilers after Carmack, 1996 (flood over portals that lie in front), and *two-sided
//! flow* as measured for this project: one step of separating planes over all pairs, before any search, makes the search
//! clearly shorter. Deviates: the flood goes from portal to portal and not from cell to cell, asking at each step also the
//! portal that it came through; and every fact is used both ways, because a line read backwards is a line.

use super::net::Net;
use super::separators::separators;
use super::window::Window;
use crate::{BitMatrix, bits};
use rayon::prelude::*;
use std::ops::Range;

/// Bit q of row p is clear only where no line crosses directed portal p and later directed portal q.
pub(super) struct MightSee {
    rows: BitMatrix,
}

impl MightSee {
    /// Pairs that the planes of the two portals allow, along chains of such pairs.
    pub fn by_planes(net: &Net) -> Self {
        let n = net.portals();
        let rows = from_rows(n, n, |a, row| (0..n).filter(|&b| net.may_follow(a, b)).for_each(|b| set(row, b)));
        let mut all = Self { rows };
        all.flood(net);
        all
    }

    /// The portals that may come after `portal`.
    #[inline]
    pub fn row(&self, portal: usize) -> &[u64] {
        self.rows.row(portal)
    }

    /// Number of portals that may come after `portal`.
    pub fn count(&self, portal: usize) -> u64 {
        self.rows.count_row(portal)
    }

    /// Keeps what a chain of allowed pairs leads to: each portal of it allowed after the one before and after the first.
    fn flood(&mut self, net: &Net) {
        let old = &self.rows;
        self.rows = from_rows(old.rows(), old.columns(), |first, row| {
            let mut queue = vec![first];
            while let Some(last) = queue.pop() {
                let out = net.out(net.target[last] as usize);
                for (word, mask) in words_of(out) {
                    let new = old.row(first)[word] & old.row(last)[word] & mask & !row[word];
                    row[word] |= new;
                    queue.extend(bits::ones(&[new]).map(|bit| word * 64 + bit));
                }
            }
        });
    }

    /// Keeps (p, q) only where (q reversed, p reversed) is there too.
    fn mirror(&mut self, net: &Net) {
        let old = &self.rows;
        self.rows = from_rows(old.rows(), old.columns(), |a, row| {
            let back = net.twin[a] as usize;
            bits::ones(old.row(a)).filter(|&b| old.get(net.twin[b] as usize, back)).for_each(|b| set(row, b));
        });
    }

    /// One step of separating planes: drops what lies outside the planes of a portal and each of its next portals.
    pub fn narrow(&mut self, net: &Net) {
        let old = &self.rows;
        let tests: Vec<Vec<u64>> = (0..net.portals()).into_par_iter().map(|first| narrowed(net, old, first)).collect();
        self.rows = from_rows(old.rows(), old.columns(), |a, row| row.copy_from_slice(&tests[a]));
        self.mirror(net);
        self.flood(net);
    }

    /// Drops everything after `portal` that leads into one of `cells`, a row of bits.
    pub fn drop_into(&mut self, net: &Net, portal: usize, cells: &[u64]) {
        let back = net.twin[portal] as usize;
        for (i, word) in self.rows.row(portal).to_vec().into_iter().enumerate() {
            for q in bits::ones(&[word]).map(|bit| i * 64 + bit) {
                if get(cells, net.target[q] as usize) {
                    self.rows.clear(portal, q);
                    self.rows.clear(net.twin[q] as usize, back);
                }
            }
        }
    }

    /// Drops pairs of portals whose lines would join two cells that don't see each other: bit j of row i of `hidden`, both
    /// ways.
    pub fn drop_hidden(&mut self, net: &Net, hidden: &BitMatrix) {
        let n = net.portals();
        // For each cell, the portals whose two cells it may see.
        let allowed = from_rows(net.cells, n, |cell, row| {
            let open = |c: u32| !hidden.get(cell, c as usize);
            (0..n).filter(|&p| open(net.source[p]) && open(net.target[p])).for_each(|p| set(row, p));
        });
        for p in 0..n {
            let (a, b) = (allowed.row(net.source[p] as usize), allowed.row(net.target[p] as usize));
            for (word, (a, b)) in self.rows.row_mut(p).iter_mut().zip(a.iter().zip(b)) {
                *word &= a & b;
            }
        }
        self.flood(net);
    }
}

/// The portals after `first` that at least one choice of the next portal leaves possible.
fn narrowed(net: &Net, old: &BitMatrix, first: usize) -> Vec<u64> {
    let mut kept = vec![0u64; old.row(first).len()];
    let (mut source, mut pass, mut spare) = (Window::default(), Window::default(), Vec::new());
    let mut planes = Vec::new();
    for (word, mask) in words_of(net.out(net.target[first] as usize)) {
        for bit in bits::ones(&[old.row(first)[word] & mask]) {
            let next = word * 64 + bit;
            source.assign(net.corners(first), net.plane(first).is_some());
            pass.assign(net.corners(next), net.plane(next).is_some());
            let crossed = net.behind(first, next).is_none_or(|p| source.cut(&p, &net.slack, &mut spare))
                && net.front(first, next).is_none_or(|p| pass.cut(&p, &net.slack, &mut spare));
            if !crossed {
                continue;
            }
            set(&mut kept, next);
            planes.clear();
            separators(&source.corners, &pass.corners, &mut planes);
            for (i, (a, b)) in old.row(first).iter().zip(old.row(next)).enumerate() {
                for bit in bits::ones(&[a & b & !kept[i]]) {
                    if !planes.iter().any(|plane| net.is_cut_off(i * 64 + bit, plane)) {
                        kept[i] |= 1 << bit;
                    }
                }
            }
        }
    }
    kept
}

/// A matrix whose rows are worked out in parallel, each by itself.
fn from_rows(rows: usize, columns: usize, fill: impl Fn(usize, &mut [u64]) + Sync) -> BitMatrix {
    let mut matrix = BitMatrix::new(rows, columns);
    let words = columns.div_ceil(64);
    let done: Vec<Vec<u64>> = (0..rows)
        .into_par_iter()
        .map(|r| {
            let mut row = vec![0; words];
            fill(r, &mut row);
            row
        })
        .collect();
    for (r, row) in done.iter().enumerate() {
        matrix.row_mut(r).copy_from_slice(row);
    }
    matrix
}

/// Sets a bit of a row.
#[inline]
pub(super) fn set(row: &mut [u64], bit: usize) {
    row[bit / 64] |= 1 << (bit % 64);
}

/// True where a bit of a row is set.
#[inline]
pub(super) fn get(row: &[u64], bit: usize) -> bool {
    row[bit / 64] >> (bit % 64) & 1 != 0
}

/// The words that a range of bits covers, each with the mask of the bits in the range.
pub(super) fn words_of(range: Range<usize>) -> impl Iterator<Item = (usize, u64)> {
    let (start, end) = (range.start, range.end);
    (start / 64..end.div_ceil(64)).map(move |word| {
        let low = !0u64 << start.saturating_sub(word * 64).min(63);
        let high = !0u64 >> (64 - (end - word * 64).min(64));
        (word, low & high)
    })
}
