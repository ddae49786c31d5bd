//! A reject test for each clause of the format, but for those of matrices.

use enfilade::cells::{PortalKind, PortalState};
use enfilade::file::{FileError, PvsFile, encode_rows};
use enfilade::{BitMatrix, CellId};
use testing::forge::{Forged, Part, REQUIRED, ZSTD, sample, sign, u32s};

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
    pub const PORTAL_STATES: u32 = 14;
    pub const VIEW_CELLS: u32 = 15;
    pub const VIEW_ROWS: u32 = 16;
    pub const VIEW_BOUNDS: u32 = 17;
    pub const VIEW_WITNESSES: u32 = 18;
    pub const GAP: u32 = 20;
    pub const CLOSED_HOLES: u32 = 22;
    pub const CLUSTERS: u32 = 23;
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
    refused_after("format version 1, this program reads version 3; bake the model again", |f| f.version = 1);
    refused_after("format version 4, this program reads version 3", |f| f.version = 4);
    refused_after("header, byte 40: guarantee 2; there are 2", |f| f.guarantee = 2);
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
    refused(&patched(last, &[whole[last] ^ 1], false), "section clusters, ");
}

#[test]
fn section_table_clauses() {
    refused_after("section 1 out of order; numbers ascend from 1", |f| f.parts.swap(0, 1));
    refused_after("section 23 out of order", |f| f.parts.push(f.parts.last().unwrap().clone()));
    refused_after("section 0 out of order", |f| f.parts[0].number = 0);
    refused_after("section 1 has unknown flags 0x5", |f| f.parts[0].flags = REQUIRED | 4);
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
fn portal_state_clauses() {
    let sample = sample();
    let n = sample.portals.len();
    assert!(n > 1 && sample.portals.iter().any(|p| p.state != PortalState::of_kind(p.kind)));
    refused_with(PORTAL_STATES, 1, &[1], "section portal-states, byte 1: portal state 1");
    refused_with(PORTAL_STATES, 0, &[8], "section portal-states, byte 0: portal state 8");
    refused_as(PORTAL_STATES, &[&vec![0; n + 1]], "1 bytes too many");
    refused_as(PORTAL_STATES, &[&vec![0; n - 1]], "1 bytes expected, 0 left");
    // A file without the section, as those before it were: every state is its kind's, and only that may be left out.
    let mut f = forged();
    f.remove(PORTAL_STATES);
    let usual = PvsFile::read(&f.bytes()).unwrap();
    assert!(usual.portals.iter().all(|p| p.state == PortalState::of_kind(p.kind)));
    assert_eq!(usual.write(), f.bytes());
    let code = |kind| match kind {
        PortalKind::Door => 4,
        PortalKind::Window => 7,
        PortalKind::Opening => 0,
    };
    let codes: Vec<u8> = sample.portals.iter().map(|p| code(p.kind)).collect();
    refused_as(PORTAL_STATES, &[&codes], "every portal has its kind's state: omit the section");
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
    refused_after("section cells: needs 2147483648 bytes of memory; a file of this length has", |f| {
        as_cells(f, vec![0; 100], 1 << 30)
    });
    refused_after("section cells: needs 18446744073709551615 bytes of memory", |f| as_cells(f, bomb.clone(), u64::MAX));
    refused_after("section cells, byte 0: can't be decompressed to 100 bytes", |f| as_cells(f, bomb.clone(), 100));
    refused_after("section cells, byte 0: 4 bytes decompressed, 5 declared", |f| {
        as_cells(f, zstd::bulk::compress(b"cell", 1).unwrap(), 5);
    });
    refused_after("section cells, byte 0: can't be decompressed", |f| as_cells(f, b"no zstd".to_vec(), 9));
}

/// What is before the flags of the options in `meta`, and what is behind the unit and the radius, which may be there or not.
fn around_options(meta: &[u8]) -> [&[u8]; 2] {
    [&meta[..37], &meta[38 + 8 * (meta[37] & 3).count_ones() as usize..]]
}

#[test]
fn meta_clauses() {
    let nan = f64::NAN.to_le_bytes();
    refused_with(META, 8, &nan, "section meta, byte 8: a number that is not finite");
    refused_with(META, 24, &f64::INFINITY.to_le_bytes(), "section meta, byte 24: a number that is not finite");
    refused_with(META, 24, &(-1.0f64).to_le_bytes(), "section meta, byte 24: a negative length");
    refused_with(META, 32, &[6], "section meta, byte 32: strategy 6; there are 6");
    refused_with(META, 33, &[0; 4], "section meta, byte 33: objects of 0 triangles");
    refused_with(META, 37, &[32], "section meta, byte 37: flags 32");
    let mut f = forged();
    let content = f.decoded(META);
    let [head, rest] = around_options(&content);
    for (unit, what) in [(0.0f64, "not above 0 metres"), (-2.0, "not above 0 metres"), (f64::NAN, "not finite")] {
        refused_as(META, &[head, &[1], &unit.to_le_bytes(), rest], "section meta, byte 38: a ");
        refused_as(META, &[head, &[1], &unit.to_le_bytes(), rest], what);
    }
    refused_as(
        META,
        &[head, &[2], &0.0f64.to_le_bytes(), rest],
        "section meta, byte 38: a radius that is not above 0 metres",
    );
    let read = |f: &mut Forged, options: &[&[u8]]| {
        f.put(META, [head, &options.concat(), rest].concat());
        let import = PvsFile::read(&f.bytes()).unwrap().import;
        (import.metres_per_unit, import.tube_radius, import.tubes)
    };
    let [foot, inch] = [0.3048f64, 0.0254].map(f64::to_le_bytes);
    assert_eq!(read(&mut f, &[&[7], &foot, &inch]), (Some(0.3048), Some(0.0254), false));
    assert_eq!(read(&mut f, &[&[2], &inch]), (None, Some(0.0254), true));
    assert_eq!(read(&mut f, &[&[0]]), (None, None, true));
}

#[test]
fn clauses_of_counts_in_meta() {
    let content = forged().decoded(META);
    let [head, rest] = around_options(&content);
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
    for (fewer, section) in [
        ([lower, upper - 1, cell_lower, cell_upper], "object-rows"),
        ([lower, upper, cell_lower, cell_upper - 1], "cell-rows"),
        ([lower - 1, upper, cell_lower, cell_upper], "object-bounds"),
        ([lower, upper, cell_lower - 1, cell_upper], "cell-bounds"),
    ] {
        refused_as(META, &[head, &[0], counts, &numbers(fewer), reason], &format!("section {section}"));
    }
}

const NO_NAME: &[u8] = &[0, 0, 0, 0];
const NO_SOURCE: &[u8] = &[0];
const CLOSED: &[u8] = &[0];

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
    // Rows of cells are read by the portals.
    let mut file = sample();
    file.portals.iter_mut().zip([[2, 1], [0, 1], [0, 1], [0, 1]]).for_each(|(p, cells)| p.cells = cells.map(CellId));
    let mut f = Forged::take_apart(&file.write());
    f.put(PORTALS, portal([2, 1], up, 2, &triangle));
    assert_eq!(PvsFile::read(&f.bytes()).unwrap().portals[0].cells, [CellId(2), CellId(1)]);

    refused_as(PORTALS, &[&portal([3, 1], up, 0, &triangle)], "section portals, byte 4: cell 3; there are 3");
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
    refused_as(OBJECTS, &[&list(&object(1, [0., 1., 0., 0., 0., 0.]))], "a box with its least corner above its greatest");
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
    refused_with(REPAIRS, 8, &3u32.to_le_bytes(), "section repairs, byte 8: cell 3; there are 3");
    refused_with(REPAIRS, 12, &f64::NAN.to_le_bytes(), "section repairs, byte 12: a number that is not finite");
    let stats = f.decoded(STATS);
    refused_as(STATS, &[&stats, &[0]], "section stats, byte 56: 1 bytes too many");
    refused_as(STATS, &[&stats[..47]], "section stats, byte 40: 8 bytes expected, 7 left");

    let numbers = |n: [u64; 5]| n.map(u64::to_le_bytes).concat();
    refused_as(GAP, &[&numbers([3, 2, 1, 1, 0])], "4 undecided pairs of 3");
    refused_as(GAP, &[&numbers([9, 2, 1, 1, 0])], "section gap, byte 0: 4 pairs, ");
    refused_as(GAP, &[&numbers([9, u64::MAX, 7, 1, 9])], "undecided pairs of 9");
    refused_as(GAP, &[&numbers([9, 2, 1, 1, 0]), &[0]], "section gap, byte 40: 1 bytes too many");

    let hole = |corners: u32, points: &[f32]| [u32s(&[1, corners]), f32s(points)].concat();
    refused_as(CLOSED_HOLES, &[&hole(2, &[0.; 9])], "section closed-holes, ");
    refused_as(CLOSED_HOLES, &[&hole(3, &[0., 0., 0., 1., f32::INFINITY, 0., 1., 1., 0.])], "a number that is not finite");
    refused_as(CLOSED_HOLES, &[&u32s(&[u32::MAX])], "a list of 4294967295");
    refused_as(CLOSED_HOLES, &[&hole(3, &[0.; 9]), &[0]], "section closed-holes, byte 44: 1 bytes too many");
    refused_as(CLUSTERS, &[&u32s(&[1, 0, 2])], "section clusters, byte 4: a cell joined from 0 cells");
    refused_as(CLUSTERS, &[&u32s(&[1, 2])], "section clusters, byte 8: 4 bytes expected, 0 left");
    refused_as(CLUSTERS, &[&u32s(&[1, 2, 3, 4])], "section clusters, byte 12: 4 bytes too many");

    // A lower pair outside the upper set: all zeros above, all ones below (rows take turns).
    let mut turns = BitMatrix::new(6, 3);
    turns.set(1, 2);
    refused_as(CELL_BOUNDS, &[&encode_rows(&turns)], "pair 0, 2 is in the lower set and not in the upper");
    // Rows that aren't what was declared.
    f.put(OBJECT_ROWS, encode_rows(&BitMatrix::new(3, 70)));
    refused(&f.bytes(), "section object-rows, byte 0: 0 pairs, ");
}

