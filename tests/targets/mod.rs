//! What reads bytes that anyone may have written, a function each: `fuzz/` gives them to libFuzzer, `tests/hostile.rs` bounded numbers
//! of mutants. Each panics where a promise is broken, and says whether the bytes were taken for what they claim to be.

mod graph;
mod ground;
mod seeds;

use enfilade::cells::{read_cells, read_view_cells, validate};
use enfilade::file::PvsFile;
use enfilade::runtime::{Camera, Culler, Mode, View};
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::indoorgml::read_indoorgml;
use enfilade_formats::{geojson, gltf, indoorgml, obj};
use enfilade_levels::prt::{Prt, read_prt};
use enfilade_levels::rows::read_rows;
use enfilade_measure::verify::rooms::RoomsFile;
use enfilade_measure::verify::score_rooms;
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_terrain::raster::{Raster, RasterOptions};
use glam::{DVec3, Vec3};
use std::sync::OnceLock;
use testing::boxes;
use testing::sound::assert_sound;

/// A reader, or the core behind readers.
pub struct Target {
    /// Its name: that of its fuzz target, and of its folder of seeds.
    pub name: &'static str,
    /// True where the bytes are accepted.
    pub run: fn(&[u8]) -> bool,
    /// Files that it accepts, to be mutated.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Memory that it may take, bytes: so much, and so much for each byte of the file.
    pub memory: [u64; 2],
    /// For so many mutants of `.pvs` files there is one of its own: more for what takes longer.
    pub share: u64,
}

impl Target {
    /// Most bytes of memory for a file of this length.
    pub fn promised(&self, length: usize) -> u64 {
        self.memory[0] + self.memory[1] * length as u64
    }
}

const MIB: u64 = 1 << 20;

/// All of them.
pub const TARGETS: &[Target] = &[
    // What docs/format.md promises, and what zstd needs for itself.
    Target { name: "pvs", run: pvs, seeds: seeds::pvs, memory: [17 * MIB, 8192], share: 1 },
    Target { name: "gltf", run: gltf_bytes, seeds: seeds::gltf, memory: [MIB / 4, 64], share: 2 },
    Target { name: "obj", run: obj_bytes, seeds: seeds::obj, memory: [MIB / 4, 64], share: 2 },
    Target { name: "geojson", run: geojson_bytes, seeds: seeds::geojson, memory: [MIB, 8192], share: 4 },
    Target { name: "indoorgml", run: indoorgml_text, seeds: seeds::indoorgml, memory: [MIB / 4, 64], share: 4 },
    // A PRT1 may promise so many isolated clusters; the list of its leaves is all that is taken for them.
    Target { name: "prt", run: prt, seeds: seeds::prt, memory: [MIB / 2, 0], share: 4 },
    Target { name: "rows", run: rows, seeds: seeds::rows, memory: [MIB / 4, 64], share: 4 },
    Target { name: "path", run: path, seeds: seeds::path, memory: [MIB / 4, 64], share: 4 },
    Target { name: "cells", run: cells, seeds: seeds::cells, memory: [MIB, 256], share: 10 },
    Target { name: "view_cells", run: view_cells, seeds: seeds::view_cells, memory: [MIB / 4, 64], share: 4 },
    Target { name: "rooms", run: rooms, seeds: seeds::rooms, memory: [MIB, 256], share: 10 },
    Target { name: "graph", run: graph::level, seeds: seeds::graph, memory: [MIB, 4096], share: 10 },
    Target { name: "flow", run: graph::cells, seeds: seeds::graph, memory: [MIB, 4096], share: 10 },
    Target { name: "ground", run: ground::file, seeds: seeds::ground, memory: [16 * MIB, 8192], share: 1 },
    Target { name: "tiff", run: tiff, seeds: seeds::tiff, memory: [16 * MIB, 8192], share: 2 },
    Target { name: "hgt", run: hgt, seeds: seeds::hgt, memory: [MIB, 64], share: 4 },
    Target { name: "asc", run: asc, seeds: seeds::asc, memory: [MIB, 64], share: 4 },
    Target { name: "bsp", run: bsp, seeds: seeds::bsp, memory: [MIB / 4, 64], share: 4 },
    Target { name: "map", run: map, seeds: seeds::map, memory: [MIB, 4096], share: 10 },
    #[cfg(feature = "ifc")]
    Target { name: "ifc", run: ifc, seeds: seeds::ifc, memory: [64 * MIB, 4096], share: 100 },
];

/// Runs the target of this name.
#[allow(dead_code, reason = "fuzz targets use this, the tests the table")]
pub fn run(name: &str, bytes: &[u8]) {
    let target = TARGETS.iter().find(|t| t.name == name).expect("a target of this name, and the feature that it needs");
    (target.run)(bytes);
}

