//! Shortest ways in an office of 1,182 rooms, between random places on its floors (`cargo bench --bench paths`; `--test` takes a small office;
//! `-- FILE.pvs` another building).
//!
//! First the answers are checked: no way is shorter than any proof of the same way, both ways round, and with some doors shut. Ways longer than
//! their proofs are counted.

use enfilade::PortalId;
use enfilade::file::PvsFile;
use enfilade::runtime::{Culler, Doors, Pathfinder};
use enfilade_measure::walkthrough::stroll::Stroll;
use glam::Vec3;
use std::hint::black_box;
use std::time::Duration;
use testing::bakes::{baked, office, with_rays};
use testing::random::Places;
use testing::times::{is_told, names, timed, us};

/// Pairs of places.
const PAIRS: usize = 4000;
/// Metres from place to place of the walk that they are from.
const STEP: f64 = 0.25;
/// One door in so many is shut.
const SHUT: usize = 10;

fn main() {
    let small = is_told("--test");
    let file = match &names()[..] {
        [pvs] => PvsFile::load(pvs.as_ref()).unwrap_or_else(|e| panic!("{e}")),
        _ => baked(&office(if small { 30 } else { 1000 }, true).1, with_rays(1_000_000)),
    };
    let culler = Culler::new(&file);
    let stroll = Stroll::through(&file, 1, STEP);
    let places: Vec<Vec3> = stroll.legs.iter().flatten().map(|frame| (frame.eye - file.origin).as_vec3()).collect();
    let mut random = Places::new(0);
    let mut pairs = || [0, 1].map(|_| places[random.below(places.len())]);
    let pairs: Vec<[Vec3; 2]> = (0..PAIRS).map(|_| pairs()).collect();
    let open = Doors::passable(&culler);
    let (mut ways, made) = timed(|| Pathfinder::new(&culler, &open));
    println!(
        "{} cells, {} portals, {} places; prepared in {:.1} ms",
        file.cells.len(),
        file.portals.len(),
        places.len(),
        made.as_secs_f64() * 1e3
    );
    let mut some_shut = open.clone();
    (0..file.portals.len()).step_by(SHUT).for_each(|q| some_shut.set_open(PortalId(q as u32), false));
    let mut cut_short = 0;
    for [from, to] in &pairs {
        let ends = |way: enfilade::runtime::Path<'_>| [way.at_least, way.metres];
        let way = ways.find(&open, *from, *to).map(ends);
        let back = ways.find(&open, *to, *from).map(ends);
        let shut = ways.find(&some_shut, *from, *to).map(ends);
        let (Some([at_least, metres]), Some(back)) = (way, back) else {
            assert!(way.is_none() && back.is_none() && shut.is_none());
            continue;
        };
        assert!(at_least <= metres && at_least <= back[1] + 1e-3 && back[0] <= metres + 1e-3, "{way:?}, and {back:?} back");
        assert!(shut.is_none_or(|[_, shut]| shut > at_least - 1e-3), "{way:?}, and {shut:?} with doors shut");
        cut_short += usize::from(metres - at_least > 1e-3);
    }
    println!("{cut_short} of {PAIRS} ways may not be the shortest");
    println!("| doors | ways | metres, mean | portals, mean | us, median | 99 % | slowest |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for (name, doors) in [("open", &open), ("a tenth shut", &some_shut)] {
        let (mut times, mut sums) = (Vec::<Duration>::new(), (0usize, 0.0, 0usize));
        for [from, to] in &pairs {
            let (way, took) = timed(|| black_box(ways.find(doors, *from, *to)).map(|way| (way.metres, way.portals.len())));
            times.push(took);
            if let Some((metres, portals)) = way {
                sums = (sums.0 + 1, sums.1 + metres, sums.2 + portals);
            }
        }
        times.sort();
        let n = sums.0.max(1) as f64;
        println!(
            "| {name} | {} of {PAIRS} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} |",
            sums.0,
            sums.1 / n,
            sums.2 as f64 / n,
            us(&times, 50),
            us(&times, 99),
            us(&times, 100)
        );
    }
}
