//! A frame takes no memory: in a binary of its own, since the counter is the allocator of all of it. What the test's thread
//! takes counts, not what the harness takes beside it.

use allocation_counter::measure;
use enfilade::occlusion::chc::Chc;
use enfilade::occlusion::chc_plus::{ChcPlus, ChcPlusOptions};
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::frustum::FrustumCuller;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::occlusion::view::{self, Frustum};
use enfilade::pvs::cubes::{Cube, CubeEngine, CubeScene, CubeView, Raster};
use enfilade::runtime::{
    Camera, Culler, Doors, Mirror, Mode, Motion, Movers, Pathfinder, Relevance, View, World, WorldView,
};
use enfilade::scene::{ImportOptions, Role, SceneBuilder, Source};
use enfilade::{CellId, PortalId};
use enfilade_tubes as tubes;
use enfilade_tubes::{Counts, Runs, SIDES, Selection, Shape, Tubes};
use glam::{DVec3, Vec3};
use testing::boxes;
use testing::maze::Grid;
use testing::meshes::{cuboid, scene, soup};
use testing::random::Places;

/// A hundred million triangles of tubes are counted before any of them is made.
#[test]
fn meshes_of_tubes_that_are_too_large_take_no_memory() {
    let mut tubes = Tubes::default();
    let shape = Shape { radius: 0.5, inner: 0.25, capped: true };
    tubes.line(&[DVec3::ZERO, DVec3::X], false, shape, 1e-4, &mut Counts::default()).unwrap();
    let sections = [tubes.sections[0], tubes.sections[1]].repeat(500_000);
    tubes.tubes[0].sections = 0..sections.len() as u32;
    tubes.sections = sections;
    assert!(tubes.tubes[0].triangles(tubes::usual_sides(0.5)) > 100_000_000);
    let options = ImportOptions { tubes: false, ..ImportOptions::default() };
    let mut builder = SceneBuilder::new(&options, Source::default());
    let taken = measure(|| {
        let refused = builder.add_tubes("pipes".into(), Role::Furnishing, tubes).unwrap_err();
        assert!(refused.to_string().starts_with("more than 50000000 triangles"), "{refused}");
    });
    assert!(taken.bytes_total < 1000, "{} bytes", taken.bytes_total);
}

#[test]
fn culling_allocates_nothing() {
    let (_, file) = boxes::flat().0.finish();
    let culler = Culler::new(&file);
    for mode in Mode::WITHOUT_QUERIES {
        let mut view = View::new(&culler);
        // The first frame too: a view has its final size from the start. Memory that is taken and given back counts.
        let taken = measure(|| {
            for turn in 0..200 {
                let (sin, cos) = (f64::from(turn) * 0.1).sin_cos();
                let eye = boxes::p(1.5 + f64::from(turn % 9), 1.6, 4.0 + sin * 1.5) - file.origin;
                let camera = Camera::look_at(eye, eye + DVec3::new(cos, 0.0, sin), 1.2, 1.6);
                let mut frame = view.cull(&camera, mode);
                std::hint::black_box((frame.runs().len(), frame.near_doors().len()));
            }
        });
        assert_eq!(taken.count_total, 0, "{mode}");
    }
    // What is seen around an eye and in mirrors, and sets without a camera: memory is taken once.
    let (mut view, mut doors) = (View::new(&culler), Doors::open(&culler));
    let corners =
        [(0.5, 0.5), (2.5, 0.5), (2.5, 2.0), (0.5, 2.0)].map(|(x, y)| (boxes::p(x, y, 0.5) - file.origin).as_vec3());
    let mirror = [Mirror::new(boxes::A, &corners).unwrap()];
    let (mut reflected, mut shut) = (0, 0);
    let mut beside = |step: u32| {
        doors.set_open(PortalId(0), !step.is_multiple_of(7));
        view.set_doors(&doors);
        let eye = boxes::p(0.5 + f64::from(step % 90) * 0.1, 1.6, 3.9) - file.origin;
        std::hint::black_box(view.around(eye.as_vec3()).objects.len());
        let camera = Camera::look_at(eye, eye - DVec3::Z, 1.2, 1.6);
        shut += view.cull(&camera, Mode::PortalsAndPvs).near_doors().len();
        reflected += view.mirrors(&mirror, 2, None).len();
        std::hint::black_box(view.within_hops(CellId(step % 3), 2).len());
        std::hint::black_box(view.in_volume(&[glam::Vec4::X], &[boxes::A]).len());
    };
    (0..100).for_each(&mut beside);
    assert_eq!(measure(|| (0..100).for_each(&mut beside)).count_total, 0);
    assert!(reflected > 20 && shut > 4, "{reflected} reflections, {shut} shut doors: a test of nothing");
    // The alarm works.
    assert_eq!(measure(|| drop(std::hint::black_box(vec![0u8; 100]))).bytes_max, 100);
}

