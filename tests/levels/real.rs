//! Real levels of Quake, against another reader of their files.
#![cfg(feature = "full")]

use super::bsp::{assert_kept, diagonal};
use enfilade::BitMatrix;
use enfilade::math::geom::newell;
use enfilade_levels::bsp::Bsp;
use enfilade_levels::prt::{Dialect, Prt};
use glam::DVec3;
use qbsp::prelude::*;
use std::collections::BTreeSet;
use testing::data::data;
use testing::random::Random;

/// A real level, read by us and whole by qbsp.
fn real(folder: &std::path::Path, name: &str) -> (Vec<u8>, Bsp, BspData) {
    let bytes = std::fs::read(folder.join(format!("quake-id-gpl/{name}.bsp"))).unwrap();
    let theirs = BspData::parse(BspParseInput { bsp: &bytes, lit: None, settings: BspParseSettings::default() }).unwrap();
    (bytes.clone(), Bsp::read(bytes).unwrap(), theirs)
}

/// What another reader of the format decodes.
pub fn rows_of(theirs: &BspData, leaves: usize) -> BitMatrix {
    let mut rows = BitMatrix::new(leaves, leaves);
    for leaf in 0..leaves {
        // Its iterator doesn't know how many leaves the world has.
        let seen = theirs.potentially_visible_set(leaf + 1).unwrap().into_leaf_indices().ok().unwrap();
        seen.filter(|&other| (1..=leaves).contains(&other)).for_each(|other| _ = rows.set(leaf, other - 1));
    }
    rows
}

#[test]
fn real_levels_keep_everything_but_their_rows() {
    let folder = data();
    for name in super::LEVELS {
        let (bytes, level, theirs) = real(&folder, name);
        let rows = level.rows().unwrap().unwrap();
        assert_eq!(rows, rows_of(&theirs, level.cells()), "{name}");
        let clusters: Vec<u32> = (0..level.cells() as u32).collect();
        // Fewer, the same, and more bytes than before.
        let mut checkered = diagonal(level.cells());
        (0..level.cells()).for_each(|i| (i % 2..level.cells()).step_by(2).for_each(|j| _ = checkered.set(i, j)));
        for new in [diagonal(level.cells()), rows, checkered] {
            let after = level.with_rows(&new, &clusters, None).unwrap().bytes;
            assert_kept(&bytes, &after, 28);
            let read =
                BspData::parse(BspParseInput { bsp: &after, lit: None, settings: BspParseSettings::default() }).unwrap();
            assert_eq!(rows_of(&read, level.cells()), new, "{name}");
            assert_eq!(Bsp::read(after).unwrap().rows().unwrap().unwrap(), new, "{name}");
        }
    }
}

#[test]
fn real_levels_sound_as_another_tool_has_it() {
    let folder = data();
    let mut heard = [0; 4];
    for name in super::LEVELS {
        let (_, level, _) = real(&folder, name);
        let clusters: Vec<u32> = (0..level.cells() as u32).collect();
        let own = level.own_ambient_levels().unwrap();
        assert_eq!(level.ambient_levels(&level.rows().unwrap().unwrap(), &clusters).unwrap().unwrap(), own, "{name}");
        own.iter().for_each(|leaf| (0..4).for_each(|sound| heard[sound] += usize::from(leaf[sound] > 0)));
    }
    // Counted in the five files: leaves that hear water, sky, slime, lava.
    assert_eq!(heard, [2848, 2496, 0, 696]);
}

#[test]
fn real_levels_portals_lie_between_their_leaves() {
    let folder = data();
    for name in super::LEVELS {
        let (_, level, theirs) = real(&folder, name);
        let derived = level.level().unwrap();
        let rows = level.rows().unwrap().unwrap();
        // 1. What the tree, asked by another reader, says of points on both sides.
        let mut astray = 0;
        for p in &derived.level.portals {
            let (middle, normal) = (enfilade::math::geom::middle(&p.winding), newell(&p.winding).normalize());
            let leaf = |side: f64| theirs.leaf_at_point(0, (middle + normal * side * 0.01).as_vec3()) as u32;
            astray += u32::from([leaf(-1.0), leaf(1.0)] != p.cells.map(|c| c + 1));
            // 2. A third party's rows know them as neighbours.
            assert!(rows.get(p.cells[0] as usize, p.cells[1] as usize), "{name}: {:?}", p.cells);
        }
        // Some leaves are thinner than that hundredth of a unit.
        assert!(astray * 500 <= derived.level.portals.len() as u32, "{name}: {astray}");
        let prt = Prt { dialect: Dialect::Prt1, leaves: (0..level.cells() as u32).collect(), level: derived.level };
        let fit = level.fit(&prt);
        assert!(fit.is_taken() && fit.elsewhere.is_empty(), "{name}: {fit}");
    }
}

/// Random segments: wherever one gets from an open leaf into another, there is a portal between the two.
#[test]
fn real_levels_are_sealed() {
    let folder = data();
    for name in super::LEVELS {
        let (_, level, theirs) = real(&folder, name);
        let derived = level.level().unwrap().level;
        let neighbours: BTreeSet<[u32; 2]> =
            derived.portals.iter().flat_map(|p| [p.cells, [p.cells[1], p.cells[0]]]).collect();
        let named: BTreeSet<u32> = derived.portals.iter().flat_map(|p| p.cells).collect();
        let mut random = Random::new(1);
        let open = |p: DVec3| {
            let leaf = theirs.leaf_at_point(0, p.as_vec3());
            (leaf > 0 && named.contains(&(leaf as u32 - 1))).then(|| leaf as u32 - 1)
        };
        let (mut crossings, mut without) = (0, 0);
        for k in 0..4000 {
            // From a random corner of a random portal's middle on, in a random direction.
            let portal = &derived.portals[(k * 7919) % derived.portals.len()];
            let mut p = enfilade::math::geom::middle(&portal.winding);
            let step = random.direction() * 0.37;
            for _ in 0..200 {
                let q = p + step;
                let (Some(a), Some(b)) = (open(p), open(q)) else { break };
                if a != b && !neighbours.contains(&[a, b]) {
                    // Something thin in between, or at an edge: closer.
                    let (mut from, mut to) = (p, q);
                    while from.distance(to) > 2e-3 {
                        let middle = (from + to) * 0.5;
                        if open(middle) == Some(a) { from = middle } else { to = middle }
                    }
                    let next = open(to);
                    without += u32::from(next.is_some_and(|next| !neighbours.contains(&[a, next])));
                }
                crossings += u32::from(a != b);
                p = q;
            }
        }
        assert!(crossings > 4000, "{name}: {crossings}");
        // Within the rounding of the planes, leaves that meet in an edge may seem to share a face.
        assert!(without <= crossings / 5000, "{name}: {without} of {crossings}");
        eprintln!("{name}: {without} of {crossings} crossings without a portal");
    }
}
