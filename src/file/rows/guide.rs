//! What a row is expected to hold, by what the file holds anyway: a cell is seen past a cell that is seen and beside it, an
//! object is seen only if a cell that it is in is seen.
//!
//! A guide walks the columns that may be set and gives each a context; columns that the walk doesn't come to are listed one by
//! one where they are set, which is rare. The walk is the same for writing and for reading: it knows no bit before it is coded.

use super::coder::{Coder, Model};
use crate::{BitMatrix, bits};

/// Lists of ids, one after the other.
#[derive(Clone, Debug, Default)]
pub(in crate::file) struct Lists {
    starts: Vec<u32>,
    ids: Vec<u32>,
}

impl Lists {
    /// `count` lists of pairs of a list and an id; ascending, each id once.
    pub fn new(count: usize, pairs: impl Iterator<Item = [u32; 2]>) -> Self {
        let mut pairs: Vec<[u32; 2]> = pairs.collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut starts = vec![0; count + 1];
        pairs.iter().for_each(|&[list, _]| starts[list as usize + 1] += 1);
        (0..count).for_each(|i| starts[i + 1] += starts[i]);
        Self { starts, ids: pairs.into_iter().map(|[_, id]| id).collect() }
    }

    /// Most bytes that so many lists of so many pairs take while they are made: pairs, which grow by doubling, and ids.
    fn bytes(lists: u64, pairs: u64) -> u64 {
        (4 * lists).saturating_add(pairs.saturating_mul(28))
    }

    #[inline]
    fn get(&self, i: usize) -> &[u32] {
        &self.ids[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

/// What the bits of a row depend on.
#[derive(Clone, Debug)]
pub(in crate::file) enum Guide {
    /// Nothing but each other.
    Plain,
    /// A row of cells: floods from the row's own cell through the cells that are seen. For each cell those beside it, by portals.
    Cells(Lists),
    /// A row of objects.
    Objects(Objects),
}

/// What rows of objects depend on.
#[derive(Clone, Debug)]
pub(in crate::file) struct Objects {
    /// For each cell those beside it, by portals.
    beside: Lists,
    /// Which objects are in which cell.
    placement: BitMatrix,
    /// Objects in no cell.
    nowhere: Vec<u64>,
    /// Which cells each cell sees; `None`: all.
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

    /// Most bytes that [`Guide::cells`] takes.
    pub fn cells_bytes(cells: usize, portals: usize) -> u64 {
        Lists::bytes(cells as u64, 2 * portals as u64)
    }

    /// Most bytes that [`Guide::objects`] takes.
    pub fn objects_bytes(portals: usize, placement: &BitMatrix, seen: Option<&BitMatrix>) -> u64 {
        let matrix = |m: &BitMatrix| (m.rows() + 1) as u64 * m.columns().div_ceil(64) as u64 * 8;
        Self::cells_bytes(placement.rows(), portals) + matrix(placement) + seen.map_or(0, matrix)
    }
}

fn beside(cells: usize, portals: impl Iterator<Item = [u32; 2]>) -> Lists {
    Lists::new(cells, portals.flat_map(|[a, b]| [[a, b], [b, a]]))
}

/// Kinds of context in a class: 0 and 1, nothing to refer to, and the bit to the left; 2 to 9, the reference's bit above (4), its
/// bit to the left (2), the row's bit to the left (1).
const KINDS: usize = 10;
/// Most classes that a guide has.
const CLASSES: usize = 8;
/// Lengths of distances between listed columns.
const LENGTHS: usize = 31;

/// What has been learned of a matrix, from the first row of a block on.
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
    /// Before the first row.
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

// How likely a bit is set before anything has been learned, of 256, by class and kind: the mean over both sides of ten
// buildings and levels, each counting alike.

/// By whether the reference's next bit is set.
const PLAIN: [[u8; KINDS]; 2] =
    [[30, 227, 9, 159, 15, 64, 172, 213, 85, 209], [128, 128, 20, 155, 16, 80, 181, 212, 58, 228]];
/// The row's own cell; then by the distance in portals, 1 to 4 or more. The bits to the left stand for two or more, three or more
/// cells beside it that are seen.
const CELLS: [[u8; KINDS]; 5] = [
    [253, 128, 252, 20, 20, 20, 253, 218, 218, 218],
    [253, 253, 231, 249, 20, 211, 253, 253, 218, 252],
    [113, 202, 7, 46, 20, 110, 170, 197, 218, 243],
    [17, 93, 5, 16, 20, 44, 67, 159, 218, 184],
    [42, 77, 11, 20, 20, 20, 110, 218, 218, 218],
];
/// Two each, in one of the cells that are seen and in more: objects in the row's cell, in a cell beside it, in others, in none.
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

/// Steps, of about 2 ns, that one row may take; a decision is [`DECISION`] of them.
pub(in crate::file) const STEPS: usize = 5_600;
const DECISION: usize = 3;
/// Steps of a row before its first decision.
const ROW: usize = 40;
/// A listed column costs as many decisions, at most.
const LISTED: usize = 64;

/// What a row goes by.
#[derive(Clone, Copy)]
pub(in crate::file) struct Known<'r> {
    pub row: usize,
    /// Number of columns.
    pub columns: usize,
    /// A row that is much like it.
    pub reference: Option<&'r [u64]>,
    /// Columns, from and up to, whose bits stand in the row from the start.
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

/// Memory of a walk, to be used again.
#[derive(Clone, Debug, Default)]
pub(in crate::file) struct Scratch {
    /// Columns that the walk came to.
    reached: Vec<u64>,
    /// Cells beside the row's.
    near: Vec<u64>,
    /// Objects in such a cell, and in more than one cell that is seen.
    close: Vec<u64>,
    twice: Vec<u64>,
    /// Cells that are seen, and how many portals away those beside them are.
    queue: Vec<(u32, u32)>,
}

/// All of `count` words clear.
fn clear(words: &mut Vec<u64>, count: usize) {
    words.clear();
    words.resize(count, 0);
}

/// A row on its way.
struct Walk<'w, C> {
    coder: &'w mut C,
    models: &'w mut Models,
    known: Known<'w>,
    truth: Option<&'w [u64]>,
    out: &'w mut [u64],
    scratch: &'w mut Scratch,
    /// The bit coded last, and its reference's.
    left: [bool; 2],
    steps: usize,
}

impl<C: Coder> Walk<'_, C> {
    /// Codes a bit by its class, the bit to the left, and those of the reference above and to the left.
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

    /// Every column.
    fn plain(&mut self) -> Result<(), String> {
        for column in 0..self.known.columns {
            // The reference's next bit, where there is one.
            let next = self.known.reference.is_some_and(|r| column + 1 < self.known.columns && bit(r, column + 1));
            self.code(usize::from(next), column);
            self.may_go_on()?;
        }
        Ok(())
    }

    /// Cells, the nearest first, as long as they are seen.
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
                    // Neighbours come in any order, so that nothing is to the left: how many cells beside it are seen.
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

    /// Objects in cells that are seen, and those in no cell.
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

    /// Columns that are set and that the walk didn't come to, one by one.
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
    /// Codes a row, `truth` when writing and `None` when reading, and sets its bits in `out`. Gives the steps that it took, or
    /// what is wrong with it.
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
