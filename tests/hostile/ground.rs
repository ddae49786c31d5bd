//! Broken `.ground` files. With their checksums repaired they get as far as the selection; without, none is read whole.

use super::mutants::{Report, Run, change, run, settle, table};
use super::wanted;
use crate::targets::{TARGETS, Target};
use testing::ground_file::{ENTRY, GroundFile};
use testing::random::Random;

/// Whole numbers that lengths go wrong with.
const WHOLES: [u64; 12] = [0, 1, 2, 4, 33, 34, 100, 1 << 20, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, u64::MAX];
/// Lengths and heights that nobody has.
const REALS: [f64; 14] =
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, -1.0, 1e-300, 1e-38, 1e-6, 0.5, 1e6, 1e30, 3.4e38, 1e300];
/// Bytes of the header's `u32`, `u64` and `f64` fields.
const WORDS: [usize; 5] = [12, 16, 20, 24, 28];
const VOIDS: usize = 88;
const DOUBLES: [usize; 6] = [40, 48, 56, 64, 72, 80];

fn target() -> &'static Target {
    TARGETS.iter().find(|t| t.name == "ground").expect("the file's own")
}

fn number(r: &mut Random) -> [u8; 4] {
    match r.below(3) {
        0 => (WHOLES[r.below(WHOLES.len())] as u32).to_le_bytes(),
        1 => (REALS[r.below(REALS.len())] as f32).to_le_bytes(),
        _ => (r.word() as u32).to_le_bytes(),
    }
}

/// A file with a few wrong numbers in its header, table or tiles, and right checksums.
fn repaired(seeds: &[GroundFile], number_of: u64) -> Vec<u8> {
    let r = &mut Random::new(number_of);
    let mut file = seeds[r.below(seeds.len())].clone();
    for _ in 0..1 + r.below(3) {
        let tile = r.below(file.tiles.len());
        match r.below(10) {
            0 => {
                let at = WORDS[r.below(WORDS.len())];
                file.head[at..at + 4].copy_from_slice(&(WHOLES[r.below(WHOLES.len())] as u32).to_le_bytes());
            }
            1 => {
                let at = DOUBLES[r.below(DOUBLES.len())];
                file.head[at..at + 8].copy_from_slice(&REALS[r.below(REALS.len())].to_le_bytes());
            }
            2 => file.head[VOIDS..VOIDS + 8].copy_from_slice(&WHOLES[r.below(WHOLES.len())].to_le_bytes()),
            // Numbers of a tile: heights, errors, samples; rarely what is zero.
            3..6 => {
                let fields = if r.below(8) == 0 { 6 } else { 5 };
                let at = 4 * r.below(fields);
                file.table[tile][at..at + 4].copy_from_slice(&number(r));
            }
            6 => file.table[tile] = file.table[r.below(file.table.len())].clone(),
            // A tile that is not what was written.
            7 => {
                let at = r.below(file.tiles[tile].len());
                file.tiles[tile][at] ^= 1 << r.below(8);
                continue;
            }
            8 => {
                let at = r.below(file.tiles[tile].len() - 3);
                file.tiles[tile][at..at + 4].copy_from_slice(&number(r));
                file.sign();
            }
            _ => file.table[tile][24 + r.below(ENTRY - 24)] ^= 1 << r.below(8),
        }
    }
    // Sizes that differ need other lengths, or get no further.
    if r.below(4) > 0 {
        file.fit();
    }
    if r.below(4) == 0 {
        file.sign();
    }
    file.bytes()
}

#[test]
fn no_ground_panics_or_takes_memory_beyond_what_is_promised() {
    let whole: Vec<Vec<u8>> = (target().seeds)();
    let seeds: Vec<GroundFile> = whole.iter().map(|bytes| GroundFile::take_apart(bytes)).collect();
    let of = |bytes: Vec<u8>| {
        let accepted = (target().run)(&bytes);
        Run { accepted, promised: target().promised(bytes.len()), length: bytes.len() }
    };
    let repaired_one = |number: u64| of(repaired(&seeds, number));
    let blind_one = |number: u64| {
        let r = &mut Random::new(number);
        let mut bytes = whole[r.below(whole.len())].clone();
        change(&mut bytes, &whole, r);
        of(bytes)
    };
    let count = (wanted() / target().share).max(50);
    let reports: [Report; 2] =
        [run("ground, checksums repaired", count, &repaired_one), run("ground, as damaged", count, &blind_one)];
    table(&reports);
    settle(&reports);
    // Mutants must get past the checksums and the first checks, or this tests nothing; some must not.
    let accepted = reports[0].accepted;
    assert!((count / 10..count).contains(&accepted), "{accepted} of {count} accepted");
}
