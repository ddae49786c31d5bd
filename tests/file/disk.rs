//! From a bake to a file, on disk, and on the command line.

use crate::cli::{self, folder, names, run_words};
use enfilade::cells::{Cell, CellGraph, Portal, PortalKind, PortalState, Strategy, read_cells};
use enfilade::file::{Container, FileError, Gap, PvsFile, entropy_bits_per_pair, replace_file};
use enfilade::math::geom::Plane;
use enfilade::pvs::{Guarantee, Pvs, PvsStats, Witness};
use enfilade::scene::{ImportOptions, Role, Scene};
use enfilade::types::note::Note;
use enfilade::{BitMatrix, CellId, ObjectId};
use glam::DVec3;
use std::path::Path;
use testing::files;
use testing::forge::sample;
use testing::meshes::{scene, soup};
use testing::rooms::{box_piece, graph};

/// A wall, a chair and a table.
fn things() -> Scene {
    let triangle = |x: f64| [DVec3::new(x, 0.0, 0.0), DVec3::new(x + 0.1, 0.0, 1.0), DVec3::new(x, 1.0, 0.1)];
    let things = [("wall", 1000.0), ("chair", 998.0), ("table", 1001.9)];
    scene(things.map(|(node, x)| soup(node, Role::Unknown, true, &[triangle(x)])))
}

/// Two rooms of 4 x 3 x 4 m joined by a door at x = 0 (scene coordinates).
fn rooms() -> CellGraph {
    let room = |name: &str, min: [f64; 3], max: [f64; 3]| {
        let pieces = vec![box_piece(min, max, DVec3::ZERO)];
        Cell { name: name.into(), pieces, ..Cell::default() }
    };
    let winding = [[0., 0., -0.5], [0., 2., -0.5], [0., 2., 0.5], [0., 0., 0.5]].map(DVec3::from_array).to_vec();
    let mut graph = CellGraph {
        strategy: Strategy::Plan,
        reason: "one storey".into(),
        cells: vec![room("west", [-4., 0., -2.], [0., 3., 2.]), room("east", [0., 0., -2.], [4., 3., 2.])],
        portals: vec![Portal {
            cells: [CellId(0), CellId(1)],
            plane: Plane { n: DVec3::X, d: 0.0 },
            winding,
            kind: PortalKind::Door,
            state: PortalState { shut: true, ..PortalState::of_kind(PortalKind::Door) },
            source: Some("door 1".into()),
        }],
        smallest_hole: 0.001,
        closed_holes: Vec::new(),
        notes: vec![Note::taken("a note")],
    };
    graph.link();
    graph
}

/// The two rooms; the wall beside the door, and a chair in each room.
fn baked(guarantee: Guarantee, keep_bounds: bool) -> (PvsFile, Scene) {
    let scene = things();
    let matrix = |columns: usize, set: &[(usize, usize)]| {
        let mut m = BitMatrix::new(2, columns);
        set.iter().for_each(|&(row, column)| assert!(m.set(row, column)));
        m
    };
    let lower = [(0, 0), (0, 1), (1, 0), (1, 2)];
    let cells = [&[(0, 0), (1, 1)][..], &[(0, 0), (0, 1), (1, 0), (1, 1)]].map(|set| matrix(2, set));
    let objects = [matrix(3, &lower), matrix(3, &[&lower[..], &[(0, 2)]].concat())];
    let witness = |&(cell, object): &(usize, usize)| Witness {
        cell: CellId(cell as u32),
        object: ObjectId(object as u32),
        from: DVec3::new(0.1, 1.0, 0.2),
        to: DVec3::new(0.3, 1.0, 0.4),
    };
    let pvs = Pvs {
        unresolved: matrix(3, &[(0, 2)]),
        witnesses: lower.iter().map(witness).collect(),
        guarantee,
        stats: PvsStats { rays: 12, ..PvsStats::default() },
        ..files::pvs(rooms(), cells, objects, matrix(3, &[(0, 0), (1, 0), (0, 1), (1, 2)]))
    };
    (PvsFile::from_bake(&scene, &ImportOptions::default(), &pvs, keep_bounds), scene)
}

