//! Visibility cubes: the fast engines give the same bits, and what one ray after the other says in `f64`, but for differences that the
//! stated tolerance explains. Every differing pixel is looked at.

use crate::cli::building;
use enfilade::pvs::cubes::{Cube, CubeEngine, CubeScene, CubeView, NONE, Raster, Rays, settle};
use enfilade::scene::rays::RayScene;
use enfilade::scene::{ImportOptions, Mesh, Role, Scene};
use enfilade_formats::import;
use enfilade_scenes::Kind;
use glam::{DMat3, DVec3};
use proptest::prelude::*;
use testing::bakes::generated;
use testing::explain::{EXACT, compare, is_explained};
use testing::meshes::{Triangle, cuboid, scene, soup};
use testing::random::Places;

fn mesh(opaque: bool, corners: &[Triangle]) -> Mesh {
    soup("soup", Role::Unknown, opaque, corners)
}

/// A closed box.
fn cube(opaque: bool, from: f64, to: f64) -> Mesh {
    mesh(opaque, &cuboid(DVec3::splat(from), DVec3::splat(to)))
}

/// Makes a cube by both engines and compares; returns how many pixels differ from the truth, all of them explained.
fn check(scene: &Scene, rays: &RayScene<'_>, ready: &CubeScene, view: &CubeView) -> usize {
    let (mut want, mut got) = (Cube::default(), Cube::default());
    Rays::new(rays).cube(view, &mut want);
    Raster::new(ready).cube(view, &mut got);
    compare(scene, view, &got, &want, EXACT)
}

/// Eyes a hair from triangles: off the middle of some, by a fraction of the triangle's size.
fn near(scene: &Scene, random: &mut Places, count: usize, off: f64) -> Vec<DVec3> {
    let beside = |_| {
        let [a, b, c] = scene.corners(random.below(scene.triangles.len()));
        let normal = (b - a).cross(c - a);
        let weights = DVec3::new(random.unit(), random.unit(), random.unit()) + 0.1;
        let weights = weights / weights.element_sum();
        a * weights.x + b * weights.y + c * weights.z + normal.normalize() * off
    };
    (0..count).map(beside).collect()
}

