//! Broken `.pvs` files. With their checksums repaired they get as far as the deepest check; without, none is read.

use super::mutants::{Report, Run, change, run, settle, table};
use super::wanted;
use crate::targets::TARGETS;
use enfilade::file::PvsFile;
use enfilade::runtime::{Camera, Culler, Mode, View};
use enfilade_measure::walkthrough::expected::expected_draw;
use enfilade_measure::walkthrough::tour::tour;
use glam::DVec3;
use testing::forge::{Forged, Shape, ZSTD, random_file, sample};
use testing::random::Random;

/// Numbers that a table's lengths go wrong with.
const NASTY: [u64; 8] = [0, 1, 0x7f, 0xff, 0xffff, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff];

fn seeds() -> Vec<Forged> {
    let small = Shape { cells: 4, portals: 3, objects: 33, keep_bounds: true };
    [sample(), random_file(7, small), random_file(8, Shape { keep_bounds: false, ..small })]
        .iter()
        .map(|file| Forged::take_apart(&file.write()))
        .collect()
}

/// A file with a few wrong sections, or sections in the wrong place, and right checksums.
fn repaired(seeds: &[Forged], number: u64) -> Vec<u8> {
    let r = &mut Random::new(number);
    let mut forged = seeds[r.below(seeds.len())].clone();
    for _ in 0..1 + r.below(2) {
        let k = r.below(forged.parts.len());
        match r.below(13) {
            // The table itself.
            0 => forged.parts[k].flags ^= 1 << r.below(3),
            1 => forged.parts[k].decoded = NASTY[r.below(NASTY.len())] << r.below(32),
            2 => forged.parts[k].number = r.below(24) as u32,
            3 if forged.parts.len() > 1 => drop(forged.parts.remove(k)),
            // Another file's section.
            4 => {
                let other = &seeds[r.below(seeds.len())];
                let wanted = forged.parts[k].number;
                if let Some(part) = other.parts.iter().find(|p| p.number == wanted) {
                    forged.parts[k] = part.clone();
                }
            }
            // A compressed stream.
            5 => {
                let stored = forged.parts[k].stored.clone();
                change(&mut forged.parts[k].stored, &[stored], r);
            }
            // What it decodes to, compressed again or not.
            _ if forged.parts[k].flags & ZSTD == 0 || forged.parts[k].decoded < 1 << 20 => {
                let Some(mut decoded) = decoded(&forged, k) else { continue };
                let before = decoded.clone();
                change(&mut decoded, &[before], r);
                let zstd = forged.parts[k].flags & ZSTD != 0 && r.below(2) == 0;
                forged.parts[k].decoded = decoded.len() as u64;
                if zstd {
                    decoded = zstd::bulk::compress(&decoded, 1).unwrap();
                } else {
                    forged.parts[k].flags &= !ZSTD;
                }
                forged.parts[k].stored = decoded;
            }
            _ => {}
        }
    }
    forged.bytes()
}

/// The decoded bytes of the `k`-th part, where it still decodes.
fn decoded(forged: &Forged, k: usize) -> Option<Vec<u8>> {
    let part = &forged.parts[k];
    if part.flags & ZSTD == 0 {
        Some(part.stored.clone())
    } else {
        zstd::bulk::decompress(&part.stored, part.decoded as usize).ok()
    }
}

#[test]
fn no_file_panics_lies_or_takes_memory_beyond_what_is_promised() {
    let target = TARGETS.iter().find(|t| t.name == "pvs").expect("the file's own");
    let forged = seeds();
    let forged_one = |number: u64| {
        let bytes = repaired(&forged, number);
        let accepted = (target.run)(&bytes);
        if accepted {
            // What is accepted means something: written again, it reads as the same.
            let file = PvsFile::read(&bytes).expect("it was accepted");
            assert_eq!(PvsFile::read(&file.write()).expect("its own bytes"), file);
        }
        Run { accepted, promised: target.promised(bytes.len()), length: bytes.len() }
    };
    let whole: Vec<Vec<u8>> = forged.iter().map(Forged::bytes).collect();
    let blind_one = |number: u64| {
        let r = &mut Random::new(number);
        let mut bytes = whole[r.below(whole.len())].clone();
        change(&mut bytes, &whole, r);
        let accepted = !whole.contains(&bytes) && (target.run)(&bytes);
        assert!(!accepted, "a changed file passes its checksums");
        Run { accepted, promised: target.promised(bytes.len()), length: bytes.len() }
    };
    let count = wanted();
    let reports: [Report; 2] =
        [run("pvs, checksums repaired", count, &forged_one), run("pvs, as damaged", count, &blind_one)];
    table(&reports);
    settle(&reports);
    // Mutants must get past the checksums and the first checks, or this tests nothing; most must not get further.
    let accepted = reports[0].accepted;
    assert!((count / 100..count / 2).contains(&accepted), "{accepted} of {count} accepted");
}

/// Whatever the counts are: refused in one line when read, and borne by what takes a file from memory.
#[test]
fn files_without_cells_objects_or_portals_are_refused_or_borne() {
    let mut random = Random::new(11);
    for number in 0..200 {
        let [cells, objects, portals] = [0, 0, 0].map(|_| [0, 0, 1, 2, 5][random.below(5)]);
        let file = random_file(number, Shape { cells, portals, objects, keep_bounds: number % 2 == 0 });
        let read = PvsFile::read(&file.write());
        assert_eq!(read.is_ok(), cells > 0 && objects > 0, "{cells} cells, {objects} objects: {:?}", read.err());
        let mut view = View::new(&Culler::new(&file));
        let camera = Camera::look_at(DVec3::ZERO, DVec3::X, 1.0, 1.5);
        for mode in [Mode::None, Mode::Frustum, Mode::Portals, Mode::Pvs, Mode::PortalsAndPvs] {
            assert!(view.cull(&camera, mode).objects.len() <= objects);
        }
        let _ = (tour(&file, number), expected_draw(&file));
    }
}
