//! The rows' code: clause by clause, any matrix there and back, and how small it gets.

use enfilade::BitMatrix;
use enfilade::file::{Container, FileError, RowReader, SectionId, encode_rows, entropy_bits_per_pair};
use proptest::prelude::*;
use testing::forge::{Shape, random_file};
use testing::random::Random;

/// A coded matrix by hand; nothing in it compressed.
struct Coded<'a> {
    shape: [u32; 2],
    unique: u32,
    block_rows: u32,
    map: &'a [u8],
    block: Vec<u8>,
}

/// The length of each row, then the rows.
fn block(rows: [&[u8]; 2]) -> Vec<u8> {
    [&rows.map(|row| row.len() as u8)[..], &rows.concat()].concat()
}

impl Coded<'_> {
    /// Three rows of 10 columns: 1100000001, the same again, 1111000001.
    fn sample() -> Self {
        // One run of 2 and one of 1, apart by 7; then two bits more.
        let block = block([&[2, 2, 0, 1, 6, 0], &[0x03, 2, 2, 0]]);
        Self { shape: [3, 10], unique: 2, block_rows: 32, map: &[0, 1, 0], block }
    }

    /// With these lengths: stored and decoded of the map, stored and decoded of the block.
    fn with_lengths(&self, lengths: [usize; 4]) -> Vec<u8> {
        let head =
            [varints(&self.shape), vec![2], varints(&[self.unique, self.block_rows]), varints(&lengths.map(|n| n as u32))];
        [&head.concat()[..], self.map, &self.block].concat()
    }

    fn bytes(&self) -> Vec<u8> {
        self.with_lengths([self.map.len(), self.map.len(), self.block.len(), self.block.len()])
    }
}

/// Seven bits a byte, low ones first, the top bit on all but the last.
fn varints(numbers: &[u32]) -> Vec<u8> {
    let mut out = Vec::new();
    for &number in numbers {
        let mut rest = number;
        while rest > 127 {
            out.push(rest as u8 | 0x80);
            rest >>= 7;
        }
        out.push(rest as u8);
    }
    out
}

fn decode(bytes: &[u8], rows: usize, columns: usize) -> Result<BitMatrix, FileError> {
    RowReader::new(SectionId::ObjectRows, bytes, rows, columns)?.matrix()
}

fn refuse(bytes: &[u8], [rows, columns]: [usize; 2], expected: &str) {
    let message = decode(bytes, rows, columns).expect_err(expected).to_string();
    assert!(message.starts_with("section object-rows, byte ") && message.contains(expected), "{message} / {expected}");
}

