//! The `.ground` file: as docs/format.md has it, and what is said and drawn where it is damaged.

use crate::cli::folder;
use enfilade::runtime::{Camera, Motion, Rect};
use enfilade_terrain::{Ground, GroundError, GroundScratch, GroundView, Limit, MakeOptions, Patch};
use glam::DVec3;
use std::io::Cursor;
use std::time::Duration;
use testing::ground::{Raster, bytes};
use testing::ground_file::{GroundFile, hills};

/// Whole metres, rough enough that every level has an error.
fn number(c: u32, r: u32) -> u16 {
    (500 + c * c / 9 + 3 * r) as u16 % 311 + 20 * ((c * 7 + r * 13) % 5) as u16
}

const SIZE: [u32; 2] = [230, 225];

fn made() -> Vec<u8> {
    let mut raster = Raster { lattice: Some(1.0), ..Raster::of(SIZE, |c, r| f64::from(number(c, r))) };
    bytes(&mut raster, &MakeOptions::default())
}

fn open(bytes: Vec<u8>, cache: u64) -> Result<Ground, GroundError> {
    let length = bytes.len() as u64;
    Ground::read(Cursor::new(bytes), length, cache)
}

/// The message: one line.
fn refused(bytes: Vec<u8>) -> String {
    let line = open(bytes, u64::MAX).err().expect("it is damaged").to_string();
    assert!(!line.contains('\n'), "{line}");
    line
}

/// By docs/format.md alone: the header but for its checksums, heights of the table, all tiles' bytes, and the checksums.
#[test]
fn a_ground_is_written_as_the_document_says() {
    let bytes = made();
    let least = (0..SIZE[1]).flat_map(|r| (0..SIZE[0]).map(move |c| number(c, r))).min().unwrap();
    let mut hand = GroundFile::by_hand(SIZE, 33, true, |c, r| number(c, r) - least);
    hand.head[72..80].copy_from_slice(&f64::from(least).to_le_bytes());
    let found = GroundFile::take_apart(&bytes);
    assert_eq!(found.tiles.len(), hand.tiles.len());
    for (tile, (found, hand)) in found.tiles.iter().zip(&hand.tiles).enumerate() {
        assert!(found == hand, "tile {tile}");
    }
    hand.sign();
    for (found, hand) in found.table.iter().zip(&mut hand.table) {
        // Samples, a zero and the checksum; errors can't be told by hand.
        assert_eq!(found[16..], hand[16..]);
        let heights = |of: &[u8]| [0, 4].map(|at| f32::from_le_bytes(of[at..at + 4].try_into().unwrap()));
        let ([low, high], [least, greatest]) = (heights(found), heights(hand));
        assert!(low <= least.next_up() && high >= greatest.next_down());
        hand.clone_from(found);
    }
    assert!(hand.bytes() == bytes);
    let shift = hills().bytes();
    assert_eq!(open(shift.clone(), u64::MAX).unwrap().sample(0, [0, 0]), Some(300.0));
    assert!(GroundFile::take_apart(&shift).bytes() == shift);
}

