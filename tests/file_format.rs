//! The `.pvs` format: what is written is read again, and what isn't as docs/format.md says is refused, rule by rule.

mod forge;

use enfilade::cells::{Cell, CellGraph, Piece, Portal, PortalKind, Strategy, read_cells};
use enfilade::file::{
    Container, FileError, PvsFile, RowReader, SectionId, encode_rows, entropy_bits_per_pair, replace_file,
};
use enfilade::geom::{Aabb, Plane};
use enfilade::pvs::{Guarantee, Pvs, PvsStats, Witness};
use enfilade::scene::{ImportOptions, Mesh, Role, Scene, SceneBuilder, Source, import};
use enfilade::{BitMatrix, CellId, ObjectId};
use forge::{Forged, Part, REQUIRED, Random, Shape, ZSTD, random_file, sample, sign};
use glam::DVec3;
use proptest::prelude::*;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

// ---------------------------------------------------------------- round trips

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn what_is_written_is_read(seed: u64, cells in 0usize..7, portals in 0usize..9, objects in 0usize..150, keep_bounds: bool) {
        let file = random_file(seed, Shape { cells, portals, objects, keep_bounds });
        let bytes = file.write();
        prop_assert_eq!(&PvsFile::read(&bytes).unwrap(), &file);
        prop_assert_eq!(file.write(), bytes);
    }

    #[test]
    fn any_bytes_are_refused(tail: Vec<u8>) {
        prop_assert!(PvsFile::read(&tail).is_err());
        prop_assert!(PvsFile::read(&[&enfilade::file::MAGIC[..], &[1, 0, 0, 0], &tail].concat()).is_err());
    }
}

#[test]
fn the_same_file_gives_the_same_bytes_on_any_number_of_threads() {
    let file = random_file(3, Shape { cells: 300, portals: 500, objects: 900, keep_bounds: true });
    let on = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| file.write());
    assert_eq!(on(1), on(5));
}

#[test]
fn a_cut_file_is_refused_wherever_it_is_cut() {
    let bytes = sample().write();
    for end in 0..bytes.len() {
        let error = PvsFile::read(&bytes[..end]).expect_err("cut");
        assert!(matches!(error, FileError::Truncated { .. }), "{end}: {error}");
    }
}

#[test]
fn a_changed_byte_is_found_wherever_it_is() {
    let mut bytes = sample().write();
    for at in 0..bytes.len() {
        for change in [0x01, 0x80, 0xff] {
            bytes[at] ^= change;
            let read = PvsFile::read(&bytes);
            assert!(read.is_err(), "byte {at} xor {change:#x}");
            bytes[at] ^= change;
        }
    }
    assert!(PvsFile::read(&bytes).is_ok());
}

// ---------------------------------------------------------------- a reject test for each clause

/// Numbers of sections in docs/format.md.
mod number {
    pub const META: u32 = 1;
    pub const CELLS: u32 = 3;
    pub const PORTALS: u32 = 4;
    pub const OBJECTS: u32 = 5;
    pub const PLACEMENT: u32 = 6;
    pub const CELL_ROWS: u32 = 7;
    pub const OBJECT_ROWS: u32 = 8;
    pub const CELL_BOUNDS: u32 = 9;
    pub const OBJECT_BOUNDS: u32 = 10;
    pub const WITNESSES: u32 = 11;
    pub const REPAIRS: u32 = 12;
    pub const STATS: u32 = 13;
}
use number::*;

fn forged() -> Forged {
    Forged::take_apart(&sample().write())
}

/// The message must be one line that holds `expected`.
fn refused(bytes: &[u8], expected: &str) {
    let message = PvsFile::read(bytes).expect_err(expected).to_string();
    assert!(message.contains(expected) && !message.contains('\n'), "{message} / {expected}");
}

fn refused_after(expected: &str, change: impl FnOnce(&mut Forged)) {
    let mut forged = forged();
    change(&mut forged);
    refused(&forged.bytes(), expected);
}

/// Overwrites bytes of a section's decoded content.
fn refused_with(number: u32, at: usize, new: &[u8], expected: &str) {
    refused_after(expected, |f| {
        let mut content = f.decoded(number);
        content[at..at + new.len()].copy_from_slice(new);
        f.put(number, content);
    });
}

/// Replaces a section's decoded content.
fn refused_as(number: u32, content: &[&[u8]], expected: &str) {
    refused_after(expected, |f| f.put(number, content.concat()));
}

#[test]
fn header_clauses() {
    // The forger itself makes no difference.
    assert_eq!(forged().bytes(), sample().write());

    refused(b"", "cut short: 0 bytes of 56");
    refused(b"glTF binary, say", "not a .pvs file");
    refused_after("not a .pvs file", |f| f.magic[1] = b'X');
    refused_after("format version 2, this program reads version 1; bake the model again", |f| f.version = 2);
    refused_after("header, byte 40: guarantee 2, of which there are 2", |f| f.guarantee = 2);
    refused_after("header, byte 46: a reserved byte that is not zero", |f| f.reserved[5] = 1);

    let whole = sample().write();
    refused(&[&whole[..], b"\n"].concat(), &format!("1 bytes too many at byte {}", whole.len()));
    let patched = |at: usize, new: &[u8], signed: bool| {
        let mut bytes = whole.clone();
        bytes[at..at + new.len()].copy_from_slice(new);
        if signed {
            sign(&mut bytes);
        }
        bytes
    };
    refused(&patched(12, &u32::MAX.to_le_bytes(), false), "header, byte 12: a table of 4294967295 sections");
    refused(
        &patched(16, &u64::MAX.to_le_bytes(), true),
        &format!("cut short: {} bytes of 18446744073709551615", whole.len()),
    );
    refused(&patched(30, &[whole[30] ^ 1], false), "header, byte 48: damaged (the checksum differs)");
    let last = whole.len() - 1;
    refused(&patched(last, &[whole[last] ^ 1], false), "section stats, ");
}

