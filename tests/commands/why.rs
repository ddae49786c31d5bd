//! `enfilade why`: three rooms in a row with a cupboard in the second, told from the command line and held against their plan.

use crate::cli::{self, folder, refused, run};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::proof::{Asker, Doubt, Goal, Occlusion, Why, WhyError};
use enfilade::pvs::{Guarantee, PvsOptions, bake};
use enfilade::scene::{ImportOptions, Scene};
use enfilade::{CellId, DirectedPortal, ObjectId};
use serde_json::{Value, json};
use std::path::Path;
use std::process::Output;
use testing::meshes::solid;
use testing::rooms::row;

/// Doors are at x = 4.2 and x = 8.4, each z = 1.8 to 2.7, y = 0 to 2.1. The cupboard leaves neither the room's second door nor
/// `behind` in view from the first room: it reaches from wall to wall but for a way along the south wall.
fn scene_and_file(ray_budget: u64, rows_from: Guarantee, keep_bounds: bool) -> (Scene, PvsFile) {
    let extra = [
        solid("cupboard", [6.0, 0.0, 0.9], [6.4, 2.5, 3.4]),
        solid("behind", [7.0, 0.0, 2.1], [7.2, 0.3, 2.4]),
        solid("beside", [5.2, 0.0, 0.1], [5.4, 0.3, 0.3]),
        // Between the last room's door and its corner: a line through both doors rises by 0.9 m in 4.2 at most.
        solid("corner", [8.7, 0.0, 0.1], [8.9, 0.3, 0.3]),
    ];
    let (scene, graph) = row(3, extra, &[]);
    let pvs = bake(&scene, graph, &PvsOptions { ray_budget, rows_from, ..PvsOptions::default() }, &Job::quiet()).unwrap();
    assert_eq!((pvs.repairs.len(), pvs.stats.contradictions), (0, 0));
    let file = PvsFile::from_bake(&scene, &ImportOptions::default(), &pvs, keep_bounds);
    (scene, file)
}

fn object(scene: &Scene, node: &str) -> ObjectId {
    ObjectId(scene.objects.iter().position(|o| o.node == node).expect("an object of that name") as u32)
}

fn why(file: &Path, arguments: &[&str]) -> Output {
    let all: Vec<&Path> = [Path::new("why"), file].into_iter().chain(arguments.iter().map(Path::new)).collect();
    run(&all)
}