#[test]
fn pixels_cover_the_sphere() {
    let mut random = Places::new(3);
    for size in [1, 2, 7, 64] {
        let frame = random.frame();
        let view = CubeView { eye: DVec3::ONE, frame, size };
        let total: f64 = (0..view.pixels()).map(|p| view.solid_angle(p)).sum();
        assert!((total - 1.0).abs() < 1e-12, "{total}");
        // The mean of direction vectors, weighed, is that of the sphere: nothing. So is that of their products: a third on each axis.
        let weigh = |f: &dyn Fn(DVec3) -> f64| -> f64 {
            (0..view.pixels()).map(|p| f(view.direction(p).normalize()) * view.solid_angle(p)).sum()
        };
        assert!(weigh(&|d| d.x).abs() < 1e-12 && weigh(&|d| d.x * d.y).abs() < 1e-12 + 0.5 / f64::from(size).powi(2));
        assert!((weigh(&|d| d.z * d.z) - 1.0 / 3.0).abs() < 0.5 / f64::from(size).powi(2));
        for pixel in 0..view.pixels() {
            assert_eq!(view.direction(view.opposite(pixel)), -view.direction(pixel));
            assert!((view.direction(pixel).dot(frame.col(pixel / (size * size) as usize / 2)).abs() - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn a_room_is_seen_from_inside() {
    // A room of 4 x 3 x 6 m, its six sides as objects, with a pane of two triangles, twice, a metre before the side at +Z.
    let (min, max) = (DVec3::new(-2.0, 0.0, -3.0), DVec3::new(2.0, 3.0, 3.0));
    let sides: Vec<Mesh> = (0..6)
        .map(|face| {
            let (axis, end) = (face / 2, if face % 2 == 0 { max } else { min });
            let at = |u: usize, v: usize| {
                let pick = |which: usize, k: usize| if which == 0 { min[k] } else { max[k] };
                let mut p = end;
                p[(axis + 1) % 3] = pick(u, (axis + 1) % 3);
                p[(axis + 2) % 3] = pick(v, (axis + 2) % 3);
                p
            };
            mesh(true, &[[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]])
        })
        .collect();
    let pane = |z: f64| {
        let at = |x: f64, y: f64| DVec3::new(x, y, z);
        let (a, b, c, d) = (at(-1.0, 1.0), at(1.0, 1.0), at(1.0, 2.0), at(-1.0, 2.0));
        [[a, b, c], [a, c, d]]
    };
    let glass = mesh(false, &[pane(2.0), pane(2.1)].concat());
    let scene = scene(sides.into_iter().chain([glass]));
    let (rays, ready) = (RayScene::new(&scene), CubeScene::new(&scene));
    let eye = DVec3::new(0.0137, 1.5071, 0.0) - scene.origin;
    let view = CubeView::new(eye, 300);
    let mut cube = Cube::default();
    Raster::new(&ready).cube(&view, &mut cube);
    for pixel in 0..view.pixels() {
        // Where the ray leaves the box.
        let d = view.direction(pixel);
        let times = (0..3).map(|k| ((if d[k] > 0.0 { max[k] } else { min[k] }) - scene.origin[k] - eye[k]) / d[k]);
        let (axis, t) = times.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        let triangle = cube.opaque(pixel).expect("a closed room");
        assert_eq!(scene.object_of(triangle as usize).index(), 2 * axis + usize::from(d[axis] < 0.0));
        let hit = settle(&rays, &view, pixel, triangle).unwrap();
        assert!((hit.t - t).abs() < 1e-12 * t);
    }
    // The pane that is nearer, each pixel once, and as large as it is.
    let mut pixels: Vec<u32> = cube.see_through.iter().map(|h| h.pixel).collect();
    pixels.sort_unstable();
    pixels.dedup();
    assert_eq!(pixels.len(), cube.see_through.len());
    assert!(cube.see_through.iter().all(|h| scene.corners(h.triangle as usize)[0].z + scene.origin.z == 2.0));
    let angle: f64 = cube.see_through.iter().map(|h| view.solid_angle(h.pixel as usize)).sum();
    // Of a rectangle of half sizes a, b at distance h, seen from before its middle: 4 asin(a b / sqrt((a^2 + h^2) (b^2 + h^2))).
    let (a, b, h) = (1.0f64, 0.5f64, 2.0f64);
    let exact = (a * b / ((a * a + h * h) * (b * b + h * h)).sqrt()).asin() / std::f64::consts::PI;
    assert!((angle / exact - 1.0).abs() < 0.02, "{angle}, {exact}");
    assert_eq!(check(&scene, &rays, &ready, &view), 0);
}

#[test]
fn nothing_is_seen_of_nothing_or_from_nowhere() {
    let empty = scene([cube(false, 0.0, 1.0)]);
    let ready = CubeScene::new(&empty);
    let mut cube = Cube::default();
    let mut engine = Raster::new(&ready);
    engine.cube(&CubeView::new(DVec3::splat(-3.0), 9), &mut cube);
    assert!(cube.triangles.iter().all(|&t| t == NONE) && !cube.see_through.is_empty());
    engine.cube(&CubeView::new(DVec3::splat(f64::NAN), 9), &mut cube);
    assert!(cube.triangles.iter().all(|&t| t == NONE) && cube.see_through.is_empty());
}

#[test]
fn real_buildings_agree_with_the_truth() {
    let (mut differ, mut pixels) = (0, 0);
    for name in ["villa_rotonda", "office", "gallery100"] {
        let scene = import(&building(&format!("{name}.glb")), &ImportOptions::default()).unwrap();
        (differ, pixels) = views(&scene, 5, 40, (differ, pixels));
    }
    println!("{differ} of {pixels} pixels differ");
}

#[test]
fn furnished_offices_agree_with_the_truth() {
    let (_, scene) = generated(Kind::Office { rooms: 30, storeys: Some(2), furnished: true }, 5);
    let (differ, pixels) = views(&scene, 6, 64, (0, 0));
    println!("{differ} of {pixels} pixels differ");
}

/// Cubes anywhere in a scene, straight and turned, and a tenth of a millimetre from surfaces.
fn views(scene: &Scene, count: usize, size: u32, mut sum: (usize, usize)) -> (usize, usize) {
    let (rays, ready) = (RayScene::new(scene), CubeScene::new(scene));
    let (bounds, mut random) = (scene.bounds(), Places::new(11));
    let anywhere = (0..count).map(|_| bounds.centre() + random.point() * bounds.size() / 2.0).collect::<Vec<_>>();
    let beside = near(scene, &mut random, count, 1e-4);
    for (i, eye) in anywhere.into_iter().chain(beside).enumerate() {
        let frame = if i % 2 == 0 { DMat3::IDENTITY } else { random.frame() };
        let view = CubeView { eye, frame, size: size - i as u32 % 3 };
        sum = (sum.0 + check(scene, &rays, &ready, &view), sum.1 + view.pixels());
    }
    sum
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Random triangles, needles and crumbs among them, at sizes from a millimetre to a thousand kilometres.
    #[test]
    fn soups_agree_with_the_truth(seed in any::<u64>(), scale in -3i32..=6, size in 1u32..36, thin in 0i32..9, apart in 0i32..6) {
        let (mut random, scale) = (Places::new(seed), 10f64.powi(scale));
        let apart = 10f64.powi(-apart);
        let objects = (0..24).map(|i| {
            let triangles: Vec<[DVec3; 3]> = (0..8)
                .map(|k| {
                    let (p, along) = (random.point(), random.point());
                    // Whole ones, needles, and crumbs.
                    let aside = random.point() * if k % 3 == 1 { 10f64.powi(-thin) } else { 1.0 };
                    let grow = if k % 3 == 2 { apart } else { 0.7 };
                    [p, p + along * grow, p + (along * random.unit() + aside) * grow].map(|v| v * scale)
                })
                .collect();
            mesh(i % 4 != 0, &triangles)
        });
        let scene = scene(objects.collect::<Vec<_>>());
        let (rays, ready) = (RayScene::new(&scene), CubeScene::new(&scene));
        let mut eyes = near(&scene, &mut random, 2, 1e-4 * scale);
        eyes.extend(near(&scene, &mut random, 1, 1e-9 * scale));
        eyes.push(random.point() * scale);
        eyes.push(random.point() * scale * 4.0);
        for eye in eyes {
            for frame in [DMat3::IDENTITY, random.frame()] {
                check(&scene, &rays, &ready, &CubeView { eye, frame, size });
            }
        }
    }
}

/// A room of a metre in a model of a thousand kilometres: positions are far from the origin that they are kept relative to.
#[test]
fn far_from_the_origin_is_as_good_as_near() {
    let far = DVec3::new(9e5, 2e3, -7e5);
    let mut random = Places::new(23);
    let room: Vec<[DVec3; 3]> = (0..300)
        .map(|_| {
            let p = far + random.point();
            [p, p + random.point() * 0.3, p + random.point() * 0.3]
        })
        .collect();
    let ground = [[DVec3::new(-1e6, 0.0, -1e6), DVec3::new(1e6, 0.0, -1e6), DVec3::new(0.0, 0.0, 1e6)]];
    let scene = scene([mesh(true, &room), mesh(true, &ground)]);
    let (rays, ready) = (RayScene::new(&scene), CubeScene::new(&scene));
    for eye in near(&scene, &mut random, 6, 1e-4).into_iter().chain([far - scene.origin]) {
        for frame in [DMat3::IDENTITY, random.frame()] {
            check(&scene, &rays, &ready, &CubeView { eye, frame, size: 40 });
        }
    }
}

/// With an engine that is wrong, the check finds it: a triangle is left out, or another one is named.
#[test]
fn the_check_can_fail() {
    let scene = scene([cube(true, 0.0, 1.0)]);
    let view = CubeView::new(DVec3::new(0.31, 0.47, 0.53) - scene.origin, 32);
    let mut cube = Cube::default();
    Raster::new(&CubeScene::new(&scene)).cube(&view, &mut cube);
    let wrong = |pixel: &usize| {
        let right = cube.triangles[*pixel];
        [NONE, (right + 1) % 12, (right + 5) % 12].iter().all(|&t| !is_explained(&scene, &view, *pixel, t, right, EXACT))
    };
    let found = (0..view.pixels()).filter(wrong).count();
    assert!(found * 100 > view.pixels() * 99, "{found} of {}", view.pixels());
}