#[test]
fn section_table_clauses() {
    refused_after("section 1 out of order; numbers ascend from 1", |f| f.parts.swap(0, 1));
    refused_after("section 13 out of order", |f| f.parts.push(f.parts.last().unwrap().clone()));
    refused_after("section 0 out of order", |f| f.parts[0].number = 0);
    refused_after("section 1 has flags 0x5", |f| f.parts[0].flags = REQUIRED | 4);
    refused_after("section 99 is required and unknown to this program", |f| {
        f.parts.push(Part { number: 99, flags: REQUIRED, stored: vec![1, 2], decoded: 2 });
    });
    refused_after("section 8 is a matrix and can't be compressed as a whole", |f| f.part(OBJECT_ROWS).flags |= ZSTD);
    refused_after("section 8 isn't compressed and has two lengths", |f| f.part(OBJECT_ROWS).decoded += 1);

    // Lengths in the table that don't add up to the file's.
    let whole = sample().write();
    for (length, expected) in [(u64::MAX, "section 1 has 18446744073709551615 bytes"), (0, "sections end at byte")] {
        let mut bytes = whole.clone();
        bytes[56 + 8..56 + 16].copy_from_slice(&length.to_le_bytes());
        bytes[56 + 4..56 + 8].copy_from_slice(&(REQUIRED | ZSTD).to_le_bytes());
        sign(&mut bytes);
        refused(&bytes, expected);
    }
}

#[test]
fn sections_that_a_reader_may_not_know_are_passed_over() {
    let mut f = forged();
    f.parts.push(Part { number: 99, flags: 0, stored: vec![1, 2, 3], decoded: 3 });
    f.parts.push(Part { number: 100, flags: ZSTD, stored: vec![9], decoded: u64::MAX });
    let bytes = f.bytes();
    assert_eq!(PvsFile::read(&bytes).unwrap(), sample());
    // Damage to them is damage.
    let mut damaged = bytes.clone();
    *damaged.last_mut().unwrap() ^= 1;
    refused(&damaged, "section 100, 1 bytes from byte");
}

#[test]
fn sections_that_must_be_there() {
    for (number, name) in
        [(META, "meta"), (CELLS, "cells"), (PORTALS, "portals"), (OBJECTS, "objects"), (PLACEMENT, "placement")]
    {
        refused_after(&format!("section {name} is missing"), |f| f.remove(number));
    }
    for (number, name) in [(CELL_BOUNDS, "cell-bounds"), (OBJECT_BOUNDS, "object-bounds"), (WITNESSES, "witnesses")] {
        refused_after(&format!("section {name} is missing"), |f| f.remove(number));
    }
    // A witness section alone.
    refused_after("section cell-bounds is missing", |f| {
        f.remove(CELL_BOUNDS);
        f.remove(OBJECT_BOUNDS);
    });
}

#[test]
fn compression_clauses() {
    let bomb = zstd::bulk::compress(&vec![0; 1 << 30], 1).unwrap();
    let as_cells = |f: &mut Forged, stored: Vec<u8>, decoded: u64| {
        *f.part(CELLS) = Part { number: CELLS, flags: REQUIRED | ZSTD, stored, decoded };
    };
    // Declared as what it is, as more than there is memory, and as less than it is.
    refused_after("section cells: needs 2147483648 bytes of memory, of which", |f| as_cells(f, vec![0; 100], 1 << 30));
    refused_after("section cells: needs 18446744073709551615 bytes of memory", |f| as_cells(f, bomb.clone(), u64::MAX));
    refused_after("section cells, byte 0: can't be decompressed to 100 bytes", |f| as_cells(f, bomb.clone(), 100));
    refused_after("section cells, byte 0: 4 bytes decompressed, 5 declared", |f| {
        as_cells(f, zstd::bulk::compress(b"cell", 1).unwrap(), 5);
    });
    refused_after("section cells, byte 0: can't be decompressed", |f| as_cells(f, b"no zstd".to_vec(), 9));
}

#[test]
fn meta_clauses() {
    let nan = f64::NAN.to_le_bytes();
    refused_with(META, 8, &nan, "section meta, byte 8: a number that is not finite");
    refused_with(META, 24, &f64::INFINITY.to_le_bytes(), "section meta, byte 24: a number that is not finite");
    refused_with(META, 24, &(-1.0f64).to_le_bytes(), "section meta, byte 24: a negative length");
    refused_with(META, 32, &[3], "section meta, byte 32: strategy 3, of which there are 3");
    refused_with(META, 33, &[0; 4], "section meta, byte 33: objects of 0 triangles");
    refused_with(META, 37, &[2], "section meta, byte 37: a flag 2");
    // The rest is behind the unit, which may be there or not.
    let mut f = forged();
    let content = f.decoded(META);
    let (head, rest) = (&content[..37], &content[if content[37] == 1 { 46 } else { 38 }..]);
    for (unit, what) in [(0.0f64, "not above 0 metres"), (-2.0, "not above 0 metres"), (f64::NAN, "not finite")] {
        refused_as(META, &[head, &[1], &unit.to_le_bytes(), rest], "section meta, byte 38: a ");
        refused_as(META, &[head, &[1], &unit.to_le_bytes(), rest], what);
    }
    f.put(META, [head, &[0], rest].concat());
    assert_eq!(PvsFile::read(&f.bytes()).unwrap().import.metres_per_unit, None);

    let (counts, pairs, reason) = (&rest[..12], &rest[12..44], &rest[44..]);
    let more = |at: usize| {
        let mut counts = counts.to_vec();
        counts[at] += 1;
        counts
    };
    for (at, name) in [(0, "cells"), (4, "portals"), (8, "objects")] {
        refused_as(META, &[head, &[0], &more(at), pairs, reason], &format!("section {name}, byte "));
    }
    refused_as(META, &[head, &[0], &[0xff; 12], pairs, reason], "section cells, byte ");
    let numbers = |n: [u64; 4]| n.map(u64::to_le_bytes).concat();
    // 3 cells and 70 objects: 210 pairs and 9.
    refused_as(META, &[head, &[0], counts, &numbers([6, 5, 0, 0]), reason], "6 pairs in the lower set, 5 in the upper");
    refused_as(META, &[head, &[0], counts, &numbers([0, 211, 0, 0]), reason], "211 in the upper, 210 in all");
    refused_as(META, &[head, &[0], counts, &numbers([0, 0, 0, 10]), reason], "10 in the upper, 9 in all");
    refused_as(META, &[head, &[0], counts, pairs, &[2, 0, 0, 0, b'a', 0xff]], "a string that is not UTF-8");
    refused_as(META, &[head, &[0], counts, pairs, &[9, 0, 0, 0, b'a']], "9 bytes expected, 1 left");
    refused_as(META, &[head, &[0], counts, pairs, reason, &[0]], "1 bytes too many");

    // Fewer pairs than the rows have.
    let real = |i: usize| u64::from_le_bytes(pairs[8 * i..8 * i + 8].try_into().unwrap());
    let [lower, upper, cell_lower, cell_upper] = [real(0), real(1), real(2), real(3)];
    refused_as(
        META,
        &[head, &[0], counts, &numbers([lower, upper - 1, cell_lower, cell_upper]), reason],
        "section object-rows",
    );
    refused_as(
        META,
        &[head, &[0], counts, &numbers([lower, upper, cell_lower, cell_upper - 1]), reason],
        "section cell-rows",
    );
    refused_as(
        META,
        &[head, &[0], counts, &numbers([lower - 1, upper, cell_lower, cell_upper]), reason],
        "section object-bounds",
    );
    refused_as(
        META,
        &[head, &[0], counts, &numbers([lower, upper, cell_lower - 1, cell_upper]), reason],
        "section cell-bounds",
    );
}

