//! Might-see: for each directed portal, a cheap superset of the portals that a line through it can cross later.
//!
//! Based on: the "base" pass of level compilers after Carmack, 1996 (flood over portals that lie in front). Deviations: the flood goes from
//! portal to portal and not from cell to cell, and each step also tests the previous portal; and every result is used in both directions,
//! because lines can be reversed. Separating planes do not pay here, because searches flood inside their own planes: a step of them over
//! all pairs in two rounds saved hardly a step. With tens of thousands of portals, pairs dominate the cost, and `reach` finds the rows
//! without testing all pairs.

use super::net::Net;
use super::planes::Planes;
use super::reach::Reach;
use crate::BitMatrix;
use crate::math::bits;
use crate::math::parallel;
use std::ops::Range;

/// Bit q of row p is clear only if no line crosses directed portal p and later directed portal q.
#[derive(Clone)]
pub struct MightSee {
    rows: BitMatrix,
    /// The transpose.
    before: BitMatrix,
    /// Cells x directed portals: the portals whose two cells are not known to be hidden from a cell.
    open: BitMatrix,
}

impl MightSee {
    /// Pairs allowed by their planes, along chains of such pairs, in both directions.
    pub fn new(net: &Net) -> Self {
        let n = net.portals();
        let rows = by_windows(net)
            .unwrap_or_else(|| from_rows(n, n, || Planes::new(net), |planes, first, row| _ = planes.from(first, row)));
        Self::of(net, rows)
    }

    /// The pairs of `rows`, a superset of those that lines cross, that are also there in the opposite direction.
    pub fn of(net: &Net, rows: BitMatrix) -> Self {
        let n = net.portals();
        let open = from_rows(net.cells, n, || (), |(), _, row| words_of(0..n).for_each(|(word, mask)| row[word] = mask));
        let before = rows.transposed();
        let mut all = Self { rows, before, open };
        all.mirror(net);
        all
    }

    /// The portals that may come after `portal`.
    #[inline]
    pub fn row(&self, portal: usize) -> &[u64] {
        self.rows.row(portal)
    }

    /// The portals that may come before `portal`.
    #[inline]
    pub fn before(&self, portal: usize) -> &[u64] {
        self.before.row(portal)
    }

    /// Number of portals that may come after `portal`.
    pub fn count(&self, portal: usize) -> u64 {
        self.rows.count_row(portal)
    }

    /// Keeps (p, q) only if (q reversed, p reversed) is also set: then the portals before p reversed are those after p, reversed.
    fn mirror(&mut self, net: &Net) {
        let mut before: Vec<Option<&mut [u64]>> = self.before.rows_mut().into_iter().map(Some).collect();
        let rows = self.rows.rows_mut().into_iter().enumerate();
        let mut pairs: Vec<_> = rows.filter_map(|(p, row)| Some((row, before[net.twin[p] as usize].take()?))).collect();
        parallel::for_each_mut(&mut pairs, |_, (after, before)| {
            keep_twins(net, after, before);
            keep_twins(net, before, after);
        });
    }

    /// Drops all portals after `portal` that lead into one of `cells`, a row of bits.
    pub fn drop_into(&mut self, net: &Net, portal: usize, cells: &[u64]) {
        let back = net.twin[portal] as usize;
        for (i, word) in self.rows.row(portal).to_vec().into_iter().enumerate() {
            for q in bits::ones(&[word]).map(|bit| i * 64 + bit) {
                if get(cells, net.target[q] as usize) {
                    self.clear(portal, q);
                    self.clear(net.twin[q] as usize, back);
                }
            }
        }
    }

    fn clear(&mut self, a: usize, b: usize) {
        self.rows.clear(a, b);
        self.before.clear(b, a);
    }

    /// Drops pairs of portals whose lines would connect two hidden cells: bit j of row i of `hidden`, symmetric.
    pub fn drop_all_hidden(&mut self, net: &Net, hidden: &BitMatrix) {
        parallel::for_each_mut(&mut self.open.rows_mut(), |cell, row| {
            for p in hidden.ones(cell).flat_map(|other| net.out(other)) {
                unset(row, p);
                unset(row, net.twin[p] as usize);
            }
        });
        self.drop_closed(net, |_| true);
    }

    /// As [`MightSee::drop_all_hidden`], for a list of pairs, each one way or both.
    pub fn drop_hidden(&mut self, net: &Net, hidden: &[(usize, usize)]) {
        let mut changed = vec![false; net.cells];
        for &(i, j) in hidden {
            for (cell, other) in [(i, j), (j, i)] {
                changed[cell] = true;
                for p in net.out(other) {
                    self.open.clear(cell, p);
                    self.open.clear(cell, net.twin[p] as usize);
                }
            }
        }
        self.drop_closed(net, |cell| changed[cell as usize]);
    }

