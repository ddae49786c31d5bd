//! The bound of what is unseen: on scenes with view cells (`exact/` in the data folder), against the truth by counting many rays.

use enfilade::BitMatrix;
use enfilade::bake::{BakeOptions, Baked, bake};
use enfilade::cells::{Locator, ViewCell, read_view_cells};
use enfilade::job::Job;
use enfilade::pvs::sampling::confidence::upper_bound;
use enfilade::pvs::{self, Guarantee, PvsOptions, SamplingEnd, view_cells};
use enfilade::scene::{ImportOptions, Scene};
use enfilade::types::bounds::CONFIDENCE;
use enfilade_formats::import;
use glam::DVec3;
use std::path::Path;
use testing::data;
use testing::meshes::{Triangle, solid};
use testing::plain::meets;
use testing::random::Random;
use testing::rooms;

/// What a ray meets first, by triangles tested one by one.
fn first_object(triangles: &[(Triangle, usize)], from: DVec3, direction: DVec3) -> Option<usize> {
    let hits = triangles.iter().filter_map(|&(triangle, object)| meets(from, direction, triangle).map(|t| (t, object)));
    hits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, object)| object)
}

/// All triangles of a scene, and which object each is of.
fn triangles(scene: &Scene) -> Vec<(Triangle, usize)> {
    (0..scene.triangles.len()).map(|t| (scene.corners(t), scene.object_of(t).index())).collect()
}

