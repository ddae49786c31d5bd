//! A walk at 1.4 m/s through a building that does not fit into memory: frames with something missing, by rows and on demand, over the budget and
//! over the bandwidth (`cargo bench --bench prefetch -- FILE.pvs`; without a file, an office of 1,182 furnished rooms is made and baked;
//! `--test` takes a small one).
//!
//! First: with memory for all and loads that take no time nothing is missing, by either way. In every walk, what is in memory is never more than
//! the budget, and what a frame draws is its set less what is missing.

use enfilade::file::PvsFile;
use enfilade::runtime::{Culler, Doors};
use enfilade_measure::walkthrough::loading::{
    LoadingFrame, LoadingOptions, LoadingSummary, Method, RATE, WALK, object_bytes, walk_loading,
};
use enfilade_measure::walkthrough::stroll::Stroll;
use std::sync::Arc;
use testing::bakes::{baked, office, with_rays};
use testing::times::{is_told, names};

/// Offices: 1,182 rooms, with corridors, stairs and the like.
const OFFICES: usize = 1000;
const SHARES: [f64; 4] = [0.05, 0.1, 0.2, 0.4];
/// Bytes a second.
const BANDWIDTHS: [f64; 6] = [0.5e6, 1e6, 2e6, 5e6, 20e6, 100e6];
/// Those of the walks over the budget.
const USUAL: f64 = 20e6;
/// Seconds.
const LATENCY: f64 = 0.05;
const SHARE: f64 = 0.2;
/// Of so many frames, the memory of one is summed up.
const CHECKED: u64 = 100;
/// Frames with memory for all.
const FIRST: usize = 20_000;

fn main() {
    let small = is_told("--test");
    let file = match &names()[..] {
        [pvs] => PvsFile::load(pvs.as_ref()).unwrap_or_else(|e| panic!("{e}")),
        _ => baked(&office(if small { 30 } else { OFFICES }, true).1, with_rays(1_000_000)),
    };
    let culler = Culler::new(&file);
    let bytes = object_bytes(&file);
    let stroll = Stroll::through(&file, 0, WALK / RATE);
    let walk = Walk { file: &file, culler: &culler, bytes: &bytes, stroll: &stroll };
    let all: u64 = bytes.iter().sum();
    println!(
        "{} cells, {} objects, {} bytes; {} frames in {} legs, {:.1} km",
        file.cells.len(),
        bytes.len(),
        all,
        stroll.frames(),
        stroll.legs.len(),
        stroll.frames() as f64 * WALK / RATE / 1e3
    );
    // With all in memory, each plan is of all: the first minutes will do.
    let first = Stroll {
        legs: stroll.legs.iter().take(1).map(|leg| leg.iter().copied().take(FIRST).collect()).collect(),
        fov_y_degrees: stroll.fov_y_degrees,
    };
    for method in [Method::Rows, Method::OnDemand] {
        let (instant, _) = Walk { stroll: &first, ..walk }.with(method, all, f64::INFINITY, 0.0);
        assert_eq!((instant.frames_missing, instant.after_jumps, instant.frames_over_budget), (0, 0, 0), "{instant:?}");
    }
    println!(
        "| memory | bytes a second | by | frames | something missing | % | objects | in open cells | after jumps | over budget | loaded, MB | us |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let over_budgets = SHARES.map(|share| (share, USUAL));
    let over_bandwidths = BANDWIDTHS.map(|bandwidth| (SHARE, bandwidth));
    for (share, bandwidth) in over_budgets.into_iter().chain(over_bandwidths) {
        for method in [Method::Rows, Method::OnDemand] {
            let (s, open) = walk.with(method, (share * all as f64) as u64, bandwidth, LATENCY);
            println!(
                "| {:.0} % | {:.1} M | {} | {} | {} | {:.3} | {} | {} of {} | {} | {} | {:.1} | {:.1}, {:.1}, {:.0} |",
                share * 1e2,
                bandwidth / 1e6,
                s.method,
                s.frames,
                s.frames_missing,
                s.frames_missing as f64 * 1e2 / s.frames.max(1) as f64,
                s.objects_missing,
                open[1],
                open[0],
                s.after_jumps,
                s.frames_over_budget,
                s.bytes_loaded as f64 / 1e6,
                s.us[0],
                s.us[1],
                s.us[2]
            );
        }
    }
}

#[derive(Clone, Copy)]
struct Walk<'w> {
    file: &'w PvsFile,
    culler: &'w Arc<Culler>,
    bytes: &'w [u64],
    stroll: &'w Stroll,
}

impl Walk<'_> {
    /// Walks, and checks each frame. Also counts frames in open cells, such as the outside, and of them those with something missing.
    fn with(&self, method: Method, budget: u64, bandwidth: f64, latency: f64) -> (LoadingSummary, [u64; 2]) {
        let options = LoadingOptions { budget, bandwidth, latency, aspect: 16.0 / 9.0 };
        let (mut frames, mut open, doors) = (0, [0; 2], Doors::open(self.culler));
        let mut told = |frame: &LoadingFrame<'_>| {
            let drawn = frame.visible.iter().filter(|object| frame.in_memory[object.index()]).count();
            assert_eq!(drawn as u64 + frame.missing, frame.visible.len() as u64);
            // All objects are gone through: not in each frame.
            if frames % CHECKED == 0 {
                let held = self.bytes.iter().zip(frame.in_memory).filter(|(_, there)| **there);
                let held: u64 = held.map(|(bytes, _)| bytes).sum();
                assert!(held <= budget, "{held} bytes of {budget}");
            }
            frames += 1;
            let home = self.culler.cell_of(frame.camera.eye);
            if frame.counts && home.is_none_or(|cell| self.file.cells[cell.index()].open) {
                open[0] += 1;
                open[1] += u64::from(frame.missing > 0);
            }
        };
        let summary = walk_loading(self.file, (self.culler, &doors), self.bytes, self.stroll, (method, &options), &mut told);
        assert!(summary.bytes_most <= budget, "{summary:?}");
        assert_eq!(summary.frames + summary.after_jumps, self.stroll.frames() as u64);
        (summary, open)
    }
}
