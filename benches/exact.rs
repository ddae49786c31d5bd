//! The exact set from a point, on one thread: furnished offices of 10,000 to 1.5 million triangles, a city, the villa,
//! teapots; twenty eyes along the walk through each.
//!
//! First the answers: no triangle that an item buffer of 4,096 x 4,096 pixels a face shows may be missing. Of ids on an
//! edge, where the buffer's tolerance lets either win, a ray in `f64` decides. Along every witness a ray must meet its
//! triangle, and nothing before it. Then the times, the least of three of each eye; and what is kept at each depth of
//! splitting. `--test` takes the villa and a small office at 512 pixels, `--quick` 1,024.

use enfilade::pvs::cubes::{Cube, CubeEngine, CubeScene, CubeView, NONE, Raster};
use enfilade::scene::Scene;
use enfilade::scene::rays::RayScene;
use enfilade_measure::exact::{ExactScene, Judge, MOST_SPLITS, Seen};
use enfilade_scenes::{Generated, Kind};
use glam::DVec3;
use testing::bakes::generated;
use testing::times::{is_told, least, timed};

const EYES: usize = 20;
const REPEATS: usize = 3;
/// Of the curve.
const SPLITS: [u32; 8] = [0, 2, 4, 5, 6, 8, 12, MOST_SPLITS];
/// Rooms of offices of about 10,000, 30,000, 100,000, 300,000, a million and 1.5 million triangles.
const OFFICES: [usize; 6] = [5, 20, 65, 200, 660, 1000];

fn main() {
    let office = |rooms| (format!("office of {rooms}"), Kind::Office { rooms, storeys: None, furnished: true });
    let mut scenes = vec![("villa".to_owned(), Kind::House)];
    let size = if is_told("--test") {
        scenes.push(office(OFFICES[0]));
        512
    } else {
        scenes.extend(OFFICES.map(office));
        scenes.push(("city, dense".to_owned(), Kind::City { dense: true }));
        scenes.push(("Teapots(500, 30)".to_owned(), Kind::Teapots { count: 500, scale: 30 }));
        if is_told("--quick") { 1024 } else { 4096 }
    };
    println!("item buffer of {size} x {size} a face; means of {EYES} eyes");
    println!(
        "| scene | triangles | visible | undecided, % | shown by the buffer | mean, ms | slowest, ms | made ready, s |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let curves: Vec<String> = scenes.into_iter().map(|(name, kind)| measure(&name, kind, size)).collect();
    println!("\n| scene | {} |", SPLITS.map(|s| format!("{s} splits")).join(" | "));
    println!("| --- |{}", " --- |".repeat(SPLITS.len()));
    curves.iter().for_each(|curve| println!("{curve}"));
}

/// One row of the first table; returns that of the second.
fn measure(name: &str, kind: Kind, size: u32) -> String {
    let (made, scene) = generated(kind, 0);
    let (ready, ready_in) = timed(|| ExactScene::new(&scene));
    let ready_in = ready_in.as_secs_f64();
    let (mut judge, eyes) = (Judge::new(&ready), eyes(&made, &scene));
    // The answers.
    let sets: Vec<Seen> = eyes.iter().map(|&eye| judge.around(eye, MOST_SPLITS)).collect();
    let shown = held_against(&scene, &eyes, &sets, size);
    // The times.
    let (mean, slowest) = judged(&mut judge, &eyes, MOST_SPLITS, REPEATS);
    let per_eye = |sum: usize| sum as f64 / eyes.len() as f64;
    let visible = per_eye(sets.iter().map(|s| s.visible.len()).sum());
    let undecided = per_eye(sets.iter().map(|s| s.undecided.len()).sum());
    println!(
        "| {name} | {} | {visible:.0} | {:.2} | {:.0} | {mean:.1} | {slowest:.1} | {ready_in:.2} |",
        scene.triangles.len(),
        100.0 * undecided / visible,
        per_eye(shown)
    );
    let at = |splits: u32| {
        let kept: usize = eyes.iter().map(|&eye| judge.around(eye, splits).triangles().len()).sum();
        let (mean, _) = judged(&mut judge, &eyes, splits, 1);
        format!("{:.0} % in {mean:.1} ms", 100.0 * (per_eye(kept) / visible - 1.0))
    };
    format!("| {name} | {} |", SPLITS.map(at).join(" | "))
}

/// Off the axes of symmetry, where edges line up with beams.
fn eyes(made: &Generated, scene: &Scene) -> Vec<DVec3> {
    let frames = made.path["frames"].as_array().expect("a walk");
    let eye = |i: usize| {
        let at = |k: usize| frames[i * frames.len() / EYES]["eye"][k].as_f64().expect("a number");
        DVec3::new(at(0), at(1), at(2)) + DVec3::new(0.0137, 0.0071, 0.0213) - scene.origin
    };
    (0..EYES).map(eye).collect()
}

/// Mean and greatest of the least times, milliseconds.
fn judged(judge: &mut Judge<'_>, eyes: &[DVec3], splits: u32, repeats: usize) -> (f64, f64) {
    let once = |&eye: &DVec3| least(repeats, || judge.around(eye, splits)).as_secs_f64() * 1e3;
    let times: Vec<f64> = eyes.iter().map(once).collect();
    (times.iter().sum::<f64>() / times.len() as f64, times.iter().copied().fold(0.0, f64::max))
}

/// Asserts that nothing of the item buffers is missing, and that rays meet what has a witness. How many triangles the
/// buffers show.
fn held_against(scene: &Scene, eyes: &[DVec3], sets: &[Seen], size: u32) -> usize {
    let (ready, rays) = (CubeScene::new(scene), RayScene::new(scene));
    let (mut raster, mut cube, mut all) = (Raster::new(&ready), Cube::default(), 0);
    for (&eye, seen) in eyes.iter().zip(sets) {
        let view = CubeView::new(eye, size);
        raster.cube(&view, &mut cube);
        let (mut kept, mut shown) = (vec![false; scene.triangles.len()], vec![false; scene.triangles.len()]);
        seen.triangles().iter().for_each(|&t| kept[t as usize] = true);
        for (pixel, &t) in cube.triangles.iter().enumerate().filter(|(_, t)| **t != NONE) {
            if kept[t as usize] {
                shown[t as usize] = true;
            } else {
                let hit = rays.first_opaque(eye, view.direction(pixel), f64::INFINITY);
                assert!(hit.is_none_or(|hit| kept[hit.triangle as usize]), "{hit:?} is missing from {eye}");
            }
        }
        for hit in &cube.see_through {
            assert!(kept[hit.triangle as usize], "{hit:?}, see-through, is missing from {eye}");
            shown[hit.triangle as usize] = true;
        }
        for witness in &seen.visible {
            let own = rays.meets(eye, witness.direction, witness.triangle).expect("a ray that meets it");
            let first = rays.first_opaque(eye, witness.direction, f64::INFINITY);
            assert!(first.is_none_or(|first| own.t <= first.t * (1.0 + 1e-9)), "{witness:?} is behind {first:?}");
        }
        all += shown.iter().filter(|s| **s).count();
    }
    all
}