    /// Drops pairs that connect a cell to a portal that is not open to it, for the cells of which that has `changed`.
    fn drop_closed(&mut self, net: &Net, changed: impl Fn(u32) -> bool + Sync) {
        let open = &self.open;
        for matrix in [&mut self.rows, &mut self.before] {
            parallel::for_each_mut(&mut matrix.rows_mut(), |p, row| {
                let ends = [net.source[p], net.target[p]];
                for cell in ends.into_iter().filter(|&cell| changed(cell)) {
                    row.iter_mut().zip(open.row(cell as usize)).for_each(|(a, b)| *a &= b);
                }
            });
        }
    }
}

/// Keeps the portals of a row whose twin is in another.
fn keep_twins(net: &Net, row: &mut [u64], other: &[u64]) {
    for (i, word) in row.iter_mut().enumerate() {
        for bit in bits::ones(&[*word]) {
            if !get(other, net.twin[i * 64 + bit] as usize) {
                *word &= !(1 << bit);
            }
        }
    }
}

/// Number of directed portals from which windows are tried. Smaller graphs take seconds for all pairs; windows would take five times as
/// long in a level of a tenth of that, where much is in sight.
pub(super) const MANY: usize = 16_384;
/// A sample of one portal in this many decides about windows.
const TRIED: usize = 64;
/// With windows, a source may visit at most one portal in this many: with more, planes are faster.
const LOOKS: usize = 32;
/// Sample size for the estimate of the flood's total work, and the limit on it, in words of 64 portals: a minute or two. Larger: bakes that
/// take hours. Smaller: cities, where a street sees every window, become one cell.
const SAMPLES: usize = 64;
const MOST_LOOKS: f64 = 6e10;

