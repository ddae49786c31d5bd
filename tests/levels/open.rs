//! Rows in levels against what is open: lines through the tree of planes, which another reader found, show pairs that no row may lack.

use enfilade::BitMatrix;
use enfilade_levels::bsp::Bsp;
use enfilade_levels::{VisOptions, vis};
use testing::games::lines::{PlaneTree, Search, Shown};
use testing::games::{CELLS, GAMES, Game, level, trees};
use testing::random::Random;

/// Takes pairs out of rows, both ways; how many there were.
fn take_out(rows: &mut BitMatrix, part: f64, seed: u64) -> BitMatrix {
    let mut random = Random::new(seed);
    let mut taken = BitMatrix::new(rows.rows(), rows.rows());
    for a in 0..rows.rows() {
        let seen: Vec<usize> = rows.ones(a).filter(|&b| b > a).collect();
        for b in seen.into_iter().filter(|_| random.chance(part)) {
            for [a, b] in [[a, b], [b, a]] {
                rows.clear(a, b);
                taken.set(a, b);
            }
        }
    }
    taken
}

/// Levels by hand whose files the readers of trees take.
const BY_HAND: [Game; 5] = [Game::Quake3, Game::Source(19), Game::Source(20), Game::Source(21), Game::Source(25)];

#[test]
fn lines_through_three_rooms_show_each_pair_and_find_what_rows_lack() {
    assert!(BY_HAND.iter().all(|game| GAMES.contains(game)));
    for game in BY_HAND {
        let file = Bsp::read(level(game)).unwrap();
        let rows =
            vis(&file.level().unwrap().level, &VisOptions::default(), None, &enfilade::job::Job::quiet()).unwrap().upper;
        let bytes = file.with_rows(&rows, &[0, 1, 2, 3, 4], None).unwrap().bytes;
        let (tree, read) = trees::read(&bytes);
        assert_eq!((tree.cells, read.as_ref()), (CELLS, Some(&rows)), "{game:?}");
        let shown = Search::run(&tree, &rows, 5000, 1);
        assert!(shown.lost.is_empty() && shown.pairs == rows, "{game:?}: {:?}", shown.lost);
        // Any single pair that is taken out is found.
        for (a, b) in (0..CELLS).flat_map(|a| rows.ones(a).filter(move |&b| b > a).map(move |b| (a, b))) {
            let mut fewer = rows.clone();
            fewer.clear(a, b);
            let lost = Search::run(&tree, &fewer, 5000, 1).lost;
            assert_eq!(lost.iter().map(|(pair, _)| *pair).collect::<Vec<_>>(), [[a as u32, b as u32]], "{game:?}");
        }
    }
}

#[cfg(feature = "full")]
mod real {
    use super::*;
    use crate::levels::games::{Case, cases};
    use crate::levels::readers::{MOST_PORTALS, read, rows_of_clusters, written};
    use crate::levels::real::rows_of;
    use qbsp::data::nodes::BspNodeRef;
    use qbsp::data::visdata::VisDataRef;
    use qbsp::prelude::*;
    use testing::games::lines::{Child, Leaf, Node};

    /// A level: more take long, fewer show less of large levels.
    const LINES: u64 = 200_000;
    /// Most bits of Quake 2's contents that hide: from window to mist.
    const MATTER: u32 = 0x7f;

    /// A level of Quake, Half-Life or Quake 2, as the crate `qbsp` reads it.
    fn tree_of(theirs: &BspData, by_cluster: bool, has_kinds: bool) -> PlaneTree {
        let child = |child: BspNodeRef| match child {
            BspNodeRef::Node(n) => Child::Node(n as usize),
            BspNodeRef::Leaf(leaf) => Child::Leaf(leaf as usize),
        };
        let node = |node: &qbsp::data::nodes::BspNode| {
            let plane = &theirs.planes[node.plane_idx as usize];
            let children = [child(*node.front), child(*node.back)];
            Node { normal: plane.normal.as_dvec3(), distance: f64::from(plane.dist), children }
        };
        let leaf = |(number, leaf): (usize, &qbsp::data::nodes::BspLeaf)| {
            let cell = match leaf.visdata {
                VisDataRef::Cluster(cluster) => u32::try_from(cluster.0).ok(),
                VisDataRef::Offset(_) => number.checked_sub(1).map(|cell| cell as u32),
            };
            // Water hides nothing in Quake.
            let matter = if has_kinds { MATTER } else { 0 };
            Leaf { cell, kind: trees::kind(leaf.contents.bits(), matter) }
        };
        let world = &theirs.models[0];
        let mut tree = PlaneTree {
            nodes: theirs.nodes.iter().map(node).collect(),
            leaves: theirs.leaves.iter().enumerate().map(leaf).collect(),
            root: child(world.hulls.root),
            bounds: [world.bound.min.as_dvec3(), world.bound.max.as_dvec3()],
            cells: 0,
        };
        assert_eq!(matches!(theirs.leaves[0].visdata, VisDataRef::Cluster(_)), by_cluster);
        tree.forget_other_models();
        tree
    }