const NO_NAME: &[u8] = &[0, 0, 0, 0];
const NO_SOURCE: &[u8] = &[0];
const CLOSED: &[u8] = &[0];

fn u32s(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

fn f32s(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

#[test]
fn cell_clauses() {
    let cell = |pieces: &[u8]| [NO_NAME, NO_SOURCE, CLOSED, pieces].concat();
    let empty = cell(&u32s(&[0]));
    let list = |first: &[u8]| [&u32s(&[3])[..], first, &empty, &empty].concat();
    let mut f = forged();
    f.put(CELLS, list(&empty));
    assert_eq!(PvsFile::read(&f.bytes()).unwrap().cells[0].pieces.len(), 0);

    refused_as(CELLS, &[&u32s(&[2]), &empty, &empty], "section cells, byte ");
    refused_as(CELLS, &[&u32s(&[u32::MAX]), &empty], "section cells, byte 0: a list of 4294967295, with 10 bytes left");
    refused_as(CELLS, &[&list(&cell(&u32s(&[u32::MAX])))], "section cells, byte 10: a list of 4294967295");
    refused_as(CELLS, &[&list(&cell(&u32s(&[1, u32::MAX])))], "section cells, byte 14: a list of 4294967295");
    refused_as(CELLS, &[&list(&[&u32s(&[u32::MAX])[..], &[0; 6]].concat())], "4294967295 bytes expected");
    refused_as(CELLS, &[&list(&[NO_NAME, &[7], CLOSED, NO_NAME].concat())], "section cells, byte 8: a flag 7");
    refused_as(CELLS, &[&list(&[NO_NAME, NO_SOURCE, &[2], NO_NAME].concat())], "section cells, byte 9: a flag 2");
    let plane = |p: [f32; 4]| list(&cell(&[u32s(&[1, 1]), f32s(&p)].concat()));
    refused_as(CELLS, &[&plane([1.0, 1.0, 0.0, 0.0])], "a plane whose normal is not of length 1");
    refused_as(CELLS, &[&plane([0.0, 0.0, 0.0, 0.0])], "a plane whose normal is not of length 1");
    refused_as(CELLS, &[&plane([0.0, f32::NAN, 0.0, 0.0])], "section cells, byte 22: a number that is not finite");
    refused_as(CELLS, &[&plane([0.0, 1.0, 0.0, f32::INFINITY])], "section cells, byte 30: a number that is not finite");
}

#[test]
fn portal_clauses() {
    let triangle = [u32s(&[3]), f32s(&[0., 0., 0., 1., 0., 0., 1., 1., 0.])].concat();
    let portal = |cells: [u32; 2], plane: [f32; 4], kind: u8, winding: &[u8]| {
        let other = [&u32s(&[0, 1])[..], &f32s(&[0., 0., 1., 0.]), &[0], NO_SOURCE, &triangle].concat();
        let first = [&u32s(&cells)[..], &f32s(&plane), &[kind], NO_SOURCE, winding].concat();
        [&u32s(&[4])[..], &first, &other, &other, &other].concat()
    };
    let up = [0., 0., 1., 0.];
    let mut f = forged();
    f.put(PORTALS, portal([2, 1], up, 2, &triangle));
    assert_eq!(PvsFile::read(&f.bytes()).unwrap().portals[0].cells, [CellId(2), CellId(1)]);

    refused_as(PORTALS, &[&portal([3, 1], up, 0, &triangle)], "section portals, byte 4: cell 3, of which there are 3");
    refused_as(PORTALS, &[&portal([0, u32::MAX], up, 0, &triangle)], "section portals, byte 8: cell 4294967295");
    refused_as(PORTALS, &[&portal([1, 1], up, 0, &triangle)], "a portal from cell 1 to itself");
    refused_as(PORTALS, &[&portal([0, 1], [0., 0., 2., 0.], 0, &triangle)], "a plane whose normal is not of length 1");
    refused_as(PORTALS, &[&portal([0, 1], up, 3, &triangle)], "section portals, byte 28: portal kind 3");
    let corners = |n: u32| [u32s(&[n]), f32s(&[0., 0., 0., 1., 0., 0.])].concat();
    refused_as(PORTALS, &[&portal([0, 1], up, 0, &corners(2))], "a winding of 2 corners");
    refused_as(PORTALS, &[&portal([0, 1], up, 0, &u32s(&[u32::MAX]))], "a list of 4294967295");
    let nan = [u32s(&[3]), f32s(&[0., 0., 0., 1., f32::NAN, 0., 1., 1., 0.])].concat();
    refused_as(PORTALS, &[&portal([0, 1], up, 0, &nan)], "a number that is not finite");
}

#[test]
fn object_clauses() {
    let object = |triangles: u32, bounds: [f32; 6]| [NO_NAME, &u32s(&[triangles]), &f32s(&bounds)].concat();
    let point = object(1, [0.; 6]);
    let list = |first: &[u8]| [&u32s(&[70])[..], first, &point.repeat(69)].concat();
    let mut f = forged();
    f.put(OBJECTS, list(&point));
    assert_eq!(PvsFile::read(&f.bytes()).unwrap().objects[69].triangles, 1);
    refused_as(OBJECTS, &[&list(&object(0, [0.; 6]))], "section objects, byte 8: an object without triangles");
    refused_as(OBJECTS, &[&list(&object(1, [0., 1., 0., 0., 0., 0.]))], "a box that ends before it begins");
    refused_as(OBJECTS, &[&list(&object(1, [0., 0., 0., f32::INFINITY, 0., 0.]))], "a number that is not finite");
}

#[test]
fn other_section_clauses() {
    let mut f = forged();
    let witnesses = f.decoded(WITNESSES);
    let count = u32::from_le_bytes(witnesses[..4].try_into().unwrap());
    refused_as(WITNESSES, &[&u32s(&[count - 1]), &witnesses[4..witnesses.len() - 48]], "no witness for cell 2, object ");
    refused_as(WITNESSES, &[&u32s(&[count + 1]), &witnesses[4..], &[0; 48]], "a witness without a pair in the lower set");
    refused_with(WITNESSES, 4, &f64::NAN.to_le_bytes(), "section witnesses, byte 4: a number that is not finite");
    refused_with(REPAIRS, 8, &3u32.to_le_bytes(), "section repairs, byte 8: cell 3, of which there are 3");
    refused_with(REPAIRS, 12, &f64::NAN.to_le_bytes(), "section repairs, byte 12: a number that is not finite");
    let stats = f.decoded(STATS);
    refused_as(STATS, &[&stats, &[0]], "section stats, byte 40: 1 bytes too many");
    refused_as(STATS, &[&stats[..39]], "section stats, byte 32: 8 bytes expected, 7 left");

    // A lower pair outside the upper set: all zeros above, all ones below (rows take turns).
    let mut turns = BitMatrix::new(6, 3);
    turns.set(1, 2);
    refused_as(CELL_BOUNDS, &[&encode_rows(&turns)], "pair 0, 2 is in the lower set and not in the upper");
    // Rows that aren't what was declared.
    f.put(OBJECT_ROWS, encode_rows(&BitMatrix::new(3, 70)));
    refused(&f.bytes(), "section object-rows, byte 0: 0 pairs, ");
}

/// A coded matrix by hand; nothing in it compressed.
struct Coded<'a> {
    shape: [u32; 2],
    unique: u32,
    block_rows: u32,
    map: &'a [u8],
    block: &'a [u8],
}

impl Coded<'_> {
    /// Three rows of 10 columns: 1100000001, the same again, 1111000001.
    fn sample() -> Self {
        // One run of 2 and one of 1, apart by 7; then two bits more.
        let block = &[2, 2, 0, 1, 6, 0, 0x03, 2, 2, 0];
        Self { shape: [3, 10], unique: 2, block_rows: 32, map: &[0, 1, 0], block }
    }

    fn bytes(&self) -> Vec<u8> {
        let lengths = [self.map.len(), self.map.len(), self.block.len(), self.block.len()];
        let lengths: Vec<u8> = lengths.iter().flat_map(|&n| (n as u64).to_le_bytes()).collect();
        let head = [u32s(&self.shape), vec![2], u32s(&[self.unique, self.block_rows]), lengths];
        [&head.concat()[..], self.map, self.block].concat()
    }
}

