//! Rows that `vis` finds, written into levels of Quake, Half-Life and Quake 2, as the crate `qbsp` reads them.
#![cfg(feature = "full")]

use super::games::cases;
use super::real::rows_of;
use enfilade::BitMatrix;
use enfilade::job::Job;
use enfilade_levels::bsp::Bsp;
use enfilade_levels::{Level, VisOptions, vis};
use qbsp::data::visdata::VisDataRef;
use qbsp::prelude::*;
use testing::data::data;
use testing::quake::{AIR, Layout, bsp, three_rooms};

/// Larger levels take too long.
pub const MOST_PORTALS: usize = 3000;

pub fn read(bytes: &[u8]) -> BspData {
    BspData::parse(BspParseInput { bsp: bytes, lit: None, settings: BspParseSettings::default() }).unwrap()
}

/// Rows of clusters, PVS and PHS, as qbsp decodes them. Two of its faults are mended: it counts offsets from behind their table, and
/// clusters from 1.
pub fn rows_of_clusters(theirs: &mut BspData, clusters: usize) -> [BitMatrix; 2] {
    let table = 4 + 8 * clusters;
    theirs.visibility.visdata.splice(..0, vec![0; table]);
    let mut rows = [(); 2].map(|()| BitMatrix::new(clusters, clusters));
    for cluster in 0..clusters {
        let is_in = |visdata: &VisDataRef| matches!(visdata, VisDataRef::Cluster(c) if c.0 == cluster as i32);
        let leaf = theirs.leaves.iter().position(|leaf| is_in(&leaf.visdata)).unwrap();
        let sets = [theirs.potentially_visible_set(leaf), theirs.potentially_audible_set(leaf)];
        for (rows, set) in rows.iter_mut().zip(sets) {
            let seen = set.unwrap().into_clusters().ok().unwrap().map(|one| one - 1);
            // The next row follows.
            seen.take_while(|&other| other < clusters).for_each(|other| _ = rows.set(cluster, other));
        }
    }
    rows
}

/// The rows that `vis` finds, and the file with them.
pub fn written(file: &Bsp, level: &Level, clusters: &[u32]) -> (BitMatrix, Vec<u8>) {
    let rows = vis(level, &VisOptions::default(), None, &Job::quiet()).unwrap().upper;
    let bytes = file.with_rows(&rows, clusters, None).unwrap().bytes;
    // By leaf or cluster, as the file has them.
    let cells = clusters.len();
    let mut unfolded = BitMatrix::new(cells, cells);
    for (a, &of_a) in clusters.iter().enumerate() {
        let seen = (0..cells).filter(|&b| rows.get(of_a as usize, clusters[b] as usize));
        seen.for_each(|b| _ = unfolded.set(a, b));
    }
    (unfolded, bytes)
}

#[test]
fn rows_in_levels_of_half_life_and_quake_2_are_read() {
    let (mut by_leaf, mut by_cluster) = (0, 0);
    for case in cases() {
        let is_of = |folder: &str| case.name.starts_with(folder);
        let Some(prt) = case.prt().filter(|prt| (is_of("hl/") || is_of("q2/")) && prt.level.portals.len() <= MOST_PORTALS)
        else {
            continue;
        };
        let file = Bsp::read(case.part("novis.bsp").or_else(|| case.part("vis.bsp")).unwrap()).unwrap();
        let (rows, bytes) = written(&file, &prt.level, &prt.leaves);
        let mut theirs = read(&bytes);
        if file.is_by_leaf() {
            assert!(rows_of(&theirs, file.cells()) == rows, "{}", case.name);
            by_leaf += 1;
        } else {
            let [seen, heard] = rows_of_clusters(&mut theirs, file.cells());
            assert!(seen == rows, "{}", case.name);
            assert!(Some(heard) == Bsp::read(bytes).unwrap().second_rows().unwrap(), "{}", case.name);
            by_cluster += 1;
        }
    }
    eprintln!("{by_leaf} levels with rows by leaf, {by_cluster} by cluster");
    assert!(by_leaf >= 5 && by_cluster >= 5, "{by_leaf} {by_cluster}");
}

#[test]
fn rows_in_levels_of_quake_are_read() {
    let by_hand = |bsp2: bool| bsp(&three_rooms(AIR), Layout { bsp2, ..Layout::default() });
    let real = |name: &str| std::fs::read(data().join(format!("quake-id-gpl/{name}.bsp"))).unwrap();
    for (name, bytes) in [("bsp29", by_hand(false)), ("BSP2", by_hand(true)), ("dm4", real("dm4"))] {
        let file = Bsp::read(bytes).unwrap();
        let clusters: Vec<u32> = (0..file.cells() as u32).collect();
        let (rows, bytes) = written(&file, &file.level().unwrap().level, &clusters);
        assert!(rows_of(&read(&bytes), file.cells()) == rows, "{name}");
    }
}