    /// A level's tree and its rows, read by others than `bytes` were written by.
    fn tree_and_rows(case: &Case, file: &Bsp, bytes: &[u8]) -> (PlaneTree, BitMatrix) {
        if case.name.starts_with("q3/") || case.name.starts_with("source/") {
            let (tree, rows) = trees::read(bytes);
            return (tree, rows.unwrap());
        }
        let mut theirs = read(bytes);
        let tree = tree_of(&theirs, !file.is_by_leaf(), !case.name.starts_with("q1/"));
        let rows = if file.is_by_leaf() {
            rows_of(&theirs, file.cells())
        } else {
            rows_of_clusters(&mut theirs, file.cells())[0].clone()
        };
        (tree, rows)
    }

    /// Levels with rows by our `vis`: from the portal file, or from the tree if there is none.
    fn with_our_rows(case: &Case) -> Option<(Bsp, Vec<u8>)> {
        // Packed, big-endian, or with the other directory: their readers are not at hand, and their rows are those of other files.
        if ["lzma", "v20be", "l4d2", "csgo"].iter().any(|part| case.name.contains(part)) {
            return None;
        }
        let file = Bsp::read(case.part("novis.bsp").or_else(|| case.part("vis.bsp")).unwrap()).unwrap();
        let (level, leaves) = match case.prt() {
            Some(prt) => (prt.level, prt.leaves),
            None => (file.level().unwrap().level, (0..file.cells() as u32).collect()),
        };
        let is_taken = level.portals.len() <= MOST_PORTALS;
        is_taken.then(|| written(&file, &level, &leaves).1).map(|bytes| (file, bytes))
    }

    /// Lines through a level; what they show is in the same leaves for qbsp.
    fn shown(tree: &PlaneTree, rows: &BitMatrix, name: &str, lines: u64) -> Shown {
        let shown = Search::run(tree, rows, lines, 1);
        let share = shown.pairs.count_ones() as f64 / rows.count_ones() as f64;
        eprintln!(
            "{name}: {} lines, {} open, {} pairs of {} shown ({:.1} %), {} lost",
            shown.lines,
            shown.open,
            shown.pairs.count_ones(),
            rows.count_ones(),
            100.0 * share,
            shown.lost.len()
        );
        shown
    }

    #[test]
    fn no_line_through_a_level_shows_a_pair_that_our_rows_lack() {
        let mut tried = 0;
        for case in cases() {
            let Some((file, bytes)) = with_our_rows(&case) else { continue };
            let (tree, rows) = tree_and_rows(&case, &file, &bytes);
            let shown = shown(&tree, &rows, &case.name, LINES);
            assert!(shown.lost.is_empty(), "{}: {:?}", case.name, &shown.lost[..shown.lost.len().min(8)]);
            assert!(4 * shown.pairs.count_ones() > rows.count_ones(), "{}: lines show too little", case.name);
            tried += 1;
        }
        assert!(tried >= 25, "{tried}");
    }

    #[test]
    fn lines_through_a_level_find_pairs_that_are_taken_out_and_those_that_its_tool_lost() {
        for (name, lost) in [("hl/id_dm4", 0), ("q2/msr_insomnia_qbism", 187), ("q3/wop_7colors", 33)] {
            let case = cases().into_iter().find(|case| case.name == name).unwrap();
            let bytes = case.part("vis.bsp").unwrap();
            let (tree, rows) = tree_and_rows(&case, &Bsp::read(bytes.clone()).unwrap(), &bytes);
            let found = shown(&tree, &rows, name, LINES).lost.len();
            assert!(if lost > 0 { 4 * found > lost } else { found == 0 }, "{name}: {found} of {lost}");
            let mut fewer = rows.clone();
            let taken = take_out(&mut fewer, 0.002, 2);
            let shown = shown(&tree, &fewer, name, LINES);
            let again = shown.lost.iter().filter(|([a, b], _)| taken.get(*a as usize, *b as usize)).count() as u64;
            assert!(2 * again > taken.count_ones() && again > 20, "{name}: {again} of {}", taken.count_ones());
        }
    }
}