fn decode(bytes: &[u8], rows: usize, columns: usize) -> Result<BitMatrix, FileError> {
    let reader = RowReader::new(SectionId::ObjectRows, bytes, rows, columns)?;
    let matrix = reader.matrix();
    // Row by row, the same answer; a row at a time may not see what is wrong with another row.
    if let Ok(matrix) = &matrix {
        for row in 0..rows {
            assert_eq!(reader.row(row).expect("readable as a whole"), matrix.row(row));
        }
    }
    matrix
}

#[test]
fn matrix_clauses() {
    let matrix = decode(&Coded::sample().bytes(), 3, 10).unwrap();
    let rows: Vec<Vec<usize>> = (0..3).map(|row| matrix.ones(row).collect()).collect();
    assert_eq!(rows, [vec![0, 1, 9], vec![0, 1, 9], vec![0, 1, 2, 3, 9]]);

    let refuse = |bytes: &[u8], expected: &str| {
        let message = decode(bytes, 3, 10).expect_err(expected).to_string();
        assert!(message.starts_with("section object-rows, byte ") && message.contains(expected), "{message} / {expected}");
    };
    let coded = |change: &dyn Fn(&mut Coded<'_>), expected: &str| {
        let mut coded = Coded::sample();
        change(&mut coded);
        refuse(&coded.bytes(), expected);
    };
    coded(&|c| c.shape[0] = 4, "a matrix of 4 rows, 3 expected");
    coded(&|c| c.shape[1] = u32::MAX, "a matrix of 4294967295 columns, 10 expected");
    coded(&|c| c.unique = 0, "0 distinct rows of 3");
    coded(&|c| c.unique = 4, "4 distinct rows of 3");
    coded(&|c| c.block_rows = 31, "blocks of 31 rows");
    coded(&|c| c.block_rows = 4097, "blocks of 4097 rows");
    coded(&|c| c.map = &[0, 2, 0], "a copy of distinct row 1, of which 1 came before");
    coded(&|c| c.map = &[0, 1, 1], "1 distinct rows, 2 declared");
    coded(&|c| c.map = &[0, 1], "1 bytes expected, 0 left");
    coded(&|c| c.map = &[0, 1, 0, 0], "1 bytes too many");
    coded(&|c| c.map = &[0, 0x81, 0, 0], "a number not in its shortest form");
    coded(&|c| c.map = &[0, 0xff, 0xff, 0xff, 0xff, 0x10], "a number beyond 32 bits");
    coded(&|c| c.map = &[0, 0xff, 0xff, 0xff, 0xff, 0xff, 1], "a number beyond 32 bits");
    coded(&|c| c.block = &[3, 0, 0, 0], "a reference 1 rows back from row 0");
    coded(&|c| c.block = &[0, 1, 10, 0, 0], "column 10, of which there are 10");
    coded(&|c| c.block = &[0, 2, 9, 0, 0, 0], "column 10, of which there are 10");
    coded(&|c| c.block = &[2, 1, 8, 2, 0, 0], "column 10, of which there are 10");
    coded(&|c| c.block = &[0, 1, 0xff, 0xff, 0xff, 0xff, 0x0f, 0, 0], "column 4294967295");
    coded(&|c| c.block = &[0, 0xff, 0xff, 0xff, 0xff, 0x0f], "1 bytes expected, 0 left");
    coded(&|c| c.block = &[1, 0xff, 0x04, 0, 0], "bits beyond the last column");
    coded(&|c| c.block = &[1, 0xff], "2 bytes expected, 1 left");
    coded(&|c| c.block = &[0, 0, 0, 0, 0], "1 bytes too many");

    let whole = Coded::sample().bytes();
    let patched = |at: usize, new: &[u8], expected: &str| {
        let mut bytes = whole.clone();
        bytes[at..at + new.len()].copy_from_slice(new);
        refuse(&bytes, expected);
    };
    patched(8, &[3], "matrix code 3, of which there are 3");
    // Lengths of the map at 17 and 25, of the block at 33 and 41.
    patched(25, &u64::MAX.to_le_bytes(), "a part of 3 bytes that decodes to 18446744073709551615, at most 15 expected");
    patched(41, &[37], "a part of 10 bytes that decodes to 37, at most 36 expected");
    patched(33, &[11], "a part of 11 bytes that decodes to 10");
    patched(41, &[11], "a block that doesn't decompress to 11 bytes");
    refuse(&[&whole[..], &[0]].concat(), "1 bytes too many");
    refuse(&whole[..whole.len() - 1], "10 bytes expected, 9 left");
    refuse(&[u32s(&[3, 10]), vec![1, 0]].concat(), "1 bytes too many");

    // A block that decompresses to more than it says.
    let bomb = zstd::bulk::compress(&vec![0; 1 << 26], 19).unwrap();
    let coded = Coded { shape: [3, 100_000], block: &bomb, ..Coded::sample() };
    let mut bytes = coded.bytes();
    bytes[41..49].copy_from_slice(&25_000u64.to_le_bytes());
    let error = decode(&bytes, 3, 100_000).expect_err("a bomb").to_string();
    assert!(error.contains("a block that doesn't decompress to 25000 bytes"), "{error}");
}

