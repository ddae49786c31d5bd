//! The `.pvs` format: what is written is read again, and what isn't as docs/format.md says is refused, rule by rule.

mod clauses;
mod disk;
mod matrix;

use enfilade::file::{FileError, MAGIC, PvsFile, PvsStats, Views};
use proptest::prelude::*;
use testing::bakes::on;
use testing::forge::{Shape, random_file, sample};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn what_is_written_is_read(seed: u64, cells in 1usize..7, portals in 0usize..9, objects in 1usize..150, keep_bounds: bool) {
        let file = random_file(seed, Shape { cells, portals, objects, keep_bounds });
        let bytes = file.write();
        prop_assert_eq!(&PvsFile::read(&bytes).unwrap(), &file);
        prop_assert_eq!(file.write(), &bytes[..]);
        let for_frames = PvsFile {
            closed_holes: Vec::new(),
            clusters: Vec::new(),
            left_out: Vec::new(),
            notes: Vec::new(),
            bounds: None,
            repairs: Vec::new(),
            stats: PvsStats::default(),
            unseen: None,
            gap: None,
            views: Views { bounds: None, ..file.views },
            relevance: None,
            bake: None,
            ..file
        };
        prop_assert_eq!(PvsFile::read_for_frames(&bytes).unwrap(), for_frames);
    }

    #[test]
    fn any_bytes_are_refused(tail: Vec<u8>) {
        prop_assert!(PvsFile::read(&tail).is_err());
        prop_assert!(PvsFile::read(&[&MAGIC[..], &[3, 0, 0, 0], &tail].concat()).is_err());
    }
}

#[test]
fn the_same_file_gives_the_same_bytes_on_any_number_of_threads() {
    let file = random_file(3, Shape { cells: 300, portals: 500, objects: 900, keep_bounds: true });
    assert_eq!(on(1, || file.write()), on(5, || file.write()));
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
            let [whole, for_frames] = [PvsFile::read(&bytes), PvsFile::read_for_frames(&bytes)];
            assert!(whole.is_err() && for_frames.is_err(), "byte {at} xor {change:#x}");
            bytes[at] ^= change;
        }
    }
    assert!(PvsFile::read(&bytes).is_ok());
}
