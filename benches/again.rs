//! Bakes after edits beside bakes of all (`cargo bench --bench again`; `--test` takes a small office; `-- MODEL LOW HIGH UP` another model, whose
//! storey between two heights is repeated so much higher up, metres).
//!
//! First the answers are checked: each pair that a bake of all has a witness for is in the rows after the edit. Then the times of both, one
//! thread, and the pairs of both: for one edit of each kind, and after twenty in a row.

use enfilade::bake::{BakeOptions, Baked, Last, bake, size_objects};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::scene::Scene;
use enfilade_formats::import;
use std::path::Path;
use std::time::Duration;
use testing::bakes::{office, on, with_rays};
use testing::edits::Model;
use testing::files::rows;
use testing::random::Random;
use testing::times::{is_told, names, timed};

/// Edits in a row.
const IN_A_ROW: usize = 20;

fn main() {
    let small = is_told("--test");
    let (scene, storey) = match &names()[..] {
        [model, heights @ ..] => {
            let scene = import(Path::new(model), &Default::default()).unwrap_or_else(|e| panic!("{model}: {e}"));
            let heights: Vec<f64> = heights.iter().map(|text| text.parse().expect("metres")).collect();
            (scene, <[f64; 3]>::try_from(heights).expect("two heights, and how much higher"))
        }
        _ => (office(if small { 12 } else { 60 }, true).1, [3.2, 6.5, 3.3]),
    };
    let bench = Bench { rays: if small { 400_000 } else { 20_000_000 } };
    let first = Model::of(&scene);
    let (last, _) = bench.bake(&first.scene(), None);
    println!("{} triangles, {} cells", scene.triangles.len(), last.file.cells.len());
    println!("| edit | seconds | of all | share | pairs | of all | factor |\n| --- | --- | --- | --- | --- | --- | --- |");
    type Edit<'e> = (&'e str, &'e dyn Fn(&mut Model));
    let edits: [Edit; 3] = [
        ("furniture moved", &|model| model.move_furniture(&mut Random::new(1))),
        ("a wall", &|model| model.add_wall(&mut Random::new(1))),
        ("a storey", &|model| model.add_storey([storey[0], storey[1]], storey[2])),
    ];
    for (what, edit) in edits {
        let mut model = first.clone();
        edit(&mut model);
        bench.compare(what, &model.scene(), &last.file);
    }
    let (mut model, mut file, mut random) = (first, last.file, Random::new(2));
    for i in 0..if small { 3 } else { IN_A_ROW } {
        match i % 5 {
            0 => model.add_wall(&mut random),
            1 => model.remove_furniture(&mut random),
            _ => model.move_furniture(&mut random),
        }
        file = bench.bake(&model.scene(), Some(&file)).0.file;
    }
    bench.compare("many, and one more", &model.scene(), &file);
}

struct Bench {
    rays: u64,
}

impl Bench {
    /// A bake as the program does it, on one thread. The last bake's file has no bounds and witnesses, as by default.
    fn bake(&self, scene: &Scene, last: Option<&PvsFile>) -> (Baked, Duration) {
        let last = last.map(|file| PvsFile { bounds: None, ..file.clone() });
        let last = last.map(|file| Last::read(&file.write()).expect("what was written"));
        let mut options = BakeOptions { keep_bounds: true, last, ..with_rays(self.rays) };
        let job = Job::quiet();
        let scene = scene.clone();
        on(1, || {
            timed(move || {
                let (scene, _) = size_objects(scene, &mut options, false, &job).expect("cells");
                bake(&scene, options, &job).expect("a bake")
            })
        })
    }

    fn compare(&self, what: &str, scene: &Scene, last: &PvsFile) {
        let ((again, took), (all, of_all)) = (self.bake(scene, Some(last)), self.bake(scene, None));
        let (rows, rows_of_all) = (rows(&again.file), rows(&all.file));
        if again.file.cells == all.file.cells && again.file.objects == all.file.objects {
            let bounds = all.file.bounds.as_ref().expect("they are kept");
            assert_eq!(bounds.objects_lower.first_outside(&rows), None, "{what}: a pair that shows is hidden");
        } else {
            println!("other cells or objects: pairs can't be compared");
        }
        let (took, of_all) = (took.as_secs_f64(), of_all.as_secs_f64());
        let pairs = [rows, rows_of_all].map(|rows| rows.count_ones());
        println!(
            "| {what} | {took:.2} | {of_all:.2} | {:.1} % | {} | {} | {:.4} |",
            100.0 * took / of_all,
            pairs[0],
            pairs[1],
            pairs[0] as f64 / pairs[1] as f64
        );
    }
}
