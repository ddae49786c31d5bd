//! A building cut at its doors into modules that are baked alone and joined again, beside the same building baked whole
//! (`cargo bench --bench modules`; `--test` takes a small office; `-- MODEL COUNT` another building).
//!
//! First the answers are checked: in frames of a tour, each pixel's triangle is in the set, in each mode. Then triangles and times of both, one
//! thread; and the time of joining and parting a module with twenty portals.

use enfilade::bake::BakeOptions;
use enfilade::cells::SplitOptions;
use enfilade::file::PvsFile;
use enfilade::runtime::{self, Camera, Culler, Mode, ModuleId, World, WorldView};
use enfilade::scene::Scene;
use enfilade::scene::rays::RayScene;
use enfilade_formats::import;
use enfilade_measure::walkthrough::missed::{missed_pixels, objects_shown};
use enfilade_measure::walkthrough::raster::{View, draw};
use enfilade_measure::walkthrough::tour::tour;
use glam::DVec3;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use testing::bakes::{baked, office, with_rays};
use testing::modules::{Module, cut, graph_of, groups, joined, single};
use testing::random::Places;
use testing::times::{is_told, least, names, timed, us};

const MODES: [Mode; 5] = Mode::WITHOUT_QUERIES;
/// Pixels of a picture.
const SIZE: [usize; 2] = [320, 180];
/// Joins and parts of a module's portals.
const PORTALS: u32 = 20;

fn main() {
    let small = is_told("--test");
    let names = names();
    let (scene, count) = match &names[..] {
        [model, count] => {
            let scene = import(Path::new(model), &Default::default()).unwrap_or_else(|e| panic!("{model}: {e}"));
            (scene, count.parse().expect("a number of modules"))
        }
        _ => (office(if small { 12 } else { 60 }, true).1, if small { 4 } else { 12 }),
    };
    let rays = if small { 50_000 } else { 1_000_000 };
    let file = baked(&scene, with_rays(rays));
    let graph = graph_of(&file);
    let single = single(&scene);
    let cuts = cut(&scene, &single, &graph, &groups(&graph, count));
    let files: Vec<PvsFile> = cuts.iter().map(|module| bake_module(module, rays / cuts.len() as u64)).collect();
    let cullers: Vec<Arc<Culler>> = files.iter().map(Culler::new).collect();
    let modules: Vec<(&Module, Arc<Culler>)> = cuts.iter().zip(cullers).collect();
    let (world, ids) = joined(&modules);
    println!("{} cells in {} modules, {} triangles", file.cells.len(), modules.len(), scene.triangles.len());
    let cameras = cameras(&file, if small { 100 } else { 10_000 });
    check(&single, &world, &ids, &cuts, &cameras);
    compare(&Culler::new(&file), &world, &cameras);
    join_and_part();
}

fn bake_module(module: &Module, rays: u64) -> PvsFile {
    let given = Some(module.graph.clone());
    let split = SplitOptions { module: true, ..SplitOptions::default() };
    baked(&module.scene, BakeOptions { given, split, ..with_rays(rays) })
}

/// Cameras of a tour, each turned anywhere.
fn cameras(file: &PvsFile, count: usize) -> Vec<Camera> {
    let (path, mut random) = (tour(file, 1), Places::new(1));
    let aspect = SIZE[0] as f64 / SIZE[1] as f64;
    let eyes = (0..count).map(|i| path.camera(i * path.frames.len() / count, file.origin, aspect).eye.as_dvec3());
    eyes.map(|eye| {
        Camera::look_at(eye, eye + random.between(DVec3::new(-1.0, -0.3, -1.0), DVec3::new(1.0, 0.3, 1.0)), 1.2, aspect)
    })
    .collect()
}

/// Every pixel's triangle is in the set of each mode.
fn check(single: &Scene, world: &World, ids: &[ModuleId], cuts: &[Module], cameras: &[Camera]) {
    let rays = RayScene::new(single);
    let mut view = WorldView::new();
    let mut missed = [0; MODES.len()];
    for camera in cameras {
        let picture = View { camera: *camera, near: 1e-3, width: SIZE[0], height: SIZE[1] };
        let full = draw(single, &picture, &|_| true);
        let shown = objects_shown(single, &full);
        for (mode, missed) in MODES.into_iter().zip(&mut missed) {
            let mut kept = vec![false; single.objects.len()];
            for seen in view.cull(world, camera, mode).to_vec() {
                let module = &cuts[ids.iter().position(|id| *id == seen).expect("a module")];
                for object in view.visible(seen).expect("a set").objects {
                    module.triangles[object.index()].iter().for_each(|&t| kept[t as usize] = true);
                }
            }
            let found = missed_pixels(&rays, &picture, &full, &shown, &|object| kept[object.index()]);
            if !found.pixels.is_empty() {
                println!("{mode}: {} pixels from {} along {}", found.pixels.len(), camera.eye, camera.w);
            }
            *missed += found.pixels.len();
        }
    }
    println!("{} views: {missed:?} missed pixels", cameras.len());
    assert_eq!(missed, [0; MODES.len()]);
}

/// Triangles and times of the whole and of the modules.
fn compare(culler: &Arc<Culler>, world: &World, cameras: &[Camera]) {
    println!("| mode | triangles: whole | joined | times | us: whole, median | 99 % | joined | 99 % | times | modules |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for mode in MODES {
        let (mut whole, mut parts) = (runtime::View::new(culler), WorldView::new());
        let (mut triangles, mut seen) = ([0, 0], 0);
        let mut times = [Vec::new(), Vec::new()];
        for camera in cameras {
            triangles[0] += whole.cull(camera, mode).stats.triangles;
            seen += parts.cull(world, camera, mode).len();
            for id in world.modules() {
                triangles[1] += parts.visible(id).map_or(0, |set| set.stats.triangles);
            }
            times[0].push(least(3, || black_box(whole.cull(camera, mode).objects.len())));
            times[1].push(least(3, || black_box(parts.cull(world, camera, mode).len())));
        }
        times.iter_mut().for_each(|times: &mut Vec<Duration>| times.sort());
        let sum = |times: &[Duration]| times.iter().sum::<Duration>().as_secs_f64();
        println!(
            "| {mode} | {:.0} | {:.0} | {:.3} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.1} |",
            triangles[0] as f64 / cameras.len() as f64,
            triangles[1] as f64 / cameras.len() as f64,
            triangles[1] as f64 / triangles[0] as f64,
            us(&times[0], 50),
            us(&times[0], 99),
            us(&times[1], 50),
            us(&times[1], 99),
            sum(&times[1]) / sum(&times[0]),
            seen as f64 / cameras.len() as f64,
        );
    }
}

/// A module that has twenty portals, joined at all of them and parted.
fn join_and_part() {
    let (mut world, [a, b]) = testing::modules::ladder(PORTALS);
    let mut both = || {
        (0..PORTALS).map(enfilade::PortalId).for_each(|portal| world.join(a, portal, b, portal).expect("on each other"));
        (0..PORTALS).map(enfilade::PortalId).for_each(|portal| world.part(a, portal).expect("joined"));
    };
    let mut times: Vec<Duration> = (0..1000).map(|_| timed(&mut both).1).collect();
    times.sort();
    println!("joining and parting {PORTALS} portals: {:.2} us, 99 % {:.2}", us(&times, 50), us(&times, 99));
}
