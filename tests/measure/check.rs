//! The check must find what is wrong with a file: a good file of two rooms and a door, then the same with one thing damaged.

use crate::cli::{done, enfilade, folder};
use enfilade::cells::{PortalKind, PortalState};
use enfilade::file::{FileCell, FileObject, FilePortal, PvsFile};
use enfilade::pvs::Guarantee;
use enfilade::scene::{Mesh, Role, Scene};
use enfilade::{BitMatrix, CellId, ObjectId};
use enfilade_measure::verify::{
    CheckError, CheckOptions, CheckReport, ExactReport, FaultKind, Violation, check, check_exact,
};
use enfilade_scenes::{Kind, generate};
use glam::{DVec3, Vec3, Vec4, dvec3 as v};
use testing::bakes::on;
use testing::files::bare;
use testing::meshes::{Quad, builder, quads, sides};

const RAYS: CheckOptions = CheckOptions { rays: 40_000, views: 20, seed: 1, leaks: false };

/// A rectangle from a corner along two edges.
fn sheet(node: &str, opaque: bool, rectangles: &[[DVec3; 3]]) -> Mesh {
    let corners: Vec<Quad> = rectangles.iter().map(|&[p, u, v]| [p, p + u, p + u + v, p + v]).collect();
    quads(node, if opaque { Role::Structure } else { Role::Window }, opaque, &corners)
}

/// A box's six sides.
fn cuboid(node: &str, min: DVec3, max: DVec3) -> Mesh {
    quads(node, Role::Structure, true, &sides(min, max))
}

// Objects, as they are added.
const STATUE: ObjectId = ObjectId(3);
const PANE: ObjectId = ObjectId(4);

/// Two rooms of 4 x 3 x 4 m side by side along x. In the wall between them, at x = 4, a door from z = 1 to 2, 2 m high, and a
/// slit of `slit` metres from floor to ceiling at z = 3. A vase in the first room, a statue in the second, opposite the door,
/// and a pane in the door if `glazed`. Every coordinate is exact in `f32`.
fn scene(slit: f64, glazed: bool) -> Scene {
    let mut builder = builder();
    builder.add(cuboid("shell", DVec3::ZERO, v(8.0, 3.0, 4.0))).unwrap();
    let (up, deep) = (DVec3::Y * 3.0, DVec3::Z);
    let wall = |z: f64, width: f64| [v(4.0, 0.0, z), up, deep * width];
    let over = [v(4.0, 2.0, 1.0), DVec3::Y, deep];
    builder.add(sheet("partition", true, &[wall(0.0, 1.0), over, wall(2.0, 1.0), wall(3.0 + slit, 1.0 - slit)])).unwrap();
    builder.add(cuboid("vase", v(1.0, 0.0, 3.0), v(1.5, 0.5, 3.5))).unwrap();
    builder.add(cuboid("statue", v(6.0, 0.0, 1.0), v(6.5, 1.5, 2.0))).unwrap();
    if glazed {
        builder.add(sheet("pane", false, &[[v(4.0, 0.0, 1.0), DVec3::Y * 2.0, deep]])).unwrap();
    }
    builder.finish("two rooms").unwrap()
}

fn full(rows: usize, columns: usize) -> BitMatrix {
    let mut m = BitMatrix::new(rows, columns);
    for (r, c) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
        m.set(r, c);
    }
    m
}

/// A box as a piece, relative to the scene's origin.
fn piece(scene: &Scene, min: DVec3, max: DVec3) -> Vec<Vec4> {
    let (min, max) = (min - scene.origin, max - scene.origin);
    let pair = |k: usize| [DVec3::AXES[k].extend(max[k]), (-DVec3::AXES[k]).extend(-min[k])];
    (0..3).flat_map(pair).map(|p| p.as_vec4()).collect()
}