/// Movers that walk, jump, go and come, and views of them by every mode, in mirrors and in volumes.
#[test]
fn movers_allocate_nothing_after_the_first_frame() {
    let (scene, file) = boxes::flat().0.finish();
    let culler = Culler::new(&file);
    let (mut view, mut movers) = (View::new(&culler), Movers::new(&culler));
    let mut buffer = DepthBuffer::new(&scene, 160, 90);
    let corners =
        [(0.5, 0.5), (2.5, 0.5), (2.5, 2.0), (0.5, 2.0)].map(|(x, y)| (boxes::p(x, y, 0.5) - file.origin).as_vec3());
    let mirror = [Mirror::new(boxes::A, &corners).unwrap()];
    let at = |k: u32, step: u32| {
        // Some go everywhere, all at once: into one cell, too.
        let x = if step.is_multiple_of(10) { 1.5 } else { f64::from((k * 7 + step) % 140) * 0.1 - 2.0 };
        let middle = boxes::p(x, 1.0, f64::from((k * 3 + step) % 60) * 0.1) - file.origin;
        [middle - 0.3, middle + 0.3].map(|q| q.as_vec3())
    };
    let mut ids: Vec<_> = (0..100).map(|k| movers.insert(at(k, 0)).unwrap()).collect();
    let mut frame = |step: u32| {
        for (k, id) in (0..).zip(&mut ids) {
            movers.set(*id, at(k, step)).unwrap();
            if (k + step).is_multiple_of(13) {
                movers.remove(*id).unwrap();
                *id = movers.insert(at(k, step + 1)).unwrap();
            }
        }
        let eye = boxes::p(0.5 + f64::from(step % 90) * 0.1, 1.6, 3.9) - file.origin;
        let camera = Camera::look_at(eye, eye - DVec3::Z, 1.2, 1.6);
        let mut seen = 0;
        for mode in Mode::ALL {
            view.cull_with(&camera, mode, 0.05, &mut buffer);
            seen += view.movers_with(&movers, &mut buffer).len() + view.movers(&movers).len();
            seen += view.mirrors(&mirror, 2, Some(&movers)).map(|reflection| reflection.movers.len()).sum::<usize>();
        }
        seen += view.movers_around(&movers, camera.eye).len();
        seen + view.movers_in_volume(&movers, &[glam::Vec4::X], &[boxes::A]).len()
    };
    (0..100).for_each(|step| _ = frame(step));
    let mut seen = 0;
    let taken = measure(|| seen = (0..100).map(&mut frame).sum());
    assert_eq!(taken.count_total, 0);
    assert!(seen > 10_000, "{seen}: a test of nothing");
}

/// Ways, the cells that bodies get to, and who may see whom, between any places of buildings with many ways around.
#[test]
fn ways_and_relevance_allocate_nothing_once_warm() {
    let mut random = Places::new(8);
    let (mut ways, mut reached, mut kept_back) = (0, 0, 0);
    for _ in 0..10 {
        let grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        let culler = Culler::new(&file);
        let (mut view, mut doors) = (View::new(&culler), Doors::open(&culler));
        let (mut finder, relevance) = (Pathfinder::new(&culler, &doors), Relevance::new(&culler, 0.5, &doors));
        let mut place = || {
            let (low, high) = grid.bounds(random.below(grid.faces.len()));
            (random.between(low, high) - file.origin).as_vec3()
        };
        let pairs: Vec<[Vec3; 2]> = (0..30).map(|_| [place(), place()]).collect();
        let mut frames = || {
            for (step, [from, to]) in (0..).zip(&pairs) {
                if culler.portal_count() > 0 {
                    doors.set_open(PortalId(step % culler.portal_count() as u32), step % 3 != 0);
                }
                view.set_doors(&doors);
                ways += finder.find(&doors, *from, *to).map_or(0, |way| way.portals.len());
                let near = view.within_metres([*from - 0.1, *from + 0.1], f64::from(step % 5));
                reached += near.len();
                kept_back += usize::from(!relevance.may_see(near, &[CellId(0)]) || !culler.may_see(&[CellId(0)], near));
            }
        };
        // The first call of a view and the hardest way take memory. The first round alone begins with all doors open.
        frames();
        frames();
        assert_eq!(measure(frames).count_total, 0);
    }
    assert!(ways > 100 && reached > 1000 && kept_back > 10, "{ways} {reached} {kept_back}: a test of nothing");
}

