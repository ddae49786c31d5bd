//! Context models of rows, from data in the file: a visible cell usually has a visible neighbour, and an object is visible only if one of
//! its cells is.
//!
//! A guide walks the columns that may be set, and gives each a context; set columns outside the walk, which are rare, are listed one by
//! one. The walk is the same for writing and reading: it depends only on bits coded before.

use super::coder::{Coder, Model};
use crate::{BitMatrix, bits};

/// Lists of ids, concatenated.
#[derive(Clone, Debug, Default)]
pub(in crate::file) struct Lists {
    starts: Vec<u32>,
    ids: Vec<u32>,
}

impl Lists {
    /// `count` lists from pairs of list and id; ascending, each id once.
    pub fn new(count: usize, pairs: impl Iterator<Item = [u32; 2]>) -> Self {
        let mut pairs: Vec<[u32; 2]> = pairs.collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut starts = vec![0; count + 1];
        pairs.iter().for_each(|&[list, _]| starts[list as usize + 1] += 1);
        (0..count).for_each(|i| starts[i + 1] += starts[i]);
        Self { starts, ids: pairs.into_iter().map(|[_, id]| id).collect() }
    }

    /// Upper bound of the memory to build lists, bytes: pairs, which grow by doubling, and ids.
    fn bytes(lists: u64, pairs: u64) -> u64 {
        (4 * lists).saturating_add(pairs.saturating_mul(28))
    }

