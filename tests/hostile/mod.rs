//! Bytes that anyone may have written, bounded numbers of them: refused or read, never a panic, never an id out of range, never much
//! memory, never without end. `ENFILADE_MUTANTS` says how many a reader (`just torture`: a million); each is known by its number.
//!
//! A binary of its own, because its allocator counts. Memory is counted for one thread, so each mutant is worked on by one.

mod ground;
mod mutants;
mod paths;
mod pvs;
mod seeds;

use self::mutants::{Report, Run, run};
use crate::targets::{TARGETS, Target};

/// How many mutants of `.pvs` files, of two kinds each; of others there are fewer.
fn wanted() -> u64 {
    match std::env::var("ENFILADE_MUTANTS") {
        Ok(n) => n.parse().expect("ENFILADE_MUTANTS is a number"),
        Err(_) => 20_000,
    }
}

/// Mutants of a reader's seeds.
fn mutants_of(target: &'static Target) -> Report {
    let seeds = (target.seeds)();
    let count = (wanted() / target.share).max(50);
    let one = |number: u64| {
        let bytes = mutants::mutant(&seeds, number);
        let accepted = (target.run)(&bytes);
        Run { accepted, promised: target.promised(bytes.len()), length: bytes.len() }
    };
    run(target.name, count, &one)
}

/// Each game's level, and each dialect of portal files, with mutants of its own.
#[test]
fn no_kind_of_level_makes_its_reader_panic_or_take_more() {
    for target in TARGETS.iter().filter(|t| t.name == "bsp" || t.name == "prt") {
        let seeds = (target.seeds)();
        let of = |(i, seed): (usize, &Vec<u8>)| {
            let one = |number: u64| {
                let bytes = mutants::mutant(std::slice::from_ref(seed), number);
                Run { accepted: (target.run)(&bytes), promised: target.promised(bytes.len()), length: bytes.len() }
            };
            run(&format!("{} {i}", target.name), (wanted() / 50).max(50), &one)
        };
        let reports: Vec<Report> = seeds.iter().enumerate().map(of).collect();
        mutants::table(&reports);
        mutants::settle(&reports);
    }
}

#[test]
fn no_reader_panics_or_takes_memory_beyond_what_is_promised() {
    // The files' own mutants are in `pvs` and `ground`: blind ones end at their checksums.
    let is_ours = |t: &&Target| t.name == "pvs" || t.name == "ground";
    let reports: Vec<Report> = TARGETS.iter().filter(|t| !is_ours(t)).map(mutants_of).collect();
    mutants::table(&reports);
    mutants::settle(&reports);
    for report in &reports {
        // Mutants must get past the first checks, or this tests nothing.
        assert!(report.accepted * 200 > report.mutants, "{}: {} of {}", report.name, report.accepted, report.mutants);
    }
}
