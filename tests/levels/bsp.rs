//! Quake levels: portals out of the tree, rows into the file and out again, and everything else as it was.

use enfilade::BitMatrix;
use enfilade::math::geom::{area, newell};
use enfilade_levels::bsp::{Bsp, BspError};
use proptest::prelude::*;
use std::collections::BTreeSet;
use testing::quake::{
    AIR, FENCE, Face, Layout, SKY, SOLID, Tree, WATER, bsp, extension, grated_room, hollow, leaf, lumps, node, three_rooms,
    with_faces,
};

const VISIBILITY: usize = 4;
const LEAVES: usize = 10;

fn read(tree: &Tree, layout: Layout) -> Bsp {
    Bsp::read(bsp(tree, layout)).unwrap()
}

fn formats() -> [Layout; 2] {
    [false, true].map(|bsp2| Layout { bsp2, ..Layout::default() })
}

/// Pairs of cells with a portal, its plane's x, and its area.
fn portals(level: &Bsp) -> Vec<([u32; 2], f64, f64)> {
    let mut all: Vec<_> = level
        .level()
        .unwrap()
        .level
        .portals
        .iter()
        .map(|p| {
            // Leads along x: from the cell with the smaller x, or the other way round.
            let forwards = newell(&p.winding).x > 0.0;
            let cells = if forwards { p.cells } else { [p.cells[1], p.cells[0]] };
            (cells, p.winding[0].x, (area(&p.winding) * 1e6).round() / 1e6)
        })
        .collect();
    all.sort_by(|a, b| a.1.total_cmp(&b.1));
    all
}

#[test]
fn three_rooms_have_four_portals() {
    for layout in formats() {
        let level = read(&three_rooms(AIR), layout);
        assert_eq!((level.cells(), level.format()), (5, if layout.bsp2 { "BSP2" } else { "bsp29" }));
        // Leaves in the order in which they are written: third room, its door, second, its door, first.
        let expected = [([4, 3], 4.0, 4.0), ([3, 2], 5.0, 4.0), ([2, 1], 9.0, 4.0), ([1, 0], 10.0, 4.0)];
        assert_eq!(portals(&level), expected);
        assert_eq!(level.level().unwrap().slivers, 0);
    }
}

#[test]
fn water_is_looked_through_and_sky_is_not() {
    let [water, sky, solid] = [WATER, SKY, SOLID].map(|last| portals(&read(&three_rooms(last), Layout::default())));
    assert_eq!((water.len(), sky.len(), solid.len()), (4, 3, 3));
}

#[test]
fn planes_that_repeat_make_no_portal_twice() {
    // A wall's plane once more below itself, either way round: nothing is between the two.
    let twice = hollow([0.0; 3], [8.0; 3], node(0, 4.0, node(0, 4.0, leaf(AIR), leaf(AIR)), leaf(AIR)));
    let level = read(&twice, Layout::default());
    let found = portals(&level);
    assert_eq!(found.iter().map(|p| (p.1, p.2)).collect::<Vec<_>>(), [(4.0, 64.0)]);
    // The leaf without a volume has no portal.
    let named: BTreeSet<u32> = found.iter().flat_map(|p| p.0).collect();
    assert_eq!(named.len(), 2);
}

#[test]
fn a_face_falls_apart_where_leaves_meet_it() {
    // One side of x = 4 is cut at y = 2 and y = 5, the other at z = 3: six pieces.
    let three = || node(1, 2.0, node(1, 5.0, leaf(AIR), leaf(AIR)), leaf(AIR));
    let two = node(2, 3.0, leaf(AIR), leaf(AIR));
    let level = read(&hollow([0.0; 3], [8.0; 3], node(0, 4.0, three(), two)), Layout::default());
    let across: Vec<_> = portals(&level).into_iter().filter(|p| p.1 == 4.0 && p.0[0] != p.0[1]).collect();
    let mut areas: Vec<f64> = level
        .level()
        .unwrap()
        .level
        .portals
        .iter()
        .filter(|p| newell(&p.winding).x.abs() > 1e-6)
        .map(|p| area(&p.winding))
        .collect();
    areas.sort_by(f64::total_cmp);
    assert_eq!(areas.iter().map(|a| a.round()).collect::<Vec<_>>(), [6.0, 9.0, 9.0, 10.0, 15.0, 15.0]);
    assert!((areas.iter().sum::<f64>() - 64.0).abs() < 1e-9 && across.len() >= 6);
}