fn told(file: &Path, from: &str, to: &str) -> Value {
    cli::json(&why(file, &[from, to, "--json"]))
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn a_witness_starts_in_the_one_and_ends_on_the_other() {
    let folder = folder("witness");
    let (scene, file) = scene_and_file(2_000_000, Guarantee::Conservative, true);
    let path = folder.join("row.pvs");
    file.save(&path).unwrap();
    let beside = object(&scene, "beside");
    let answer = told(&path, "cell:0", &format!("object:{beside}"));
    assert_eq!(
        (&answer["verdict"], &answer["cells"], &answer["chain"]),
        (&json!("witnessed"), &json!([0, 1]), &json!([[0, 0]]))
    );
    assert_eq!((&answer["from"]["cell"], &answer["to"]["node"]), (&json!(0), &json!("beside")));
    let [from, to] = [0, 1].map(|i| numbers(&answer["segment"][i]));
    // In the first room, and on the box that stands in the second.
    let inside = |p: &[f64], min: [f64; 3], max: [f64; 3]| (0..3).all(|k| p[k] > min[k] - 1e-6 && p[k] < max[k] + 1e-6);
    assert!(inside(&from, [0.2, 0.0, 0.0], [4.2, 2.6, 4.0]), "{from:?}");
    assert!(inside(&to, [5.2, 0.0, 0.1], [5.4, 0.3, 0.3]), "{to:?}");
    // Through the doorway, on both faces of its wall.
    for x in [4.2, 4.4] {
        let s = (x - from[0]) / (to[0] - from[0]);
        let p: Vec<f64> = (0..3).map(|k| from[k] + s * (to[k] - from[k])).collect();
        assert!(inside(&p, [x, 0.0, 1.8], [x, 2.1, 2.7]), "{p:?}");
    }
    // Neighbours meet in their portal; from the first room to the last nothing is seen past the cupboard.
    assert_eq!(told(&path, "0", "cell:1")["chain"], json!([[0, 0]]));
    assert_eq!(told(&path, "2", "cell:1")["chain"], json!([[1, 1]]));
    assert_eq!(told(&path, "1", "cell:1")["verdict"], "itself");
    // Prose says the same.
    let out = why(&path, &["0", &beside.to_string()]);
    let text = String::from_utf8(out.stdout).unwrap();
    assert!(text.starts_with(&format!("cell 0 sees object {beside} (beside): the segment from [")), "{text}");
    assert!(text.ends_with("through portal 0, cells 0 1\n"), "{text}");
    // Held against the model.
    let asker = Asker::new(&file, Some(&scene)).unwrap();
    let Why::Witnessed(sight) = asker.why(CellId(0), Goal::Object(beside)).unwrap() else { panic!("a witness") };
    assert_eq!(sight.clear, Some(true));
}

#[test]
fn what_is_hidden_says_by_what() {
    let folder = folder("hidden");
    let (scene, mut file) = scene_and_file(2_000_000, Guarantee::Conservative, true);
    let [behind, corner] = ["behind", "corner"].map(|node| object(&scene, node));
    // By the doors: every chain of portals ends, and the last room's corner is outside a plane of the chain that leads there.
    let path = folder.join("row.pvs");
    file.save(&path).unwrap();
    let answer = told(&path, "0", &corner.to_string());
    assert_eq!(answer["verdict"], "separated");
    let separations = answer["separations"].as_array().unwrap();
    assert_eq!(answer["chains"], separations.len());
    assert!(separations.iter().any(|s| s["chain"] == json!([[0, 0], [1, 0]])), "{separations:?}");
    for s in separations {
        let cuts = |plane: &Value| {
            let n = numbers(plane);
            let least: f64 =
                [[8.7, 8.9], [0.0, 0.3], [0.1, 0.3]].iter().zip(&n).map(|(ends, n)| (ends[0] * n).min(ends[1] * n)).sum();
            least > n[3]
        };
        assert!(s["planes"].as_array().unwrap().iter().any(cuts), "{s}");
    }
    let text = String::from_utf8(why(&path, &["0", &corner.to_string()]).stdout).unwrap();
    assert!(text.contains("doesn't see") && text.contains("  portals 0 1: lines beyond stay inside\n    ["), "{text}");

    // By the cupboard: portals leave it open, triangles don't.
    let answer = told(&path, "0", &behind.to_string());
    assert_eq!(
        (&answer["verdict"], &answer["chain"], &answer["confirmed"]),
        (&json!("occluded"), &json!([[0, 0]]), &json!(null))
    );
    let occlusion = |confirmed| Why::Occluded(Occlusion { chain: vec![DirectedPortal(0)], confirmed });
    let why = |file: &PvsFile, model| Asker::new(file, model).unwrap().why(CellId(0), Goal::Object(behind)).unwrap();
    assert_eq!(why(&file, None), occlusion(None));
    assert_eq!(why(&file, Some(&scene)), occlusion(Some(true)));

    // By there being no way at all.
    file.portals.clear();
    assert_eq!(why(&file, None), Why::Apart);
    file.save(&path).unwrap();
    assert_eq!(told(&path, "0", &corner.to_string())["verdict"], "apart");
}

#[test]
fn without_rays_the_cupboard_is_not_known_to_hide() {
    let (scene, file) = scene_and_file(0, Guarantee::Conservative, true);
    let asker = Asker::new(&file, None).unwrap();
    let why = |cell: u32, node: &str| asker.why(CellId(cell), Goal::Object(object(&scene, node))).unwrap();
    assert_eq!(why(0, "behind"), Why::Undecided(Doubt::Open(vec![DirectedPortal(0)])));
    assert_eq!(why(2, "behind"), Why::Undecided(Doubt::Open(vec![DirectedPortal(3)])));
    assert_eq!(why(1, "behind"), Why::Undecided(Doubt::Inside));
}

#[test]
fn one_side_alone_tells_what_it_can() {
    let folder = folder("one_side");
    let (scene, upper) = scene_and_file(200_000, Guarantee::Conservative, false);
    let (_, lower) = scene_and_file(200_000, Guarantee::Sampled, false);
    let [beside, corner] = ["beside", "corner"].map(|node| object(&scene, node).to_string());
    let path = folder.join("upper.pvs");
    upper.save(&path).unwrap();
    assert_eq!(told(&path, "0", &corner)["verdict"], "separated");
    refused(&why(&path, &["0", &beside]), &["upper.pvs: keeps only one bound", "is in its rows", "--rows both"]);
    let path = folder.join("lower.pvs");
    lower.save(&path).unwrap();
    refused(&why(&path, &["0", &corner]), &["lower.pvs: keeps only one bound", "isn't in its rows", "--rows both"]);
}

/// Names in the place of numbers; those that are nobody's, or several things', are refused.
#[test]
fn names_of_rooms_and_objects_are_taken() {
    let folder = folder("names");
    let (scene, mut file) = scene_and_file(200_000, Guarantee::Conservative, true);
    file.cells.iter_mut().zip(["Hall", "Store", "Study"]).for_each(|(cell, name)| cell.name = name.into());
    file.cells[2].source = Some("1kT$".into());
    let path = folder.join("named.pvs");
    file.save(&path).unwrap();
    let corner = object(&scene, "corner");
    assert_eq!(told(&path, "Hall", "corner"), told(&path, "0", &corner.to_string()));
    assert_eq!(told(&path, "cell:hall", "object:CORNER"), told(&path, "0", &corner.to_string()));
    assert_eq!(told(&path, "Hall", "Study"), told(&path, "0", "cell:2"));
    assert_eq!(told(&path, "1kT$", "Store"), told(&path, "2", "cell:1"));
    refused(&why(&path, &["Attic", "corner"]), &["named.pvs: no cell is named \"Attic\""]);
    refused(&why(&path, &["Hall", "object:Study"]), &["named.pvs: no object or cell is named \"Study\""]);
    file.cells[1].name = "Study".into();
    file.save(&path).unwrap();
    refused(&why(&path, &["Hall", "Study"]), &["named.pvs: 2 cells are named \"Study\": 1 2; give a number"]);
    file.cells[1].name = "corner".into();
    file.save(&path).unwrap();
    refused(&why(&path, &["Hall", "corner"]), &["give object:corner or cell:corner"]);
}

#[test]
fn bad_input_is_one_line_and_exit_2() {
    let folder = folder("bad");
    let (scene, file) = scene_and_file(0, Guarantee::Conservative, true);
    let path = folder.join("row.pvs");
    file.save(&path).unwrap();
    let objects = scene.objects.len();
    refused(&why(&path, &["3", "0"]), &["row.pvs: no cell 3: the file has 0 to 2"]);
    refused(&why(&path, &["0", "cell:7"]), &["row.pvs: no cell 7: the file has 0 to 2"]);
    let last = objects - 1;
    refused(
        &why(&path, &["0", &objects.to_string()]),
        &[&format!("row.pvs: no object {objects}: the file has 0 to {last}")],
    );
    refused(&why(&folder.join("none.pvs"), &["0", "0"]), &["none.pvs: "]);
    for ids in [["x", "0"], ["0", "cell:"], ["0", "door:1"], ["-1", "0"], ["0", "99999999999"]] {
        assert_eq!(why(&path, &ids).status.code(), Some(2), "{ids:?}");
    }
    // Another model.
    let other = folder.join("other.obj");
    std::fs::write(&other, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    refused(&why(&path, &["0", "0", "--model", other.to_str().unwrap()]), &["other.obj: is not the file's model"]);
    let (other, _) = row(2, [], &[]);
    assert!(matches!(Asker::new(&file, Some(&other)), Err(WhyError::OtherModel { .. })));
}
