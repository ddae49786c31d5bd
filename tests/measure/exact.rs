//! The exact judge from a point: scenes whose answer is known, rays in `f64` that must find nothing else, and what no change
//! of a scene may change.

use enfilade::scene::rays::RayScene;
use enfilade::scene::{Mesh, Role, Scene};
use enfilade_measure::exact::{ExactScene, Judge, MOST_SPLITS, Seen};
use glam::{DMat3, DVec3, dvec3 as v};
use testing::meshes::{Triangle, cuboid, halves, scene, soup};
use testing::random::Random;

/// A hit nearer than this is on the triangle that holds the eye, by rounding.
const ON: f64 = 1e-12;

fn mesh(node: &str, opaque: bool, corners: &[Triangle]) -> Mesh {
    soup(node, Role::Unknown, opaque, corners)
}

/// An upright rectangle at `x`, from `a` to `b` in y and z.
fn plate(x: f64, a: [f64; 2], b: [f64; 2]) -> Vec<Triangle> {
    halves(&[[v(x, a[0], a[1]), v(x, b[0], a[1]), v(x, b[0], b[1]), v(x, a[0], b[1])]])
}

/// What is visible from `eye`, in the coordinates that the scene was made in.
fn look(scene: &Scene, eye: DVec3) -> Seen {
    Judge::new(&ExactScene::new(scene)).around(eye - scene.origin, MOST_SPLITS)
}

/// Names of the objects that show; that nothing is undecided is part of the answer.
fn names(scene: &Scene, eye: DVec3) -> Vec<&str> {
    let seen = look(scene, eye);
    assert!(seen.undecided.is_empty(), "{} undecided", seen.undecided.len());
    seen.objects(scene).into_iter().map(|o| scene.objects[o.index()].node.as_str()).collect()
}

/// Casts rays from an eye in the scene's own coordinates, half of them at random points of triangles: what they meet must be
/// in the set. Every witness must be met, with nothing nearer. How many rays met something.
fn holds_what_rays_see(scene: &Scene, seen: &Seen, eye: DVec3, rays: usize) -> usize {
    let (tracer, mut random) = (RayScene::new(scene), Random::new(5));
    let set = seen.triangles();
    let mut met = 0;
    for i in 0..rays {
        let corners = scene.corners(random.below(scene.triangles.len()));
        let to = if i % 2 == 0 { random.direction() } else { random.point_of(&corners) - eye };
        let Some(hit) = tracer.first_opaque(eye, to, f64::INFINITY).filter(|hit| hit.t > ON) else { continue };
        met += 1;
        assert!(set.binary_search(&hit.triangle).is_ok(), "{hit:?} along {to} is missing");
    }
    for witness in &seen.visible {
        let own = tracer.meets(eye, witness.direction, witness.triangle).unwrap_or_else(|| panic!("{witness:?} isn't met"));
        let first = tracer.first_opaque(eye, witness.direction, f64::INFINITY);
        assert!(first.is_none_or(|f| f.t <= ON || own.t <= f.t * (1.0 + 1e-9)), "{witness:?} is behind {first:?}");
    }
    met
}

/// Triangles anywhere in a cube of 2 m, of edges up to `size` metres.
fn random_soup(random: &mut Random, count: usize, size: f64) -> Vec<Triangle> {
    let mut point = |by: f64| v(random.signed(), random.signed(), random.signed()) * by;
    let mut one = || {
        let a = point(1.0);
        [a, a + point(size), a + point(size)]
    };
    (0..count).map(|_| one()).collect()
}

#[test]
fn a_hole_shows_what_is_behind_it_and_no_more() {
    // A wall 1 m away with a hole of 0.2 m: at 5 m it shows 1 m.
    let sides = [
        plate(1., [-9., -9.], [9., -0.1]),
        plate(1., [-9., 0.1], [9., 9.]),
        plate(1., [-9., -0.1], [-0.1, 0.1]),
        plate(1., [0.1, -0.1], [9., 0.1]),
    ];
    let mut meshes = vec![mesh("wall", true, &sides.concat())];
    let mut expected = vec!["wall".to_owned()];
    for (i, k) in (-10..10).flat_map(|i| (-10..10).map(move |k| (i, k))) {
        let [y, z] = [i, k].map(|n| f64::from(n) * 0.1);
        let name = format!("plate {i} {k}");
        meshes.push(mesh(&name, true, &plate(5.0, [y + 0.01, z + 0.01], [y + 0.09, z + 0.09])));
        if [i, k].iter().all(|n| (-5..5).contains(n)) {
            expected.push(name);
        }
    }
    let scene = scene(meshes);
    assert_eq!(names(&scene, DVec3::ZERO), expected);
}