/// Every id that a file names is there, and a culler that trusts it draws.
fn pvs(bytes: &[u8]) -> bool {
    let read = PvsFile::read(bytes);
    let Ok(file) = read else { return false };
    let (cells, objects) = (file.cells.len(), file.objects.len());
    assert!(file.portals.iter().flat_map(|p| p.cells).all(|c| c.index() < cells));
    assert!(file.repairs.iter().flat_map(|r| r.cells).all(|c| c.index() < cells));
    assert_eq!((file.placement.rows(), file.placement.columns()), (cells, objects));
    let shapes = [(&file.cell_rows, cells, cells), (&file.object_rows, cells, objects)];
    for (rows, height, width) in shapes {
        assert!(rows.as_ref().is_none_or(|m| (m.rows(), m.columns()) == (height, width)));
    }
    if let Some(bounds) = &file.bounds {
        assert_eq!(bounds.objects_lower.first_outside(&bounds.objects_upper), None);
        assert!(bounds.witnesses.iter().all(|w| w.cell.index() < cells && w.object.index() < objects));
    }
    let mut view = View::new(&Culler::new(&file));
    let eyes = file.portals.iter().take(2).map(|p| p.winding[0]).chain([Vec3::ZERO]);
    for eye in eyes.map(|p| p.as_dvec3()) {
        let camera = Camera::look_at(eye, eye + DVec3::new(1.0, 0.25, 0.5), 1.2, 1.5);
        for mode in [Mode::Frustum, Mode::Portals, Mode::Pvs, Mode::PortalsAndPvs] {
            let seen = view.cull(&camera, mode);
            assert!(seen.objects.iter().all(|o| o.index() < objects));
        }
    }
    true
}

fn read<E: std::fmt::Display>(scene: Result<Scene, E>) -> bool {
    match scene {
        Ok(scene) => assert_sound(&scene, ImportOptions::default().object_triangles),
        Err(e) => {
            assert!(!e.to_string().is_empty());
            return false;
        }
    }
    true
}

fn gltf_bytes(bytes: &[u8]) -> bool {
    read(gltf::from_slice(bytes, "hostile", None, &ImportOptions::default()))
}

fn obj_bytes(bytes: &[u8]) -> bool {
    read(obj::from_slice(bytes, "hostile", None, &ImportOptions::default()))
}

fn geojson_bytes(bytes: &[u8]) -> bool {
    read(geojson::from_slice(bytes, "hostile", &ImportOptions::default()))
}

/// As a scene, and as a graph over it.
fn indoorgml_text(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let scene = indoorgml::from_str(text, "hostile", &ImportOptions::default());
    if let Ok(scene) = &scene
        && let Ok(graph) = read_indoorgml(text, scene)
    {
        ids(&graph);
    }
    read(scene)
}

fn ids(graph: &enfilade::cells::CellGraph) {
    assert!(graph.portals.iter().flat_map(|p| p.cells).all(|c| c.index() < graph.cells.len()));
    assert!(graph.portals.iter().all(|p| p.winding.len() >= 3 && p.winding.iter().all(|q| q.is_finite())));
}

fn of_prt(prt: &Prt) {
    assert!(prt.level.portals.iter().flat_map(|p| p.cells).all(|c| (c as usize) < prt.level.cells));
    assert!(prt.level.portals.iter().all(|p| p.winding.len() >= 3 && p.winding.iter().all(|q| q.is_finite())));
    assert!(prt.leaves.iter().all(|&c| (c as usize) < prt.level.cells));
}

fn prt(bytes: &[u8]) -> bool {
    read_prt(bytes).map(|prt| of_prt(&prt)).is_ok()
}

fn rows(bytes: &[u8]) -> bool {
    let rows = read_rows(bytes, seeds::ROWS);
    rows.map(|m| assert_eq!((m.rows(), m.columns()), (seeds::ROWS, seeds::ROWS))).is_ok()
}

/// Two rooms, a corridor and the outside: what goes with a model is read beside it.
fn flat() -> &'static (Scene, PvsFile) {
    static FLAT: OnceLock<(Scene, PvsFile)> = OnceLock::new();
    FLAT.get_or_init(|| boxes::flat().0.finish())
}

/// Every camera of a path that is accepted sees something without a panic.
fn path(bytes: &[u8]) -> bool {
    let Some(path) = std::str::from_utf8(bytes).ok().and_then(|text| CameraPath::from_json(text).ok()) else { return false };
    let (_, file) = flat();
    let mut view = View::new(&Culler::new(file));
    for frame in 0..path.frames.len().min(16) {
        let camera = path.camera(frame, file.origin, 1.5);
        for mode in [Mode::Frustum, Mode::Portals, Mode::PortalsAndPvs] {
            let seen = view.cull(&camera, mode);
            assert!(seen.objects.iter().all(|o| o.index() < file.objects.len()));
        }
    }
    true
}

