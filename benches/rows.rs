//! The code of rows over the size of buildings: floors of 64 to 4,096 rooms with 10 objects each; or, with files named, over
//! those (`cargo bench --bench rows -- A.pvs B.pvs`).
//!
//! Every matrix is read and compared with what was written before any time counts. Printed are, for cells and objects: the matrix, its
//! density, the section's bits a pair beside the zero-order entropy and what part of it that is; and milliseconds to read the whole file, the
//! fastest of several.
//! `--test` takes the smallest alone.

use enfilade::cells::{PortalKind, PortalState};
use enfilade::file::{Container, FileCell, FileObject, FilePortal, PairCounts, PvsFile};
use enfilade::file::{SectionId, entropy_bits_per_pair};
use enfilade::{BitMatrix, CellId};
use glam::{Vec3, Vec4};
use testing::files::bare;
use testing::floor::{Floor, floor};
use testing::times::{is_told, least, names, timed};

const SIDES: [usize; 4] = [8, 16, 32, 64];
const OBJECTS: usize = 10;
/// How often each file is read.
const TIMES: usize = 10;

fn main() {
    let files = names();
    println!("| file | rows of | rows | columns | density | bits a pair | entropy | ratio | read, ms |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for path in &files {
        let file = PvsFile::load(path.as_ref()).unwrap_or_else(|e| panic!("{e}"));
        measure(path.rsplit('/').next().unwrap_or(path), &file);
    }
    let sides = if is_told("--test") { &SIDES[..1] } else { &SIDES[..] };
    for &side in sides.iter().filter(|_| files.is_empty()) {
        measure(&format!("floor of {} rooms", side * side), &of_floor(side));
    }
}

fn measure(name: &str, file: &PvsFile) {
    let (bytes, write) = timed(|| file.write());
    assert!(PvsFile::read(&bytes).expect("its own bytes") == *file, "{name}");
    let container = Container::parse(&bytes).expect("its own bytes");
    let read = least(TIMES, || PvsFile::read(&bytes).expect("its own bytes")).as_secs_f64();
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
    eprintln!("{name}: written in {:.2} s, {} bytes", write.as_secs_f64(), bytes.len());
}

/// A file of a floor of `side` x `side` rooms. Rows of cells are read by the portals.
fn of_floor(side: usize) -> PvsFile {
    let Floor { doors, cells, objects } = floor(side, OBJECTS);
    let mut placement = BitMatrix::new(cells.rows(), objects.columns());
    (0..objects.columns()).for_each(|o| assert!(placement.set(o / OBJECTS, o)));
    let mut portals = Vec::new();
    for (room, axis) in (0..doors.len()).flat_map(|room| [(room, 0), (room, 1)]) {
        let (step, place) = [(1, room % side), (side, room / side)][axis];
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
    let cell = || FileCell { name: String::new(), source: None, open: false, pieces: Vec::new() };
    let object = || FileObject { node: String::new(), triangles: 1, bounds: [Vec3::ZERO; 2] };
    PvsFile {
        cells: (0..cells.rows()).map(|_| cell()).collect(),
        portals,
        objects: (0..objects.columns()).map(|_| object()).collect(),
        placement,
        pairs: PairCounts { lower: 0, upper: objects.count_ones(), cell_lower: 0, cell_upper: cells.count_ones() },
        cell_rows: Some(cells),
        object_rows: Some(objects),
        ..bare()
    }
}
