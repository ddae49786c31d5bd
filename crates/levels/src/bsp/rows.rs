//! The visibility lump.
//!
//! A row has a bit for each cell, lowest bit first. Run-length code: a nonzero byte stands for itself; a zero is followed by the number
//! of zeros, 1 to 255. See [`Rows`] for where a row is found.

use super::error::{BspError, entry, lump as fault};
use super::file::LevelFile;
use super::layout::{Lump, Rows};
use super::record::u32;
use super::tree::Tree;
use crate::MOST_CLUSTERS;
use enfilade::BitMatrix;

/// Of the lump's head: the number of clusters, and per cluster two offsets; or the bytes of a row ([`Rows::Plain`]).
const HEAD: usize = 4;
const PLAIN_HEAD: usize = 8;
/// Plain rows are whole words of this many bits.
const PLAIN_BITS: usize = 64;

/// The rows of a file, and the second ones that some games have.
pub(super) struct Decoded {
    pub rows: BitMatrix,
    pub second: Option<BitMatrix>,
}

/// Rows of all cells; `None` without rows.
pub(super) fn decode(file: &LevelFile, tree: &Tree) -> Result<Option<Decoded>, BspError> {
    let lump = file.lump(Lump::Visibility)?;
    if lump.is_empty() {
        return Ok(None);
    }
    let n = tree.cells;
    let beyond =
        |of: Lump, at: usize, offset: usize| entry(of, at, format!("its row at byte {offset} goes on beyond the lump"));
    Ok(Some(match file.layout.rows {
        Rows::ByLeaf => {
            let mut rows = BitMatrix::new(n, n);
            for cell in 0..n {
                match usize::try_from(tree.leaves[cell + 1].row) {
                    Err(_) => (0..n).for_each(|c| _ = rows.set(cell, c)),
                    Ok(offset) => {
                        let row = lump.get(offset..).and_then(|code| expand(code, n.div_ceil(8)));
                        set(&mut rows, cell, &row.ok_or_else(|| beyond(Lump::Leaves, cell + 1, offset))?);
                    }
                }
            }
            Decoded { rows, second: None }
        }
        Rows::ByCluster(_) => {
            let end = HEAD + 8 * n;
            if n as u64 > MOST_CLUSTERS || lump.len() < end {
                return Err(fault(
                    Lump::Visibility,
                    format!("has {} bytes, too few for the offsets of {n} clusters", lump.len()),
                ));
            }
            let offsets = file.records(Lump::Visibility, &lump[HEAD..end], 8)?;
            let mut both = [BitMatrix::new(n, n), BitMatrix::new(n, n)];
            for cluster in 0..n {
                for (rows, at) in both.iter_mut().zip([0, 4]) {
                    let offset = offsets.index(cluster, u32(at));
                    let row = lump.get(offset..).and_then(|code| expand(code, n.div_ceil(8)));
                    set(rows, cluster, &row.ok_or_else(|| beyond(Lump::Visibility, cluster, offset))?);
                }
            }
            let [rows, second] = both;
            Decoded { rows, second: Some(second) }
        }
        Rows::Plain => {
            if lump.len() < PLAIN_HEAD {
                return Err(fault(Lump::Visibility, "ends within its head"));
            }
            let size = file.records(Lump::Visibility, &lump[..PLAIN_HEAD], PLAIN_HEAD)?.index(0, u32(4));
            let (needed, rest) = (n.saturating_mul(size), lump.len() - PLAIN_HEAD);
            if size < n.div_ceil(8) || needed > rest {
                let what = format!("has {rest} bytes for {n} rows of {size} bytes");
                return Err(fault(Lump::Visibility, what));
            }
            let mut rows = BitMatrix::new(n, n);
            for cluster in 0..n {
                let from = PLAIN_HEAD + cluster * size;
                set(&mut rows, cluster, &lump[from..from + size]);
            }
            Decoded { rows, second: None }
        }
    }))
}

/// A row's bits; those beyond the last cell mean nothing.
fn set(rows: &mut BitMatrix, row: usize, bits: &[u8]) {
    (0..rows.columns()).filter(|c| bits[c / 8] >> (c % 8) & 1 != 0).for_each(|c| _ = rows.set(row, c));
}