/// The good file: two cells, the second in two pieces, one portal, everything visible from everywhere.
fn file(scene: &Scene) -> PvsFile {
    let cell = |name: &str, pieces| FileCell { name: name.into(), source: None, open: false, pieces };
    let at = |x: f64, y: f64, z: f64| (v(x, y, z) - scene.origin).as_vec3();
    let objects = scene.objects.iter().map(|o| FileObject {
        node: o.node.clone(),
        triangles: o.triangles.len() as u32,
        bounds: [o.bounds.min.as_vec3(), o.bounds.max.as_vec3()],
    });
    let everything = full(2, scene.objects.len());
    PvsFile {
        model_hash: scene.hash(),
        origin: scene.origin,
        smallest_hole: scene.tolerance().smallest_hole(),
        cells: vec![
            cell("first", vec![piece(scene, DVec3::ZERO, v(4.0, 3.0, 4.0))]),
            cell(
                "second",
                vec![piece(scene, v(4.0, 0.0, 0.0), v(6.0, 3.0, 4.0)), piece(scene, v(6.0, 0.0, 0.0), v(8.0, 3.0, 4.0))],
            ),
        ],
        portals: vec![FilePortal {
            cells: [CellId(0), CellId(1)],
            plane: Vec3::X.extend((4.0 - scene.origin.x) as f32),
            // Counter-clockwise seen from the second room: (b - a) x (c - a) is along +x.
            winding: vec![at(4.0, 0.0, 1.0), at(4.0, 2.0, 1.0), at(4.0, 2.0, 2.0), at(4.0, 0.0, 2.0)],
            kind: PortalKind::Opening,
            state: PortalState::default(),
            source: None,
        }],
        objects: objects.collect(),
        placement: everything.clone(),
        cell_rows: Some(full(2, 2)),
        object_rows: Some(everything),
        ..bare()
    }
}

fn run(file: &PvsFile, scene: &Scene) -> CheckReport {
    check(file, scene, &RAYS).unwrap()
}

/// The counts that must be zero in a good file.
fn faults(r: &CheckReport) -> [u64; 5] {
    [r.missed_rays, r.missed_pairs, r.missed_cell_pairs, r.missed_segments, r.crack_rays]
}

#[test]
fn a_good_file_passes() {
    let scene = scene(0.0, false);
    let report = run(&file(&scene), &scene);
    assert!(report.passed);
    assert_eq!((faults(&report), report.rays, report.segments, report.views), ([0; 5], 40_000, 40_000, 20));
    assert_eq!((report.false_pixels.max, report.empty_cells, report.examples.len()), (0.0, 0, 0));
}

#[test]
fn a_dropped_object_is_found_and_named() {
    let scene = scene(0.0, false);
    let mut file = file(&scene);
    file.object_rows.as_mut().unwrap().clear(0, STATUE.index());
    let report = run(&file, &scene);
    assert!(!report.passed && report.missed_rays > 0 && report.false_pixels.max > 0.0);
    assert_eq!((report.missed_pairs, report.missed_segments, report.missed_cell_pairs), (1, 0, 0));
    for example in &report.examples {
        assert_eq!(
            (example.violation, example.object, example.cells[0]),
            (Violation::Object, Some(STATUE), Some(CellId(0)))
        );
        // In the model's own coordinates: the eye in the first room, the place on the statue's surface.
        assert!(example.from.x < 4.0 && (example.at.x - 6.25).abs() <= 0.25 + 1e-9, "{example:?}");
    }
}

#[test]
fn sampled_rows_that_miss_something_are_an_estimate_and_no_failure() {
    let scene = scene(0.0, false);
    let mut file = file(&scene);
    file.guarantee = Guarantee::Sampled;
    file.object_rows.as_mut().unwrap().clear(0, STATUE.index());
    let report = run(&file, &scene);
    assert!(report.passed);
    assert_eq!(report.missed_pairs, 1);
    // But its portals must hold.
    file.portals.clear();
    assert!(!run(&file, &scene).passed);
}

#[test]
fn a_dropped_cell_pair_is_found() {
    let scene = scene(0.0, false);
    let mut file = file(&scene);
    file.cell_rows.as_mut().unwrap().clear(1, 0);
    let report = run(&file, &scene);
    assert!(!report.passed);
    assert_eq!((report.missed_cell_pairs, report.missed_pairs, report.missed_segments), (1, 0, 0));
    assert_eq!(report.examples[0].cells, [Some(CellId(1)), Some(CellId(0))]);
}

#[test]
fn a_dropped_portal_is_found_and_named() {
    let scene = scene(0.0, false);
    let mut file = file(&scene);
    file.portals.clear();
    let report = run(&file, &scene);
    assert!(!report.passed && report.missed_segments > 0);
    assert_eq!((report.missed_pairs, report.missed_cell_pairs), (0, 0));
    for example in &report.examples {
        assert_eq!(example.violation, Violation::Segment);
        let [a, b] = example.cells.map(|c| c.unwrap().0);
        assert!(a + b == 1 && (example.at.x - 4.0).abs() < 0.01 && (0.99..2.01).contains(&example.at.z), "{example:?}");
    }
}

