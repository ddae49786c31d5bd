//! Broken files with right checksums: refused or read, never a panic, never much memory. A binary of its own, because
//! the allocator counts.

mod forge;

use allocation_counter::measure;
use enfilade::file::{Container, PvsFile, SectionId};
use forge::{Forged, Random, Shape, ZSTD, random_file, sample};

const MUTANTS: u64 = 20_000;

/// What docs/format.md promises: 16 MiB and 1,024 times the file's length, and what zstd needs for itself.
fn promised(file: usize) -> usize {
    (16 << 20) + 1024 * file + (1 << 20)
}

/// Numbers that lengths and ids go wrong with.
const NASTY: [u32; 10] = [0, 1, 2, 0x7f, 0x80, 0xff, 0xffff, 0x7fff_ffff, 0x8000_0000, u32::MAX];

/// Changes a few places of decoded content.
fn mutate(bytes: &mut Vec<u8>, r: &mut Random) {
    for _ in 0..1 + r.below(3) {
        if bytes.is_empty() {
            bytes.push(r.next() as u8);
        }
        let at = r.below(bytes.len());
        match r.below(6) {
            0 => bytes[at] ^= 1 << r.below(8),
            1 => bytes[at] = r.next() as u8,
            2 => {
                let nasty = NASTY[r.below(NASTY.len())].to_le_bytes();
                bytes.iter_mut().skip(at).zip(nasty).for_each(|(b, n)| *b = n);
            }
            3 => bytes.truncate(at),
            4 => bytes.insert(at, r.next() as u8),
            _ => {
                let end = (at + 1 + r.below(16)).min(bytes.len());
                let again = bytes[at..end].to_vec();
                bytes.splice(at..at, again);
            }
        }
    }
}

#[test]
fn mutants_never_panic_nor_take_memory_beyond_what_is_promised() {
    let small = Shape { cells: 4, portals: 3, objects: 33, keep_bounds: true };
    let seeds: Vec<Forged> = [sample(), random_file(7, small), random_file(8, Shape { keep_bounds: false, ..small })]
        .iter()
        .map(|file| Forged::take_apart(&file.write()))
        .collect();
    let r = &mut Random(1);
    let mut accepted = 0u64;
    for i in 0..MUTANTS {
        let mut forged = seeds[r.below(seeds.len())].clone();
        for _ in 0..1 + r.below(2) {
            let k = r.below(forged.parts.len());
            match r.below(12) {
                // The table itself.
                0 => forged.parts[k].flags ^= 1 << r.below(3),
                1 => forged.parts[k].decoded = u64::from(NASTY[r.below(NASTY.len())]) << r.below(32),
                2 => forged.parts[k].number = r.below(16) as u32,
                3 => {
                    forged.parts.remove(k);
                }
                // A compressed stream.
                4 => mutate(&mut forged.parts[k].stored, r),
                // What it decodes to, compressed again or not.
                _ if forged.parts[k].flags & ZSTD == 0 || forged.parts[k].decoded < 1 << 20 => {
                    let Some(mut decoded) = decoded(&forged, k) else { continue };
                    mutate(&mut decoded, r);
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
        let bytes = forged.bytes();
        let mut read = None;
        let taken = measure(|| {
            read = Some(PvsFile::read(&bytes));
            let rows = Container::parse(&bytes).and_then(|c| c.rows(SectionId::ObjectRows));
            if let Ok(Some(rows)) = rows {
                (0..rows.rows().min(8)).for_each(|row| drop(rows.row(row)));
            }
        })
        .bytes_max;
        assert!(taken <= promised(bytes.len()) as u64, "mutant {i}: {taken} bytes for a file of {}", bytes.len());
        if let Some(Ok(file)) = read {
            accepted += 1;
            // What is accepted means something: written again, it reads as the same.
            assert_eq!(PvsFile::read(&file.write()).expect("its own bytes"), file, "mutant {i}");
        }
    }
    // Mutants must get past the checksums and the first checks, or this tests nothing; most must not get further.
    assert!((MUTANTS / 100..MUTANTS / 2).contains(&accepted), "{accepted} of {MUTANTS} accepted");
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