    #[inline]
    fn get(&self, i: usize) -> &[u32] {
        &self.ids[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

/// The context of a row's bits.
#[derive(Clone, Debug)]
pub(in crate::file) enum Guide {
    /// Other bits of the row and its reference only.
    Plain,
    /// A row of cells: a flood from the row's own cell through visible cells. Neighbours of each cell, by portals.
    Cells(Lists),
    /// A row of objects.
    Objects(Objects),
}

/// The context of rows of objects.
#[derive(Clone, Debug)]
pub(in crate::file) struct Objects {
    /// Neighbours of each cell, by portals.
    beside: Lists,
    /// The objects in each cell.
    placement: BitMatrix,
    /// Objects in no cell.
    nowhere: Vec<u64>,
    /// The cells that each cell sees; `None`: all.
    seen: Option<BitMatrix>,
}

impl Guide {
    /// For rows of cells: `portals` are pairs of cells.
    pub fn cells(cells: usize, portals: impl Iterator<Item = [u32; 2]>) -> Self {
        Self::Cells(beside(cells, portals))
    }

    /// For rows of objects.
    pub fn objects(portals: impl Iterator<Item = [u32; 2]>, placement: &BitMatrix, seen: Option<&BitMatrix>) -> Self {
        let mut nowhere = vec![0; placement.columns().div_ceil(64)];
        (0..placement.columns()).for_each(|object| set(&mut nowhere, object));
        for cell in 0..placement.rows() {
            nowhere.iter_mut().zip(placement.row(cell)).for_each(|(n, placed)| *n &= !placed);
        }
        let beside = beside(placement.rows(), portals);
        Self::Objects(Objects { beside, placement: placement.clone(), nowhere, seen: seen.cloned() })
    }

    /// Upper bound of the memory of [`Guide::cells`], bytes.
    pub fn cells_bytes(cells: usize, portals: usize) -> u64 {
        Lists::bytes(cells as u64, 2 * portals as u64)
    }

    /// Upper bound of the memory of [`Guide::objects`], bytes.
    pub fn objects_bytes(portals: usize, placement: &BitMatrix, seen: Option<&BitMatrix>) -> u64 {
        let matrix = |m: &BitMatrix| (m.rows() + 1) as u64 * m.columns().div_ceil(64) as u64 * 8;
        Self::cells_bytes(placement.rows(), portals) + matrix(placement) + seen.map_or(0, matrix)
    }
}

fn beside(cells: usize, portals: impl Iterator<Item = [u32; 2]>) -> Lists {
    Lists::new(cells, portals.flat_map(|[a, b]| [[a, b], [b, a]]))
}

/// Kinds of context in a class: 0 and 1: no reference, by the bit to the left; 2 to 9: the reference's bit above (4), its bit to the left
/// (2), the row's bit to the left (1).
const KINDS: usize = 10;
/// Most classes of a guide.
const CLASSES: usize = 8;
/// Number of length models for distances between listed columns.
const LENGTHS: usize = 31;

/// The adaptive models of a block.
#[derive(Clone, Debug)]
pub(in crate::file) struct Models {
    bits: [Model; CLASSES * KINDS],
    /// Whether another column is listed.
    more: Model,
    distance: [Model; LENGTHS],
    /// Lengths of references.
    pub back: [Model; 7],
}

impl Models {
    /// The models before the first row.
    pub fn new(guide: &Guide) -> Self {
        let start: &[[u8; KINDS]] = match guide {
            Guide::Plain => &PLAIN,
            Guide::Cells(_) => &CELLS,
            Guide::Objects(_) => &OBJECTS,
        };
        let mut bits = [Model::EVEN; CLASSES * KINDS];
        for (model, &one) in bits.iter_mut().zip(start.as_flattened()) {
            *model = Model::new(u16::from(one) << 8);
        }
        Self { bits, more: Model::new(600), distance: [Model::EVEN; LENGTHS], back: [Model::EVEN; 7] }
    }
}

// Starting probabilities of a set bit, in 256ths, by class and kind: the mean over both bounds of ten buildings and levels, with equal
// weights.

/// Class: whether the reference's next bit is set.
const PLAIN: [[u8; KINDS]; 2] =
    [[30, 227, 9, 159, 15, 64, 172, 213, 85, 209], [128, 128, 20, 155, 16, 80, 181, 212, 58, 228]];
/// Classes: the row's own cell; then the distance in portals, 1 to 4 or more. The bits to the left mean at least two, and at least three,
/// visible neighbours.
const CELLS: [[u8; KINDS]; 5] = [
    [253, 128, 252, 20, 20, 20, 253, 218, 218, 218],
    [253, 253, 231, 249, 20, 211, 253, 253, 218, 252],
    [113, 202, 7, 46, 20, 110, 170, 197, 218, 243],
    [17, 93, 5, 16, 20, 44, 67, 159, 218, 184],
    [42, 77, 11, 20, 20, 20, 110, 218, 218, 218],
];
/// Classes: objects in the row's cell, in a neighbour, in other cells, in none; two each: in one visible cell, and in more.
const OBJECTS: [[u8; KINDS]; 8] = [
    [247, 255, 245, 255, 20, 252, 239, 242, 225, 254],
    [251, 255, 247, 253, 238, 243, 253, 252, 251, 255],
    [54, 232, 12, 181, 18, 46, 157, 200, 63, 245],
    [174, 241, 78, 214, 67, 126, 219, 237, 170, 245],
    [11, 116, 5, 123, 9, 28, 84, 124, 24, 174],
    [98, 174, 47, 169, 35, 74, 169, 208, 141, 218],
    [6, 128, 2, 20, 20, 20, 218, 218, 218, 218],
    [6, 128, 2, 20, 20, 20, 218, 218, 218, 218],
];

/// Most steps of one row, about 2 ns each; a decision takes [`DECISION`].
pub(in crate::file) const STEPS: usize = 5_600;
const DECISION: usize = 3;
/// Steps of a row before its first decision.
const ROW: usize = 40;
/// Largest cost of a listed column, in decisions.
const LISTED: usize = 64;

/// The known context of a row.
#[derive(Clone, Copy)]
pub(in crate::file) struct Known<'r> {
    pub row: usize,
    /// Number of columns.
    pub columns: usize,
    /// A similar row.
    pub reference: Option<&'r [u64]>,
    /// Range of columns whose bits are known in advance.
    pub given: [usize; 2],
}

#[inline]
fn bit(words: &[u64], i: usize) -> bool {
    words[i / 64] >> (i % 64) & 1 != 0
}

#[inline]
fn set(words: &mut [u64], i: usize) {
    words[i / 64] |= 1 << (i % 64);
}

fn too_long(row: usize) -> String {
    format!("row {row} takes more than {STEPS} steps")
}

/// Scratch memory of walks.
#[derive(Clone, Debug, Default)]
pub(in crate::file) struct Scratch {
    /// Columns reached by the walk.
    reached: Vec<u64>,
    /// Neighbours of the row's cell.
    near: Vec<u64>,
    /// Objects in such a cell, and in more than one visible cell.
    close: Vec<u64>,
    twice: Vec<u64>,
    /// Visible cells, and the distance of their neighbours in portals.
    queue: Vec<(u32, u32)>,
}

/// Resets to `count` zero words.
fn clear(words: &mut Vec<u64>, count: usize) {
    words.clear();
    words.resize(count, 0);
}

/// The state of coding a row.
struct Walk<'w, C> {
    coder: &'w mut C,
    models: &'w mut Models,
    known: Known<'w>,
    truth: Option<&'w [u64]>,
    out: &'w mut [u64],
    scratch: &'w mut Scratch,
    /// The last coded bit, and its reference's.
    left: [bool; 2],
    steps: usize,
}

impl<C: Coder> Walk<'_, C> {
    /// Codes a bit by its class, the bit to the left, and the reference's bits above and to the left.
    #[inline]
    fn code(&mut self, class: usize, column: usize) -> bool {
        let above = self.known.reference.map(|r| bit(r, column));
        let left = usize::from(self.left[0]);
        let kind = above.map_or(left, |above| 2 + 4 * usize::from(above) + 2 * usize::from(self.left[1]) + left);
        let truth = self.truth.is_some_and(|row| bit(row, column));
        let is_set = self.coder.decide(&mut self.models.bits[class * KINDS + kind], truth);
        if is_set {
            set(self.out, column);
        }
        self.left = [is_set, above.unwrap_or(false)];
        self.steps += DECISION;
        is_set
    }