#[test]
fn a_small_file_cannot_ask_for_a_large_matrix() {
    // Names compress to nothing, and a matrix of ones is a byte: 200,000 cells and as many objects would need 5 GB.
    let n = 200_000u32;
    let mut f = forged();
    let part = |content: Vec<u8>| {
        let stored = zstd::bulk::compress(&content, 19).unwrap();
        (stored, content.len() as u64)
    };
    let cells = [u32s(&[n]), [NO_NAME, NO_SOURCE, CLOSED, NO_NAME].concat().repeat(n as usize)].concat();
    let objects = [u32s(&[n]), [NO_NAME, &u32s(&[1]), &[0; 24]].concat().repeat(n as usize)].concat();
    let mut meta = f.decoded(META);
    let counts = if meta[37] == 1 { 46 } else { 38 };
    meta[counts..counts + 12].copy_from_slice(&u32s(&[n, 4, n]));
    f.put(META, meta);
    for (number, content) in [(CELLS, cells), (OBJECTS, objects)] {
        let (stored, decoded) = part(content);
        *f.part(number) = Part { number, flags: ZSTD, stored, decoded };
    }
    for number in [PLACEMENT, CELL_ROWS, OBJECT_ROWS] {
        f.put(number, [u32s(&[n, n]), vec![1]].concat());
    }
    for number in [CELL_BOUNDS, OBJECT_BOUNDS, WITNESSES] {
        f.remove(number);
    }
    let error = PvsFile::read(&f.bytes()).expect_err("too large");
    assert!(matches!(error, FileError::TooLarge { .. }), "{error}");
}

// ---------------------------------------------------------------- the rows' code

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_matrix_is_read_as_it_was_written(
        seed: u64, rows in 0usize..40, columns in 0usize..300, eighths in 0usize..9, copies in 0usize..40, flips in 0usize..60,
    ) {
        let r = &mut Random(seed);
        let mut m = r.matrix(rows, columns, eighths);
        if rows > 0 && columns > 0 {
            // Rows that are equal, and rows that are nearly so.
            for _ in 0..copies {
                let from = m.row(r.below(rows)).to_vec();
                m.row_mut(r.below(rows)).copy_from_slice(&from);
            }
            for _ in 0..flips {
                m.set(r.below(rows), r.below(columns));
                m.clear(r.below(rows), r.below(columns));
            }
        }
        let bytes = encode_rows(&m);
        prop_assert_eq!(decode(&bytes, rows, columns).unwrap(), m);
        // At worst the bits themselves and a few bytes a row.
        prop_assert!(bytes.len() <= 64 + rows * (columns.div_ceil(8) + 8));
    }
}

#[test]
fn uniform_matrices_are_a_byte_and_their_size() {
    for (rows, columns) in [(0, 0), (0, 9), (9, 0), (1, 1), (7, 64), (100, 1000)] {
        let zeros = BitMatrix::new(rows, columns);
        let mut ones = zeros.clone();
        (0..rows).for_each(|row| (0..columns).for_each(|column| assert!(ones.set(row, column))));
        for matrix in [zeros, ones] {
            let bytes = encode_rows(&matrix);
            assert_eq!(bytes.len(), 9);
            assert_eq!(decode(&bytes, rows, columns).unwrap(), matrix);
        }
    }
}

#[test]
fn equal_rows_are_stored_once() {
    let mut r = Random(5);
    let distinct = r.matrix(3, 2000, 4);
    let mut many = BitMatrix::new(900, 2000);
    (0..900).for_each(|row| many.row_mut(row).copy_from_slice(distinct.row(row % 3)));
    let (once, all) = (encode_rows(&distinct).len(), encode_rows(&many).len());
    assert!(all < once + 100, "{all} bytes for 900 rows, {once} for 3");
    assert_eq!(decode(&encode_rows(&many), 900, 2000).unwrap(), many);
}

/// A floor of 24 x 24 rooms with 20 objects each, most doors open at random: a room sees along its row and its column until a
/// door is shut, and of the objects that stand there the fewer the further they are.
fn rooms() -> BitMatrix {
    const SIDE: usize = 24;
    const OBJECTS: usize = 20;
    let r = &mut Random(9);
    let doors: Vec<[bool; 2]> = (0..SIDE * SIDE).map(|_| [r.below(5) > 0, r.below(5) > 0]).collect();
    // How far along the line of sight an object is still seen.
    let reach: Vec<usize> = (0..SIDE * SIDE * OBJECTS).map(|_| 1 + r.below(9)).collect();
    let mut m = BitMatrix::new(SIDE * SIDE, SIDE * SIDE * OBJECTS);
    for room in 0..SIDE * SIDE {
        let mut see = |other: usize, far: usize| {
            (other * OBJECTS..(other + 1) * OBJECTS).filter(|&object| reach[object] > far).for_each(|object| {
                m.set(room, object);
            });
        };
        see(room, 0);
        for (axis, step, place) in [(0, 1, room % SIDE), (1, SIDE, room / SIDE)] {
            // A room's doors lead on, to greater numbers.
            (1..SIDE - place).take_while(|k| doors[room + (k - 1) * step][axis]).for_each(|k| see(room + k * step, k));
            (1..=place).take_while(|k| doors[room - k * step][axis]).for_each(|k| see(room - k * step, k));
        }
    }
    m
}