#[test]
fn what_is_no_ground_is_told_in_one_line() {
    let whole = hills().bytes();
    let with = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] ^= byte;
        bytes
    };
    let not = "not a .ground file (`enfilade ground RASTER -o X.ground` makes one)";
    assert_eq!(refused(Vec::new()), not);
    assert_eq!(refused(b"P5 70 90 65535\n".to_vec()), not);
    assert_eq!(refused(with(1, 1)), not);
    let version = "version 3 of the format, but this program reads 1; make the file again (`enfilade ground`)";
    assert_eq!(refused(with(8, 2)), version);
    assert_eq!(refused(with(57, 1)), "the header is damaged (wrong checksum); make the file again");
    assert_eq!(refused(with(104, 1)), "the header is damaged (wrong checksum); make the file again");
    assert_eq!(refused(with(112 + 40, 1)), "the table of tiles is damaged (wrong checksum); make the file again");
    let length = whole.len();
    for cut in [8, 60, 111] {
        let line = format!("cut off: it has {cut} bytes and needs 112; make the file again");
        assert_eq!(refused(whole[..cut].to_vec()), line);
    }
    for cut in [112, 300, length - 1] {
        let line = format!("cut off: it has {cut} bytes and needs {length}; make the file again");
        assert_eq!(refused(whole[..cut].to_vec()), line);
    }
    assert_eq!(refused([&whole[..], &[0; 7]].concat()), "7 bytes after its end; make the file again");
    // A length that is said and isn't there.
    let short = Ground::read(Cursor::new(whole[..200].to_vec()), length as u64, 0).err().unwrap().to_string();
    assert_eq!(short, "the table of tiles is cut off: the file has become shorter; make it again");
    let short = Ground::read(Cursor::new(whole[..50].to_vec()), length as u64, 0).err().unwrap().to_string();
    assert_eq!(short, "the header is cut off: the file has become shorter; make it again");
}

#[test]
fn numbers_that_no_ground_has_are_refused_where_they_stand() {
    let head = |at: usize, value: &[u8]| {
        let mut file = hills();
        file.head[at..at + value.len()].copy_from_slice(value);
        refused(file.bytes())
    };
    let word = |at: usize, value: u32| head(at, &value.to_le_bytes());
    let real = |at: usize, value: f64| head(at, &value.to_le_bytes());
    assert_eq!(word(12, 3), "byte 12: heights have 2 or 4 bytes; make the file again");
    let size = "byte 16: invalid number of columns, rows or samples per tile; make the file again";
    for (at, value) in [(16, 1), (20, 0), (16, u32::MAX), (24, 34), (24, 0), (28, 2)] {
        assert_eq!(word(at, value), size, "{at} {value}");
    }
    // Two numbers that are allowed, and of another file.
    assert!(word(16, 103).contains("and needs") || word(16, 103).contains("after its end"));
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300, 1e-300, 1e38] {
        let line = "byte 40: the spacing is not above 0, or the ground is infinite; make the file again";
        assert_eq!(real(48, value), line, "{value}");
    }
    assert_eq!(real(64, f64::NAN), "byte 56: the origin is not finite; make the file again");
    for value in [0.0, -1.0, f64::NAN, 1e300, 1e-300, 1e37] {
        let line = "byte 80: the step of heights is not above 0, or heights are infinite; make the file again";
        assert_eq!(real(80, value), line, "{value}");
    }
    let voids = "byte 88: more samples without a height than samples; make the file again";
    assert_eq!(head(88, &6301u64.to_le_bytes()), voids);
    let entry = |at: usize, value: f32| {
        let mut file = hills();
        file.table[3][at..at + 4].copy_from_slice(&value.to_le_bytes());
        open(file.bytes(), 0).err().map(|e| e.to_string())
    };
    let line = "byte 208: invalid heights or errors of a tile; make the file again";
    for (at, value) in [
        (0, f32::NAN),
        (0, 1e9),
        (4, -1e9),
        (4, f32::INFINITY),
        (8, -1.0),
        (8, f32::NAN),
        (8, f32::INFINITY),
        (12, f32::NAN),
        (12, -1.0),
        (20, 1.0),
    ] {
        assert_eq!(entry(at, value).as_deref(), Some(line), "{at} {value}");
    }
    // Beside voids, a rim may have nothing near it.
    assert_eq!(entry(12, f32::INFINITY), None);
}

