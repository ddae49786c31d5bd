//! The rows of a mesh against exact ones: the faces of five levels, baked without their trees, beside the rows that `vis` finds
//! through the levels' own portals. Not run without the data folder.
//!
//! First the answers are checked: nothing that a line shows is missing from the rows, and no witness shows what is hidden. Then a
//! table by level and strategy: cells and portals, how many of them are within the level, portals that lead out of it through a
//! face, and the share of the area of those within that is solid; then hidden pairs that rows keep for each visible pair, of
//! points and objects and of two leaves, and what of it the lower rows keep, too. `--test` takes the smallest level alone.
//!
//! `--write DIR` writes each mesh as an OBJ file and a camera path within the level, and bakes nothing. Files that are named are
//! measured instead, if they are bakes of such a mesh with `--rows both`: `cargo bench --bench truth -- DIR/e1m1.ANY.pvs`.

use enfilade::bake::{BakeOptions, bake};
use enfilade::cells::{SplitOptions, Strategy};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::pvs::PvsOptions;
use enfilade_levels::bsp::Bsp;
use enfilade_levels::{VisOptions, vis};
use std::path::{Path, PathBuf};
use std::time::Instant;
use testing::data::data;
use testing::level_mesh::{LevelMesh, obj_text};
use testing::truth::Truth;
use testing::world::World;

const LEVELS: [&str; 5] = ["dm4", "e1m1", "e1m3", "e2m2", "start"];
/// Points of each leaf, lines of sight, rays of a bake, and eyes of a camera path.
const POINTS: usize = 64;
const LINES: u64 = 1_000_000;
const RAYS: u64 = 5_000_000;
const EYES: usize = 240;
/// Points of the model's box, and of a portal.
const PLACES: usize = 1_000_000;
const SAMPLES: usize = 256;

fn main() {
    let folder = data().join("quake-id-gpl");
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let files: Vec<&Path> = arguments.iter().map(Path::new).filter(|a| a.extension().is_some_and(|e| e == "pvs")).collect();
    let levels = if arguments.iter().any(|a| a == "--test") { &LEVELS[..1] } else { &LEVELS[..] };
    let write = arguments.iter().position(|a| a == "--write").map(|at| PathBuf::from(&arguments[at + 1]));
    if write.is_none() {
        let columns = "level | by | leaves | cells | within | portals | within | astray | solid | objects | witnessed | leaves | witnessed | s";
        println!("| {columns} |");
        println!("|{}", " --- |".repeat(columns.split('|').count()));
    }
    for level in levels {
        let of_level: Vec<&&Path> = files.iter().filter(|f| level_of(f) == *level).collect();
        if of_level.is_empty() && !files.is_empty() {
            continue;
        }
        let bytes = std::fs::read(folder.join(format!("{level}.bsp"))).unwrap_or_else(|e| panic!("{level}.bsp: {e}"));
        let world = World::read(&bytes);
        let portals = Bsp::read(bytes).expect("a level").level().expect("its portals").level;
        let exact = vis(&portals, &VisOptions::default(), None, &Job::quiet()).expect("its rows");
        assert_eq!(exact.lower, exact.upper, "{level}: undecided pairs");
        let mesh = LevelMesh::new(&world, level);
        let truth = Truth::new(&world, &mesh, &exact.upper, POINTS, 1);
        if let Some(folder) = &write {
            let path = serde_json::to_string(&truth.path(EYES, 1)).expect("a path");
            std::fs::write(folder.join(format!("{level}.obj")), obj_text(&world)).expect("a folder to write to");
            std::fs::write(folder.join(format!("{level}.path.json")), path).expect("a folder to write to");
            continue;
        }
        for path in of_level {
            let file = PvsFile::load(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            measure(&path.file_stem().unwrap_or_default().to_string_lossy(), &truth, &file, None);
        }
        for strategy in [None, Some(Strategy::Bsp)].iter().filter(|_| files.is_empty()) {
            let options = BakeOptions {
                split: SplitOptions { strategy: *strategy, ..SplitOptions::default() },
                pvs: PvsOptions { ray_budget: RAYS, ..PvsOptions::default() },
                keep_bounds: true,
                ..BakeOptions::default()
            };
            let begin = Instant::now();
            let file = bake(&mesh.scene, options, &Job::quiet()).expect("a bake").file;
            measure(level, &truth, &file, Some(begin.elapsed().as_secs_f64()));
        }
    }
}

/// The level of a file, `LEVEL.ANY.pvs`.
fn level_of(file: &Path) -> &str {
    let name = file.file_name().and_then(|n| n.to_str()).unwrap_or_default();
    name.split('.').next().unwrap_or_default()
}

fn measure(name: &str, truth: &Truth, file: &PvsFile, seconds: Option<f64>) {
    assert_eq!(file.model_hash, truth.mesh.scene.hash(), "{name}: the file of another model");
    let sights = truth.sights(file, LINES, 2);
    let witnessed = truth.witnessed(file.bounds.as_ref().expect("a file with both bounds"));
    eprintln!("{name}: {sights:?} {witnessed:?}");
    sights.assert_sound(name);
    witnessed.assert_sound(name);
    let figures = truth.figures(file);
    let openings = truth.openings(file, PLACES, SAMPLES, 3);
    eprintln!("{name}: {figures:?} {openings:?}");
    println!(
        "| {name} | {} | {} | {} | {} | {} | {} | {} | {:.0} % | {:.2} | {:.2} | {:.2} | {:.2} | {} |",
        format!("{:?}", file.strategy).to_lowercase(),
        figures.asked,
        file.cells.len(),
        openings.cells,
        file.portals.len(),
        openings.portals,
        openings.astray,
        100.0 * openings.solid / openings.area,
        figures.objects.excess(),
        figures.objects.witnessed_excess(),
        figures.leaves.excess(),
        figures.leaves.witnessed_excess(),
        seconds.map_or(String::new(), |s| format!("{s:.0}")),
    );
}
