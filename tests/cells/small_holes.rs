//! Holes that the user finds too small, in hand-made walls with holes of known width.

use enfilade::bake::BakeOptions;
use enfilade::cells::{CellGraph, Portal, PortalKind};
use enfilade::file::{FileCell, PvsFile};
use enfilade::scene::rays::RayScene;
use enfilade::scene::{Mesh, Scene};
use enfilade_measure::verify::{CheckOptions, check};
use glam::DVec3;
use std::fs;
use std::path::Path;
use testing::bakes;
use testing::meshes::{scene, solid};
use testing::rooms::{box_piece, graph, portal};
use testing::solids::{Box3, less};

use crate::cli::{done, enfilade, folder, refused, run_words, text};

/// Holes of the wall between the rooms: least and greatest z and y, metres.
type Hole = ([f64; 2], [f64; 2]);

const DOOR: Hole = ([2.0, 0.0], [2.9, 2.1]);
const SLIT: Hole = ([4.0, 0.0], [4.2, 2.4]);

/// Two rooms of 4 x 5 m, 2.6 m high, with a wall of 0.2 m between them, and a box in each.
fn rooms(holes: &[Hole]) -> Scene {
    let v = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let mut walls: Vec<Box3> = vec![[v(4.0, 0.0, 0.0), v(4.2, 2.6, 5.0)]];
    for &([z0, y0], [z1, y1]) in holes {
        walls = walls.into_iter().flat_map(|wall| less(wall, [v(4.0, y0, z0), v(4.2, y1, z1)])).collect();
    }
    let shell = [
        ([-0.2, -0.2, -0.2], [8.4, 0.0, 5.2]),
        ([-0.2, 2.6, -0.2], [8.4, 2.8, 5.2]),
        ([-0.2, 0.0, -0.2], [0.0, 2.6, 5.2]),
        ([8.2, 0.0, -0.2], [8.4, 2.6, 5.2]),
        ([0.0, 0.0, -0.2], [8.2, 2.6, 0.0]),
        ([0.0, 0.0, 5.0], [8.2, 2.6, 5.2]),
    ];
    let things = [("west", [1.0, 0.8, 3.0], [1.4, 1.2, 3.4]), ("east", [7.0, 0.8, 4.4], [7.4, 1.2, 4.8])];
    let shell = shell.iter().enumerate().map(|(i, &(min, max))| solid(&format!("shell {i}"), min, max));
    let walls = walls.iter().enumerate().map(|(i, &[min, max])| solid(&format!("wall {i}"), min.into(), max.into()));
    scene(shell.chain(walls).chain(things.map(|(name, min, max)| solid(name, min, max))))
}

/// The rooms as cells 0 and 1, with a portal at the east end of each hole, or two where a hole is cut at a height.
fn cells(scene: &Scene, holes: &[Hole], cut: Option<f64>) -> CellGraph {
    let origin = scene.origin;
    let mut west = vec![box_piece([0.0, 0.0, 0.0], [4.0, 2.6, 5.0], origin)];
    let mut portals: Vec<Portal> = Vec::new();
    for &([z0, y0], [z1, y1]) in holes {
        west.push(box_piece([4.0, y0, z0], [4.2, y1, z1], origin));
        let heights = cut.map_or(vec![[y0, y1]], |cut| vec![[y0, cut], [cut, y1]]);
        portals.extend(heights.iter().map(|&[a, b]| portal([0, 1], 0, [4.2, a, z0], [4.2, b, z1], origin)));
    }
    graph(vec![west, vec![box_piece([4.2, 0.0, 0.0], [8.2, 2.6, 5.0], origin)]], portals)
}

fn baked(scene: &Scene, given: Option<CellGraph>, smallest_hole: Option<f64>) -> PvsFile {
    bakes::baked(scene, BakeOptions { given, smallest_hole, ..bakes::with_rays(200_000) })
}

fn area(windings: &[Vec<glam::Vec3>]) -> f64 {
    windings.iter().map(|w| enfilade::math::geom::area(&w.iter().map(|p| p.as_dvec3()).collect::<Vec<_>>())).sum()
}