    fn may_go_on(&self) -> Result<(), String> {
        if self.steps > STEPS { Err(too_long(self.known.row)) } else { Ok(()) }
    }

    /// Codes every column.
    fn plain(&mut self) -> Result<(), String> {
        for column in 0..self.known.columns {
            // The reference's next bit, if there is one.
            let next = self.known.reference.is_some_and(|r| column + 1 < self.known.columns && bit(r, column + 1));
            self.code(usize::from(next), column);
            self.may_go_on()?;
        }
        Ok(())
    }

    /// Codes cells by a flood through visible cells, the nearest first.
    fn flood(&mut self, beside: &Lists) -> Result<(), String> {
        let Known { row, given: [first, last], .. } = self.known;
        self.scratch.queue.clear();
        set(&mut self.scratch.reached, row);
        if self.code(0, row) {
            self.scratch.queue.push((row as u32, 1));
        }
        let mut at = 0;
        while let Some(&(cell, distance)) = self.scratch.queue.get(at) {
            at += 1;
            for &next in beside.get(cell as usize) {
                let next = next as usize;
                self.steps += 1;
                if bit(&self.scratch.reached, next) {
                    continue;
                }
                set(&mut self.scratch.reached, next);
                let is_seen = if (first..last).contains(&next) {
                    bit(self.out, next)
                } else {
                    let around = beside.get(next);
                    self.steps += around.len();
                    let seen = around.iter().filter(|&&cell| bit(self.out, cell as usize)).count();
                    // Neighbours have no order, so the number of visible neighbours replaces the bit to the left.
                    self.left = [seen > 1, seen > 2];
                    self.code(distance as usize, next)
                };
                if is_seen {
                    self.scratch.queue.push((next as u32, (distance + 1).min(4)));
                }
                self.may_go_on()?;
            }
        }
        (first..last).for_each(|column| set(&mut self.scratch.reached, column));
        Ok(())
    }