#[test]
fn the_rows_of_a_building_take_a_fraction_of_their_entropy() {
    let m = rooms();
    let bytes = encode_rows(&m);
    assert_eq!(decode(&bytes, m.rows(), m.columns()).unwrap(), m);
    let pairs = (m.rows() * m.columns()) as u64;
    let bits_per_pair = bytes.len() as f64 * 8.0 / pairs as f64;
    let entropy = entropy_bits_per_pair(m.count_ones(), pairs);
    let raw: Vec<u8> = (0..m.rows()).flat_map(|row| m.row(row)).flat_map(|word| word.to_le_bytes()).collect();
    let zstd = zstd::bulk::compress(&raw, 15).unwrap().len();
    eprintln!("{} bytes, {bits_per_pair:.4} bits a pair, entropy {entropy:.4}; raw {}, zstd {zstd}", bytes.len(), raw.len());
    assert!(bits_per_pair < entropy / 2.0 && bytes.len() * 20 < raw.len());
    // Reading rows alone costs little beside one zstd frame over everything.
    assert!(bytes.len() < zstd + zstd / 8);
}

#[test]
fn entropy_of_known_matrices() {
    assert_eq!(entropy_bits_per_pair(0, 0), 0.0);
    assert_eq!(entropy_bits_per_pair(0, 9), 0.0);
    assert_eq!(entropy_bits_per_pair(9, 9), 0.0);
    assert_eq!(entropy_bits_per_pair(5, 10), 1.0);
    // H(1/4) = 2 - 3/4 log2 3.
    assert!((entropy_bits_per_pair(1, 4) - (2.0 - 0.75 * 3f64.log2())).abs() < 1e-15);
}

#[test]
fn rows_are_read_from_a_file_one_by_one() {
    let file = random_file(11, Shape { cells: 40, portals: 10, objects: 500, keep_bounds: false });
    let bytes = file.write();
    let container = Container::parse(&bytes).unwrap();
    let rows = container.rows(SectionId::ObjectRows).unwrap().expect("in the file");
    for cell in (0..40).rev() {
        assert_eq!(Some(&rows.row(cell).unwrap()[..]), file.object_row(CellId(cell as u32)));
    }
    assert!(container.rows(SectionId::Notes).unwrap().is_none());
}

// ---------------------------------------------------------------- from a bake, on disk, on the command line

/// Two rooms of 4 x 3 x 4 m joined by a door at x = 0 (scene coordinates); a wall beside the door, and a chair in each room.
fn baked(guarantee: Guarantee, keep_bounds: bool) -> (PvsFile, Scene) {
    let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
    let triangle = |x: f64| [DVec3::new(x, 0.0, 0.0), DVec3::new(x + 0.1, 0.0, 1.0), DVec3::new(x, 1.0, 0.1)].to_vec();
    for (node, x) in [("wall", 1000.0), ("chair", 998.0), ("table", 1001.9)] {
        let mesh = Mesh {
            node: node.into(),
            role: Role::Unknown,
            opaque: true,
            positions: triangle(x),
            triangles: vec![[0, 1, 2]],
        };
        builder.add(mesh).unwrap();
    }
    let scene = builder.finish("two rooms").unwrap();
    let room = |name: &str, min: [f64; 3], max: [f64; 3]| {
        let (min, max) = (DVec3::from_array(min), DVec3::from_array(max));
        let planes = DVec3::AXES.iter().flat_map(|&n| [Plane::through(max, n), Plane::through(min, -n)]).collect();
        let pieces = vec![Piece { planes, bounds: Aabb { min, max } }];
        Cell { name: name.into(), pieces, ..Cell::default() }
    };
    let winding = [[0., 0., -0.5], [0., 2., -0.5], [0., 2., 0.5], [0., 0., 0.5]].map(DVec3::from_array).to_vec();
    let mut graph = CellGraph {
        strategy: Strategy::Plan,
        reason: "one storey".into(),
        cells: vec![room("west", [-4., 0., -2.], [0., 3., 2.]), room("east", [0., 0., -2.], [4., 3., 2.])],
        portals: vec![Portal {
            cells: [CellId(0), CellId(1)],
            plane: Plane { n: DVec3::X, d: 0.0 },
            winding,
            kind: PortalKind::Door,
            source: Some("door 1".into()),
        }],
        smallest_hole: 0.001,
        notes: vec!["a note".into()],
    };
    graph.link();
    let matrix = |columns: usize, set: &[(usize, usize)]| {
        let mut m = BitMatrix::new(2, columns);
        set.iter().for_each(|&(row, column)| assert!(m.set(row, column)));
        m
    };
    let lower = [(0, 0), (0, 1), (1, 0), (1, 2)];
    let pvs = Pvs {
        cells_lower: matrix(2, &[(0, 0), (1, 1)]),
        cells_upper: matrix(2, &[(0, 0), (0, 1), (1, 0), (1, 1)]),
        objects_lower: matrix(3, &lower),
        objects_upper: matrix(3, &[&lower[..], &[(0, 2)]].concat()),
        placement: matrix(3, &[(0, 0), (1, 0), (0, 1), (1, 2)]),
        witnesses: lower
            .iter()
            .map(|&(cell, object)| Witness {
                cell: CellId(cell as u32),
                object: ObjectId(object as u32),
                from: DVec3::new(0.1, 1.0, 0.2),
                to: DVec3::new(0.3, 1.0, 0.4),
            })
            .collect(),
        guarantee,
        repairs: Vec::new(),
        stats: PvsStats { rays: 12, ..PvsStats::default() },
    };
    (PvsFile::from_bake(&scene, &ImportOptions::default(), &graph, &pvs, keep_bounds), scene)
}