/// Whether some cell that holds `from` sees the object of node `to`.
fn sees(file: &PvsFile, scene: &Scene, from: [f64; 3], to: &str) -> bool {
    let at = (DVec3::from(from) - scene.origin).as_vec3();
    let holds = |cell: &FileCell| cell.pieces.iter().any(|p| p.iter().all(|h| h.dot(at.extend(-1.0)) <= 0.0));
    let cell = file.cells.iter().position(holds).expect("in a cell");
    let object = scene.objects.iter().position(|o| o.node == to).unwrap();
    file.object_rows.as_ref().is_none_or(|rows| rows.get(cell, object))
}

#[test]
fn what_is_narrower_than_the_smallest_hole_is_closed() {
    let holes = [DOOR, SLIT];
    let scene = rooms(&holes);
    // Widths of the holes: 0.9 and 0.2 m, to 2 %.
    let closed = [(0.1, 0), (0.195, 0), (0.205, 1), (0.3, 1), (0.88, 1), (0.92, 2), (50.0, 2)];
    for (smallest, expected) in closed {
        let file = baked(&scene, Some(cells(&scene, &holes, None)), Some(smallest));
        assert_eq!((file.closed_holes.len(), file.portals.len()), (expected, 2 - expected), "{smallest} m");
        let areas = [0.0, 0.2 * 2.4, 0.2 * 2.4 + 0.9 * 2.1];
        assert!((area(&file.closed_holes) - areas[expected]).abs() < 1e-4);
        let note = if expected == 0 { "no portal is narrower".to_owned() } else { format!("{expected} of 2 portals are") };
        assert_eq!(file.notes.iter().filter(|n| n.contains("--smallest-hole") && n.contains(&note)).count(), 1);
    }
}

#[test]
fn a_strip_of_a_wide_hole_is_wide() {
    // A door's portal cut at 0.05 m: the lower part alone is narrow, the hole is not.
    let scene = rooms(&[DOOR]);
    let file = baked(&scene, Some(cells(&scene, &[DOOR], Some(0.05))), Some(0.3));
    assert_eq!((file.closed_holes.len(), file.portals.len()), (0, 2));
    let file = baked(&scene, Some(cells(&scene, &[DOOR], Some(0.05))), Some(1.0));
    assert_eq!((file.closed_holes.len(), file.portals.len()), (2, 0));
    // And a slit's, cut in two across: each part is as narrow as the slit.
    let scene = rooms(&[SLIT]);
    let file = baked(&scene, Some(cells(&scene, &[SLIT], Some(1.2))), Some(0.3));
    assert_eq!((file.closed_holes.len(), file.portals.len()), (2, 0));
}

#[test]
fn rows_lose_what_shows_only_through_a_closed_hole() {
    for (holes, still) in [(&[SLIT][..], false), (&[DOOR, SLIT][..], true)] {
        let scene = rooms(holes);
        for given in [None, Some(cells(&scene, holes, None))] {
            let file = baked(&scene, given.clone(), None);
            assert!(file.closed_holes.is_empty() && sees(&file, &scene, [0.5, 1.0, 0.5], "east"));
            let file = baked(&scene, given, Some(0.3));
            assert!(!file.closed_holes.is_empty());
            assert_eq!(sees(&file, &scene, [0.5, 1.0, 0.5], "east"), still);
            assert_eq!(sees(&file, &scene, [7.0, 1.0, 0.5], "west"), still);
            assert!(sees(&file, &scene, [0.5, 1.0, 0.5], "west") && sees(&file, &scene, [7.0, 1.0, 0.5], "east"));
            // The promise is for a model in which the slit is walled up; views look at the model as it is.
            let options = CheckOptions { rays: 50_000, views: 0, ..CheckOptions::default() };
            let report = check(&file, &scene, &options).unwrap();
            assert_eq!((report.missed_segments, report.structure.count), (0, 0), "{:?}", report.structure);
            assert!(report.passed);
            // As read again.
            let read = PvsFile::read(&file.write()).unwrap();
            assert_eq!(read, file);
            assert!(check(&read, &scene, &options).unwrap().passed);
        }
    }
}