#[test]
fn a_slit_of_a_tenth_of_a_millimetre_at_a_hundred_metres_is_open() {
    let half = 5e-5;
    let wall = [plate(100.0, [-50.0, -50.0], [-half, 50.0]), plate(100.0, [half, -50.0], [50.0, 50.0])].concat();
    let scene = scene([
        mesh("wall", true, &wall),
        mesh("behind the slit", true, &plate(200.0, [-1e-5, -1.0], [1e-5, 1.0])),
        mesh("across the slit", true, &plate(201.0, [-3.0, -1.0], [3.0, 1.0])),
        mesh("beside the slit", true, &plate(200.0, [3e-4, -1.0], [1.0, 1.0])),
    ]);
    assert_eq!(names(&scene, DVec3::ZERO), ["wall", "behind the slit", "across the slit"]);
    // From half a metre beside it the slit shows what is half a metre to the other side.
    assert_eq!(names(&scene, v(0.0, -0.5, 0.0)), ["wall", "beside the slit"]);
}

#[test]
fn neighbours_leave_no_gap_whatever_their_edges() {
    // A wall of two hundred triangles about points on no grid, and things behind it.
    let mut random = Random::new(8);
    let mut at = |i: i32, k: i32| {
        let inner = i.abs() < 5 && k.abs() < 5;
        let mut off = || if inner { 0.3 * random.signed() } else { 0.0 };
        v(3.0 + off(), f64::from(i) + off(), f64::from(k) + off())
    };
    let grid: Vec<Vec<DVec3>> = (-5..=5).map(|i| (-5..=5).map(|k| at(i, k)).collect()).collect();
    let quad = |i: usize, k: usize| [grid[i][k], grid[i + 1][k], grid[i + 1][k + 1], grid[i][k + 1]];
    let wall = halves(&(0..100).map(|n| quad(n / 10, n % 10)).collect::<Vec<_>>());
    let behind: Vec<Triangle> = (0..50)
        .flat_map(|i| {
            let at = v(6.0, f64::from(i % 10) - 4.5, f64::from(i / 10) - 2.0);
            cuboid(at, at + 0.5)
        })
        .collect();
    let scene = scene([mesh("wall", true, &wall), mesh("behind", true, &behind)]);
    let mut eyes = Random::new(9);
    for _ in 0..20 {
        let seen = look(&scene, v(1.0, eyes.signed(), eyes.signed()));
        let names: Vec<&str> = seen.objects(&scene).iter().map(|o| scene.objects[o.index()].node.as_str()).collect();
        // Where the wall folds, rounding may leave some of its own triangles undecided: here of 200 at most two a view.
        assert!(names == ["wall"] && seen.undecided.len() < 3, "{names:?}, undecided: {:?}", seen.undecided);
    }
}

#[test]
fn doubles_are_both_seen_and_hide_what_is_behind_them() {
    let front = plate(2.0, [-1.0, -1.0], [1.0, 1.0]);
    let scene = scene([
        mesh("first", true, &front),
        mesh("second", true, &front),
        mesh("part of it", true, &plate(2.0, [-0.5, -0.5], [0.25, 0.5])),
        mesh("behind", true, &plate(2.001, [-0.9, -0.9], [0.9, 0.9])),
    ]);
    assert_eq!(names(&scene, v(0.1, 0.2, 0.3)), ["first", "second", "part of it"]);
}

#[test]
fn panes_are_seen_and_seen_through() {
    let scene = scene([
        mesh("pane", false, &plate(1.0, [-1.0, -1.0], [1.0, 1.0])),
        mesh("wall", true, &plate(2.0, [-5.0, -5.0], [5.0, 5.0])),
        mesh("pane behind", false, &plate(3.0, [-1.0, -1.0], [1.0, 1.0])),
        mesh("behind", true, &plate(4.0, [-1.0, -1.0], [1.0, 1.0])),
    ]);
    assert_eq!(names(&scene, DVec3::ZERO), ["pane", "wall"]);
}

#[test]
fn of_a_box_an_eye_outside_sees_three_sides() {
    let scene = scene([mesh("box", true, &cuboid(v(1.0, 1.0, 1.0), v(2.0, 2.0, 2.0)))]);
    let seen = look(&scene, DVec3::ZERO);
    let faces = |t: &u32| scene.corners(*t as usize).map(|p| p + scene.origin);
    let expected: Vec<u32> = (0..12).filter(|t| (0..3).any(|k| faces(t).iter().all(|p| p[k] == 1.0))).collect();
    assert_eq!((seen.triangles(), seen.undecided.len(), expected.len()), (expected, 0, 6));
    // Far away it is smaller than rounding can tell: kept, and not claimed to be hidden.
    assert_eq!(look(&scene, v(-1e9, -1e9, -1e9)).objects(&scene).len(), 1);
}