/// Refuses [`Coded::sample`] after a change.
fn refuse_after(change: impl FnOnce(&mut Coded<'_>), expected: &str) {
    let mut coded = Coded::sample();
    change(&mut coded);
    refuse(&coded.bytes(), [3, 10], expected);
}

#[test]
fn matrix_clauses() {
    let matrix = decode(&Coded::sample().bytes(), 3, 10).unwrap();
    let rows: Vec<Vec<usize>> = (0..3).map(|row| matrix.ones(row).collect()).collect();
    assert_eq!(rows, [vec![0, 1, 9], vec![0, 1, 9], vec![0, 1, 2, 3, 9]]);

    refuse_after(|c| c.shape[0] = 4, "a matrix of 4 rows, 3 expected");
    refuse_after(|c| c.shape[1] = u32::MAX, "a matrix of 4294967295 columns, 10 expected");
    refuse_after(|c| c.unique = 0, "0 distinct rows of 3");
    refuse_after(|c| c.unique = 4, "4 distinct rows of 3");
    refuse_after(|c| c.block_rows = 0, "blocks of 0 rows");
    refuse_after(|c| c.block_rows = 4097, "blocks of 4097 rows");
    refuse_after(|c| c.map = &[0, 2, 0], "a copy of distinct row 1, of which 1 came before");
    refuse_after(|c| c.map = &[0, 1, 1], "1 distinct rows, 2 declared");
    refuse_after(|c| c.map = &[0, 1], "1 bytes expected, 0 left");
    refuse_after(|c| c.map = &[0, 1, 0, 0], "1 bytes too many");
    refuse_after(|c| c.map = &[0, 0x81, 0, 0], "a number not in its shortest form");
    refuse_after(|c| c.map = &[0, 0xff, 0xff, 0xff, 0xff, 0x10], "a number beyond 32 bits");
    refuse_after(|c| c.map = &[0, 0xff, 0xff, 0xff, 0xff, 0xff, 1], "a number beyond 32 bits");
}

#[test]
fn clauses_of_blocks() {
    let first = |row: &[u8], expected: &str| refuse_after(|c| c.block = block([row, &[0, 0]]), expected);
    first(&[3, 0], "a reference 1 rows back from row 0");
    first(&[0, 1, 10], "column 10, of which there are 10");
    first(&[0, 2, 9, 0], "column 10, of which there are 10");
    first(&[2, 1, 8, 2], "column 10, of which there are 10");
    first(&[0, 1, 0xff, 0xff, 0xff, 0xff, 0x0f], "column 4294967295");
    first(&[0, 0xff, 0xff, 0xff, 0xff, 0x0f], "1 bytes expected, 0 left");
    first(&[1, 0xff, 0x04], "bits beyond the last column");
    first(&[1, 0xff], "2 bytes expected, 1 left");
    first(&[0, 0, 0], "1 bytes too many");
    refuse_after(|c| c.block.push(0), "1 bytes too many");
    refuse_after(|c| c.block[0] = 11, "11 bytes expected, 10 left");
    refuse_after(|c| c.block = vec![0x80], "1 bytes expected, 0 left");
}

#[test]
fn clauses_of_lengths() {
    let whole = Coded::sample().bytes();
    let refuse = |bytes: &[u8], expected: &str| refuse(bytes, [3, 10], expected);
    // Two bytes of size, then the code.
    let mut unknown = whole.clone();
    unknown[2] = 4;
    refuse(&unknown, "matrix code 4, of which there are 4");
    let lengths = |lengths, expected: &str| refuse(&Coded::sample().with_lengths(lengths), expected);
    lengths([3, 16, 12, 12], "a part of 3 bytes that decodes to 16, at most 15 expected");
    lengths([3, u32::MAX as usize, 12, 12], "a part of 3 bytes that decodes to 4294967295, at most 15 expected");
    lengths([3, 3, 12, 37], "a part of 12 bytes that decodes to 37, at most 36 expected");
    lengths([3, 3, 13, 12], "a part of 13 bytes that decodes to 12");
    lengths([3, 3, 12, 13], "a block that doesn't decompress to 13 bytes");
    refuse(&[&whole[..], &[0]].concat(), "1 bytes too many");
    refuse(&whole[..whole.len() - 1], "12 bytes expected, 11 left");
    refuse(&[3, 10, 1, 0], "1 bytes too many");

    // A block that decompresses to more than it says.
    let bomb = zstd::bulk::compress(&vec![0; 1 << 26], 19).unwrap();
    let length = bomb.len();
    let bytes = Coded { shape: [3, 100_000], block: bomb, ..Coded::sample() }.with_lengths([3, 3, length, 25_000]);
    let error = decode(&bytes, 3, 100_000).expect_err("a bomb").to_string();
    assert!(error.contains("a block that doesn't decompress to 25000 bytes"), "{error}");
}

/// Rows bit by bit: not symmetric, one block.
fn modelled(shape: [u32; 2], rows: u32, bits: &[u8]) -> Vec<u8> {
    [&varints(&shape)[..], &[3, 0], &varints(&[rows, bits.len() as u32]), bits].concat()
}

#[test]
fn clauses_of_rows_bit_by_bit() {
    // The end of the interval is a clear bit, always: no references and no bits. Twenty unlikely bits settle no byte.
    assert_eq!(decode(&modelled([2, 10], 2, &[0xff]), 2, 10).unwrap(), BitMatrix::new(2, 10));
    // Its start is a set bit, always: the longest reference there is, as zeros or as no bytes at all.
    refuse(&modelled([2, 10], 2, &[0]), [2, 10], "a reference 254 rows back from row 0");
    refuse(&modelled([2, 10], 2, &[]), [2, 10], "a reference 254 rows back from row 0");
    refuse(&modelled([2, 10], 2, &[0xff, 0xff]), [2, 10], "block 0 doesn't end with its last row");
    refuse(&modelled([2, 10], 2, &[0xff, 0]), [2, 10], "block 0 doesn't end with its last row");
    refuse(&modelled([2, 10], 2, &[0xfe]), [2, 10], "block 0 doesn't end with its last row");
    refuse(&modelled([2, 10], 0, &[0xff]), [2, 10], "a block of 0 rows from row 0 of 2");
    refuse(&modelled([2, 10], 3, &[0xff]), [2, 10], "a block of 3 rows from row 0 of 2");
    refuse(&modelled([2, 10], 1, &[0xff]), [2, 10], "1 bytes expected, 0 left");
    let mut flags = modelled([2, 10], 2, &[0xff]);
    flags[3] = 1;
    refuse(&flags, [2, 10], "a symmetric matrix, not of cells");
    flags[3] = 2;
    refuse(&flags, [2, 10], "a flag 2, of which there are 2");
    let long = modelled([2, 2000], 2, &[0xff]);
    let message = decode(&long, 2, 2000).expect_err("too many steps").to_string();
    assert!(message.contains("row 0 takes more than 5600 steps"), "{message}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_matrix_is_read_as_it_was_written(
        seed: u64, rows in 0usize..40, columns in 0usize..300, eighths in 0usize..9, copies in 0usize..40, flips in 0usize..60,
    ) {
        let r = &mut Random::new(seed);
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
        // At worst the bits themselves and three bytes a row: its place in the map, its length, its form and reference.
        prop_assert!(bytes.len() <= 20 + rows * (columns.div_ceil(8) + 3));
    }
}

#[test]
fn uniform_matrices_are_their_size_and_a_byte() {
    for (rows, columns) in [(0, 0), (0, 9), (9, 0), (1, 1), (7, 64), (100, 1000)] {
        let zeros = BitMatrix::new(rows, columns);
        let mut ones = zeros.clone();
        (0..rows).for_each(|row| (0..columns).for_each(|column| assert!(ones.set(row, column))));
        for matrix in [zeros, ones] {
            let bytes = encode_rows(&matrix);
            assert!(bytes.len() <= 5);
            assert_eq!(decode(&bytes, rows, columns).unwrap(), matrix);
        }
    }
}

#[test]
fn equal_rows_are_stored_once() {
    let mut r = Random::new(5);
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
    let r = &mut Random::new(9);
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
    // Reading rows alone, from blocks of a few KiB, costs little beside one zstd frame over everything.
    assert!(bytes.len() < zstd + zstd / 5);
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
fn a_matrix_is_read_without_the_rest_of_the_file() {
    let file = random_file(11, Shape { cells: 40, portals: 10, objects: 500, keep_bounds: false });
    let bytes = file.write();
    let container = Container::parse(&bytes).unwrap();
    let rows = container.rows(SectionId::ObjectRows).unwrap().expect("in the file");
    assert_eq!(Some(rows.matrix().unwrap()), file.object_rows);
    assert!(container.rows(SectionId::Notes).unwrap().is_none());
}
