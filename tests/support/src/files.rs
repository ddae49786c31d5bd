//! Files and bakes by hand, to be filled in.

use enfilade::cells::{CellGraph, Placement, Strategy};
use enfilade::file::{Import, PairCounts, PvsFile};
use enfilade::pvs::{Guarantee, Pvs, PvsStats, SamplingEnd};
use enfilade::scene::ImportOptions;
use enfilade::{BitMatrix, CellId};
use glam::DVec3;

/// A conservative file without anything in it.
pub fn bare() -> PvsFile {
    PvsFile {
        model_hash: 0,
        origin: DVec3::ZERO,
        guarantee: Guarantee::Conservative,
        import: Import {
            object_triangles: ImportOptions::default().object_triangles,
            metres_per_unit: None,
            z_up: false,
            tube_radius: None,
            tubes: true,
            smallest_hole: None,
        },
        strategy: Strategy::Given,
        reason: "made by hand".into(),
        smallest_hole: 0.0,
        closed_holes: Vec::new(),
        clusters: Vec::new(),
        left_out: Vec::new(),
        notes: Vec::new(),
        cells: Vec::new(),
        portals: Vec::new(),
        objects: Vec::new(),
        placement: BitMatrix::new(0, 0),
        placed: None,
        cell_rows: None,
        object_rows: None,
        bounds: None,
        pairs: PairCounts::default(),
        repairs: Vec::new(),
        unseen: None,
        gap: None,
        stats: PvsStats::default(),
        views: Default::default(),
        relevance: None,
        ways_in: None,
        bake: None,
    }
}

/// A bake of both bounds, lower and upper, of cells and of objects. Nothing is unresolved, and there is no witness.
pub fn pvs(graph: CellGraph, cells: [BitMatrix; 2], objects: [BitMatrix; 2], placement: BitMatrix) -> Pvs {
    let ([cells_lower, cells_upper], [objects_lower, objects_upper]) = (cells, objects);
    Pvs {
        unresolved: BitMatrix::new(placement.rows(), placement.columns()),
        graph,
        cells_lower,
        cells_upper,
        objects_lower,
        objects_upper,
        placement: Placement { matrix: placement, boxes: None },
        witnesses: Vec::new(),
        guarantee: Guarantee::Conservative,
        clusters: Vec::new(),
        repairs: Vec::new(),
        unseen: None,
        sampling_end: SamplingEnd::Rays,
        is_whole: true,
        again: None,
        stats: PvsStats::default(),
    }
}

/// Cells x objects: the pairs in a file's rows.
pub fn rows(file: &PvsFile) -> BitMatrix {
    let mut rows = BitMatrix::new(file.cells.len(), file.objects.len());
    for cell in 0..file.cells.len() {
        file.objects_seen(CellId(cell as u32)).for_each(|object| _ = rows.set(cell, object.index()));
    }
    rows
}
