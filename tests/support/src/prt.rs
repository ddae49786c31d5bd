//! Portal files and reference rows, read for tests and benches only: the strict reader is the library's.

use enfilade::BitMatrix;
use enfilade_levels::{Level, LevelPortal};
use glam::DVec3;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The folder of portal files, where there is one.
pub fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("ENFILADE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from)
        .join("prt");
    folder.is_dir().then_some(folder)
}

/// A `.prt` file that is taken to be sound.
pub fn level(path: &Path) -> Level {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut words = text.lines();
    let counts = if words.next() == Some("PRT1") { 2 } else { 3 };
    let counts: Vec<usize> = words.by_ref().take(counts).map(|w| w.trim().parse().expect("a count")).collect();
    let (portals, cells) = (counts[counts.len() - 1], counts[counts.len() - 2]);
    let portal = |line: &str| {
        let line = line.replace(['(', ')'], " ");
        let numbers: Vec<f64> = line.split_whitespace().map(|w| w.parse().expect("a number")).collect();
        let winding = numbers[3..].chunks_exact(3).map(DVec3::from_slice).collect();
        LevelPortal { cells: [numbers[1] as u32, numbers[2] as u32], winding }
    };
    Level { cells, portals: words.take(portals).map(portal).collect(), rounding: 0.0 }
}

/// Reference rows: `c n: id id ...`.
pub fn rows(path: &Path, cells: usize) -> BitMatrix {
    let text = unpacked(path);
    let mut rows = BitMatrix::new(cells, cells);
    for line in text.lines() {
        let (head, ids) = line.split_once(':').expect("a row");
        let cell: usize = head.split_whitespace().next().and_then(|w| w.parse().ok()).expect("a cell");
        ids.split_whitespace().for_each(|id| _ = rows.set(cell, id.parse().expect("an id")));
    }
    rows
}

/// The text of a packed file.
pub fn unpacked(path: &Path) -> String {
    let mut text = String::new();
    let file = std::fs::File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).expect("gzip");
    text
}
