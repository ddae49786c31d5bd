//! Context models of rows, from data in the file: a visible cell usually has a visible neighbour, and an object is visible only if one of
//! its cells is.
//!
//! A guide walks the columns that may be set, and gives each a context; set columns outside the walk, which are rare, are listed one by
//! one. The walk is the same for writing and reading: it depends only on bits coded before.

use super::arithmetic::{Coder, Model};
use crate::BitMatrix;
use crate::math::{bits, sorting};

/// Lists of ids, concatenated.
#[derive(Clone, Debug, Default)]
pub(in crate::file) struct Lists {
    starts: Vec<u32>,
    ids: Vec<u32>,
}

impl Lists {
    /// Lists in order.
    fn new<I: Iterator<Item = u32>>(lists: impl Iterator<Item = I>) -> Self {
        let (mut starts, mut ids) = (vec![0], Vec::new());
        for list in lists {
            ids.extend(list);
            starts.push(ids.len() as u32);
        }
        Self { starts, ids }
    }

    /// Upper bound of the memory to build lists of `ids` in all, bytes: both lists grow by doubling, as may one for each list.
    fn bytes(lists: u64, ids: u64) -> u64 {
        (36 * lists).saturating_add(ids.saturating_mul(28))
    }

    #[inline]
    fn get(&self, i: usize) -> &[u32] {
        &self.ids[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

/// The context of a row's bits.
#[derive(Clone, Debug)]
pub(in crate::file) enum Guide<'f> {
    /// Other bits of the row and its reference only.
    Plain,
    /// A row of cells: a flood from the row's own cell through visible cells. Neighbours of each cell, by portals.
    Cells(Lists),
    /// A row of objects.
    Objects(Objects<'f>),
}

/// The context of rows of objects.
#[derive(Clone, Debug)]
pub(in crate::file) struct Objects<'f> {
    /// Neighbours of each cell, by portals.
    beside: Lists,
    /// The objects in each cell.
    placement: &'f BitMatrix,
    /// The same, as lists by cell.
    placed: Lists,
    /// Objects in no cell.
    nowhere: Vec<u64>,
    /// The cells that each cell sees; `None`: all.
    seen: Option<&'f BitMatrix>,
}

impl<'f> Guide<'f> {
    /// For rows of cells: `portals` are pairs of cells.
    pub fn cells(cells: usize, portals: impl Iterator<Item = [u32; 2]>) -> Self {
        Self::Cells(beside(cells, portals))
    }

    /// For rows of objects.
    pub fn objects(portals: impl Iterator<Item = [u32; 2]>, placement: &'f BitMatrix, seen: Option<&'f BitMatrix>) -> Self {
        let mut nowhere = vec![0; placement.columns().div_ceil(64)];
        (0..placement.columns()).for_each(|object| set(&mut nowhere, object));
        for cell in 0..placement.rows() {
            nowhere.iter_mut().zip(placement.row(cell)).for_each(|(n, placed)| *n &= !placed);
        }
        let beside = beside(placement.rows(), portals);
        let placed = Lists::new((0..placement.rows()).map(|cell| placement.ones(cell).map(|object| object as u32)));
        Self::Objects(Objects { beside, placement, placed, nowhere, seen })
    }

    /// Upper bound of the memory of [`Guide::cells`], bytes.
    pub fn cells_bytes(cells: usize, portals: usize) -> u64 {
        Lists::bytes(cells as u64, 2 * portals as u64)
    }

    /// Upper bound of the memory of [`Guide::objects`], bytes.
    pub fn objects_bytes(portals: usize, placement: &BitMatrix) -> u64 {
        let placed = Lists::bytes(placement.rows() as u64, placement.count_ones());
        Self::cells_bytes(placement.rows(), portals) + placed + placement.columns() as u64 / 8
    }
}

/// The neighbours of each cell; ascending, each once.
fn beside(cells: usize, portals: impl Iterator<Item = [u32; 2]>) -> Lists {
    let mut beside = vec![Vec::new(); cells];
    for [a, b] in portals {
        beside[a as usize].push(b);
        beside[b as usize].push(a);
    }
    let mut spare = Vec::new();
    for list in &mut beside {
        sorting::sort(list, &mut spare, &|a, b| a < b);
        list.dedup();
    }
    Lists::new(beside.into_iter().map(Vec::into_iter))
}

/// Kinds of context in a class: 0 and 1: no reference, by the bit to the left; 2 to 9: the reference's bit above (4), its bit to the left
/// (2), the row's bit to the left (1).
const KINDS: usize = 10;
/// Most classes of a guide.
const CLASSES: usize = 8;
/// Number of length models for distances between listed columns.
const LENGTHS: usize = 31;

/// The adaptive models of a matrix.
#[derive(Clone, Debug)]
pub(in crate::file) struct Models {
    bits: [Model; CLASSES * KINDS],
    /// Whether another column is listed.
    more: Model,
    distance: [Model; LENGTHS],
    /// Lengths of references.
    back: [Model; 7],
    /// Whether a row is its reference.
    equal: Model,
    /// Whether a word is that of the reference: with a reference (4), whose word has no bits (2), after a word that was (1).
    same: [Model; 8],
}

impl Models {
    /// The models before the first row.
    pub fn new(guide: &Guide<'_>) -> Self {
        let start: &[[u8; KINDS]] = match guide {
            Guide::Plain => &PLAIN,
            Guide::Cells(_) => &CELLS,
            Guide::Objects(_) => &OBJECTS,
        };
        let mut bits = [Model::EVEN; CLASSES * KINDS];
        for (model, &one) in bits.iter_mut().zip(start.as_flattened()) {
            *model = Model::new(u16::from(one) << 8);
        }
        Self {
            bits,
            more: Model::new(600),
            distance: [Model::EVEN; LENGTHS],
            back: [Model::EVEN; 7],
            equal: Model::EVEN,
            same: [Model::EVEN; 8],
        }
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

/// Most visits of a matrix: of a cell's neighbours, of objects in a cell, or of words of them. About a nanosecond each.
const VISITS: u64 = 1 << 31;

/// The known context of a row.
#[derive(Clone, Copy)]
pub(in crate::file) struct Known<'r> {
    pub row: usize,
    /// Number of columns.
    pub columns: usize,
    /// Bits of columns below this one are known in advance.
    pub given: usize,
    /// The matrix; only rows above are read.
    pub above: &'r BitMatrix,
}

#[inline]
fn bit(words: &[u64], i: usize) -> bool {
    words[i / 64] >> (i % 64) & 1 != 0
}

#[inline]
fn set(words: &mut [u64], i: usize) {
    words[i / 64] |= 1 << (i % 64);
}

/// All of `count` words clear.
fn clear(words: &mut Vec<u64>, count: usize) {
    words.clear();
    words.resize(count, 0);
}

/// Codes the rows of a matrix, one after the other.
pub(in crate::file) struct Walker<'g> {
    guide: &'g Guide<'g>,
    /// Columns reached by the walk.
    reached: Vec<u64>,
    /// Neighbours of the row's cell.
    near: Vec<u64>,
    /// Objects in such a cell, and in more than one visible cell.
    close: Vec<u64>,
    twice: Vec<u64>,
    /// Visible cells, and the distance of their neighbours in portals.
    queue: Vec<(u32, u32)>,
    visits: u64,
}

impl<'g> Walker<'g> {
    /// A walker before the first row.
    pub fn new(guide: &'g Guide<'g>) -> Self {
        let (reached, near, close, twice, queue) = Default::default();
        Self { guide, reached, near, close, twice, queue, visits: 0 }
    }

    /// Codes a row. The first `known.given` bits are in `out`; the others are set there. `truth`: when writing, the row and the distance of
    /// its reference. Returns the fault.
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        models: &mut Models,
        known: Known<'_>,
        truth: Option<(&[u64], usize)>,
        out: &mut [u64],
    ) -> Result<(), String> {
        if coder.is_beyond() {
            return Err(format!("the bytes end before row {}", known.row));
        }
        let back = coder.number(&mut models.back, truth.map_or(0, |(_, back)| back as u32)) as usize;
        let reference = match known.row.checked_sub(back) {
            None => return Err(format!("a reference {back} rows back from row {}", known.row)),
            Some(_) if back == 0 => None,
            Some(row) => Some(known.above.row(row)),
        };
        let truth = truth.map(|(row, _)| row);
        if let Some(reference) = reference
            && coder.decide(&mut models.equal, truth == Some(reference))
        {
            out.copy_from_slice(reference);
            return Ok(());
        }
        let (guide, left) = (self.guide, [false; 2]);
        let mut row = Row { coder, models, known, reference, truth, out, walker: self, left };
        match guide {
            Guide::Plain => {
                row.plain();
                return Ok(());
            }
            Guide::Cells(beside) => row.flood(beside)?,
            Guide::Objects(objects) => row.objects(objects)?,
        }
        row.listed()
    }

    fn visit(&mut self, count: usize) -> Result<(), String> {
        self.visits += count as u64;
        if self.visits > VISITS { Err(format!("more than {VISITS} visits")) } else { Ok(()) }
    }

    /// Codes a row without counting visits, to measure its cost.
    #[cfg(feature = "bake")]
    pub fn trial<C: Coder>(
        &mut self,
        coder: &mut C,
        models: &mut Models,
        known: Known<'_>,
        truth: Option<(&[u64], usize)>,
        out: &mut [u64],
    ) {
        let visits = self.visits;
        // A row with too many visits fails again in `code`.
        _ = self.code(coder, models, known, truth, out);
        self.visits = visits;
    }
}

/// The state of coding a row.
struct Row<'w, 'g, C> {
    coder: &'w mut C,
    models: &'w mut Models,
    known: Known<'w>,
    /// A row that is much like it.
    reference: Option<&'w [u64]>,
    truth: Option<&'w [u64]>,
    out: &'w mut [u64],
    walker: &'w mut Walker<'g>,
    /// The last coded bit, and its reference's.
    left: [bool; 2],
}

impl<C: Coder> Row<'_, '_, C> {
    /// Codes a bit by its class, the bit to the left, and the reference's bits above and to the left.
    #[inline]
    fn code(&mut self, class: usize, column: usize) -> bool {
        let above = self.reference.map(|r| bit(r, column));
        let left = usize::from(self.left[0]);
        let kind = above.map_or(left, |above| 2 + 4 * usize::from(above) + 2 * usize::from(self.left[1]) + left);
        let truth = self.truth.is_some_and(|row| bit(row, column));
        let is_set = self.coder.decide(&mut self.models.bits[class * KINDS + kind], truth);
        if is_set {
            set(self.out, column);
        }
        self.left = [is_set, above.unwrap_or(false)];
        is_set
    }