#[test]
fn an_empty_scene_and_an_eye_that_is_nowhere_show_nothing() {
    let full = scene([mesh("box", true, &cuboid(DVec3::ZERO, DVec3::ONE))]);
    let mut empty = full.clone();
    empty.objects.clear();
    empty.triangles.clear();
    assert_eq!(look(&empty, DVec3::ZERO), Seen::default());
    for eye in [v(f64::NAN, 0.0, 0.0), v(0.0, f64::INFINITY, 0.0)] {
        assert_eq!(look(&full, eye), Seen::default(), "{eye}");
    }
}

#[test]
fn eyes_on_corners_edges_and_faces_lose_nothing() {
    let room = cuboid(v(-2.0, -2.0, -2.0), v(2.0, 2.0, 2.0));
    let (box_at, far) = (cuboid(v(0.0, 0.0, 0.0), v(1.0, 1.0, 1.0)), cuboid(v(-1.5, 1.0, -1.0), v(-1.0, 1.5, 1.5)));
    let scene = scene([mesh("room", true, &room), mesh("box", true, &box_at), mesh("far", true, &far)]);
    for (eye, what) in [
        (v(1.0, 1.0, 1.0), "a corner"),
        (v(1.0, 1.0, 0.5), "an edge"),
        (v(1.0, 0.25, 0.5), "a face"),
        (v(1.0, 0.5, 0.5), "a diagonal"),
        (v(2.0, 0.3, 0.7), "the room's wall"),
        (v(0.0, 0.3, -0.7), "the plane of a face"),
    ] {
        let eye = eye - scene.origin;
        let seen = Judge::new(&ExactScene::new(&scene)).around(eye, MOST_SPLITS);
        assert!(holds_what_rays_see(&scene, &seen, eye, 4000) > 1000, "{what}");
        assert!(seen.visible.len() >= 10, "{what}: {seen:?}");
    }
}

#[test]
fn small_soups_are_what_rays_say() {
    let mut random = Random::new(1);
    for round in 0..60 {
        let size = [0.1, 0.5, 2.0][round % 3];
        let triangles = random_soup(&mut random, 40, size);
        let scene = scene([mesh("soup", true, &triangles)]);
        let eye = v(random.signed(), random.signed(), random.signed()) * 1.2 - scene.origin;
        let seen = Judge::new(&ExactScene::new(&scene)).around(eye, MOST_SPLITS);
        assert!(seen.undecided.is_empty(), "round {round}: {:?}", seen.undecided);
        assert!(holds_what_rays_see(&scene, &seen, eye, 4000) > 100);
    }
}

#[test]
fn slivers_needles_and_fans_lose_nothing() {
    let mut random = Random::new(2);
    let mut needle = |width: f64| {
        let a = random.direction() * random.real(1.0, 3.0);
        [a, a + random.direction() * 2.0, a + random.direction() * width]
    };
    let needles: Vec<Triangle> = (0..1500).map(|i| needle([1e-3, 1e-6, 1e-9][i % 3])).collect();
    // A cone of 3,000 triangles about one corner, a box behind it, and slivers whose planes hold the eye, nearly.
    let around = |i: usize| v(5.0, 0.0, 0.0) + DMat3::from_rotation_x(i as f64 * std::f64::consts::TAU / 3000.0) * DVec3::Y;
    let fan: Vec<Triangle> = (0..3000).map(|i| [v(4.0, 0.1, 0.0), around(i), around((i + 1) % 3000)]).collect();
    let edge_on: Vec<Triangle> = (0..40)
        .map(|i| {
            let at = v(3.0, 1.0 + f64::from(i) * 0.05, 1.0);
            [at, at * 1.5, at + v(0.0, 1e-9 * f64::from(i), 0.2)]
        })
        .collect();
    let scene = scene([
        mesh("needles", true, &needles),
        mesh("fan", true, &fan),
        mesh("behind", true, &cuboid(v(6.0, -0.1, -0.1), v(6.2, 0.1, 0.1))),
        mesh("edge-on", true, &edge_on),
    ]);
    let eye = v(0.01, 0.02, 0.03) - scene.origin;
    let seen = Judge::new(&ExactScene::new(&scene)).around(eye, MOST_SPLITS);
    assert!(holds_what_rays_see(&scene, &seen, eye, 40_000) > 10_000);
    let of_fan =
        seen.triangles().iter().filter(|t| scene.objects[scene.object_of(**t as usize).index()].node == "fan").count();
    assert_eq!(of_fan, 3000, "the whole cone shows its outside");
}