pub fn diagonal(n: usize) -> BitMatrix {
    let mut rows = BitMatrix::new(n, n);
    (0..n).for_each(|i| _ = rows.set(i, i));
    rows
}

/// Everything but the rows is as it was.
pub fn assert_kept(before: &[u8], after: &[u8], leaf_size: usize) {
    let (a, b) = (lumps(before), lumps(after));
    for k in (0..15).filter(|&k| k != VISIBILITY && k != LEAVES) {
        assert_eq!(a[k], b[k], "lump {k}");
    }
    assert_eq!(a[LEAVES].len(), b[LEAVES].len());
    for (x, y) in a[LEAVES].chunks_exact(leaf_size).zip(b[LEAVES].chunks_exact(leaf_size)) {
        assert_eq!((&x[..4], &x[8..]), (&y[..4], &y[8..]));
    }
    assert_eq!(extension(before), extension(after));
}

#[test]
fn rows_come_back_and_the_rest_stays() {
    let some = || Layout { vis: &[9; 5], ..Layout::default() };
    let layouts = [
        Layout::default(),
        some(),
        Layout { extended: true, ..Layout::default() },
        Layout { extended: true, ..some() },
        Layout { vis_last: true, ..some() },
        Layout { vis_last: true, extended: true, ..some() },
        Layout { tail: b"somebody's own bytes", ..some() },
        Layout { vis_last: true, tail: b"somebody's own bytes", ..some() },
    ];
    for (k, layout) in layouts.into_iter().enumerate() {
        for bsp2 in [false, true] {
            let before = bsp(&three_rooms(AIR), Layout { bsp2, ..layout });
            let level = Bsp::read(before.clone()).unwrap();
            let mut rows = diagonal(5);
            [(0, 1), (1, 0), (1, 2), (4, 0)].iter().for_each(|&(a, b)| _ = rows.set(a, b));
            let after = level.with_rows(&rows, &[0, 1, 2, 3, 4], None).unwrap().bytes;
            let again = Bsp::read(after.clone()).unwrap();
            assert_eq!(again.rows().unwrap(), Some(rows.clone()), "layout {k}");
            assert_eq!(again.level().unwrap(), level.level().unwrap());
            assert_kept(&before, &after, if bsp2 { 44 } else { 28 });
            assert!(after.ends_with(layout.tail), "layout {k}");
            // The solid leaf, and those of doors and lifts, have no row.
            let leaves = &lumps(&after)[LEAVES];
            let offsets: Vec<i32> = leaves
                .chunks_exact(if bsp2 { 44 } else { 28 })
                .map(|l| i32::from_le_bytes(l[4..8].try_into().unwrap()))
                .collect();
            assert_eq!((offsets[0], offsets[6], offsets.len()), (-1, -1, 7));
            // Once more, with the same rows: the same file.
            assert_eq!(again.with_rows(&rows, &[0, 1, 2, 3, 4], None).unwrap().bytes, after, "layout {k}");
        }
    }
}

#[test]
fn clusters_rows_are_spread_over_their_leaves() {
    let level = read(&three_rooms(AIR), Layout::default());
    // Two clusters: leaves 0, 1, 2 and 3, 4; the first sees the second, which sees itself only.
    let mut rows = diagonal(2);
    rows.set(0, 1);
    let after = Bsp::read(level.with_rows(&rows, &[0, 0, 0, 1, 1], None).unwrap().bytes).unwrap().rows().unwrap().unwrap();
    let of = |leaf: usize| after.ones(leaf).collect::<Vec<_>>();
    assert_eq!([of(0), of(1), of(2)], [(); 3].map(|()| vec![0, 1, 2, 3, 4]));
    assert_eq!([of(3), of(4)], [(); 2].map(|()| vec![3, 4]));
}

/// A triangle that a leaf names.
fn sounding(texture: &'static str, leaf: usize) -> Face {
    Face { corners: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], texture, leaf }
}