#[test]
fn a_bake_becomes_a_file() {
    let (file, scene) = baked(Guarantee::Conservative, true);
    assert_eq!(PvsFile::read(&file.write()).unwrap(), file);
    assert_eq!((file.model_hash, file.origin), (scene.hash(), scene.origin));
    // Every cell sees every cell: that row is left out; table 2 is not proven hidden from the west room, chair 1 is from the east.
    assert_eq!(file.cell_rows, None);
    assert!(file.sees_cell(CellId(0), CellId(1)));
    assert!(file.sees_object(CellId(0), ObjectId(2)) && !file.sees_object(CellId(1), ObjectId(1)));
    assert_eq!(file.object_row(CellId(1)), Some(&[0b101][..]));
    assert_eq!((file.pairs.lower, file.pairs.upper, file.pairs.cell_lower, file.pairs.cell_upper), (4, 5, 2, 4));
    assert_eq!(
        file.left_out,
        ["cell rows: every cell sees every cell", "online hierarchy: the building is closed", "repairs: none were needed"]
    );
    assert_eq!(file.bounds.unwrap().witnesses.len(), 4);

    let (sampled, _) = baked(Guarantee::Sampled, false);
    assert!(!sampled.sees_object(CellId(0), ObjectId(2)) && !sampled.sees_cell(CellId(0), CellId(1)));
    assert!(sampled.sees_cell(CellId(1), CellId(1)));
    assert_eq!(sampled.bounds, None);
    assert!(sampled.left_out.contains(&"bounds and witnesses: not asked for (--keep-bounds)".to_owned()));
}

#[test]
fn one_room_carries_no_portals_and_no_rows() {
    let (two, scene) = baked(Guarantee::Conservative, false);
    let all = |columns: usize| {
        let mut m = BitMatrix::new(1, columns);
        (0..columns).for_each(|column| assert!(m.set(0, column)));
        m
    };
    let graph = CellGraph {
        strategy: Strategy::Plan,
        reason: two.reason,
        cells: vec![Cell::default()],
        portals: Vec::new(),
        smallest_hole: 0.001,
        notes: Vec::new(),
    };
    let pvs = Pvs {
        cells_lower: all(1),
        cells_upper: all(1),
        objects_lower: BitMatrix::new(1, 3),
        objects_upper: all(3),
        placement: all(3),
        witnesses: Vec::new(),
        guarantee: Guarantee::Conservative,
        repairs: Vec::new(),
        stats: PvsStats::default(),
    };
    let file = PvsFile::from_bake(&scene, &ImportOptions::default(), &graph, &pvs, false);
    let bytes = file.write();
    assert_eq!(PvsFile::read(&bytes).unwrap(), file);
    let sections: Vec<String> = Container::parse(&bytes).unwrap().sections().iter().map(|s| s.name()).collect();
    assert_eq!(sections, ["meta", "notes", "cells", "objects", "placement"]);
    assert_eq!(
        file.left_out[..3],
        ["cell rows: there is only one cell", "object rows: every cell sees every object", "portals: one cell has none"]
    );
}