/// A row of `length` bytes; `None` if its code ends too early or counts no zeros.
fn expand(code: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut row = Vec::with_capacity(length);
    let mut code = code.iter();
    while row.len() < length {
        match *code.next()? {
            0 => match *code.next()? {
                0 => return None,
                zeros => row.resize((row.len() + usize::from(zeros)).min(length), 0),
            },
            byte => row.push(byte),
        }
    }
    Some(row)
}

/// Run-length codes a row.
fn compress(row: &[u8]) -> Vec<u8> {
    let mut code = Vec::new();
    for run in row.chunk_by(|a, b| *a == 0 && *b == 0) {
        match run {
            [0, ..] => run.chunks(255).for_each(|zeros| code.extend([0, zeros.len() as u8])),
            _ => code.extend_from_slice(run),
        }
    }
    code
}

/// A row's bytes: the columns for which `is_set`, of `columns`, in whole words of `word` bits.
fn bytes_of(columns: usize, word: usize, is_set: impl Fn(usize) -> bool) -> Vec<u8> {
    let mut row = vec![0u8; columns.div_ceil(word) * (word / 8)];
    (0..columns).for_each(|c| row[c / 8] |= u8::from(is_set(c)) << (c % 8));
    row
}

/// A new lump, and the offset of each row in games that keep it in the leaves.
pub(super) struct Encoded {
    pub lump: Vec<u8>,
    pub offsets: Vec<i32>,
    /// Ordered pairs of the second rows.
    pub heard_pairs: Option<u64>,
}

/// Codes rows of clusters; `clusters`: the cluster of each cell of the level.
pub(super) fn encode(file: &LevelFile, rows: &BitMatrix, clusters: &[u32]) -> Result<Encoded, BspError> {
    let mut out = Encoded { lump: Vec::new(), offsets: Vec::new(), heard_pairs: None };
    let n = rows.rows();
    match file.layout.rows {
        Rows::ByLeaf => {
            for cluster in 0..n {
                out.offsets.push(i32::try_from(out.lump.len()).map_err(|_| BspError::TooLong)?);
                out.lump.extend(compress(&bytes_of(clusters.len(), 8, |leaf| rows.get(cluster, clusters[leaf] as usize))));
            }
        }
        Rows::ByCluster(_) => {
            let second = heard(rows);
            out.heard_pairs = Some(second.count_ones());
            let mut offsets: Vec<u32> = Vec::new();
            let mut codes = Vec::new();
            for rows in [rows, &second] {
                for cluster in 0..n {
                    let offset = HEAD + 8 * n + codes.len();
                    offsets.push(i32::try_from(offset).map_err(|_| BspError::TooLong)? as u32);
                    codes.extend(compress(&bytes_of(n, 8, |c| rows.get(cluster, c))));
                }
            }
            out.lump.extend(file.bytes_of(n as u32));
            (0..n).for_each(|c| {
                [offsets[c], offsets[n + c]].iter().for_each(|&offset| out.lump.extend(file.bytes_of(offset)))
            });
            out.lump.extend(codes);
        }
        Rows::Plain => {
            let size = n.div_ceil(PLAIN_BITS) * (PLAIN_BITS / 8);
            [n, size].iter().for_each(|&number| out.lump.extend(file.bytes_of(number as u32)));
            (0..n).for_each(|cluster| out.lump.extend(bytes_of(n, PLAIN_BITS, |c| rows.get(cluster, c))));
        }
    }
    Ok(out)
}

/// What can be heard: the union of the rows that a cluster sees (PHS of Quake 2, PAS of Source).
pub(super) fn heard(rows: &BitMatrix) -> BitMatrix {
    let mut all = BitMatrix::new(rows.rows(), rows.columns());
    for cluster in 0..rows.rows() {
        for other in rows.ones(cluster) {
            all.row_mut(cluster).iter_mut().zip(rows.row(other)).for_each(|(a, b)| *a |= b);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_zeros_are_counted_to_255_and_no_further() {
        let mut row = vec![7, 0, 0, 9];
        row.extend([0; 600]);
        let code = compress(&row);
        assert_eq!(code, [7, 0, 2, 9, 0, 255, 0, 255, 0, 90]);
        assert_eq!(expand(&code, row.len()), Some(row));
        assert_eq!(expand(&code, 700), None);
        assert_eq!(expand(&[0, 0, 1], 1), None);
    }
}