    /// Codes objects in visible cells, and those in no cell.
    fn objects(&mut self, objects: &Objects) -> Result<(), String> {
        let Objects { beside, placement, nowhere, seen } = objects;
        let (row, words) = (self.known.row, self.out.len());
        let Scratch { reached, near, close, twice, .. } = &mut *self.scratch;
        clear(near, placement.rows().div_ceil(64));
        clear(close, words);
        clear(twice, words);
        let mut visited = 3 * words;
        beside.get(row).iter().for_each(|&cell| set(near, cell as usize));
        reached.copy_from_slice(placement.row(row));
        let mut join = |cell: usize| {
            let mask = if bit(near, cell) { u64::MAX } else { 0 };
            let words_of = reached.iter_mut().zip(twice.iter_mut().zip(close.iter_mut()));
            for (&placed, (reached, (twice, close))) in placement.row(cell).iter().zip(words_of) {
                *twice |= *reached & placed;
                *reached |= placed;
                *close |= placed & mask;
            }
            visited += words;
            if visited > 4 * STEPS { Err(too_long(row)) } else { Ok(()) }
        };
        match seen {
            Some(seen) => seen.ones(row).filter(|&cell| cell != row).try_for_each(&mut join)?,
            None => (0..placement.rows()).filter(|&cell| cell != row).try_for_each(&mut join)?,
        }
        self.steps += visited / 4;
        for i in 0..words {
            let Scratch { reached, close, twice, .. } = &mut *self.scratch;
            reached[i] |= nowhere[i];
            let (own, nowhere, close, twice) = (placement.row(row)[i], nowhere[i], close[i], twice[i]);
            let mut left = reached[i];
            while left != 0 {
                let at = left.trailing_zeros();
                left &= left - 1;
                let is = |word: u64| word >> at & 1 != 0;
                let class = match () {
                    () if is(own) => 0,
                    () if is(close) => 1,
                    () if is(nowhere) => 3,
                    () => 2,
                };
                self.code(2 * class + usize::from(is(twice)), 64 * i + at as usize);
            }
            self.may_go_on()?;
        }
        Ok(())
    }

    /// Codes set columns outside the walk, one by one.
    fn listed(&mut self) -> Result<(), String> {
        let missed = |truth: &[u64]| truth.iter().zip(&self.scratch.reached).map(|(t, r)| t & !r).collect::<Vec<u64>>();
        let missed = self.truth.map(missed).unwrap_or_default();
        let (mut list, mut next) = (bits::ones(&missed), 0);
        loop {
            let column = list.next();
            if !self.coder.decide(&mut self.models.more, column.is_some()) {
                return Ok(());
            }
            self.steps += LISTED * DECISION;
            self.may_go_on()?;
            let distance = column.map_or(0, |column| column - next) as u32;
            let column = next + self.coder.number(&mut self.models.distance, distance) as usize;
            if column >= self.known.columns || bit(&self.scratch.reached, column) {
                return Err(format!("column {column} can't be listed for row {}", self.known.row));
            }
            set(self.out, column);
            next = column + 1;
        }
    }
}

impl Guide {
    /// Codes a row, `truth` when writing and `None` when reading, and sets its bits in `out`. Returns the number of steps, or the fault.
    pub(in crate::file) fn walk<C: Coder>(
        &self,
        coder: &mut C,
        models: &mut Models,
        known: Known<'_>,
        truth: Option<&[u64]>,
        out: &mut [u64],
        scratch: &mut Scratch,
    ) -> Result<usize, String> {
        clear(&mut scratch.reached, out.len());
        let mut walk = Walk { coder, models, known, truth, out, scratch, left: [false; 2], steps: ROW };
        match self {
            Self::Plain => {
                walk.plain()?;
                return Ok(walk.steps);
            }
            Self::Cells(beside) => walk.flood(beside)?,
            Self::Objects(objects) => walk.objects(objects)?,
        }
        walk.listed()?;
        Ok(walk.steps)
    }
}
