//! Mutants by number, run side by side, and what came of them.

use allocation_counter::measure;
use std::collections::BTreeMap;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};
use testing::bakes;
use testing::random::Random;

/// Numbers that lengths and ids go wrong with.
const NASTY: [u32; 10] = [0, 1, 2, 0x7f, 0x80, 0xff, 0xffff, 0x7fff_ffff, 0x8000_0000, u32::MAX];
/// Numbers that texts go wrong with.
const TEXTS: [&str; 18] = [
    "2",
    "-0.5",
    "0",
    "-1",
    "1",
    "1e-6",
    "1e-300",
    "1e7",
    "1e12",
    "1e300",
    "1e999",
    "NaN",
    "inf",
    "4294967295",
    "18446744073709551615",
    "",
    "0.30000000000000004",
    "[]",
];

/// Changes a few places of bytes.
pub fn change(bytes: &mut Vec<u8>, seeds: &[Vec<u8>], r: &mut Random) {
    for _ in 0..1 + r.below(3) {
        if bytes.is_empty() {
            bytes.push(r.word() as u8);
        }
        let at = r.below(bytes.len());
        match r.below(9) {
            0 => bytes[at] ^= 1 << r.below(8),
            1 => bytes[at] = r.word() as u8,
            2 => {
                let nasty = NASTY[r.below(NASTY.len())].to_le_bytes();
                bytes.iter_mut().skip(at).zip(nasty).for_each(|(b, n)| *b = n);
            }
            3 => bytes.truncate(at),
            4 => bytes.insert(at, b"0123456789-./{}[]()\",:<>e \n"[r.below(27)]),
            5 => drop(bytes.drain(at..(at + 1 + r.below(16)).min(bytes.len()))),
            6 => {
                let end = (at + 1 + r.below(64)).min(bytes.len());
                let again = bytes[at..end].to_vec();
                bytes.splice(at..at, again);
            }
            7 => {
                let other = &seeds[r.below(seeds.len())];
                let from = r.below(other.len());
                let part = other[from..(from + 1 + r.below(64)).min(other.len())].to_vec();
                let end = (at + r.below(64)).min(bytes.len());
                bytes.splice(at..end, part);
            }
            _ => number(bytes, at, r),
        }
    }
}

/// Another number in the place of the next one in a text.
fn number(bytes: &mut Vec<u8>, at: usize, r: &mut Random) {
    let is_number = |b: &u8| b.is_ascii_digit() || *b == b'.' || *b == b'-';
    let Some(start) = (at..bytes.len()).find(|&i| bytes[i].is_ascii_digit()) else { return };
    let end = (start..bytes.len()).find(|&i| !is_number(&bytes[i])).unwrap_or(bytes.len());
    bytes.splice(start..end, TEXTS[r.below(TEXTS.len())].bytes());
}

/// The mutant of a number. A `.glb` keeps a header that owns up to its length, or it would get no further.
pub fn mutant(seeds: &[Vec<u8>], number: u64) -> Vec<u8> {
    let r = &mut Random::new(number);
    let mut bytes = seeds[r.below(seeds.len())].clone();
    if r.below(2) == 0 && !bytes.is_empty() {
        // Numbers alone: what is around them stays whole.
        for _ in 0..1 + r.below(4) {
            let at = r.below(bytes.len());
            self::number(&mut bytes, at, r);
        }
    } else {
        change(&mut bytes, seeds, r);
    }
    if bytes.starts_with(b"glTF") && bytes.len() >= 12 && r.below(8) > 0 {
        let length = bytes.len() as u32;
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
    }
    bytes
}

/// What became of a mutant.
pub struct Run {
    pub accepted: bool,
    /// Most memory that it may take, bytes, and its own length.
    pub promised: u64,
    pub length: usize,
}

/// What became of all of a reader's.
pub struct Report {
    pub name: String,
    pub mutants: u64,
    pub accepted: u64,
    /// Most memory taken, bytes, and of a mutant of which length.
    pub memory: (u64, usize),
    pub slowest: Duration,
    /// Numbers of mutants and what was wrong with them.
    pub faults: BTreeMap<u64, String>,
    pub seconds: f64,
}