#[test]
fn the_command_says_what_it_closed() {
    let folder = folder("small_holes");
    let model = folder.join("office.glb");
    done(&enfilade!("generate", "office", "--rooms", "4", "-o", &model));
    let bake = |file: &Path, more: &[&str]| {
        run_words(&[&["bake", text(&model), "-o", text(file), "--rays", "10k"][..], more].concat())
    };
    let of = |name: &str| folder.join(name).with_extension("pvs");
    for (name, more) in [
        ("plain", &[][..]),
        ("fine", &["--smallest-hole", "0.05"][..]),
        ("wide", &["--smallest-hole", "3"][..]),
        ("one", &["--smallest-hole", "3", "--threads", "1"][..]),
    ] {
        assert!(bake(&of(name), more).status.success());
    }
    let [plain, fine, wide, one] = ["plain", "fine", "wide", "one"].map(|name| fs::read(of(name)).unwrap());
    assert_eq!(wide, one);
    let [plain, fine, wide] = [plain, fine, wide].map(|bytes| PvsFile::read(&bytes).unwrap());
    // Every door of the office is wider than 0.05 m, none than 3 m.
    let doors = plain.portals.len();
    assert_eq!(
        (&plain.portals, &plain.object_rows, &plain.closed_holes),
        (&fine.portals, &fine.object_rows, &fine.closed_holes)
    );
    assert_eq!((wide.portals.len(), wide.closed_holes.len()), (0, doors));
    let named = plain.portals.iter().filter(|p| p.kind == PortalKind::Door).count();
    let note = format!(
        "{doors} of {doors} portals are narrower than 3 m (--smallest-hole) and are closed, including {named} doors"
    );
    assert!(wide.notes.iter().any(|n| n.contains(&note)), "{:?}", wide.notes);
    let info = enfilade!("info", &of("wide"));
    assert!(String::from_utf8_lossy(&info.stdout).contains("(--smallest-hole)"));
    for bad in ["0", "-1", "nan", "inf"] {
        refused(
            &bake(&of("bad"), &[&format!("--smallest-hole={bad}")]),
            &["--smallest-hole <METRES>': takes metres, above 0"],
        );
    }
}

/// Rays end at a closed hole: what is behind it is not met, be it opaque or of glass.
#[test]
fn rays_end_at_closed_holes() {
    let glass = Mesh { opaque: false, ..solid("pane", [2.0, -1.0, -1.0], [2.1, 1.0, 1.0]) };
    let scene = scene([glass, solid("wall", [3.0, -1.0, -1.0], [3.2, 1.0, 1.0])]);
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z) - scene.origin;
    let hole = vec![at(1.0, -0.5, -0.5), at(1.0, 0.5, -0.5), at(1.0, 0.5, 0.5), at(1.0, -0.5, 0.5)];
    let met = |holes: &[Vec<DVec3>], y: f64| {
        let (rays, mut panes) = (RayScene::with_closed_holes(&scene, holes), Vec::new());
        rays.see_through(at(0.0, y, 0.1), DVec3::X, f64::INFINITY, &mut panes);
        (rays.first_opaque(at(0.0, y, 0.1), DVec3::X, f64::INFINITY).is_some(), panes.len())
    };
    assert_eq!(met(&[], 0.2), (true, 1));
    assert_eq!(met(std::slice::from_ref(&hole), 0.2), (false, 0));
    // Beside the hole.
    assert_eq!(met(&[hole], 0.8), (true, 1));
}

/// A cell without portals stays a cell.
#[test]
fn a_room_that_is_cut_off_keeps_its_row() {
    let scene = rooms(&[SLIT]);
    let file = baked(&scene, Some(cells(&scene, &[SLIT], None)), Some(0.3));
    let rows = file.object_rows.as_ref().expect("rooms see different things");
    assert_eq!(file.cells.len(), 2);
    assert!([0, 1].iter().all(|&cell| rows.ones(cell).next().is_some()));
}