#[test]
fn view_cell_clauses() {
    let view = |id: &str| [&u32s(&[id.len() as u32])[..], id.as_bytes(), NO_NAME].concat();
    let list = |ids: [&str; 2]| [u32s(&[2]), view(ids[0]), view(ids[1])].concat();
    let mut f = forged();
    f.put(VIEW_CELLS, list(["a", "b"]));
    let file = PvsFile::read(&f.bytes()).unwrap();
    assert_eq!((file.view_cell(&"b".into()), file.view_cell(&"c".into())), (Some(1), None));
    refused_as(VIEW_CELLS, &[&list(["a", "a"])], "duplicate view cell \"a\"");
    refused_as(VIEW_CELLS, &[&u32s(&[0])], "no view cells: omit the section");
    refused_as(VIEW_CELLS, &[&u32s(&[1]), &view("a")], "a matrix of 2 rows, 1 expected");
    refused_as(VIEW_CELLS, &[&u32s(&[u32::MAX])], "a list of 4294967295");

    let witnesses = f.decoded(VIEW_WITNESSES);
    let count = u32::from_le_bytes(witnesses[..4].try_into().unwrap());
    let fewer = [&u32s(&[count - 1])[..], &witnesses[4..witnesses.len() - 48]].concat();
    refused_as(VIEW_WITNESSES, &[&fewer], &format!("{} witnesses, {count} pairs in the lower set", count - 1));
    refused_with(VIEW_WITNESSES, 4, &f64::NAN.to_le_bytes(), "section view-witnesses, byte 4: a number that is not finite");
    let mut turns = BitMatrix::new(4, 70);
    turns.set(3, 69);
    refused_as(VIEW_BOUNDS, &[&encode_rows(&turns)], "pair 1, 69 is in the lower set and not in the upper");
    refused_as(VIEW_ROWS, &[&encode_rows(&BitMatrix::new(2, 70))], "section view-rows, byte 0: 0 pairs, ");
    refused_after("section view-cells is missing", |f| f.remove(VIEW_CELLS));
    refused_after("section view-bounds is missing", |f| f.remove(VIEW_BOUNDS));
    refused_after("section view-witnesses is missing", |f| f.remove(VIEW_WITNESSES));
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
    let counts = 38 + 8 * (meta[37] & 3).count_ones() as usize;
    meta[counts..counts + 12].copy_from_slice(&u32s(&[n, 4, n]));
    f.put(META, meta);
    for (number, content) in [(CELLS, cells), (OBJECTS, objects)] {
        let (stored, decoded) = part(content);
        *f.part(number) = Part { number, flags: ZSTD, stored, decoded };
    }
    for number in [PLACEMENT, CELL_ROWS, OBJECT_ROWS] {
        f.put(number, vec![0xc0, 0x9a, 0x0c, 0xc0, 0x9a, 0x0c, 1]);
    }
    for number in [CELL_BOUNDS, OBJECT_BOUNDS, WITNESSES] {
        f.remove(number);
    }
    let error = PvsFile::read(&f.bytes()).expect_err("too large");
    assert!(matches!(error, FileError::TooLarge { .. }), "{error}");
}