#[test]
fn leaves_hear_what_they_see() {
    // Leaf `i + 1` is cell `i`. Slime sounds like water; a teleporter doesn't sound.
    let faces = vec![
        sounding("*Slime0", 1),
        sounding("SKY4", 2),
        sounding("*lava1", 3),
        sounding("*04water2", 4),
        sounding("*teleport", 5),
        sounding("brick", 5),
    ];
    let level = Bsp::read(with_faces(&bsp(&three_rooms(AIR), Layout::default()), &[faces], "")).unwrap();
    let heard = |rows: &BitMatrix, clusters: &[u32]| level.ambient_levels(rows, clusters).unwrap().unwrap();
    let (water, sky, lava, none) = ([255, 0, 0, 0], [0, 255, 0, 0], [0, 0, 0, 255], [0; 4]);
    assert_eq!(heard(&diagonal(5), &[0, 1, 2, 3, 4]), [water, sky, lava, water, none]);
    let mut rows = diagonal(5);
    [(4, 0), (4, 1), (1, 3), (0, 3), (2, 4)].iter().for_each(|&(a, b)| _ = rows.set(a, b));
    let both = [255, 255, 0, 0];
    assert_eq!(heard(&rows, &[0, 1, 2, 3, 4]), [water, both, lava, water, both]);
    // Clusters of leaves: 0, 1, 2 and 3, 4; the second sees the first.
    let mut rows = diagonal(2);
    rows.set(1, 0);
    let all = [255, 255, 0, 255];
    assert_eq!(heard(&rows, &[0, 0, 0, 1, 1]), [all; 5]);
    assert_eq!(heard(&diagonal(2), &[0, 0, 0, 1, 1]), [all, all, all, water, water]);
}

#[test]
fn ambient_levels_are_written_where_they_belong_and_only_if_asked_for() {
    for layout in formats() {
        let before = bsp(&three_rooms(AIR), layout);
        let level = Bsp::read(before.clone()).unwrap();
        let own = level.own_ambient_levels().unwrap();
        assert_eq!(own, [1, 2, 3, 4, 5].map(|leaf| [1, 2, 3, leaf]));
        let levels: Vec<[u8; 4]> = own.iter().map(|leaf| leaf.map(|level| level + 100)).collect();
        let write = |levels| level.with_rows(&diagonal(5), &[0, 1, 2, 3, 4], levels).unwrap().bytes;
        let (without, after) = (write(None), write(Some(&levels[..])));
        assert_kept(&before, &without, if layout.bsp2 { 44 } else { 28 });
        let again = Bsp::read(after.clone()).unwrap();
        assert_eq!(again.own_ambient_levels().unwrap(), levels);
        // Five leaves' four bytes, and nothing else.
        let changed = after.iter().zip(&without).filter(|(a, b)| a != b).count();
        assert_eq!((changed, after.len()), (5 * 4, without.len()));
        // Rows alone leave them as they are.
        let rows = again.with_rows(&diagonal(5), &[0, 1, 2, 3, 4], None).unwrap().bytes;
        assert_eq!(Bsp::read(rows).unwrap().own_ambient_levels().unwrap(), levels);
    }
}

#[test]
fn leaves_without_an_offset_see_everything() {
    let level = read(&three_rooms(AIR), Layout { vis: &[0, 1], ..Layout::default() });
    assert_eq!(level.rows().unwrap().unwrap().count_ones(), 25);
    assert_eq!(read(&three_rooms(AIR), Layout::default()).rows().unwrap(), None);
}

#[test]
fn a_solid_leaf_of_its_own_is_looked_through() {
    // A wall of one leaf, without any.
    let wall = Bsp::read(grated_room(SOLID)).unwrap();
    assert_eq!((wall.cells(), wall.level().unwrap_err()), (3, BspError::Fences(2)));
    let fence = Bsp::read(grated_room(FENCE)).unwrap();
    assert_eq!(portals(&fence), [([3, 2], 2.0, 16.0), ([2, 1], 4.0, 16.0), ([1, 0], 5.0, 16.0)]);
}

