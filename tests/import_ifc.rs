//! IFC import against what others wrote down about the same files (`*.rooms.json`), and against a house small enough to know
//! every number of it.
#![cfg(feature = "ifc")]

use enfilade::scene::ifc::import_bytes;
use enfilade::scene::{ImportOptions, OpeningHint, OpeningKind, Role, Scene};
use glam::DVec3;
use serde_json::Value;
use std::path::PathBuf;
use std::time::Instant;

/// The data folder, or `None` after saying that the test wasn't run.
fn data(test: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("ENFILADE_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var_os("CI").is_none(), "{test}: no data folder");
    eprintln!("not run: {test}: no data folder");
    None
}

const FILES: [&str; 7] = [
    "duplex/Duplex_A_20110907",
    "kit-apache/AC11-FZK-Haus",
    "kit-apache/AC11-Smiley-West",
    "webifc-mpl/AC20-FZK-Haus",
    "webifc-mpl/Office_A_20110811",
    "bimwhale-mit/LargeBuilding",
    "bimwhale-mit/TallBuilding",
];

#[test]
fn explore() {
    let Some(folder) = data("explore") else { return };
    for file in FILES {
        let path = folder.join(format!("{file}.ifc"));
        let start = Instant::now();
        let scene = enfilade::scene::import(&path, &ImportOptions::default()).unwrap();
        println!("== {file} {:.2} s, {} tris {} objects {:?} origin {}", start.elapsed().as_secs_f64(), scene.triangles.len(), scene.objects.len(), scene.source, scene.origin);
        let oracle: Value = serde_json::from_slice(&std::fs::read(folder.join(format!("{file}.rooms.json"))).unwrap()).unwrap();
        println!("storeys {:?}", scene.hints.storeys);
        println!("rooms {} of {}", scene.hints.rooms.len(), oracle["rooms"].as_array().unwrap().len());
        let mut bad = 0;
        for r in oracle["rooms"].as_array().unwrap() {
            let Some(h) = scene.hints.rooms.iter().find(|h| h.id == r["id"].as_str().unwrap()) else { println!("no room {}", r["id"]); continue };
            let lo = h.surface.iter().flatten().map(|p| p.y).fold(f64::INFINITY, f64::min) + scene.origin.y;
            let hi = h.surface.iter().flatten().map(|p| p.y).fold(-f64::INFINITY, f64::max) + scene.origin.y;
            if (lo - r["floor_y"].as_f64().unwrap()).abs() > 0.01 || (hi - r["ceiling_y"].as_f64().unwrap()).abs() > 0.01 {
                bad += 1;
                if bad < 5 { println!("room {} {} {lo} {hi} {} {}", h.id, h.name, r["floor_y"], r["ceiling_y"]); }
            }
            let storey = h.storey.map(|s| scene.hints.storeys[s].name.clone()).unwrap_or_default();
            if r["storey"].as_str() != Some(&storey) { println!("storey {storey} {}", r["storey"]); }
        }
        let mut counts = std::collections::BTreeMap::new();
        for o in &scene.hints.openings { *counts.entry(format!("{:?}", o.kind)).or_insert(0) += 1; }
        println!("openings {counts:?}");
        let mut shown = 0;
        let mut ok = 0; let mut n = 0; let mut roomsok = [0; 3];
        for d in oracle["doors"].as_array().unwrap() {
            n += 1;
            let id = d["id"].as_str().unwrap();
            let c: Vec<f64> = d["centre"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
            let c = DVec3::new(c[0], c[1], c[2]) - scene.origin;
            let nn: Vec<f64> = d["normal"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
            let nn = DVec3::new(nn[0], nn[1], nn[2]);
            let h = scene.hints.openings.iter().find(|h| h.id == id);
            let Some(h) = h else { 
                let near = scene.hints.openings.iter().filter(|h| (h.winding.iter().sum::<DVec3>() / h.winding.len() as f64).distance(c) < 0.2).count();
                println!("no opening {} {} ({near} near)", d["kind"], id); continue };
            let hc = h.winding.iter().sum::<DVec3>() / h.winding.len() as f64;
            let w = h.winding[0].distance(h.winding[1]);
            let hh = h.winding[1].distance(h.winding[2]);
            let hn = enfilade::geom::newell(&h.winding).normalize();
            let (ow, oh, ot) = (d["width"].as_f64().unwrap(), d["height"].as_f64().unwrap(), d["thickness"].as_f64().unwrap());
            let good = hc.distance(c) < 0.15 && (w - ow).abs() < 0.1 && (hh - oh).abs() < 0.1 && (h.thickness - ot).abs() < 0.02 && hn.dot(nn).abs() > 0.99;
            if good { ok += 1 } else { shown += 1; if shown < 8 { println!("{} {id} centre off {:?}, w {w:.3} {ow} h {hh:.3} {oh} t {:.3} {ot} n {hn:.2} {nn:.2}", d["kind"], hc - c, h.thickness); } }
            let want: Vec<_> = d["rooms"].as_array().unwrap().iter().filter_map(|x| x.as_str()).collect();
            let have: Vec<_> = h.rooms.iter().flatten().map(|&r| scene.hints.rooms[r].id.as_str()).collect();
            if have.is_empty() { roomsok[0] += 1 } else if have.iter().all(|x| want.contains(x)) { roomsok[1] += 1 } else { roomsok[2] += 1; }
        }
        println!("openings ok {ok} of {n}; rooms none/consistent/contradicting {roomsok:?}");
        let b = scene.bounds();
        println!("bounds {} {}", b.min + scene.origin, b.max + scene.origin);
        let mut roles = std::collections::BTreeMap::new();
        for o in &scene.objects { *roles.entry(format!("{:?} {}", o.role, o.opaque)).or_insert(0) += 1; }
        println!("{roles:?}");
    }
    let _ = (import_bytes, OpeningKind::Door, Role::Door);
    let _ = |_: &OpeningHint, _: &Scene| ();
}