/// A folder of its own for a test, gone afterwards.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("enfilade-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn files(&self) -> Vec<String> {
        let mut names: Vec<String> =
            self.0.read_dir().unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_file_is_saved_whole_or_not_at_all() {
    let folder = Folder::new("save");
    let path = folder.0.join("a.pvs");
    let file = sample();
    file.save(&path).unwrap();
    file.save(&path).unwrap();
    assert_eq!(PvsFile::load(&path).unwrap(), file);
    assert_eq!(folder.files(), ["a.pvs"]);

    // A write that fails half-way leaves the old file and nothing else.
    let error = replace_file(&path, |out| {
        out.write_all(&[0; 100_000])?;
        Err(std::io::Error::other("the disk is full"))
    });
    assert_eq!(error.unwrap_err().to_string(), "the disk is full");
    assert_eq!(PvsFile::load(&path).unwrap(), file);
    assert_eq!(folder.files(), ["a.pvs"]);

    // No such folder; a folder in the file's place.
    assert!(matches!(file.save(&folder.0.join("none/a.pvs")), Err(FileError::Io(_))));
    assert!(matches!(file.save(&folder.0), Err(FileError::Io(_))));
    assert_eq!(folder.files(), ["a.pvs"]);
    assert!(matches!(PvsFile::load(&folder.0.join("b.pvs")), Err(FileError::Io(_))));
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link_and_a_device_a_device() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    let folder = Folder::new("link");
    let (path, link) = (folder.0.join("a.pvs"), folder.0.join("link.pvs"));
    std::fs::write(&path, "old").unwrap();
    symlink(&path, &link).unwrap();
    sample().save(&link).unwrap();
    assert!(link.symlink_metadata().unwrap().is_symlink());
    assert_eq!(PvsFile::load(&path).unwrap(), sample());
    sample().save(Path::new("/dev/null")).unwrap();
    assert!(std::fs::metadata("/dev/null").unwrap().file_type().is_char_device());
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_cannot_be_written_to_is_an_error() {
    // Nobody, root included, makes files here.
    assert!(matches!(sample().save(Path::new("/proc/self/fd/a.pvs")), Err(FileError::Io(_))));
}

fn enfilade(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_enfilade")).args(args).output().unwrap()
}

fn json(args: &[&str]) -> serde_json::Value {
    let output = enfilade(args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON and nothing else")
}

#[test]
fn info_says_what_is_in_a_file() {
    let folder = Folder::new("info");
    let path = folder.0.join("a.pvs");
    let (file, scene) = baked(Guarantee::Conservative, true);
    file.save(&path).unwrap();
    let path = path.to_str().unwrap();
    let info = json(&["info", path, "--json"]);
    assert_eq!(info["model_hash"], format!("{:032x}", scene.hash()));
    assert_eq!(
        (&info["cells"], &info["portals"], &info["objects"], &info["triangles"]),
        (&2.into(), &1.into(), &3.into(), &3.into())
    );
    assert_eq!(
        (&info["guarantee"], &info["strategy"], &info["open_cells"]),
        (&"conservative".into(), &"plan".into(), &0.into())
    );
    let pvs = &info["pvs"];
    assert_eq!(
        (&pvs["lower_pairs"], &pvs["upper_pairs"], &pvs["undecided_pairs"], &pvs["total_pairs"]),
        (&4.into(), &5.into(), &1.into(), &6.into())
    );
    assert_eq!(
        (&pvs["cell_lower_pairs"], &pvs["cell_upper_pairs"], &pvs["cell_total_pairs"]),
        (&2.into(), &4.into(), &4.into())
    );
    assert_eq!(pvs["bits_per_pair"].as_f64().unwrap(), pvs["row_bytes"].as_f64().unwrap() * 8.0 / 6.0);
    assert_eq!(pvs["entropy_bits_per_pair"].as_f64().unwrap(), entropy_bits_per_pair(5, 6));
    let bytes: u64 = info["sections"].as_array().unwrap().iter().map(|s| s["bytes"].as_u64().unwrap()).sum();
    let table = 56 + 32 * info["sections"].as_array().unwrap().len() as u64;
    assert_eq!(info["file_bytes"].as_u64().unwrap(), bytes + table);

    let prose = String::from_utf8(enfilade(&["info", path]).stdout).unwrap();
    assert!(prose.contains("conservative") && prose.lines().count() <= 24, "{prose}");
}

#[test]
fn dump_gives_what_a_cells_file_takes() {
    let folder = Folder::new("dump");
    let path = folder.0.join("a.pvs");
    let (file, scene) = baked(Guarantee::Conservative, true);
    file.save(&path).unwrap();
    let path = path.to_str().unwrap();
    let dump = json(&["dump", path, "--json"]);
    assert_eq!(dump["rows"]["cells"], serde_json::json!([[0, 1], [0, 1]]));
    assert_eq!(dump["rows"]["objects"], serde_json::json!([[0, 1, 2], [0, 2]]));
    assert_eq!(dump["bounds"]["lower"]["objects"], serde_json::json!([[0, 1], [0, 2]]));
    assert_eq!(dump["bounds"]["upper"]["cells"], serde_json::json!([[0, 1], [0, 1]]));
    assert_eq!(dump["objects"][1], serde_json::json!({ "id": 1, "node": "chair", "triangles": 1 }));
    // In the model's own coordinates: the door stands at x = origin + 0.
    assert_eq!(dump["portals"][0]["winding"][0], serde_json::json!([scene.origin.x, scene.origin.y, scene.origin.z - 0.5]));
    assert_eq!(dump["cells"][1]["pieces"][0]["planes"][0], serde_json::json!([1.0, 0.0, 0.0, scene.origin.x + 4.0]));

    let graph = read_cells(&dump.to_string(), &scene).unwrap();
    let again = |plane: &Plane| plane.n.as_vec3().extend(plane.d as f32);
    for (given, kept) in graph.cells.iter().zip(&file.cells) {
        let planes: Vec<_> = given.pieces[0].planes.iter().map(again).collect();
        assert_eq!((planes, &given.name), (kept.pieces[0].clone(), &kept.name));
    }
    assert_eq!(again(&graph.portals[0].plane), file.portals[0].plane);
    assert_eq!(graph.portals[0].winding.iter().map(|p| p.as_vec3()).collect::<Vec<_>>(), file.portals[0].winding);

    let only = json(&["dump", path, "--json", "--rows", "cells"]);
    assert!(only["rows"].get("objects").is_none() && only["rows"]["cells"].is_array());
    let text = |args: &[&str]| String::from_utf8(enfilade(args).stdout).unwrap();
    assert_eq!(text(&["dump", path, "--rows", "objects"]), "0 3: 0 1 2\n1 2: 0 2\n");
    assert!(text(&["dump", path]).contains("cell 1 \"east\": 1 pieces\n"));
}

/// A square of two triangles and a triangle, `lift` metres above 5 m.
fn obj(lift: f64) -> String {
    let y = 5.0 + lift;
    format!(
        "o square\nv 10 {y} 0\nv 11 {y} 0\nv 11 {y} 1\nv 10 {y} 1\nf 1 2 3\nf 1 3 4\no flag\nv 12 9 0\nv 13 9 0\nv 12 9.5 0\nf 5 6 7\n"
    )
}

#[test]
fn dump_writes_the_model_that_was_baked_and_no_other() {
    let folder = Folder::new("obj");
    let at = |name: &str| folder.0.join(name).to_str().unwrap().to_owned();
    let [pvs, model, other, out] = ["a.pvs", "a.obj", "b.obj", "scene.obj"].map(at);
    std::fs::write(&model, obj(0.0)).unwrap();
    std::fs::write(&other, obj(0.125)).unwrap();
    // Each triangle an object, and the source in feet: a default import would be another scene.
    let options = ImportOptions { object_triangles: 1, metres_per_unit: Some(0.3048), ..ImportOptions::default() };
    let scene = import(Path::new(&model), &options).unwrap();
    let mut file = sample();
    file.model_hash = scene.hash();
    file.import = Import { object_triangles: 1, metres_per_unit: Some(0.3048) };
    file.save(Path::new(&pvs)).unwrap();

    let output = enfilade(&["dump", &pvs, "--obj", &out, "--model", &model]);
    assert!(output.status.success() && output.stdout.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    let written = std::fs::read_to_string(&out).unwrap();
    let groups: Vec<&str> = written.lines().filter(|line| line.starts_with("o ")).collect();
    assert_eq!(groups, ["o object_0", "o object_1", "o object_2"]);
    // Written in metres, where it was read.
    let again = import(Path::new(&out), &ImportOptions::default()).unwrap();
    let corners = |scene: &Scene| -> Vec<DVec3> {
        (0..scene.triangles.len()).flat_map(|t| scene.corners(t)).map(|p| p + scene.origin).collect()
    };
    assert_eq!(corners(&again).len(), 9);
    assert!(corners(&again).iter().zip(corners(&scene)).all(|(a, b)| a.distance(b) < 1e-12));

    let refused = enfilade(&["dump", &pvs, "--obj", &at("none.obj"), "--model", &other]);
    let message = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(message.starts_with(&format!("enfilade: {other}: not the model that {pvs} was baked for")), "{message}");
    assert!(!Path::new(&at("none.obj")).exists());
}

#[test]
fn bad_files_are_one_line_and_exit_2() {
    let folder = Folder::new("bad");
    let path = folder.0.join("a.pvs");
    std::fs::write(&path, "not one of ours").unwrap();
    let path = path.to_str().unwrap();
    for args in
        [&["info", path][..], &["dump", path, "--json"], &["info", "/nowhere/a.pvs"], &["dump", path, "--obj", "x.obj"]]
    {
        let output = enfilade(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(output.stdout.is_empty());
    }
    let message = String::from_utf8(enfilade(&["info", path]).stderr).unwrap();
    assert_eq!(message, format!("enfilade: {path}: not a .pvs file; give one that `enfilade bake` wrote\n"));
}
