//! Columns: the cells that see an object, or any of the objects with a mesh.

use enfilade::file::PvsFile;
use enfilade::math::bits::ones;
use enfilade::{CellId, ObjectId};

/// Something to load: an object, or a mesh that several objects share.
#[derive(Clone)]
pub(crate) struct Item {
    /// The cells that need it, a bit per cell.
    pub(crate) column: Vec<u64>,
    /// Bytes that it will take, about; above 0.
    pub(crate) weight: u64,
    /// A cell that it is in.
    pub(crate) home: Option<usize>,
}

/// The column of each object.
pub(crate) fn columns(file: &PvsFile) -> Vec<Vec<u64>> {
    let mut columns = vec![vec![0u64; file.cells.len().div_ceil(64)]; file.objects.len()];
    for cell in 0..file.cells.len() {
        for ObjectId(object) in file.objects_seen(CellId(cell as u32)) {
            columns[object as usize][cell / 64] |= 1 << (cell % 64);
        }
    }
    columns
}

/// The first cell of each object's placement.
pub(crate) fn homes(file: &PvsFile) -> Vec<Option<usize>> {
    let mut homes = vec![None; file.objects.len()];
    for cell in 0..file.placement.rows() {
        for object in file.placement.ones(cell) {
            homes[object].get_or_insert(cell);
        }
    }
    homes
}

/// The cells behind a cell's portals, ascending.
pub(crate) fn neighbours(file: &PvsFile) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new(); file.cells.len()];
    for [a, b] in file.portals.iter().map(|portal| portal.cells.map(CellId::index)) {
        all[a].push(b);
        all[b].push(a);
    }
    for list in &mut all {
        list.sort_unstable();
        list.dedup();
    }
    all
}

/// Number of cells of a column.
pub(crate) fn count(column: &[u64]) -> u64 {
    column.iter().map(|word| u64::from(word.count_ones())).sum()
}

/// Number of cells of both columns.
pub(crate) fn common(a: &[u64], b: &[u64]) -> u64 {
    a.iter().zip(b).map(|(a, b)| u64::from((a & b).count_ones())).sum()
}

/// Cells of both columns.
pub(crate) fn both<'c>(a: &'c [u64], b: &'c [u64]) -> impl Iterator<Item = usize> + 'c {
    joined(a, b, |a, b| a & b)
}

/// The cells of `a` that are not in `b`.
pub(crate) fn without<'c>(a: &'c [u64], b: &'c [u64]) -> impl Iterator<Item = usize> + 'c {
    joined(a, b, |a, b| a & !b)
}

fn joined<'c>(a: &'c [u64], b: &'c [u64], word: fn(u64, u64) -> u64) -> impl Iterator<Item = usize> + 'c {
    let words = a.iter().zip(b).enumerate();
    words.flat_map(move |(number, (a, b))| ones_of(word(*a, *b)).map(move |bit| number * 64 + bit))
}

fn ones_of(word: u64) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(word), |word| Some(word & word.wrapping_sub(1)))
        .take_while(|word| *word != 0)
        .map(|w| w.trailing_zeros() as usize)
}

/// For each cell, the bytes of all items that it needs.
pub(crate) fn needs<'i>(items: impl IntoIterator<Item = &'i Item>, cells: usize) -> Vec<u64> {
    let mut needs = vec![0; cells];
    for item in items {
        ones(&item.column).for_each(|cell| needs[cell] += item.weight);
    }
    needs
}
