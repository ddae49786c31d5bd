//! Visibility cubes by a graphics processor: what rays say in `f64`, but for differences that the stated tolerance explains; every
//! differing pixel is looked at. Needs an adapter, of software at least: with `CI` set, tests fail without one.

use enfilade::pvs::cubes::{Cube, CubeEngine, CubeScene, CubeView, NONE, Raster, Rays};
use enfilade::scene::rays::RayScene;
use enfilade::scene::{ImportOptions, Mesh, Role, Scene};
use enfilade_formats::import;
use enfilade_scenes::{Kind, generate};
use enfilade_studies::device_cubes::{CORNERS, EDGE, GpuCubes, GpuError, GpuScene, NEAR};
use glam::{DMat3, DVec3};
use std::path::PathBuf;
use std::sync::Arc;
use testing::explain::{Allowed, compare, is_explained};
use testing::meshes::{Triangle, scene, soup};
use testing::random::Places;

const GPU: Allowed = Allowed { edge: EDGE, corners: CORNERS, near: NEAR as f64 };

fn mesh(opaque: bool, corners: &[Triangle]) -> Mesh {
    soup("soup", Role::Unknown, opaque, corners)
}

/// A rectangle in two triangles: `at`, and along two sides.
fn pane(opaque: bool, at: DVec3, u: DVec3, v: DVec3) -> Mesh {
    mesh(opaque, &[[at, at + u, at + u + v], [at, at + u + v, at + v]])
}

/// The scene on the device, or `None` after saying that the test wasn't run.
fn on_gpu(test: &str, scene: &Scene) -> Option<Arc<GpuScene>> {
    match GpuScene::new(scene) {
        Ok(gpu) => Some(Arc::new(gpu)),
        Err(e @ GpuError::NoAdapter { .. }) => {
            assert!(std::env::var_os("CI").is_none(), "{test}: {e}");
            eprintln!("not run: {test}: {e}");
            None
        }
        Err(e) => panic!("{test}: {e}"),
    }
}

fn office(name: &str, rooms: usize) -> (PathBuf, Scene) {
    let office = generate(Kind::Office { rooms, storeys: Some(2), furnished: true }, 5).unwrap();
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.glb"));
    std::fs::write(&path, &office.glb).unwrap();
    let scene = import(&path, &ImportOptions::default()).unwrap();
    (path, scene)
}

/// What the device says.
fn draw(engine: &mut GpuCubes<'_>, view: &CubeView) -> Cube {
    let mut cube = Cube::default();
    engine.cubes(std::slice::from_ref(view), std::slice::from_mut(&mut cube)).unwrap();
    cube
}

/// How many pixels and hits differ from the truth, all of them explained.
fn check(scene: &Scene, rays: &RayScene<'_>, engine: &mut GpuCubes<'_>, view: &CubeView) -> usize {
    let mut want = Cube::default();
    Rays::new(rays).cube(view, &mut want);
    compare(scene, view, &draw(engine, view), &want, GPU)
}

/// A room of 4 x 3 x 6 m around the origin, six panes from inside.
fn room() -> Vec<Mesh> {
    let (min, size) = (DVec3::new(-2.0, -1.5, -3.0), DVec3::new(4.0, 3.0, 6.0));
    let side = |face: usize| {
        let (k, u, v) = (face / 2, (face / 2 + 1) % 3, (face / 2 + 2) % 3);
        let at = if face.is_multiple_of(2) { min + DVec3::AXES[k] * size[k] } else { min };
        pane(true, at, DVec3::AXES[u] * size[u], DVec3::AXES[v] * size[v])
    };
    (0..6).map(side).collect()
}

#[test]
fn a_room_shows_the_ids_that_are_known() {
    let scene = scene(room());
    let Some(gpu) = on_gpu("a_room_shows_the_ids_that_are_known", &scene) else { return };
    println!("{}", gpu.adapter());
    let (ready, eye) = (CubeScene::new(&scene), DVec3::new(0.0137, 0.0071, 0.0213) - scene.origin);
    let mut engine = GpuCubes::new(gpu, &ready);
    for size in [1, 7, 64, 130] {
        let view = CubeView::new(eye, size);
        let cube = draw(&mut engine, &view);
        for pixel in 0..view.pixels() {
            // Where the ray leaves the room.
            let d = view.direction(pixel);
            let end = DVec3::new(2.0, 1.5, 3.0) * d.signum() - scene.origin;
            let t = (end - eye) / d;
            let axis = (0..3).min_by(|&a, &b| t[a].total_cmp(&t[b])).unwrap();
            let triangle = cube.opaque(pixel).expect("a closed room");
            assert_eq!(scene.object_of(triangle as usize).index(), 2 * axis + usize::from(d[axis] < 0.0));
        }
        assert!(cube.see_through.is_empty());
    }
}