#[test]
fn a_shifted_portal_is_found() {
    let scene = scene(0.0, false);
    let mut file = file(&scene);
    for p in &mut file.portals[0].winding {
        p.z += 0.25;
    }
    let report = run(&file, &scene);
    assert!(!report.passed && report.missed_segments > 0);
    for example in &report.examples {
        assert!((0.99..1.26).contains(&example.at.z), "only what the shift uncovered: {example:?}");
    }
}

#[test]
fn a_dropped_piece_is_found_as_space_in_no_cell() {
    let scene = scene(0.0, false);
    let mut file = file(&scene);
    file.cells[1].pieces.pop();
    let report = run(&file, &scene);
    assert!(!report.passed && report.missed_segments > 0);
    for example in &report.examples {
        assert_eq!((example.violation, example.cells), (Violation::Segment, [Some(CellId(1)), None]));
        assert!((example.at.x - 6.0).abs() < 0.1, "{example:?}");
    }
}

#[test]
fn what_is_behind_glass_and_the_glass_itself_must_be_listed() {
    let scene = scene(0.0, true);
    assert!(run(&file(&scene), &scene).passed);
    for object in [PANE, STATUE] {
        let mut file = file(&scene);
        file.object_rows.as_mut().unwrap().clear(0, object.index());
        let report = run(&file, &scene);
        assert_eq!((report.passed, report.missed_pairs), (false, 1));
        assert_eq!(report.examples[0].object, Some(object));
    }
}

#[test]
fn a_slit_counts_only_if_it_is_as_wide_as_the_file_promises() {
    let narrow = CheckOptions { rays: 400_000, ..RAYS };
    // 8 mm, where openings of less than 20 mm may be sealed: cracks.
    let slit = scene(0.0078125, false);
    let mut sealed = file(&slit);
    sealed.smallest_hole = 0.02;
    let report = check(&sealed, &slit, &narrow).unwrap();
    assert!(report.passed && report.crack_rays > 0, "{report:?}");
    assert_eq!(report.missed_segments, 0);
    // The same, promised: a hole without a portal.
    let open = file(&slit);
    let report = check(&open, &slit, &narrow).unwrap();
    assert!(!report.passed && report.missed_segments > 0, "{report:?}");
    assert!(report.examples.iter().all(|e| (2.99..3.02).contains(&e.at.z)));
}

#[test]
fn every_pixel_is_false_where_nothing_is_listed() {
    let scene = scene(0.0, false);
    let mut file = file(&scene);
    file.object_rows = Some(BitMatrix::new(2, scene.objects.len()));
    let f = run(&file, &scene).false_pixels;
    assert_eq!((f.mean, f.p95, f.max), (1.0, 1.0, 1.0));
}

#[test]
fn another_model_is_refused() {
    let (good, other) = (scene(0.0, false), scene(0.0, true));
    let error = check(&file(&good), &other, &RAYS).unwrap_err();
    assert_eq!(error, CheckError::OtherModel { model: other.hash(), file: good.hash() });
}