/// Loads and evictions from the first frame on, with jumps, and an eye in no cell now and then.
#[test]
fn prefetching_allocates_nothing() {
    use enfilade::runtime::prefetch::{Chunks, Prefetcher, Step};
    let (_, file) = boxes::flat().0.finish();
    let culler = Culler::new(&file);
    let (mut view, mut motion) = (View::new(&culler), Motion::default());
    let chunks = Chunks::of_one(vec![10; culler.object_count()]);
    let mut prefetcher = Prefetcher::new(&file, &culler, chunks, 60);
    let mut loads = 0;
    let taken = measure(|| {
        for turn in 0..400 {
            let (sin, cos) = (f64::from(turn) * 0.1).sin_cos();
            let eye = boxes::p(1.5 + f64::from(turn % 90) * 0.1, 1.6, 3.0 + sin * 4.0) - file.origin;
            let camera = Camera::look_at(eye, eye + DVec3::new(cos, 0.0, sin), 1.2, 1.6);
            motion.see(&camera, f64::from(turn));
            let visible = view.cull(&camera, Mode::PortalsAndPvs).objects;
            prefetcher.frame(camera.eye, &motion, visible);
            while let Some(step) = prefetcher.next_step() {
                if let Step::Load { chunk, .. } = step {
                    prefetcher.loaded(chunk);
                    loads += 1;
                }
            }
        }
    });
    assert_eq!(taken.count_total, 0);
    assert!(loads > 50, "{loads}");
}

#[test]
fn online_culling_allocates_nothing_after_its_first_frame() {
    let (scene, file) = boxes::flat().0.finish();
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let mut buffer = DepthBuffer::new(&scene, 160, 90);
    let (mut frustum_culler, mut chc) = (FrustumCuller::default(), Chc::default());
    let mut plus = ChcPlus::new(ChcPlusOptions::default());
    let mut frame = |turn: u32| {
        // Back and forth, in and out of the building: what is asked about differs from frame to frame.
        let (sin, cos) = (f64::from(turn) * 0.7).sin_cos();
        let eye = boxes::p(1.5 + f64::from(turn % 9), 1.6, 4.0 + sin * 9.0) - file.origin;
        let view = view::View::look_at(eye, eye + DVec3::new(cos, 0.0, sin), 1.2, 1.6, 0.05);
        let frustum = Frustum::new(&view);
        let mut drawn = frustum_culler.cull(&tree, &frustum).len();
        buffer.begin(&view);
        drawn += chc.cull(&tree, &frustum, &mut buffer).len();
        buffer.begin(&view);
        drawn + plus.cull(&tree, &frustum, &mut buffer).len()
    };
    frame(0);
    let mut drawn = 0;
    let taken = measure(|| drawn = (1..200).map(&mut frame).sum());
    assert_eq!(taken.count_total, 0);
    assert!(drawn > 200, "{drawn} objects: a test of nothing");
}

/// Portals, rows and queries together, and whoever chooses among them.
#[test]
fn culling_with_an_oracle_allocates_nothing_after_the_first_frame_of_each_method() {
    let (scene, file) = boxes::flat().0.finish();
    let mut view = View::new(&Culler::new(&file));
    let mut buffer = DepthBuffer::new(&scene, 160, 90);
    let mut frame = |turn: u32, mode: Mode| {
        let (sin, cos) = (f64::from(turn) * 0.7).sin_cos();
        let eye = boxes::p(1.5 + f64::from(turn % 9), 1.6, 4.0 + sin * 9.0) - file.origin;
        let camera = Camera::look_at(eye, eye + DVec3::new(cos, 0.0, sin), 1.2, 1.6);
        view.cull_with(&camera, mode, 0.05, &mut buffer).objects.len()
    };
    for mode in Mode::ALL {
        frame(0, mode);
    }
    for mode in Mode::ALL {
        let mut drawn = 0;
        let taken = measure(|| drawn = (1..100).map(|turn| frame(turn, mode)).sum());
        assert_eq!(taken.count_total, 0, "{mode:?}");
        assert!(drawn > 100, "{drawn} objects: a test of nothing");
    }
}

/// Visibility cubes, once they have their buffers.
#[test]
fn a_warm_engine_allocates_nothing() {
    let cube =
        |opaque, from: f64, to: f64| soup("cube", Role::Unknown, opaque, &cuboid(DVec3::splat(from), DVec3::splat(to)));
    let scene = scene([cube(true, 0.0, 9.0), cube(false, 4.0, 5.0)]);
    let ready = CubeScene::new(&scene);
    let (mut engine, mut cube) = (Raster::new(&ready), Cube::default());
    let view = CubeView::new(DVec3::splat(2.0) - scene.origin, 50);
    engine.cube(&view, &mut cube);
    let taken = measure(|| (0..5).for_each(|_| engine.cube(&view, &mut cube)));
    assert_eq!(taken.count_total, 0);
}