impl Report {
    /// Adds a mutant that took this long and so many bytes of memory.
    fn add(&mut self, number: u64, took: Duration, taken: u64, found: std::thread::Result<Run>) {
        self.slowest = self.slowest.max(took);
        match found {
            Ok(run) => {
                self.accepted += u64::from(run.accepted);
                self.memory = self.memory.max((taken, run.length));
                if taken > run.promised {
                    let what = format!("{taken} bytes of memory for a file of {}, {} promised", run.length, run.promised);
                    self.faults.insert(number, what);
                }
            }
            Err(panic) => {
                let text = panic.downcast_ref::<String>().cloned();
                let text = text.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
                self.faults.insert(number, format!("panic: {}", text.unwrap_or_default()));
            }
        }
    }
}

/// One mutant that runs longer hangs: the slowest known takes a hundredth.
const HANGS: Duration = Duration::from_secs(120);

/// Runs mutants 0 to `count` on two threads; each on one, with what it asks of others.
pub fn run(name: &str, count: u64, one: &(dyn Fn(u64) -> Run + Sync)) -> Report {
    let next = AtomicU64::new(0);
    let total = Mutex::new(Report {
        name: name.to_owned(),
        mutants: count,
        accepted: 0,
        memory: (0, 0),
        slowest: Duration::ZERO,
        faults: BTreeMap::new(),
        seconds: 0.0,
    });
    let begin = Instant::now();
    let busy: [Mutex<Option<(u64, Instant)>>; 2] = [Mutex::new(None), Mutex::new(None)];
    let work = |busy: &Mutex<Option<(u64, Instant)>>| {
        loop {
            let number = next.fetch_add(1, Relaxed);
            if number >= count {
                break;
            }
            let start = Instant::now();
            *busy.lock().unwrap() = Some((number, start));
            let mut found = None;
            let taken = measure(|| found = Some(catch_unwind(AssertUnwindSafe(|| one(number))))).bytes_max;
            let took = start.elapsed();
            *busy.lock().unwrap() = None;
            total.lock().unwrap().add(number, took, taken, found.expect("it ran"));
        }
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = busy
            .iter()
            .map(|busy| {
                let work = &work;
                scope.spawn(move || bakes::on(1, || work(busy)))
            })
            .collect();
        while threads.iter().any(|t| !t.is_finished()) {
            std::thread::sleep(Duration::from_millis(20));
            let hung = busy.iter().filter_map(|b| *b.lock().unwrap()).find(|(_, start)| start.elapsed() > HANGS);
            if let Some((number, _)) = hung {
                // A thread can't be ended from outside; what hangs fails by name.
                eprintln!("{name}: mutant {number} hangs");
                std::process::abort();
            }
        }
    });
    let mut report = total.into_inner().unwrap();
    report.seconds = begin.elapsed().as_secs_f64();
    report
}

/// Prints what became of mutants, past the harness that holds back what passing tests say.
pub fn table(reports: &[Report]) {
    let mut text = String::from("| reader | mutants | accepted | panics, lies | most memory, KiB | slowest, ms | s |\n");
    text += "| --- | --- | --- | --- | --- | --- | --- |\n";
    for r in reports {
        let memory = format!("{} (of {} bytes)", r.memory.0 >> 10, r.memory.1);
        let ms = r.slowest.as_secs_f64() * 1e3;
        let (name, mutants, accepted, faults) = (&r.name, r.mutants, r.accepted, r.faults.len());
        text += &format!("| {name} | {mutants} | {accepted} | {faults} | {memory} | {ms:.1} | {:.1} |\n", r.seconds);
    }
    std::io::stderr().write_all(text.as_bytes()).unwrap();
}

/// Fails with the first faults of each reader.
pub fn settle(reports: &[Report]) {
    let faults: Vec<String> = reports
        .iter()
        .flat_map(|r| r.faults.iter().take(5).map(move |(number, what)| format!("{} {number}: {what}", r.name)))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