fn folder(data: &Path, name: &str) -> (Scene, Vec<ViewCell>) {
    let folder = data.join("exact").join(name);
    let scene = import(&folder.join("scene.obj"), &ImportOptions::default()).unwrap();
    let views = read_view_cells(&std::fs::read_to_string(folder.join("cells.json")).unwrap(), &scene).unwrap();
    (scene, views)
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn the_bound_holds_in_all_but_one_run_of_twenty() {
    the_bound_holds(&data::data(), 14, 10_000);
}

/// The same from 200 seeds: `just torture`.
#[test]
#[ignore = "minutes; run by `just torture`"]
fn the_bound_holds_in_all_but_one_run_of_twenty_from_200_seeds() {
    the_bound_holds(&data::data(), 200, 100_000);
}

/// The truth by `rays` from each view cell.
fn the_bound_holds(data: &Path, seeds: u64, rays_of_truth: u32) {
    let (mut runs, mut wrong, mut vain) = (0u32, 0u32, 0u32);
    for name in ["two_rooms", "rooms3x3", "keyhole", "random_boxes", "slit_possible", "slit_barely_visible", "l_corridors"] {
        let (scene, views) = folder(data, name);
        let triangles = triangles(&scene);
        // How much of all that there is to see from a view cell each object is.
        let mut random = Random::new(0x9e37_79b9_7f4a_7c15);
        let solid = |view: &ViewCell| {
            let bounds = view.pieces[0].bounds;
            assert_eq!((view.pieces.len(), view.pieces[0].planes.len()), (1, 6), "a box");
            let mut counts = vec![0u32; scene.objects.len()];
            for _ in 0..rays_of_truth {
                let at = bounds.min
                    + bounds.size() * DVec3::new(random.real(0.0, 1.0), random.real(0.0, 1.0), random.real(0.0, 1.0));
                if let Some(object) = first_object(&triangles, at, random.direction()) {
                    counts[object] += 1;
                }
            }
            counts
        };
        let truth: Vec<Vec<u32>> = views.iter().map(solid).collect();
        // Cells once; then both bakes for each seed.
        let none = PvsOptions { ray_budget: 0, ..PvsOptions::default() };
        let cells = bake(&scene, BakeOptions { pvs: none, ..BakeOptions::default() }, &Job::quiet()).unwrap();
        for seed in 0..seeds {
            // Rays so few that much stays unseen: 25 to 1,600 from each view cell find, a quarter as many test.
            let rays = views.len() as u64 * (128 << (seed % 7));
            let options = PvsOptions { ray_budget: rays, flow_steps: 0, seed, ..PvsOptions::default() };
            let pvs = pvs::bake(&scene, cells.file.graph().clone(), &options, &Job::quiet()).unwrap();
            let rows = view_cells::bake(&scene, &pvs, &views, &options, &Job::quiet()).unwrap();
            let unseen = |v: usize, lower: &BitMatrix| -> u32 {
                (0..scene.objects.len()).filter(|&o| !lower.get(v, o)).map(|o| truth[v][o]).sum()
            };
            for (v, &bound) in rows.unseen.iter().enumerate() {
                runs += 1;
                // The truth is known to within its own rays: it counts as more than the bound where that is sure.
                let count = unseen(v, &rows.lower);
                let sure = 1.0 - upper_bound(u64::from(rays_of_truth - count), u64::from(rays_of_truth), 0.01);
                wrong += u32::from(sure > bound);
                vain += u32::from(bound >= 0.5 && count < rays_of_truth / 100);
                assert!((0.0..=1.0).contains(&bound), "{name} {v}: {bound}");
            }
        }
    }
    println!("{runs} runs, {wrong} above their bound");
    assert!(f64::from(wrong) <= (1.0 - CONFIDENCE) * f64::from(runs), "{wrong} of {runs}");
    // A bound of 1 would hold always.
    assert!(vain < runs / 4, "{vain} of {runs} bounds say nothing of rows that miss little");
}

/// Two rooms with a doorway, and a chair in each.
fn two_rooms() -> Scene {
    rooms::row(2, [1.0, 6.0].map(|x| solid("chair", [x, 0.0, 1.0], [x + 0.4, 0.4, 1.4])), &[]).0
}

fn asked(unseen: Option<f64>, ray_budget: u64) -> Baked {
    let pvs = PvsOptions { unseen, ray_budget, rows_from: Guarantee::Sampled, ..PvsOptions::default() };
    bake(&two_rooms(), BakeOptions { pvs, ..BakeOptions::default() }, &Job::quiet()).unwrap()
}

#[test]
fn sampling_goes_on_until_an_error_is_met_or_rays_end_it() {
    let noted =
        |baked: &Baked, what: &str| baked.file.notes.iter().any(|note| note.starts_with("unseen") && note.contains(what));
    let met = asked(Some(1e-3), 100_000_000);
    assert_eq!(met.sampling_end, SamplingEnd::Unseen);
    assert!(met.file.unseen.as_ref().is_some_and(|unseen| unseen.mean > 0.0 && unseen.mean <= 1e-3));
    assert!(met.file.stats.rays < 10_000_000 && noted(&met, "the goal was 0.10 %"), "{:?}", met.file.notes);
    // The same is found once more, and a smaller error takes more rays.
    assert!(asked(Some(1e-3), 100_000_000).file.write() == met.file.write());
    let less = asked(Some(2e-6), 100_000_000);
    assert_eq!(less.sampling_end, SamplingEnd::Unseen);
    let [mean, rays] = [less.file.unseen.as_ref().map_or(1.0, |unseen| unseen.mean), less.file.stats.rays as f64];
    assert!(mean <= 2e-6 && rays > met.file.stats.rays as f64, "{mean}, {rays}, {:?}", met.file.stats);
    // What can't be reached is said.
    let few = asked(Some(1e-7), 300_000);
    assert_eq!(few.sampling_end, SamplingEnd::Rays);
    assert!(few.file.stats.rays <= 300_000 && noted(&few, "was not reached with all"), "{:?}", few.file.notes);
}

/// Rays of another generator from random points of both rooms meet what isn't in the rows no more often than the bound says.
#[test]
fn the_error_that_was_asked_for_holds_for_rays_that_had_no_part_in_it() {
    let scene = two_rooms();
    let baked = asked(Some(1e-3), 100_000_000);
    let triangles = triangles(&scene);
    let closed: Vec<usize> = (0..baked.file.cells.len()).filter(|&c| !baked.file.cells[c].open).collect();
    assert!(!closed.is_empty());
    let graph = baked.file.graph();
    let locator = Locator::new(&graph);
    let (mut random, mut missed, mut cast) = (Random::new(0x2545_f491_4f6c_dd1d), 0, 0u32);
    while cast < 20_000 {
        let within = DVec3::new(8.2 * random.real(0.0, 1.0), 3.0 * random.real(0.0, 1.0), 4.0 * random.real(0.0, 1.0));
        let (at, direction) = (within - scene.origin, random.direction());
        let Some((cell, _)) = locator.locate(at).filter(|(cell, _)| closed.contains(&cell.index())) else { continue };
        cast += 1;
        let seen = first_object(&triangles, at, direction);
        missed += u32::from(seen.is_some_and(|object| !baked.file.objects_seen(cell).any(|o| o.index() == object)));
    }
    // The bound is of the mean over all cells: the closed ones have at most all of it.
    let share = baked.file.cells.len() as f64 / closed.len() as f64;
    assert!(f64::from(missed) <= 1e-3 * share * f64::from(cast) + 3.0, "{missed} of {cast}");
}