#[test]
fn another_triangle_makes_none_visible() {
    let mut random = Random::new(3);
    for round in 0..40 {
        let triangles = random_soup(&mut random, 60, 0.7);
        let (fewer, more) = (scene([mesh("s", true, &triangles[..59])]), scene([mesh("s", true, &triangles)]));
        let eye = v(random.signed(), random.signed(), random.signed());
        let (few, many) = (look(&fewer, eye).triangles(), look(&more, eye).triangles());
        let new: Vec<u32> = many.into_iter().filter(|&t| t < 59 && few.binary_search(&t).is_err()).collect();
        assert!(new.is_empty(), "round {round}: {new:?}");
    }
}

#[test]
fn more_splits_add_nothing_and_leave_less_undecided() {
    let mut random = Random::new(4);
    let scene = scene([mesh("soup", true, &random_soup(&mut random, 3000, 0.3))]);
    let ready = ExactScene::new(&scene);
    let mut judge = Judge::new(&ready);
    let eye = v(0.1, 0.2, 0.3);
    let mut before = (0..3000).collect::<Vec<u32>>();
    let mut sizes = Vec::new();
    for splits in 0..=10 {
        let seen = judge.around(eye, splits);
        let set = seen.triangles();
        assert!(set.iter().all(|t| before.binary_search(t).is_ok()), "{splits} splits add something");
        sizes.push((set.len(), seen.undecided.len()));
        before = set;
    }
    assert!(sizes[0].0 > 2500 && sizes[0].1 > 2000, "{sizes:?}");
    assert_eq!(sizes[10].1, 0, "{sizes:?}");
    assert_eq!(judge.around(eye, 10), Judge::new(&ready).around(eye, 10), "what was asked before matters");
}

#[test]
fn a_turned_scene_shows_the_same() {
    let mut random = Random::new(6);
    let triangles = random_soup(&mut random, 500, 0.4);
    let eye = v(0.05, -0.1, 0.2);
    // Larger meshes are parted, another way when they are turned.
    let scene_of = |all: &[Triangle]| scene(all.chunks(50).map(|some| mesh("s", true, some)));
    let expected = look(&scene_of(&triangles), eye).triangles();
    assert!(expected.len() > 100 && expected.len() < 450, "{}", expected.len());
    for turn in [DMat3::from_rotation_y(0.7), DMat3::from_rotation_x(2.1) * DMat3::from_rotation_z(-0.4)] {
        let turned: Vec<Triangle> = triangles.iter().map(|t| t.map(|p| turn * p)).collect();
        assert_eq!(look(&scene_of(&turned), turn * eye).triangles(), expected);
    }
}

#[test]
fn a_pyramid_shows_its_part_at_any_opening_angle() {
    let mut random = Random::new(7);
    let scene = scene([mesh("soup", true, &random_soup(&mut random, 800, 0.4))]);
    let (ready, eye) = (ExactScene::new(&scene), v(0.1, 0.2, 0.15));
    let mut judge = Judge::new(&ready);
    let all = judge.around(eye, MOST_SPLITS).triangles();
    let rays = RayScene::new(&scene);
    for degrees in [1e-5, 1e-2, 1.0, 60.0, 120.0, 179.9_f64] {
        let wide = (degrees.to_radians() * 0.5).tan();
        let turn = DMat3::from_rotation_y(0.3) * DMat3::from_rotation_x(0.2);
        let seen = judge.through(eye, [turn.x_axis / wide, turn.y_axis / wide, turn.z_axis], MOST_SPLITS);
        let set = seen.triangles();
        assert!(!set.is_empty() && set.iter().all(|t| all.binary_search(t).is_ok()), "{degrees} degrees");
        for _ in 0..2000 {
            let to = turn * v(random.signed() * wide, random.signed() * wide, 1.0);
            if let Some(hit) = rays.first_opaque(eye, to, f64::INFINITY) {
                assert!(set.binary_search(&hit.triangle).is_ok(), "{degrees} degrees: {hit:?} along {to}");
            }
        }
    }
}

/// A triangle that is seen edge-on isn't hidden where nothing is before it, along an axis or not; behind a plate it is.
#[test]
fn a_triangle_seen_edge_on_is_undecided_unless_it_is_hidden() {
    for turn in [DMat3::IDENTITY, DMat3::from_rotation_y(0.3), DMat3::from_rotation_z(0.7)] {
        let flat = [v(1.0, 0.2, 0.0), v(2.0, 0.5, 0.0), v(1.5, -0.4, 0.0)].map(|p| turn * p);
        let alone = scene([mesh("flat", true, &[flat])]);
        let seen = look(&alone, DVec3::ZERO);
        assert_eq!((seen.visible.len(), seen.undecided), (0, vec![0]), "{turn}");
        let before: Vec<Triangle> = plate(0.5, [-1.0, -1.0], [1.0, 1.0]).iter().map(|t| t.map(|p| turn * p)).collect();
        let behind = scene([mesh("flat", true, &[flat]), mesh("plate", true, &before)]);
        assert_eq!(names(&behind, DVec3::ZERO), ["plate"], "{turn}");
    }
}