#[test]
fn tables_that_do_not_fit_are_refused() {
    let scene = scene(0.0, false);
    let mut few = file(&scene);
    few.objects.pop();
    let mut rows = file(&scene);
    rows.object_rows = Some(full(3, scene.objects.len()));
    let mut portal = file(&scene);
    portal.portals[0].cells[1] = CellId(2);
    for (file, what) in [(few, "objects"), (rows, "rows"), (portal, "portal 0")] {
        let error = check(&file, &scene, &RAYS).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
}

#[test]
fn the_exact_judge_finds_what_a_row_lacks_and_says_where_to_look() {
    let scene = scene(0.0, true);
    let good = check_exact(&file(&scene), &scene, 60, 1).unwrap();
    assert_eq!((good.eyes, good.missed_pairs, good.passed), (60, 0, true));
    assert!(good.visible_mean > 20.0 && good.undecided_mean < 1.0, "{good:?}");
    for object in [PANE, STATUE] {
        let mut file = file(&scene);
        file.object_rows.as_mut().unwrap().clear(0, object.index());
        let of = |threads| ExactReport { seconds: 0.0, ..on(threads, || check_exact(&file, &scene, 60, 1)).unwrap() };
        let report = of(1);
        assert_eq!(report, of(2));
        assert_eq!((report.passed, report.missed_pairs, report.misses.len()), (false, 1, 1));
        let miss = &report.misses[0];
        assert_eq!((miss.cell, miss.object), (CellId(0), object));
        // From the eye, along the direction, through the door at x = 4, to the pane in it or to the statue's front at x = 6.
        let at = |x: f64| miss.from + miss.direction * ((x - miss.from.x) / miss.direction.x);
        assert!(at(4.0).z > 1.0 && at(4.0).z < 2.0 && at(4.0).y > 0.0 && at(4.0).y < 2.0, "{miss:?}");
        file.guarantee = Guarantee::Sampled;
        assert!(check_exact(&file, &scene, 60, 1).unwrap().passed, "sampled rows promise nothing");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let scene = scene(0.0, true);
    let mut file = file(&scene);
    file.portals.clear();
    file.object_rows.as_mut().unwrap().clear(1, 0);
    let of = |threads| CheckReport { seconds: 0.0, ..on(threads, || run(&file, &scene)) };
    assert_eq!(of(1), of(3));
}

#[test]
fn the_command_exits_with_0_for_passed_1_for_failed_and_2_for_bad_input() {
    let folder = folder("exits");
    let [glb, other, pvs] = ["gallery.glb", "other.glb", "gallery.pvs"].map(|n| folder.join(n));
    std::fs::write(&glb, generate(Kind::Gallery { rooms: 4 }, 1).unwrap().glb).unwrap();
    std::fs::write(&other, generate(Kind::Gallery { rooms: 4 }, 2).unwrap().glb).unwrap();
    done(&enfilade!("bake", &glb, "-o", &pvs, "--rays", "500k"));
    let check = |model: &std::path::Path| {
        let out = enfilade!("check", &pvs, "--model", model, "--rays", "20000", "--views", "2", "--exact", "20", "--json");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (out.status.code(), text(out.stdout), text(out.stderr))
    };

    let (code, stdout, stderr) = check(&glb);
    assert_eq!(code, Some(0), "{stderr}");
    let json: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    for key in ["rays", "segments", "missed_pairs", "missed_segments", "crack_rays", "views", "seconds"] {
        assert!(json[key].is_number(), "{key}");
    }
    for key in ["mean", "p95", "max"] {
        assert_eq!(json["false_pixels"][key], 0.0);
    }
    assert_eq!((&json["passed"], &json["missed_pairs"]), (&true.into(), &0.into()));
    let exact = &json["exact"];
    assert_eq!((&exact["passed"], &exact["missed_pairs"], &exact["eyes"]), (&true.into(), &0.into(), &20.into()));
    for bad in ["-1", "x", "100001"] {
        let out = enfilade!("check", &pvs, "--model", &glb, "--exact", bad);
        assert_eq!(out.status.code(), Some(2), "--exact {bad}");
    }

    let mut damaged = PvsFile::load(&pvs).unwrap();
    let rows = damaged.object_rows.as_mut().unwrap();
    for row in 0..rows.rows() {
        let first = rows.ones(row).next().unwrap();
        rows.clear(row, first);
    }
    // The reader holds a file to its own counts; this one is forged with care.
    let pairs = &mut damaged.pairs;
    pairs.upper = rows.count_ones();
    pairs.lower = pairs.lower.min(pairs.upper);
    std::fs::write(&pvs, damaged.write()).unwrap();
    let (code, stdout, stderr) = check(&glb);
    assert_eq!(code, Some(1), "{stderr}");
    assert!(serde_json::from_str::<serde_json::Value>(&stdout).unwrap()["missed_pairs"].as_u64().unwrap() > 0);

    let (code, stdout, stderr) = check(&other);
    assert_eq!((code, stdout.as_str()), (Some(2), ""));
    assert!(stderr.contains("other.glb: is not the file's model") && stderr.trim_end().lines().count() == 1, "{stderr}");
}

/// A cell that ends short of a wall leaves a gap, and a slanting segment is in it for long. As far as nothing is promised there, so near
/// the wall, none counts, although it ends on the very object that it is near; in a wider gap those count that keep clear.
#[test]
fn segments_count_while_they_keep_clear_of_what_they_end_on() {
    let scene = scene(0.0, false);
    let missed = |holes: f64| {
        let mut file = file(&scene);
        file.cells[0].pieces = vec![piece(&scene, v(holes * file.smallest_hole, 0.0, 0.0), v(4.0, 3.0, 4.0))];
        let report = check(&file, &scene, &RAYS).unwrap();
        (report.missed_segments, report.crack_rays)
    };
    let (count, cracks) = missed(1.25);
    assert!(count == 0 && cracks > 0, "{count} {cracks}");
    assert!(missed(4.0).0 > 0);
}

#[test]
fn faults_of_structure_are_named() {
    let scene = scene(0.0, false);
    let faults = |damage: &dyn Fn(&mut PvsFile)| {
        let mut file = file(&scene);
        damage(&mut file);
        let report = check(&file, &scene, &CheckOptions { rays: 100, views: 0, ..RAYS }).unwrap();
        assert_eq!(report.structure.count, report.structure.faults.len());
        // A fault fails the check, whatever the rays find.
        assert!(report.structure.count == 0 || !report.passed);
        report.structure.faults
    };
    assert!(faults(&|_| ()).is_empty());
    let kinds = |damage: &dyn Fn(&mut PvsFile)| faults(damage).iter().map(|f| f.fault).collect::<Vec<_>>();
    assert_eq!(kinds(&|f| f.portals[0].winding.reverse()), [FaultKind::Clockwise]);
    assert_eq!(kinds(&|f| f.portals[0].winding[1].x += 0.125), [FaultKind::NotPlanar]);
    assert_eq!(
        kinds(&|f| f.portals[0].winding.insert(2, Vec3::new(0.0, -1.0, -0.5) - Vec3::Y * 0.25)),
        [FaultKind::NotConvex]
    );
    let aside = |f: &mut PvsFile| {
        f.portals[0].winding.iter_mut().for_each(|p| p.x += 1.0);
        f.portals[0].plane.w += 1.0;
    };
    assert_eq!(kinds(&aside), [FaultKind::NotBetween]);
    // A portal may be larger than its opening, and moved until all but a strip of it lies beside the rooms: still no fault. Beside them
    // altogether, it is one.
    let beside = |by: f32| move |f: &mut PvsFile| f.portals[0].winding.iter_mut().for_each(|p| p.y += by);
    let [low, high] = {
        let ys = || file(&scene).portals[0].winding.iter().map(|p| p.y).collect::<Vec<_>>();
        [ys().into_iter().fold(f32::MAX, f32::min), ys().into_iter().fold(f32::MIN, f32::max)]
    };
    let top = file(&scene).cells[0].pieces.iter().flatten().filter(|p| p.y > 0.5).map(|p| p.w).fold(f32::MIN, f32::max);
    assert!(high - low > 0.5 && top >= high - 0.001, "{low} {high} {top}");
    assert_eq!(kinds(&beside(top - low - 2e-6)), []);
    assert_eq!(kinds(&beside(top - low + 0.01)), [FaultKind::NotBetween]);
    // The second room's first piece reaches half a metre into the first room.
    let found = faults(&|f| f.cells[1].pieces[0] = piece(&scene, v(3.5, 0.0, 0.0), v(6.0, 3.0, 4.0)));
    let overlap = found.iter().find(|f| f.fault == FaultKind::Overlap).expect("named");
    assert_eq!((overlap.cells, overlap.portal), ([CellId(0), CellId(1)], None));
    assert!((3.5..4.0).contains(&overlap.at.x), "in the model's own coordinates: {}", overlap.at);
}

#[test]
fn free_space_in_no_cell_is_measured_and_placed() {
    let scene = scene(0.0, false);
    let mut file = file(&scene);
    let good = check(&file, &scene, &RAYS).unwrap().free_outside_cells;
    assert!(good.points > 10_000 && good.outside == 0 && good.places.is_empty(), "{good:?}");
    // A quarter of the rooms' volume, at x > 6, loses its piece.
    file.cells[1].pieces.truncate(1);
    let bad = check(&file, &scene, &RAYS).unwrap().free_outside_cells;
    assert!((0.1..0.4).contains(&bad.share), "{bad:?}");
    assert_eq!(bad.share, bad.outside as f64 / bad.points as f64);
    assert!(!bad.places.is_empty() && bad.places.iter().all(|p| p.at.x > 5.9 && p.points > 0), "{bad:?}");
    assert!(bad.places.is_sorted_by(|a, b| a.points >= b.points));
}