#[test]
fn offices_agree_with_rays() {
    let (_, scene) = office("agree", 12);
    let Some(gpu) = on_gpu("offices_agree_with_rays", &scene) else { return };
    let (rays, ready) = (RayScene::new(&scene), CubeScene::new(&scene));
    let mut engine = GpuCubes::new(gpu, &ready);
    let (bounds, mut random) = (scene.bounds(), Places::new(11));
    let (mut differ, mut pixels) = (0, 0);
    for (i, size) in [64, 64, 65, 100, 128, 256].into_iter().enumerate() {
        let eye = bounds.centre() + random.point() * bounds.size() * 0.45;
        let frame = if i % 2 == 0 { DMat3::IDENTITY } else { random.frame() };
        let view = CubeView { eye, frame, size };
        differ += check(&scene, &rays, &mut engine, &view);
        pixels += view.pixels();
    }
    println!("{differ} of {pixels} pixels and hits differ");
    assert!(differ * 1000 < pixels, "explained, but too many");
    // A tenth of a millimetre off surfaces, many of which lie on each other.
    for i in 0..6 {
        let [a, b, c] = scene.corners((random.unit() * scene.triangles.len() as f64) as usize);
        let eye = (a + b + c) / 3.0 + (b - a).cross(c - a).normalize() * 1e-4;
        let frame = if i % 2 == 0 { DMat3::IDENTITY } else { random.frame() };
        let view = CubeView { eye, frame, size: 64 };
        check(&scene, &rays, &mut engine, &view);
    }
}

/// Triangles of all shapes, at sizes from a millimetre to a thousand kilometres.
#[test]
fn soups_agree_with_rays() {
    let mut random = Places::new(7);
    for (case, scale) in [-3, -1, 0, 0, 2, 6].into_iter().enumerate() {
        let scale = 10f64.powi(scale);
        let soup = (0..24).map(|i| {
            let triangles: Vec<[DVec3; 3]> = (0..8)
                .map(|k| {
                    let (p, along) = (random.point(), random.point());
                    // Whole ones, needles, and crumbs.
                    let aside = random.point() * if k % 3 == 1 { 10f64.powi(-(case as i32)) } else { 1.0 };
                    let grow = if k % 3 == 2 { 0.05 } else { 0.7 };
                    [p, p + along * grow, p + (along * 0.6 + aside) * grow].map(|v| v * scale)
                })
                .collect();
            mesh(i % 4 != 0, &triangles)
        });
        let scene = scene(soup.collect::<Vec<_>>());
        let Some(gpu) = on_gpu("soups_agree_with_rays", &scene) else { return };
        let (rays, ready) = (RayScene::new(&scene), CubeScene::new(&scene));
        let mut engine = GpuCubes::new(gpu, &ready);
        for far in [0.3, 1.0, 4.0] {
            for frame in [DMat3::IDENTITY, random.frame()] {
                let eye = random.point() * scale * far;
                check(&scene, &rays, &mut engine, &CubeView { eye, frame, size: 64 });
            }
        }
    }
}

/// A room of crumbs, a metre wide, beside the origin, and the same 1e6 m from where positions are relative to: the ids are the same, but
/// for what the tolerance explains.
#[test]
fn far_from_the_origin_is_as_good_as_near() {
    let mut random = Places::new(23);
    let crumbs: Vec<[DVec3; 3]> = (0..250)
        .map(|_| {
            let p = random.point();
            [p, p + random.point() * 0.05, p + random.point() * 0.05]
        })
        .collect();
    // To numbers that are the same far away.
    let whole = |v: DVec3| (v * 1e6).round() / 1048576.0;
    let moved = |by: f64| {
        let moved = crumbs.iter().map(|t| t.map(|p| whole(p) + by)).collect::<Vec<_>>();
        // Two far corners, so that the origin stays between them.
        let far = DVec3::splat(1048576.0 * 2.0);
        let corner = |at: DVec3| [at, at + DVec3::X, at + DVec3::Y];
        scene([mesh(true, &moved), mesh(true, &[corner(far), corner(-far)])])
    };
    let (near, far) = (moved(0.0), moved(1048576.0));
    let (Some(near_there), Some(far_there)) = (on_gpu("far_from_the_origin_is_as_good_as_near", &near), on_gpu("", &far))
    else {
        return;
    };
    let (near_ready, far_ready, far_rays) = (CubeScene::new(&near), CubeScene::new(&far), RayScene::new(&far));
    let mut at_home = GpuCubes::new(near_there, &near_ready);
    let mut away = GpuCubes::new(far_there, &far_ready);
    for frame in [DMat3::IDENTITY, random.frame(), random.frame()] {
        let eye = whole(random.point() * 0.5);
        let view = CubeView { eye: eye - near.origin, frame, size: 64 };
        let there = CubeView { eye: eye + 1048576.0 - far.origin, ..view };
        let (a, b) = (draw(&mut at_home, &view), draw(&mut away, &there));
        check(&far, &far_rays, &mut away, &there);
        let differ: Vec<usize> = (0..view.pixels()).filter(|&p| a.triangles[p] != b.triangles[p]).collect();
        let explained = |p: usize| is_explained(&near, &view, p, a.triangles[p], b.triangles[p], GPU);
        assert!(differ.iter().all(|&p| explained(p)) && differ.len() < 50, "{differ:?}");
        assert!(a.triangles.iter().filter(|&&t| t < 250).count() > 300, "crumbs are seen");
    }
}