#[test]
fn a_bake_becomes_a_file() {
    let (file, scene) = baked(Guarantee::Conservative, true);
    assert_eq!(PvsFile::read(&file.write()).unwrap(), file);
    assert_eq!((file.model_hash, file.origin), (scene.hash(), scene.origin));
    // Every cell sees every cell: that row is left out; table 2 is not proven hidden from the west room, chair 1 is from the east.
    assert_eq!(file.cell_rows, None);
    assert!(file.sees_cell(CellId(0), CellId(1)));
    assert!(file.sees_object(CellId(0), ObjectId(2)) && !file.sees_object(CellId(1), ObjectId(1)));
    assert_eq!(file.object_row(CellId(1)), Some(&[0b101][..]));
    assert_eq!((file.pairs.lower, file.pairs.upper, file.pairs.cell_lower, file.pairs.cell_upper), (4, 5, 2, 4));
    assert_eq!(
        file.left_out,
        [
            "cell rows: every cell sees every cell",
            "boxes of objects in cells: hardly smaller than the objects' boxes cut to the cells",
            "online hierarchy: the building is closed",
            "repairs: none were needed"
        ]
    );
    // The one undecided pair is of a closed cell, and open for the tolerance.
    assert_eq!(file.gap, Some(Gap { closed_upper: 5, tolerance: 1, ..Gap::default() }));
    assert_eq!(file.bounds.unwrap().witnesses.len(), 4);

    let (sampled, _) = baked(Guarantee::Sampled, false);
    assert!(!sampled.sees_object(CellId(0), ObjectId(2)) && !sampled.sees_cell(CellId(0), CellId(1)));
    assert!(sampled.sees_cell(CellId(1), CellId(1)));
    assert_eq!(sampled.bounds, None);
    assert!(sampled.left_out.contains(&"bounds and witnesses: not requested (--rows both)".to_owned()));
}

#[test]
fn one_room_carries_no_portals_and_no_rows() {
    let (_, scene) = baked(Guarantee::Conservative, false);
    let all = |columns: usize| {
        let mut m = BitMatrix::new(1, columns);
        (0..columns).for_each(|column| assert!(m.set(0, column)));
        m
    };
    let graph = graph(vec![Vec::new()], Vec::new());
    let objects = [BitMatrix::new(1, 3), all(3)];
    let pvs = Pvs { unresolved: all(3), ..files::pvs(graph, [all(1), all(1)], objects, all(3)) };
    let file = PvsFile::from_bake(&scene, &ImportOptions::default(), &pvs, false);
    let bytes = file.write();
    assert_eq!(PvsFile::read(&bytes).unwrap(), file);
    let sections: Vec<String> = Container::parse(&bytes).unwrap().sections().iter().map(|s| s.name()).collect();
    assert_eq!(sections, ["meta", "notes", "cells", "objects", "placement", "gap"], "three objects are undecided");
    assert_eq!(
        file.left_out[..3],
        ["cell rows: there is only one cell", "object rows: every cell sees every object", "portals: one cell has none"]
    );
}

