//! The rows' code: clause by clause, any matrix there and back, and how small it gets.

use enfilade::BitMatrix;
use enfilade::file::{FileError, SectionId, decode_rows, encode_rows, entropy_bits_per_pair};
use proptest::prelude::*;
use testing::floor::floor;
use testing::random::Random;

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
    decode_rows(SectionId::ObjectRows, bytes, rows, columns)
}

/// A coded matrix by hand.
fn coded(shape: [u32; 2], flags: u8, bits: &[u8]) -> Vec<u8> {
    [&varints(&shape)[..], &[2, flags], bits].concat()
}

#[test]
fn matrix_clauses() {
    // The end of the interval is a clear bit, always: no references, no word like the one above, and no bits.
    assert_eq!(decode(&coded([2, 10], 0, &[0xff]), 2, 10).unwrap(), BitMatrix::new(2, 10));
    let refuse = |bytes: &[u8], expected: &str| {
        let message = decode(bytes, 2, 10).expect_err(expected).to_string();
        assert!(message.starts_with("section object-rows, byte ") && message.contains(expected), "{message} / {expected}");
    };
    refuse(&coded([4, 10], 0, &[0xff]), "a matrix of 4 rows, 2 expected");
    refuse(&coded([2, u32::MAX], 0, &[0xff]), "a matrix of 4294967295 columns, 10 expected");
    refuse(&[2, 10, 3, 0xff], "matrix code 3; there are 3");
    refuse(&[2, 10, 1, 0], "1 bytes too many");
    refuse(&[2, 10, 2], "1 bytes expected, 0 left");
    refuse(&[2, 0x80, 0, 2], "a number not in its shortest form");
    refuse(&[2, 0xff, 0xff, 0xff, 0xff, 0x10], "a number beyond 32 bits");
    // Its start is a set bit, always: the longest reference there is, as zeros or as no bytes at all.
    refuse(&coded([2, 10], 0, &[0]), "a reference 254 rows back from row 0");
    refuse(&coded([2, 10], 0, &[]), "a reference 254 rows back from row 0");
    for bits in [&[0xff, 0xff][..], &[0xff, 0], &[0xfe]] {
        refuse(&coded([2, 10], 0, bits), "a matrix that doesn't end with its last row");
    }
    for flags in [1, 3] {
        refuse(&coded([2, 10], flags, &[0xff]), "a symmetric matrix, not of cells");
    }
    refuse(&coded([2, 10], 4, &[0xff]), "flags 4; there are 4");
    // Rows that nothing stands for cost no time.
    let message = decode(&coded([50_000, 10_000], 0, &[0x7f; 3]), 50_000, 10_000).expect_err("no rows").to_string();
    assert!(message.contains("the bytes end before row ") || message.contains(" rows back from row "), "{message}");
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
        // At worst the bits themselves, what models learn of them, and two bytes a row for its reference.
        prop_assert!(bytes.len() <= 40 + rows * (columns.div_ceil(8) * 17 / 16 + 2));
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
    // Which row it is, at most three bits.
    assert!(all < once + 900 * 3 / 8, "{all} bytes for 900 rows, {once} for 3");
    assert_eq!(decode(&encode_rows(&many), 900, 2000).unwrap(), many);
}

#[test]
fn the_rows_of_a_building_take_a_fraction_of_their_entropy() {
    let m = floor(24, 20).objects;
    let bytes = encode_rows(&m);
    assert_eq!(decode(&bytes, m.rows(), m.columns()).unwrap(), m);
    let pairs = (m.rows() * m.columns()) as u64;
    let bits_per_pair = bytes.len() as f64 * 8.0 / pairs as f64;
    let entropy = entropy_bits_per_pair(m.count_ones(), pairs);
    let raw: Vec<u8> = (0..m.rows()).flat_map(|row| m.row(row)).flat_map(|word| word.to_le_bytes()).collect();
    let zstd = zstd::bulk::compress(&raw, 15).unwrap().len();
    eprintln!("{} bytes, {bits_per_pair:.4} bits a pair, entropy {entropy:.4}; raw {}, zstd {zstd}", bytes.len(), raw.len());
    assert!(bits_per_pair < entropy / 2.0 && bytes.len() * 20 < raw.len());
    assert!(bytes.len() < zstd);
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