/// Nearer than what is drawn: the tolerance says so, and nothing else is amiss.
#[test]
fn an_eye_on_a_wall_looks_through_it() {
    let scene = scene(room().into_iter().chain([pane(true, DVec3::new(-9.0, -9.0, 5.0), DVec3::X * 18.0, DVec3::Y * 18.0)]));
    let Some(gpu) = on_gpu("an_eye_on_a_wall_looks_through_it", &scene) else { return };
    let (rays, ready) = (RayScene::new(&scene), CubeScene::new(&scene));
    let mut engine = GpuCubes::new(gpu, &ready);
    let eye = |off: f64| CubeView::new(DVec3::new(0.0137, 0.0071, 3.0 - off) - scene.origin, 64);
    let wall = |cube: &Cube| cube.triangles.iter().filter(|&&t| t / 2 == 4).count();
    let (on, off) = (draw(&mut engine, &eye(0.3e-6)), draw(&mut engine, &eye(3e-6)));
    // Of a face and a half, what is nearer than that along its axis.
    assert!(wall(&off) > 64 * 64 * 2 && wall(&on) + 64 * 64 <= wall(&off), "{} {}", wall(&on), wall(&off));
    for off in [0.3e-6, 3e-6, 1e-4] {
        check(&scene, &rays, &mut engine, &eye(off));
    }
}

#[test]
fn what_is_see_through_hides_nothing_and_shows_once() {
    // Before the wall at +Z three panes of one object, one of another, and one behind the wall.
    let z = |at: f64| pane(false, DVec3::new(-1.0, -1.0, at), DVec3::X * 2.0, DVec3::Y * 2.0);
    let joined = |at: [f64; 3]| {
        let corners = at.map(|at| {
            let m = z(at);
            m.triangles.iter().map(|t| t.map(|i| m.positions[i as usize])).collect::<Vec<_>>()
        });
        mesh(false, &corners.concat())
    };
    let scene = scene(room().into_iter().chain([joined([2.5, 2.0, 2.2]), z(1.0), z(4.0)]));
    let Some(gpu) = on_gpu("what_is_see_through_hides_nothing_and_shows_once", &scene) else { return };
    let (rays, ready) = (RayScene::new(&scene), CubeScene::new(&scene));
    let mut engine = GpuCubes::new(gpu, &ready);
    let view = CubeView::new(DVec3::new(0.0137, 0.0071, 0.0213) - scene.origin, 64);
    let cube = draw(&mut engine, &view);
    assert!(cube.triangles.iter().all(|&t| t != NONE && t < 12));
    let depths = cube.see_through.iter().map(|h| scene.corners(h.triangle as usize)[0].z + scene.origin.z);
    let depths: Vec<f64> = depths.collect();
    // The nearest of each object, none from behind the wall; the nearer object is the larger one to the eye.
    let (near, middle) = (depths.iter().filter(|&&z| z == 1.0).count(), depths.iter().filter(|&&z| z == 2.0).count());
    assert!(near > middle && middle > 100 && near + middle == depths.len(), "{near}, {middle} of {}", depths.len());
    check(&scene, &rays, &mut engine, &view);
    // More hits than there is room for at first: from close before a pane.
    let close = CubeView::new(DVec3::new(0.0, 0.0, 0.99) - scene.origin, 64);
    assert!(draw(&mut engine, &close).see_through.len() > 2 * 64 * 64);
    check(&scene, &rays, &mut engine, &close);
}