    /// Codes every column, word by word: a word equals the reference's, or is coded bit by bit.
    fn plain(&mut self) {
        let mut was_same = true;
        let Known { columns, given, .. } = self.known;
        for word in given / 64..self.out.len() {
            let open = if word == given / 64 { u64::MAX << (given % 64) } else { u64::MAX };
            let above = self.reference.map_or(0, |r| r[word]) & open;
            let has_reference = self.reference.is_some();
            let context = 4 * usize::from(has_reference) + 2 * usize::from(above == 0) + usize::from(was_same);
            let is_same = self.truth.is_some_and(|row| row[word] & open == above);
            was_same = self.coder.decide(&mut self.models.same[context], is_same);
            if was_same {
                self.out[word] |= above;
                continue;
            }
            self.left = [false; 2];
            for column in (64 * word).max(given)..(64 * word + 64).min(columns) {
                // The reference's next bit, if there is one.
                let next = self.reference.is_some_and(|r| column + 1 < columns && bit(r, column + 1));
                self.code(usize::from(next), column);
            }
        }
    }

    /// Codes cells by a flood through visible cells, the nearest first.
    fn flood(&mut self, beside: &Lists) -> Result<(), String> {
        let Known { row, given, .. } = self.known;
        clear(&mut self.walker.reached, self.out.len());
        self.walker.queue.clear();
        set(&mut self.walker.reached, row);
        if self.code(0, row) {
            self.walker.queue.push((row as u32, 1));
        }
        let mut at = 0;
        while let Some(&(cell, distance)) = self.walker.queue.get(at) {
            at += 1;
            for &next in beside.get(cell as usize) {
                let next = next as usize;
                if bit(&self.walker.reached, next) {
                    continue;
                }
                set(&mut self.walker.reached, next);
                let is_seen = if next < given {
                    bit(self.out, next)
                } else {
                    let around = beside.get(next);
                    self.walker.visit(around.len())?;
                    let seen = around.iter().filter(|&&cell| bit(self.out, cell as usize)).count();
                    // Neighbours have no order, so the number of visible neighbours replaces the bit to the left.
                    self.left = [seen > 1, seen > 2];
                    self.code(distance as usize, next)
                };
                if is_seen {
                    self.walker.queue.push((next as u32, (distance + 1).min(4)));
                }
            }
            self.walker.visit(beside.get(cell as usize).len())?;
        }
        let reached = &mut self.walker.reached;
        reached[..given / 64].fill(u64::MAX);
        if given % 64 > 0 {
            reached[given / 64] |= u64::MAX >> (64 - given % 64);
        }
        Ok(())
    }

