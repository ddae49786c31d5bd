//! Levels of every kind, written by hand: portals out of the tree, and rows into the file and out again.

use enfilade::BitMatrix;
use enfilade_levels::bsp::Bsp;
use testing::games::{CELLS, GAMES, Game, level};

/// Cells in a row that see their neighbours.
fn neighbours() -> BitMatrix {
    let mut rows = BitMatrix::new(CELLS, CELLS);
    for a in 0..CELLS {
        (a.saturating_sub(1)..(a + 2).min(CELLS)).for_each(|b| _ = rows.set(a, b));
    }
    rows
}

#[test]
fn three_rooms_have_four_portals_in_every_game() {
    for game in GAMES {
        let level = Bsp::read(level(game)).unwrap_or_else(|e| panic!("{game:?}: {e}"));
        assert_eq!((level.cells(), level.rows().unwrap(), level.has_rows()), (CELLS, None, false), "{game:?}");
        let found = level.level().unwrap();
        assert_eq!((found.level.portals.len(), found.slivers), (4, 0), "{game:?}");
        // Doors of 2 x 2, in planes x = 4, 5, 9, 10.
        let mut planes: Vec<f64> = found.level.portals.iter().map(|p| p.winding[0].x).collect();
        planes.sort_by(f64::total_cmp);
        assert_eq!(planes, [4.0, 5.0, 9.0, 10.0], "{game:?}");
        for portal in &found.level.portals {
            assert_eq!(enfilade::math::geom::area(&portal.winding), 4.0, "{game:?}");
        }
        // A point of the third room, of a wall, and of the outside.
        let at = |x: f64| level.cell_at(glam::dvec3(x, 1.5, 0.0));
        assert!(at(12.0).is_some() && at(4.5).is_none() && at(-3.0).is_none(), "{game:?}");
    }
}

#[test]
fn rows_come_back_in_every_game_and_the_rest_stays() {
    for game in GAMES {
        let before = level(game);
        let read = Bsp::read(before.clone()).unwrap();
        let clusters: Vec<u32> = (0..CELLS as u32).collect();
        let rows = neighbours();
        let new = read.with_rows(&rows, &clusters, None).unwrap();
        let again = Bsp::read(new.bytes.clone()).unwrap();
        assert_eq!(again.rows().unwrap(), Some(rows.clone()), "{game:?}");
        assert_eq!(again.level().unwrap(), read.level().unwrap(), "{game:?}");
        // What is heard is two steps away at most: 3 + 4 + 5 + 4 + 3.
        let heard = read.second().map(|_| 19);
        assert_eq!((new.heard_pairs, again.second_rows().unwrap().map(|s| s.count_ones())), (heard, heard), "{game:?}");
        // Once more, with the same rows: the same file.
        assert_eq!(again.with_rows(&rows, &clusters, None).unwrap().bytes, new.bytes, "{game:?}");
        // The text of entities comes last, and is whole.
        let text = b"{\"classname\" \"worldspawn\"}\n\0";
        let find = |file: &[u8]| file.windows(text.len()).filter(|w| w == text).count();
        assert_eq!(find(&new.bytes), 1, "{game:?}");
        // Fewer rows fit into the place of more.
        let mut all = BitMatrix::new(CELLS, CELLS);
        (0..CELLS).for_each(|a| (0..CELLS).for_each(|b| _ = all.set(a, b)));
        let full = Bsp::read(again.with_rows(&all, &clusters, None).unwrap().bytes).unwrap();
        let back = full.with_rows(&rows, &clusters, None).unwrap().bytes;
        assert_eq!(Bsp::read(back).unwrap().rows().unwrap(), Some(rows), "{game:?}");
    }
}

/// Half-Life's own directory and Xash's further one both follow the lumps that move.
#[test]
fn the_second_directory_moves_with_its_lumps() {
    let before = level(Game::Xash);
    let rows = neighbours();
    let after = Bsp::read(before.clone()).unwrap().with_rows(&rows, &[0, 1, 2, 3, 4], None).unwrap().bytes;
    let own = |file: &[u8]| {
        let at = u32::from_le_bytes(file[132..136].try_into().unwrap()) as usize;
        file[at..at + 4].to_vec()
    };
    assert!(after.len() > before.len());
    assert_eq!((own(&before), own(&after)), (b"more".to_vec(), b"more".to_vec()));
}

/// Source keeps offsets within its lumps, so nothing of the file before the rows moves.
#[test]
fn nothing_moves_in_a_level_of_source() {
    for game in [Game::Source(20), Game::Source21VersionFirst, Game::Console] {
        let before = level(game);
        let after = Bsp::read(before.clone()).unwrap().with_rows(&neighbours(), &[0, 1, 2, 3, 4], None).unwrap().bytes;
        assert_eq!(after[1036..before.len()], before[1036..], "{game:?}");
        // Longer rows take the place of those at the end, so runs do not pile up.
        let mut all = BitMatrix::new(CELLS, CELLS);
        (0..CELLS).for_each(|a| (0..CELLS).for_each(|b| _ = all.set(a, b)));
        let first = Bsp::read(before.clone()).unwrap().with_rows(&all, &[0, 1, 2, 3, 4], None).unwrap();
        let second = Bsp::read(after).unwrap().with_rows(&all, &[0, 1, 2, 3, 4], None).unwrap();
        assert_eq!((second.bytes.len(), second.lump), (first.bytes.len(), first.lump), "{game:?}");
    }
}

#[test]
fn other_versions_are_named() {
    let fault = |game: Game, version: i32| {
        let mut file = level(game);
        file[4..8].copy_from_slice(&version.to_le_bytes());
        Bsp::read(file).unwrap_err().to_string()
    };
    assert!(fault(Game::Source(20), 22).starts_with("VBSP version 22 isn't known; levels that are read: bsp29, "));
    assert!(fault(Game::Quake3, 47).starts_with("IBSP version 47 isn't known"));
    assert!(Bsp::read(b"PNG? no.".to_vec()).unwrap_err().to_string().starts_with("doesn't begin as a level does"));
}