#[test]
fn a_fence_half_before_a_wall_is_told() {
    // Of what is behind the grating, half is a wall.
    let half = node(1, 0.0, leaf(FENCE), leaf(SOLID));
    let tree = hollow([0.0, -2.0, -2.0], [9.0, 2.0, 2.0], node(0, 4.0, half, leaf(AIR)));
    let grating = |from: f32| Face {
        corners: vec![[4.0, from, -2.0], [4.0, from, 2.0], [4.0, 2.0, 2.0], [4.0, 2.0, -2.0]],
        texture: "{grate",
        leaf: 2,
    };
    let told = |from: f32| {
        let file = with_faces(&bsp(&tree, Layout::default()), &[vec![grating(from)]], "");
        Bsp::read(file).unwrap().level().map(|found| found.level.portals.len())
    };
    assert_eq!((told(-2.0), told(0.0)), (Err(BspError::Fences(1)), Ok(1)));
}

#[test]
fn damage_is_named() {
    let file = bsp(&three_rooms(AIR), Layout { vis: &[1], ..Layout::default() });
    let fault = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut file = file.clone();
        change(&mut file);
        Bsp::read(file).and_then(|b| b.rows()).unwrap_err().to_string()
    };
    let offset = |lump: usize| u32::from_le_bytes(file[4 + 8 * lump..8 + 8 * lump].try_into().unwrap()) as usize;
    let put = |at: usize, value: i32| move |f: &mut Vec<u8>| f[at..at + 4].copy_from_slice(&value.to_le_bytes());
    let short = |at: usize, value: i16| move |f: &mut Vec<u8>| f[at..at + 2].copy_from_slice(&value.to_le_bytes());
    assert_eq!(fault(&|f| f.truncate(100)), "ends after 100 bytes, within the header");
    assert!(fault(&|f| f[0] = 31).starts_with("doesn't begin as a level does; levels that are read: bsp29, BSP2, "));
    assert!(fault(&put(4 + 8 * 5, i32::MAX)).starts_with("lump nodes ends at byte "));
    assert!(fault(&put(8 + 8 * 5, 25)).starts_with("lump nodes has 25 bytes, not a multiple of 24"));
    assert_eq!(fault(&put(8 + 8 * 10, 0)), "lump leaves is empty");
    assert_eq!(fault(&put(offset(5), 9999)), "lump nodes, entry 0: its plane 9999 doesn't exist");
    assert_eq!(fault(&put(offset(1) + 8, 0)), "lump planes, entry 0: is not a plane with a unit normal");
    assert_eq!(fault(&put(offset(1) + 12, 0x7fc0_0000)), "lump planes, entry 0: is not a plane with a unit normal");
    assert_eq!(fault(&short(offset(5) + 24 + 4, 0)), "lump nodes, entry 0: is reached twice");
    assert_eq!(fault(&short(offset(5) + 4, 999)), "lump nodes, entry 999: doesn't exist, but the tree leads to it");
    assert_eq!(fault(&short(offset(5) + 6, -99)), "lump leaves, entry 98: doesn't exist, but the tree leads to it");
    assert!(fault(&short(offset(5) + 6, -3)).ends_with("is reached twice"));
    assert!(fault(&short(offset(5) + 6, -7)).contains("only the first 5 have rows"));
    assert!(fault(&put(offset(14) + 36 + 16, 7)).starts_with("lump models, entry 0: has 7 leaves"));
    assert!(fault(&put(offset(14), 0x7f80_0000)).starts_with("lump models, entry 0: has no finite extent"));
    assert!(fault(&put(offset(10) + 28 + 4, 1)).starts_with("lump leaves, entry 1: its row at byte 1 goes on beyond"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn mutants_never_panic(edits in prop::collection::vec((any::<prop::sample::Index>(), any::<[u8; 2]>()), 1..8), bsp2 in any::<bool>()) {
        let mut file = bsp(&three_rooms(WATER), Layout { bsp2, vis: &[3, 0, 4], extended: true, ..Layout::default() });
        for (at, bytes) in edits {
            let at = at.index(file.len() - 2);
            file[at..at + 2].copy_from_slice(&bytes);
        }
        if let Ok(level) = Bsp::read(file) {
            let _ = (level.rows(), level.level());
            let n = level.cells();
            let clusters: Vec<u32> = (0..n as u32).collect();
            if let Ok(after) = level.with_rows(&diagonal(n), &clusters, None) {
                prop_assert_eq!(Bsp::read(after.bytes).unwrap().rows().unwrap().unwrap_or(diagonal(n)), diagonal(n));
            }
        }
    }
}