    /// Codes objects in visible cells, and those in no cell.
    fn objects(&mut self, objects: &Objects<'_>) -> Result<(), String> {
        let Objects { beside, placement, nowhere, seen, .. } = objects;
        let (row, words) = (self.known.row, self.out.len());
        clear(&mut self.walker.near, placement.rows().div_ceil(64));
        clear(&mut self.walker.close, words);
        clear(&mut self.walker.twice, words);
        beside.get(row).iter().for_each(|&cell| set(&mut self.walker.near, cell as usize));
        clear(&mut self.walker.reached, words);
        self.walker.reached.copy_from_slice(placement.row(row));
        match seen {
            Some(seen) => seen.ones(row).filter(|&cell| cell != row).try_for_each(|cell| self.walker.join(objects, cell))?,
            None => {
                (0..placement.rows()).filter(|&cell| cell != row).try_for_each(|cell| self.walker.join(objects, cell))?
            }
        }
        self.walker.visit(words)?;
        for i in 0..words {
            let Walker { reached, close, twice, .. } = &mut *self.walker;
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
        }
        Ok(())
    }

    /// Codes set columns outside the walk, one by one.
    fn listed(&mut self) -> Result<(), String> {
        let missed = |truth: &[u64]| truth.iter().zip(&self.walker.reached).map(|(t, r)| t & !r).collect::<Vec<u64>>();
        let missed = self.truth.map(missed).unwrap_or_default();
        let (mut list, mut next) = (bits::ones(&missed), 0);
        loop {
            let column = list.next();
            if !self.coder.decide(&mut self.models.more, column.is_some()) {
                return Ok(());
            }
            let distance = column.map_or(0, |column| column - next) as u32;
            let column = next + self.coder.number(&mut self.models.distance, distance) as usize;
            if column >= self.known.columns || bit(&self.walker.reached, column) {
                return Err(format!("column {column} can't be listed for row {}", self.known.row));
            }
            set(self.out, column);
            next = column + 1;
        }
    }
}

impl Walker<'_> {
    /// Adds the objects of a visible cell.
    fn join(&mut self, objects: &Objects<'_>, cell: usize) -> Result<(), String> {
        let is_near = bit(&self.near, cell);
        let placed = objects.placed.get(cell);
        let words = self.reached.len();
        if placed.len() < words {
            for &object in placed {
                let (word, at) = (object as usize / 64, 1 << (object % 64));
                self.twice[word] |= self.reached[word] & at;
                self.reached[word] |= at;
                self.close[word] |= if is_near { at } else { 0 };
            }
        } else {
            let near = if is_near { u64::MAX } else { 0 };
            for (word, &placed) in objects.placement.row(cell).iter().enumerate() {
                self.twice[word] |= self.reached[word] & placed;
                self.reached[word] |= placed;
                self.close[word] |= placed & near;
            }
        }
        self.visit(placed.len().min(words) + 1)
    }
}
