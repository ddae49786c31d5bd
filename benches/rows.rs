//! The code of rows over the size of buildings: floors of 64 to 4,096 rooms with 10 objects each; or, with files named, over
//! those (`cargo bench --bench rows -- A.pvs B.pvs`).
//!
//! Every matrix is read and compared with what was written before any time counts. Printed are, for cells and objects: the matrix, its
//! density, the section's bits a pair beside the zero-order entropy and what part of it that is; and milliseconds to read the whole file, the
//! fastest of several.
//! `--test` takes the smallest alone.

use enfilade::cells::{PortalKind, PortalState, Strategy};
use enfilade::file::{Container, FileCell, FileObject, FilePortal, Import, PairCounts, PvsFile};
use enfilade::file::{SectionId, entropy_bits_per_pair};
use enfilade::pvs::{Guarantee, PvsStats};
use enfilade::{BitMatrix, CellId};
use glam::{DVec3, Vec3, Vec4};
use std::time::Instant;
use testing::random::Random;

const SIDES: [usize; 4] = [8, 16, 32, 64];
const OBJECTS: usize = 10;
/// How often each file is read.
const TIMES: usize = 10;

fn main() {
    let files: Vec<String> = std::env::args().skip(1).filter(|a| a.ends_with(".pvs")).collect();
    println!("| file | rows of | rows | columns | density | bits a pair | entropy | ratio | read, ms |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for path in &files {
        let file = PvsFile::load(path.as_ref()).unwrap_or_else(|e| panic!("{path}: {e}"));
        measure(path.rsplit('/').next().unwrap_or(path), &file);
    }
    let sides = if std::env::args().any(|a| a == "--test") { &SIDES[..1] } else { &SIDES[..] };
    for &side in sides.iter().filter(|_| files.is_empty()) {
        measure(&format!("floor of {} rooms", side * side), &floor(side));
    }
}

fn measure(name: &str, file: &PvsFile) {
    let begin = Instant::now();
    let bytes = file.write();
    let write = begin.elapsed().as_secs_f64();
    assert!(PvsFile::read(&bytes).expect("its own bytes") == *file, "{name}");
    let container = Container::parse(&bytes).expect("its own bytes");
    let mut read = f64::INFINITY;
    for _ in 0..TIMES {
        let begin = Instant::now();
        std::hint::black_box(PvsFile::read(&bytes).expect("its own bytes"));
        read = read.min(begin.elapsed().as_secs_f64());
    }
    for (id, what, matrix) in
        [(SectionId::CellRows, "cells", &file.cell_rows), (SectionId::ObjectRows, "objects", &file.object_rows)]
    {
        let Some(matrix) = matrix else { continue };
        let pairs = (matrix.rows() * matrix.columns()) as f64;
        let section = container.section(id).expect("in the file").bytes as f64 * 8.0 / pairs;
        let entropy = entropy_bits_per_pair(matrix.count_ones(), pairs as u64);
        println!(
            "| {name} | {what} | {} | {} | {:.2} | {section:.4} | {entropy:.4} | {:.2} | {:.2} |",
            matrix.rows(),
            matrix.columns(),
            matrix.count_ones() as f64 / pairs,
            section / entropy,
            read * 1e3,
        );
    }
    eprintln!("{name}: written in {write:.2} s, {} bytes", bytes.len());
}

/// A floor of `side` x `side` rooms, most doors open at random: a room sees along its row and its column until a door is shut,
/// and of the objects that stand there the fewer the further they are.
fn floor(side: usize) -> PvsFile {
    let random = &mut Random::new(9);
    let rooms = side * side;
    let doors: Vec<[bool; 2]> = (0..rooms).map(|_| [(); 2].map(|()| !random.word().is_multiple_of(5))).collect();
    let reach: Vec<u64> = (0..rooms * OBJECTS).map(|_| 1 + random.word() % 9).collect();
    let (mut cells, mut objects) = (BitMatrix::new(rooms, rooms), BitMatrix::new(rooms, rooms * OBJECTS));
    let mut placement = BitMatrix::new(rooms, rooms * OBJECTS);
    let mut portals = Vec::new();
    for room in 0..rooms {
        (room * OBJECTS..(room + 1) * OBJECTS).for_each(|o| assert!(placement.set(room, o)));
        let mut see = |other: usize, far: u64| {
            cells.set(room, other);
            (other * OBJECTS..(other + 1) * OBJECTS).filter(|&o| reach[o] > far).for_each(|o| assert!(objects.set(room, o)));
        };
        see(room, 0);
        for (axis, step, place) in [(0, 1, room % side), (1, side, room / side)] {
            (1..side - place)
                .take_while(|k| doors[room + (k - 1) * step][axis])
                .for_each(|k| see(room + k * step, k as u64));
            (1..=place).take_while(|k| doors[room - k * step][axis]).for_each(|k| see(room - k * step, k as u64));
            if place + 1 < side && doors[room][axis] {
                portals.push(FilePortal {
                    cells: [room, room + step].map(|c| CellId(c as u32)),
                    plane: Vec4::X,
                    winding: vec![Vec3::ZERO, Vec3::Y, Vec3::Z],
                    kind: PortalKind::Door,
                    state: PortalState::of_kind(PortalKind::Door),
                    source: None,
                });
            }
        }
    }
    file_of(cells, objects, placement, portals)
}

/// A conservative file with these rows.
fn file_of(cells: BitMatrix, objects: BitMatrix, placement: BitMatrix, portals: Vec<FilePortal>) -> PvsFile {
    let cell = || FileCell { name: String::new(), source: None, open: false, pieces: Vec::new() };
    let object = || FileObject { node: String::new(), triangles: 1, bounds: [Vec3::ZERO; 2] };
    PvsFile {
        model_hash: 0,
        origin: DVec3::ZERO,
        guarantee: Guarantee::Conservative,
        import: Import {
            object_triangles: 1,
            metres_per_unit: None,
            tube_radius: None,
            tubes: true,
            z_up: false,
            smallest_hole: None,
        },
        strategy: Strategy::Given,
        reason: String::new(),
        smallest_hole: 0.0,
        closed_holes: Vec::new(),
        clusters: Vec::new(),
        left_out: Vec::new(),
        notes: Vec::new(),
        cells: (0..cells.rows()).map(|_| cell()).collect(),
        portals,
        objects: (0..objects.columns()).map(|_| object()).collect(),
        placement,
        placed: None,
        pairs: PairCounts { lower: 0, upper: objects.count_ones(), cell_lower: 0, cell_upper: cells.count_ones() },
        cell_rows: Some(cells),
        object_rows: Some(objects),
        bounds: None,
        repairs: Vec::new(),
        unseen: None,
        gap: None,
        stats: PvsStats::default(),
        views: Default::default(),
    }
}