/// Two rooms that face each other through twenty doorways, joined and parted while one looks around in them.
#[test]
fn worlds_allocate_nothing_after_the_first_frame() {
    let (mut world, [a, b]) = testing::modules::ladder(20);
    let movers = Movers::new(world.culler(b).unwrap());
    for mode in Mode::WITHOUT_QUERIES {
        let mut view = WorldView::new();
        let mut seen = [0, 0];
        let mut frames = |world: &mut World| {
            for portal in (0..20).map(PortalId) {
                world.join(a, portal, b, portal).unwrap();
                let (sin, cos) = f64::from(portal.0).sin_cos();
                let eye = boxes::p(4.0 * sin, 1.0, f64::from(portal.0) + 0.5);
                let camera = Camera::look_at(eye, eye + DVec3::new(cos, 0.0, sin), 1.2, 1.6);
                view.cull(world, &camera, mode);
                for (module, seen) in [a, b].into_iter().zip(&mut seen) {
                    *seen += view.visible(module).map_or(0, |mut set| 1 + set.runs().len());
                }
                std::hint::black_box(view.movers(b, &movers).len());
            }
            (0..20).map(PortalId).for_each(|portal| world.part(a, portal).unwrap());
        };
        frames(&mut world);
        assert_eq!(measure(|| frames(&mut world)).count_total, 0, "{mode}");
        assert!(seen.iter().all(|seen| *seen > 10), "{mode}: {seen:?}");
    }
}

/// Ground: choosing, and loading from a file by its thread, after the first frames.
#[test]
fn ground_allocates_nothing() {
    use enfilade_terrain::{Ground, GroundScratch, GroundView, Horizon, Limit, flight};
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("no-alloc.ground");
    let mut raster = testing::ground::Raster::of([700, 500], |c, r| f64::from(c * 31 % 57) + f64::from(r * 17 % 91));
    testing::ground::written(&mut raster, &path);
    // Less than the file: it is loaded as it is flown over.
    let mut ground = Ground::open(&path, 200_000).unwrap();
    let cameras = flight(&ground, 40.0, 400);
    for limit in [Limit::Pixels(4.0), Limit::Distance(4.0), Limit::Triangles(50_000)] {
        let (mut scratch, mut motion, mut loaded) = (GroundScratch::default(), Motion::default(), 0);
        let mut horizon = Horizon::new(&ground);
        let mut frame = |k: usize, loaded: &mut u32| {
            let view = GroundView { camera: cameras[k], size: [1920, 1080], windows: &[enfilade::runtime::Rect::FULL] };
            let patches = ground.select(&view, limit, &mut scratch);
            horizon.hide(&ground, &view, 1e-3, patches);
            motion.see(&cameras[k], k as f64 / 60.0);
            *loaded += ground.load(&view, limit, &motion, 0.3, scratch.patches()).loaded;
        };
        (0..10).for_each(|k| frame(k, &mut loaded));
        let taken = measure(|| {
            for k in 10..cameras.len() {
                frame(k, &mut loaded);
                // The disk is given time to answer.
                std::thread::sleep(std::time::Duration::from_micros(200));
            }
        });
        assert_eq!(taken.count_total, 0, "{limit:?}");
        assert!(loaded > 0, "{limit:?}: nothing was loaded");
    }
}

#[test]
fn tubes_are_chosen_without_memory_once_warm() {
    let mut pipes = Tubes::default();
    for k in 0..20 {
        let helix = (0..200).map(|t| 0.1 * f64::from(t)).map(|t| DVec3::new(t.cos() + 3.0 * f64::from(k), 0.1 * t, t.sin()));
        let shape = Shape { radius: 0.1, inner: 0.05, capped: true };
        pipes.through(&helix.collect::<Vec<_>>(), false, shape, 1e-3, &mut Counts::default()).unwrap();
    }
    let objects: Vec<_> = pipes.tubes.iter().map(|tube| tube.segments()).collect();
    let runs = Runs::new(&pipes, objects.iter().cloned());
    let mut selection = Selection::default();
    let mut fly = || {
        let mut drawn = 0;
        for step in 0..50 {
            let eye = DVec3::new(f64::from(step), 1.0, 2.0 + f64::from(step % 7));
            let rows = [DVec3::X, DVec3::Y * 1.8, -DVec3::Z];
            let view = tubes::View::new(eye, rows, 1e-3, [960.0, 540.0], 0.5);
            selection.select(&pipes, &runs, &view, (0..).zip(objects.iter().cloned()));
            drawn += (0..SIDES.len()).map(|sides| selection.bands(sides).len()).sum::<usize>();
        }
        drawn
    };
    let warm = fly();
    let mut drawn = 0;
    assert_eq!(measure(|| drawn = fly()).count_total, 0);
    assert!(drawn == warm && drawn > 1000, "{drawn} bands");
}