#[test]
fn a_file_is_saved_whole_or_not_at_all() {
    let folder = folder("save");
    let path = folder.join("a.pvs");
    let file = sample();
    file.save(&path).unwrap();
    file.save(&path).unwrap();
    assert_eq!(PvsFile::load(&path).unwrap(), file);
    assert_eq!(names(&folder), ["a.pvs"]);

    // A write that fails half-way leaves the old file and nothing else.
    let error = replace_file(&path, |out| {
        out.write_all(&[0; 100_000])?;
        Err(std::io::Error::other("the disk is full"))
    });
    assert_eq!(error.unwrap_err().to_string(), "the disk is full");
    assert_eq!(PvsFile::load(&path).unwrap(), file);
    assert_eq!(names(&folder), ["a.pvs"]);

    // No such folder; a folder in the file's place.
    assert!(matches!(file.save(&folder.join("none/a.pvs")), Err(FileError::Io(_))));
    assert!(matches!(file.save(&folder), Err(FileError::Io(_))));
    assert_eq!(names(&folder), ["a.pvs"]);
    for (name, content, fault) in [
        ("b.pvs", None, ""),
        ("c.pvs", Some(&b"text"[..]), "not a .pvs file"),
        ("d.pvs", Some(&b"\x89PVS\r\n\x1a\n"[..]), ""),
    ] {
        let path = folder.join(name);
        content.iter().for_each(|content| std::fs::write(&path, content).unwrap());
        let error = PvsFile::load(&path).unwrap_err();
        assert!(matches!(error, FileError::At { .. }), "{error:?}");
        let said = error.to_string();
        assert!(said.starts_with(&format!("{}: ", path.display())) && said.contains(fault), "{said}");
    }
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link_and_a_device_a_device() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    let folder = folder("link");
    let (path, link) = (folder.join("a.pvs"), folder.join("link.pvs"));
    std::fs::write(&path, "old").unwrap();
    symlink(&path, &link).unwrap();
    sample().save(&link).unwrap();
    assert!(link.symlink_metadata().unwrap().is_symlink());
    assert_eq!(PvsFile::load(&path).unwrap(), sample());
    sample().save(Path::new("/dev/null")).unwrap();
    assert!(std::fs::metadata("/dev/null").unwrap().file_type().is_char_device());
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_cannot_be_written_to_is_an_error() {
    // Nobody, root included, makes files here.
    assert!(matches!(sample().save(Path::new("/proc/self/fd/a.pvs")), Err(FileError::Io(_))));
}

fn json(args: &[&str]) -> serde_json::Value {
    cli::json(&run_words(args))
}

#[test]
fn info_says_what_is_in_a_file() {
    let folder = folder("info");
    let path = folder.join("a.pvs");
    let (file, scene) = baked(Guarantee::Conservative, true);
    file.save(&path).unwrap();
    let path = path.to_str().unwrap();
    let info = json(&["info", path, "--json"]);
    assert_eq!(info["model_hash"], format!("{:032x}", scene.hash()));
    assert_eq!(
        (&info["cells"], &info["portals"], &info["objects"], &info["triangles"]),
        (&2.into(), &1.into(), &3.into(), &3.into())
    );
    assert_eq!(
        (&info["guarantee"], &info["strategy"], &info["open_cells"]),
        (&"conservative".into(), &"plan".into(), &0.into())
    );
    let pvs = &info["pvs"];
    assert_eq!(
        (&pvs["lower_pairs"], &pvs["upper_pairs"], &pvs["undecided_pairs"], &pvs["total_pairs"]),
        (&4.into(), &5.into(), &1.into(), &6.into())
    );
    assert_eq!(
        (&pvs["cell_lower_pairs"], &pvs["cell_upper_pairs"], &pvs["cell_total_pairs"]),
        (&2.into(), &4.into(), &4.into())
    );
    assert_eq!(pvs["bits_per_pair"].as_f64().unwrap(), pvs["row_bytes"].as_f64().unwrap() * 8.0 / 6.0);
    assert_eq!(pvs["entropy_bits_per_pair"].as_f64().unwrap(), entropy_bits_per_pair(5, 6));
    let bytes: u64 = info["sections"].as_array().unwrap().iter().map(|s| s["bytes"].as_u64().unwrap()).sum();
    let table = 56 + 32 * info["sections"].as_array().unwrap().len() as u64;
    assert_eq!(info["file_bytes"].as_u64().unwrap(), bytes + table);

    let prose = String::from_utf8(run_words(&["info", path]).stdout).unwrap();
    assert!(prose.contains("conservative") && prose.lines().count() <= 24, "{prose}");
}

#[test]
fn dump_gives_what_a_cells_file_takes() {
    let folder = folder("dump");
    let path = folder.join("a.pvs");
    let (file, scene) = baked(Guarantee::Conservative, true);
    file.save(&path).unwrap();
    let path = path.to_str().unwrap();
    let dump = json(&["dump", path, "--json"]);
    assert_eq!(dump["rows"]["cells"], serde_json::json!([[0, 1], [0, 1]]));
    assert_eq!(dump["rows"]["objects"], serde_json::json!([[0, 1, 2], [0, 2]]));
    assert_eq!(dump["bounds"]["lower"]["objects"], serde_json::json!([[0, 1], [0, 2]]));
    assert_eq!(dump["bounds"]["upper"]["cells"], serde_json::json!([[0, 1], [0, 1]]));
    assert_eq!(dump["objects"][1], serde_json::json!({ "id": 1, "node": "chair", "triangles": 1 }));
    // In the model's own coordinates: the door stands at x = origin + 0.
    assert_eq!(dump["portals"][0]["winding"][0], serde_json::json!([scene.origin.x, scene.origin.y, scene.origin.z - 0.5]));
    assert_eq!(dump["cells"][1]["pieces"][0]["planes"][0], serde_json::json!([1.0, 0.0, 0.0, scene.origin.x + 4.0]));

    let graph = read_cells(&dump.to_string(), &scene).unwrap();
    let again = |plane: &Plane| plane.n.as_vec3().extend(plane.d as f32);
    for (given, kept) in graph.cells.iter().zip(&file.cells) {
        let planes: Vec<_> = given.pieces[0].planes.iter().map(again).collect();
        assert_eq!((planes, &given.name), (kept.pieces[0].clone(), &kept.name));
    }
    assert_eq!(again(&graph.portals[0].plane), file.portals[0].plane);
    assert_eq!(graph.portals[0].winding.iter().map(|p| p.as_vec3()).collect::<Vec<_>>(), file.portals[0].winding);

    let only = json(&["dump", path, "--json", "--rows", "cells"]);
    assert!(only["rows"].get("objects").is_none() && only["rows"]["cells"].is_array());
    let text = |args: &[&str]| String::from_utf8(run_words(args).stdout).unwrap();
    assert_eq!(text(&["dump", path, "--rows", "objects"]), "0 3: 0 1 2\n1 2: 0 2\n");
    assert!(text(&["dump", path]).contains("cell 1 \"east\": 1 pieces\n"));
}

/// What any bad file does on the command line is in tests/commands/errors.rs.
#[test]
fn what_is_no_file_is_told_with_the_remedy() {
    let path = folder("bad").join("a.pvs");
    std::fs::write(&path, "not one of ours").unwrap();
    let remedy = format!(
        "enfilade: {}: not a .pvs file; give a file from `enfilade bake`
",
        path.display()
    );
    assert_eq!(String::from_utf8(run_words(&["info", path.to_str().unwrap()]).stderr).unwrap(), remedy);
}