/// Cells that are accepted are laid out, judged and flown through.
fn cells(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let (scene, _) = flat();
    let Ok(graph) = read_cells(text, scene) else { return false };
    ids(&graph);
    drop(validate::structure(&graph, 1e-6));
    graph::flown(&graph);
    true
}

fn view_cells(bytes: &[u8]) -> bool {
    let Some(views) = std::str::from_utf8(bytes).ok().and_then(|text| read_view_cells(text, &flat().0).ok()) else {
        return false;
    };
    let pieces = views.iter().flat_map(|v| &v.pieces);
    assert!(!views.is_empty() && pieces.into_iter().all(|p| p.bounds.min.is_finite() && p.bounds.max.is_finite()));
    true
}

/// Rooms that are accepted can be scored.
fn rooms(bytes: &[u8]) -> bool {
    let Ok(written) = serde_json::from_slice::<RoomsFile>(bytes) else { return false };
    let (scene, file) = flat();
    score_rooms(file, scene, &written).is_ok()
}

/// Most rows of a raster that a target reads, a row at a time.
const RASTER_ROWS: u32 = 64;

/// A raster that is accepted has a place, and heights that are finite or void.
fn raster(name: &str, bytes: &[u8]) -> bool {
    let opened = Raster::from_bytes(name, bytes.to_vec(), &RasterOptions::default());
    let refused = |e: enfilade_terrain::raster::RasterError| {
        let line = e.to_string();
        assert!(line.starts_with(name) && !line.contains('\n'), "{line}");
        false
    };
    let mut raster = match opened {
        Ok(raster) => raster,
        Err(e) => return refused(e),
    };
    assert!(raster.spacing().iter().all(|s| s.is_finite() && *s > 0.0) && raster.first().iter().all(|x| x.is_finite()));
    let [columns, rows] = raster.size();
    // A row of this is what the reader's caller has, and not the reader.
    let columns = columns.min(1 << 12);
    if columns != raster.size()[0] {
        return true;
    }
    let mut row = vec![0.0; columns as usize];
    for y in 0..rows.min(RASTER_ROWS) {
        if let Err(e) = raster.read(y..y + 1, &mut row) {
            return refused(e);
        }
        assert!(row.iter().all(|h| !h.is_infinite()));
    }
    true
}

fn tiff(bytes: &[u8]) -> bool {
    raster("hostile.tif", bytes)
}

fn hgt(bytes: &[u8]) -> bool {
    raster("N34W119.hgt", bytes)
}

fn asc(bytes: &[u8]) -> bool {
    raster("hostile.asc", bytes)
}

fn map(bytes: &[u8]) -> bool {
    let scene = enfilade_levels::quake::import_map_bytes(bytes, "hostile", &ImportOptions::default());
    if let Ok(scene) = &scene {
        // One that leaks has none.
        let leaves = scene.hints.leaves.iter();
        let mut ends = leaves.flat_map(|l| l.portals.iter().flat_map(|p| p.cells).map(|c| (c as usize, l.leaves.len())));
        assert!(ends.all(|(cell, count)| cell < count));
    }
    read(scene)
}

fn bsp(bytes: &[u8]) -> bool {
    use enfilade_levels::bsp::Bsp;
    let Ok(bsp) = Bsp::read(bytes.to_vec()) else { return false };
    if let Ok(derived) = bsp.level() {
        assert!(derived.level.portals.iter().flat_map(|p| p.cells).all(|c| (c as usize) < derived.level.cells));
    }
    if let Ok(Some(rows)) = bsp.rows() {
        assert_eq!(rows.rows(), bsp.cells());
    }
    // Rows written into whatever was read.
    let cells = bsp.cells();
    let mut rows = enfilade::BitMatrix::new(cells, cells);
    (0..cells).for_each(|cell| _ = rows.set(cell, cell));
    let clusters: Vec<u32> = (0..cells as u32).collect();
    if let Ok(new) = bsp.with_rows(&rows, &clusters, None) {
        assert!(new.bytes.len() >= bytes.len().min(new.lump));
    }
    let scene = enfilade_levels::quake::import_bytes(bytes.to_vec(), "hostile", &ImportOptions::default());
    if let Ok(scene) = &scene {
        let leaves = scene.hints.leaves.as_ref().expect("a level has leaves");
        assert!(leaves.portals.iter().flat_map(|p| p.cells).all(|c| (c as usize) < leaves.leaves.len()));
    }
    read(scene);
    true
}

#[cfg(feature = "ifc")]
fn ifc(bytes: &[u8]) -> bool {
    read(enfilade_formats::ifc::import_bytes(bytes.to_vec(), "hostile", &ImportOptions::default()))
}