/// True if there are many portals, and narrowing windows reach few portals from most of them.
fn windows_pay(net: &Net) -> bool {
    let n = net.portals();
    if n < MANY {
        return false;
    }
    let one = |(reach, found): &mut (Reach<'_>, Vec<u32>), i: usize| reach.from(i * TRIED, n / LOOKS, found);
    let done = parallel::map_init(n.div_ceil(TRIED), || (Reach::new(net), Vec::new()), one);
    2 * done.iter().filter(|done| **done).count() >= done.len()
}

/// True if might-see would take longer than minutes: tens of thousands of portals between few cells, as with cracks in rough walls.
pub(super) fn is_over_budget(net: &Net) -> bool {
    looks_of_all(net) > MOST_LOOKS && !windows_pay(net)
}

/// Estimate of the total work of floods by planes, words of 64 portals, from a sample.
fn looks_of_all(net: &Net) -> f64 {
    let n = net.portals();
    let samples = SAMPLES.min(n);
    let scratch = || (Planes::new(net), vec![0; n.div_ceil(64)]);
    let looks = parallel::map_init(samples, scratch, |(planes, row), i| {
        row.fill(0);
        planes.from(i * n / samples, row)
    });
    looks.into_iter().sum::<u64>() as f64 * n as f64 / samples.max(1) as f64
}

/// The rows by narrowing windows, if there are many portals and most reach few others.
fn by_windows(net: &Net) -> Option<BitMatrix> {
    if !windows_pay(net) {
        return None;
    }
    let n = net.portals();
    let scratch = || (Reach::new(net), Vec::new(), Planes::new(net));
    let fill = |(reach, found, planes): &mut (Reach<'_>, Vec<u32>, Planes<'_>), first: usize, row: &mut [u64]| {
        if reach.from(first, n / LOOKS, found) {
            found.iter().for_each(|&p| set(row, p as usize));
        } else {
            planes.from(first, row);
        }
    };
    Some(from_rows(n, n, scratch, fill))
}

/// A matrix whose rows are computed in parallel, independently, with scratch memory.
pub(crate) fn from_rows<S: Send>(
    rows: usize,
    columns: usize,
    scratch: impl Fn() -> S + Sync,
    fill: impl Fn(&mut S, usize, &mut [u64]) + Sync,
) -> BitMatrix {
    let mut matrix = BitMatrix::new(rows, columns);
    parallel::for_each_init(&mut matrix.rows_mut(), scratch, |scratch, r, row| fill(scratch, r, row));
    matrix
}

/// Sets a bit of a row.
#[inline]
pub fn set(row: &mut [u64], bit: usize) {
    row[bit / 64] |= 1 << (bit % 64);
}

/// Clears a bit of a row.
#[inline]
fn unset(row: &mut [u64], bit: usize) {
    row[bit / 64] &= !(1 << (bit % 64));
}

/// True if a bit of a row is set.
#[inline]
pub(crate) fn get(row: &[u64], bit: usize) -> bool {
    row[bit / 64] >> (bit % 64) & 1 != 0
}

/// The words of a range of bits, each with the mask of its bits in the range.
pub(crate) fn words_of(range: Range<usize>) -> impl Iterator<Item = (usize, u64)> {
    (range.start / 64..range.end.div_ceil(64)).map(move |word| (word, mask_of(&range, word)))
}

/// The mask of a range's bits in one word.
#[inline]
pub(super) fn mask_of(range: &Range<usize>, word: usize) -> u64 {
    let low = !0u64 << range.start.saturating_sub(word * 64).min(63);
    let high = !0u64 >> (64 - (range.end - word * 64).min(64));
    low & high
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::CellId;
    use crate::cells::{Cell, CellGraph, Portal, PortalKind, PortalState};
    use crate::math::geom::Plane;
    use glam::DVec3;

    /// Rooms in a row along x; the door into room k + 1 begins at height `low[k]` and is 1 m wide and high.
    pub fn row(low: &[f64]) -> Net {
        let portal = |(k, &z): (usize, &f64)| Portal {
            cells: [CellId(k as u32), CellId(k as u32 + 1)],
            plane: Plane { n: DVec3::X, d: k as f64 },
            winding: [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(y, h)| DVec3::new(k as f64, y, z + h)).to_vec(),
            kind: PortalKind::Door,
            state: PortalState::of_kind(PortalKind::Door),
            source: None,
        };
        let graph = CellGraph::given(vec![Cell::default(); low.len() + 1], low.iter().enumerate().map(portal).collect());
        Net::of_graph(&graph, 1e-6)
    }

    fn cells_after(net: &Net, might_see: &MightSee, portal: usize) -> Vec<u32> {
        bits::ones(might_see.row(portal)).map(|q| net.target[q]).collect()
    }

    #[test]
    fn planes_tell_forwards_from_backwards() {
        let net = row(&[0.0, 0.0, 2.5, 0.0]);
        let might_see = MightSee::new(&net);
        assert_eq!(cells_after(&net, &might_see, net.out(0).start), [2, 3, 4]);
        assert_eq!(cells_after(&net, &might_see, net.out(4).start), [0, 1, 2]);
        let middle: Vec<usize> = net.out(2).collect();
        assert_eq!(middle.iter().map(|&p| cells_after(&net, &might_see, p).len()).collect::<Vec<_>>(), [1, 1]);
    }

    #[test]
    fn what_is_hidden_is_dropped() {
        let net = row(&[0.0; 4]);
        let mut might_see = MightSee::new(&net);
        let mut all = might_see.clone();
        might_see.drop_hidden(&net, &[(0, 2)]);
        let mut hidden = BitMatrix::new(5, 5);
        hidden.set(0, 2);
        hidden.set(2, 0);
        all.drop_all_hidden(&net, &hidden);
        assert!(all.rows == might_see.rows && all.before == might_see.before && all.rows.transposed() == all.before);
        // The portal out of cell 2 joins it to cell 0; the one into cell 4 is left to the flood of a search.
        assert_eq!(cells_after(&net, &might_see, net.out(0).start), [4]);
        let mut might_see = MightSee::new(&net);
        might_see.drop_into(&net, net.out(0).start, &[1 << 4]);
        assert_eq!(cells_after(&net, &might_see, net.out(0).start), [2, 3]);
        assert_eq!(might_see.count(net.out(4).start), 2, "and back");
    }

    #[test]
    fn a_few_floods_tell_what_all_take() {
        // A row of rooms with all doors in line: each source visits all doors in front and behind.
        let net = row(&[0.0; 60]);
        let mut planes = Planes::new(&net);
        let all: u64 = (0..net.portals()).map(|first| planes.from(first, &mut [0; 2])).sum();
        let told = looks_of_all(&net);
        assert!((0.5..2.0).contains(&(told / all as f64)), "{told} for {all}");
        assert_eq!(looks_of_all(&Net::new(1, &[], 1e-6)), 0.0);
    }

    #[test]
    fn words_cover_a_range() {
        for (range, count) in [(0..0, 0), (5..5, 0), (3..64, 61), (64..64, 0), (60..200, 140), (0..128, 128)] {
            let words: Vec<(usize, u64)> = words_of(range.clone()).collect();
            assert_eq!(words.iter().map(|(_, m)| m.count_ones()).sum::<u32>(), count, "{range:?}");
            let inside = words.iter().all(|&(w, m)| bits::ones(&[m]).all(|b| range.contains(&(w * 64 + b))));
            assert!(inside, "{range:?}");
        }
    }
}
