//! Real buildings, from the model to a checked file: rooms as their authors named them, nothing missed.
#![cfg(feature = "ifc")]

use enfilade::bake::BakeOptions;
use enfilade::scene::ImportOptions;
use enfilade_formats::import;
use enfilade_measure::verify::{CheckOptions, check};
use serde_json::Value;
use std::collections::BTreeSet;
use testing::bakes;
use testing::data::data;

fn check_building(model: &str) {
    let folder = data();
    let options = ImportOptions::default();
    let scene = import(&folder.join(format!("{model}.ifc")), &options).unwrap();
    let file = bakes::baked(&scene, BakeOptions { import: options, ..bakes::with_rays(2_000_000) });
    assert_eq!(file.stats.contradictions, 0, "{model}: {:?}", file.stats);

    // 1. Every room of the author's that holds free space is a cell, and no cell bears a room's name that isn't one.
    let rooms: Value = serde_json::from_slice(&std::fs::read(folder.join(format!("{model}.rooms.json"))).unwrap()).unwrap();
    let authored: BTreeSet<&str> = rooms["rooms"].as_array().unwrap().iter().map(|r| r["id"].as_str().unwrap()).collect();
    let named: BTreeSet<&str> = file.cells.iter().filter_map(|c| c.source.as_deref()).collect();
    let stray: Vec<&&str> = named.difference(&authored).collect();
    assert!(stray.is_empty(), "cells named after no room: {stray:?}");
    let without: BTreeSet<&str> = authored.difference(&named).copied().collect();
    let said =
        |id: &&str| file.notes.iter().any(|n| n.starts_with(&format!("room {id} ")) && n.ends_with("holds no free space"));
    let lost: Vec<&&str> = without.iter().filter(|id| !said(id)).collect();
    assert!(lost.is_empty(), "rooms without a cell, and without a word about it: {lost:?}");
    assert!(named.len() as f64 >= 0.95 * authored.len() as f64, "{} of {} rooms: {without:?}", named.len(), authored.len());
    eprintln!(
        "{model}: {} of {} rooms, {} cells, {} portals",
        named.len(),
        authored.len(),
        file.cells.len(),
        file.portals.len()
    );

    // 2. The file keeps what it promises.
    let report = check(&file, &scene, &CheckOptions { rays: 300_000, ..CheckOptions::default() }).unwrap();
    assert!(report.passed, "{model}: {:?}", report.examples);
    assert_eq!((report.missed_pairs, report.missed_cell_pairs, report.missed_segments), (0, 0, 0), "{:?}", report.examples);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn real_buildings_have_their_rooms_and_keep_their_promises() {
    for model in ["duplex/Duplex_A_20110907", "kit-apache/AC11-FZK-Haus", "webifc-mpl/Office_A_20110811"] {
        check_building(model);
    }
}
