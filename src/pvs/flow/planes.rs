//! The flood of might-see: from portal to portal, if the planes allow the last two portals and the first and the last.
//!
//! Based on: Carmack's "base" pass, 1996, of single portals instead of cells. Deviation: words of 64 portals are processed together, and
//! skipped once all of them are reached.

use super::might_see::{mask_of, words_of};
use super::net::Net;
use crate::math::bits;

/// Cost of a plane test of two portals, in word accesses.
const LOOKS_A_QUESTION: u64 = 10;

/// A flood over portals, restricted by their planes.
pub struct Planes<'n> {
    net: &'n Net,
    queue: Vec<u32>,
    /// Portals out of reached cells, as bits: those that may follow the first and are not reached yet.
    waiting: Vec<u64>,
    left: WordsLeft<'n>,
}

impl<'n> Planes<'n> {
    pub fn new(net: &'n Net) -> Self {
        Self { net, queue: Vec::new(), waiting: vec![0; net.portals().div_ceil(64)], left: WordsLeft::new(net) }
    }

    /// Sets the portals that a flood from `first` reaches. Returns the work, in accesses to words of 64 portals.
    pub fn from(&mut self, first: usize, row: &mut [u64]) -> u64 {
        let Self { net, queue, waiting, left } = self;
        let mut looks = 0;
        waiting.fill(0);
        left.restart();
        queue.push(first as u32);
        while let Some(last) = queue.pop() {
            let cell = net.target[last as usize] as usize;
            if left.is_new(cell) {
                let out = net.out(cell);
                looks += LOOKS_A_QUESTION * out.len() as u64;
                net.all_that_follow(first, cell, waiting);
            }
            let mut next = net.next(last as usize);
            left.retain(cell, |word, mask| {
                looks += 1;
                if next.first().is_some_and(|&(other, _)| (other as usize) < word) {
                    next = &next[next.partition_point(|&(other, _)| (other as usize) < word)..];
                }
                let allowed = next.first().map_or(0, |&(other, allowed)| if other as usize == word { allowed } else { 0 });
                let new = waiting[word] & allowed;
                if new != 0 {
                    waiting[word] &= !new;
                    row[word] |= new;
                    queue.extend(bits::ones(&[new]).map(|bit| (word * 64 + bit) as u32));
                }
                waiting[word] & mask != 0
            });
        }
        looks
    }
}

/// For each cell, the unfinished words of its portals. A cell may have a thousand portals, and be entered as often: so finished words are
/// dropped.
struct WordsLeft<'n> {
    net: &'n Net,
    /// Words of all cells, ascending within each; those of a cell begin at `begin`.
    words: Vec<u32>,
    begin: Vec<u32>,
    /// For each cell, the number of unfinished words, and the flood that it is valid for.
    left: Vec<(u32, u32)>,
    flood: u32,
}

impl<'n> WordsLeft<'n> {
    pub fn new(net: &'n Net) -> Self {
        let mut begin = vec![0; net.cells + 1];
        for cell in 0..net.cells {
            begin[cell + 1] = begin[cell] + words_of(net.out(cell)).count() as u32;
        }
        Self { net, words: vec![0; begin[net.cells] as usize], begin, left: vec![(0, 0); net.cells], flood: 0 }
    }

    /// Starts the next flood: all words are unfinished.
    pub fn restart(&mut self) {
        self.flood += 1;
    }

    /// True before the first access to the cell in this flood.
    fn is_new(&self, cell: usize) -> bool {
        self.left[cell].1 != self.flood
    }

    /// Visits the unfinished words of a cell, ascending, each with the mask of the cell's portals in it; drops those for which `keep` is
    /// false.
    #[inline]
    pub fn retain(&mut self, cell: usize, mut keep: impl FnMut(usize, u64) -> bool) {
        let out = self.net.out(cell);
        if out.is_empty() {
            return;
        }
        let words = &mut self.words[self.begin[cell] as usize..self.begin[cell + 1] as usize];
        let (left, flood) = &mut self.left[cell];
        if std::mem::replace(flood, self.flood) != self.flood {
            *left = words.len() as u32;
            words.iter_mut().zip(out.start / 64..).for_each(|(slot, word)| *slot = word as u32);
        }
        let mut kept = 0;
        for i in 0..*left as usize {
            let word = words[i];
            if keep(word as usize, mask_of(&out, word as usize)) {
                words[kept] = word;
                kept += 1;
            }
        }
        *left = kept as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::super::net::NetPortal;
    use super::*;
    use crate::math::geom::Plane;
    use crate::math::random::SplitMix;
    use glam::DVec3;

    /// Random squares in a cube of 10 m, each between two random cells.
    fn scattered(cells: u32, portals: usize, seed: u64) -> Net {
        let mut random = SplitMix::new(seed);
        let mut unit = || DVec3::new(random.unit(), random.unit(), random.unit());
        let windings: Vec<(Plane, [DVec3; 4])> = (0..portals)
            .map(|_| {
                let (middle, n) = (10.0 * unit(), (unit() - 0.5).normalize());
                let (u, v) = n.any_orthonormal_pair();
                let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(a, b)| middle + a * u + b * v);
                (Plane { n, d: n.dot(middle) }, corners)
            })
            .collect();
        let ends = (0..portals as u32).map(|i| [i % cells, (i + 1 + i / cells % (cells - 1)) % cells]);
        let portals: Vec<NetPortal<'_>> =
            windings.iter().zip(ends).map(|((plane, winding), cells)| NetPortal { cells, plane: *plane, winding }).collect();
        Net::new(cells as usize, &portals, 1e-6)
    }

    #[test]
    fn floods_come_to_what_single_steps_come_to() {
        for (cells, portals) in [(2, 150), (3, 200), (9, 120), (40, 90)] {
            let net = scattered(cells, portals, u64::from(cells));
            let (n, mut planes, mut found) = (net.portals(), Planes::new(&net), 0);
            for first in 0..n {
                let mut row = vec![0; n.div_ceil(64)];
                planes.from(first, &mut row);
                let (mut come, mut queue) = (vec![false; n], vec![first]);
                while let Some(last) = queue.pop() {
                    for p in net.out(net.target[last] as usize) {
                        if !come[p] && net.may_follow(last, p) && net.may_follow(first, p) {
                            come[p] = true;
                            queue.push(p);
                        }
                    }
                }
                assert!((0..n).filter(|&p| come[p]).eq(bits::ones(&row)), "{cells} cells, portal {first}");
                found += bits::ones(&row).count();
            }
            assert!(found > n && found < n * n, "{found}");
        }
    }
}