/// What is seen from above with every tile as fine as it can be, once nothing is under way any more.
fn settled(ground: &mut Ground) -> Vec<Patch> {
    let high = DVec3::new(0.0, 4000.0, 1.0);
    let camera = Camera::look_at(high, DVec3::ZERO, 1.2, 1.0);
    let view = GroundView { camera, size: [1000, 1000], windows: &[Rect::FULL] };
    let (mut scratch, motion) = (GroundScratch::default(), Motion::default());
    let mut quiet = 0;
    loop {
        let patches = ground.select(&view, Limit::Pixels(0.0), &mut scratch).to_vec();
        let loading = ground.load(&view, Limit::Pixels(0.0), &motion, 0.0, &patches);
        quiet = if loading.loaded == 0 && loading.under_way == 0 { quiet + 1 } else { 0 };
        // Frames in which nothing is read: what is lost is not asked for again.
        if quiet == 50 {
            return patches;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// In memory, and with a cache that holds all but one tile.
fn each_way(bytes: &[u8], check: impl Fn(Ground)) {
    let whole = open(bytes.to_vec(), u64::MAX).unwrap();
    let cache = whole.cache_bytes() - 1;
    check(whole);
    check(open(bytes.to_vec(), cache).unwrap());
}

#[test]
fn a_damaged_tile_is_told_once_and_what_it_is_a_quarter_of_is_drawn() {
    let mut file = GroundFile::take_apart(&made());
    let whole = open(file.bytes(), u64::MAX).unwrap();
    let grid = whole.header().grid.clone();
    for (level, x, y) in [(0, 3, 2), (1, 1, 1), (2, 0, 1)] {
        let tile = grid.tile(enfilade_terrain::Key { level, x, y }).unwrap();
        let before = file.tiles[tile as usize].clone();
        file.tiles[tile as usize][100] ^= 4;
        each_way(&file.bytes(), |mut ground| {
            let drawn = settled(&mut ground);
            let told: Vec<String> = ground.faults().iter().map(ToString::to_string).collect();
            assert_eq!(told, [format!("tile {tile} is damaged (wrong checksum); make the file again")]);
            let parent = ground.header().parent(tile).unwrap();
            let draws = |tile: u32| drawn.iter().any(|p| p.tile == tile);
            assert!(draws(parent) && !draws(tile) && ground.slot(tile).is_none(), "{drawn:?}");
            let within = grid.children(grid.key(tile)).filter(|&t| ground.slot(t).is_some()).count();
            assert_eq!(within, 0, "quarters of what is lost are of no use");
            settled(&mut ground);
            assert_eq!(ground.faults().len(), 1);
        });
        file.tiles[tile as usize] = before;
    }
    // Undamaged, all of it is drawn as fine as it is.
    let mut ground = open(file.bytes(), u64::MAX).unwrap();
    assert!(settled(&mut ground).iter().all(|p| p.key.level == 0) && ground.faults().is_empty());
    // Without the coarsest tile there is nothing to draw.
    file.tiles[0][5] ^= 1;
    each_way(&file.bytes(), |mut ground| {
        assert!(settled(&mut ground).is_empty() && ground.faults().len() == 1);
    });
}

#[test]
fn a_file_that_is_cut_after_it_was_opened_is_drawn_as_far_as_it_goes() {
    let path = folder("cut").join("a.ground");
    let bytes = made();
    std::fs::write(&path, &bytes).unwrap();
    let whole = open(bytes.clone(), u64::MAX).unwrap();
    let mut ground = Ground::open(&path, whole.cache_bytes() - 1).unwrap();
    let grid = whole.header().grid.clone();
    // Within the second tile of the finest level.
    let last = grid.tiles_of(0).start + 1;
    let length = GroundFile::take_apart(&bytes).place(last as usize) as u64 + 9;
    std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(length).unwrap();
    let drawn = settled(&mut ground);
    assert!(drawn.iter().all(|p| p.tile < last) && drawn.iter().any(|p| p.key.level == 1), "{drawn:?}");
    let told: Vec<String> = ground.faults().iter().map(ToString::to_string).collect();
    assert!(told.contains(&format!("tile {last} is cut off: the file has become shorter; make it again")), "{told:?}");
    assert_eq!(told.len() as u32, grid.tiles() - last, "each once: {told:?}");
    // Opened anew, it is refused.
    assert!(Ground::open(&path, 0).err().unwrap().to_string().starts_with("cut off: it has"));
}