#[test]
fn nothing_is_seen_of_nothing_or_from_nowhere() {
    let empty = scene([pane(false, DVec3::Z, DVec3::X, DVec3::Y)]);
    let Some(gpu) = on_gpu("nothing_is_seen_of_nothing_or_from_nowhere", &empty) else { return };
    let ready = CubeScene::new(&empty);
    let mut engine = GpuCubes::new(gpu, &ready);
    let cube = draw(&mut engine, &CubeView::new(DVec3::new(0.3, 0.2, 0.0) - empty.origin, 9));
    assert!(cube.triangles.iter().all(|&t| t == NONE) && !cube.see_through.is_empty());
    let nowhere = [f64::NAN, f64::INFINITY, 1e300].map(|x| CubeView::new(DVec3::splat(x), 9));
    let mut out = vec![cube; 3];
    engine.cubes(&nowhere, &mut out).unwrap();
    assert!(out.iter().all(|c| c.triangles.iter().all(|&t| t == NONE) && c.see_through.is_empty()));
    assert!(engine.shares(&nowhere).unwrap().iter().flatten().all(|s| s.pixels == 0));
}

/// Many views at once, of several sizes, more than fit a batch: the same as one after the other, and as the trait's.
#[test]
fn a_batch_gives_the_same_cubes() {
    let (_, scene) = office("batch", 4);
    let Some(gpu) = on_gpu("a_batch_gives_the_same_cubes", &scene) else { return };
    let ready = CubeScene::new(&scene);
    let (mut together, mut alone) = (GpuCubes::new(gpu.clone(), &ready), GpuCubes::new(gpu.clone(), &ready));
    let (bounds, mut random) = (scene.bounds(), Places::new(3));
    let sizes = [32; 5].into_iter().chain([500; 3]).chain([33; 3]);
    let mut views: Vec<CubeView> = sizes
        .map(|size| CubeView { eye: bounds.centre() + random.point() * bounds.size() * 0.4, frame: random.frame(), size })
        .collect();
    views[1].eye.x = f64::NAN;
    let mut out = vec![Cube::default(); views.len()];
    together.cubes(&views, &mut out).unwrap();
    let mut one = Cube::default();
    for (view, cube) in views.iter().zip(&out) {
        alone.cube(view, &mut one);
        assert!(one == *cube, "{view:?}");
    }
    assert_eq!(gpu.missed(), None);
}

#[test]
fn counts_on_the_device_are_those_of_the_ids() {
    let (_, scene) = office("shares", 4);
    let Some(gpu) = on_gpu("counts_on_the_device_are_those_of_the_ids", &scene) else { return };
    let ready = CubeScene::new(&scene);
    let mut engine = GpuCubes::new(gpu, &ready);
    let (bounds, mut random) = (scene.bounds(), Places::new(3));
    let sizes = [64, 64, 100, 600, 600, 1];
    let mut views = sizes.map(|size| CubeView::new(bounds.centre() + random.point() * bounds.size() * 0.4, size));
    views[3].eye.x = f64::NAN;
    let shares = engine.shares(&views).unwrap();
    for (view, shares) in views.iter().zip(&shares) {
        let cube = draw(&mut engine, view);
        assert_eq!(*shares, engine.shares_of(view, &cube));
        // And what each pixel's own solid angle adds up to.
        let seen = (0..view.pixels()).filter(|&p| cube.triangles[p] != NONE);
        let (pixels, angle) = seen.fold((0, 0.0), |(n, a), p| (n + 1, a + view.solid_angle(p)));
        let got = shares.iter().fold((0, 0.0), |(n, a), s| (n + s.pixels, a + s.solid_angle));
        assert!(got.0 == pixels && (got.1 - angle).abs() <= 1e-8 * angle, "{got:?}, {pixels}, {angle}");
    }
}

/// Where the device can't, another engine makes the cube, and it is counted.
#[test]
fn what_the_device_cannot_another_engine_does() {
    let scene = scene(room());
    let Some(gpu) = on_gpu("what_the_device_cannot_another_engine_does", &scene) else { return };
    let ready = CubeScene::new(&scene);
    let mut engine = GpuCubes::new(gpu.clone(), &ready);
    gpu.close();
    let view = CubeView::new(DVec3::splat(0.1) - scene.origin, 16);
    let (mut got, mut want) = (Cube::default(), Cube::default());
    assert!(matches!(
        engine.cubes(std::slice::from_ref(&view), std::slice::from_mut(&mut got)),
        Err(GpuError::Failed { .. })
    ));
    engine.cube(&view, &mut got);
    Raster::new(&ready).cube(&view, &mut want);
    assert!(got == want && gpu.missed().is_some_and(|(count, _)| count == 1));
}
