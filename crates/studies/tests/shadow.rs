//! Shadow frusta: scenes whose answer is known, and the exact judge from a point.

use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::occlusion::view::View;
use enfilade::scene::{ImportOptions, Mesh, Role, Scene};
use enfilade_formats::import;
use enfilade_measure::exact::{ExactScene, Judge, MOST_SPLITS};
use enfilade_scenes::{Kind, generate};
use enfilade_studies::shadow_frusta::{Occluders, ShadowCuller};
use glam::{DMat3, DVec3};
use testing::meshes::{Triangle, cuboid, halves, scene, solid, soup};
use testing::random::Random;

const NEAR: f64 = 0.05;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// An upright rectangle at `x`, from `a` to `b` in y and z.
fn plate(x: f64, a: [f64; 2], b: [f64; 2]) -> Vec<Triangle> {
    halves(&[[v(x, a[0], a[1]), v(x, b[0], a[1]), v(x, b[0], b[1]), v(x, a[0], b[1])]])
}

fn mesh(node: &str, opaque: bool, corners: &[Triangle]) -> Mesh {
    soup(node, Role::Unknown, opaque, corners)
}

/// Names of what is taken, looking from `eye` along +X, 90 degrees upwards; and how many shadows there were.
fn names(scene: &Scene, eye: DVec3, near: f64) -> (Vec<&str>, usize) {
    let (tree, occluders) = (Hierarchy::build(scene, &HierarchyOptions::default()), Occluders::find(scene));
    let eye = eye - scene.origin;
    let view = View::look_at(eye, eye + DVec3::X, 90f64.to_radians(), 1.0, near);
    let mut culler = ShadowCuller::new(8);
    let mut taken = culler.cull(&tree, &occluders, &view).to_vec();
    taken.sort_unstable();
    (taken.into_iter().map(|o| scene.objects[o.index()].node.as_str()).collect(), culler.shadows())
}

/// A wall of 4 x 4 m 2 m away throws a shadow that at 4 m is 8 x 8 m.
fn behind_a_wall(opaque: bool) -> Scene {
    scene([
        mesh("wall", opaque, &plate(2.0, [-2.0, -2.0], [2.0, 2.0])),
        mesh("in the middle", true, &cuboid(v(4.0, -1.0, -1.0), v(5.0, 1.0, 1.0))),
        mesh("just inside", true, &cuboid(v(4.0, 3.0, -1.0), v(4.1, 3.999, 1.0))),
        mesh("a millimetre out", true, &cuboid(v(4.0, 3.0, -1.0), v(4.1, 4.001, 1.0))),
        mesh("before", true, &cuboid(v(1.0, -0.1, -0.1), v(1.1, 0.1, 0.1))),
        mesh("in the wall's plane", true, &plate(2.0, [-1.0, -1.0], [1.0, 1.0])),
        mesh("through the wall", true, &cuboid(v(1.9, 0.2, 0.2), v(2.5, 0.4, 0.4))),
    ])
}

#[test]
fn a_wall_hides_what_is_in_its_shadow_and_nothing_beside_it() {
    let scene = behind_a_wall(true);
    let (taken, shadows) = names(&scene, DVec3::ZERO, NEAR);
    assert_eq!(taken, ["wall", "a millimetre out", "before", "in the wall's plane", "through the wall"]);
    assert!(shadows > 0);
}

#[test]
fn glass_hides_nothing() {
    let scene = behind_a_wall(false);
    // The small plate in its plane still hides the middle, and that alone.
    let taken = names(&scene, DVec3::ZERO, NEAR).0;
    let expected = ["wall", "just inside", "a millimetre out", "before", "in the wall's plane", "through the wall"];
    assert_eq!(taken, expected);
}

#[test]
fn a_wall_that_the_near_plane_cuts_or_that_the_eye_is_in_the_plane_of_hides_nothing() {
    let wall = mesh("wall", true, &plate(2.0, [-2.0, -2.0], [2.0, 2.0]));
    let behind = mesh("behind", true, &cuboid(v(4.0, -1.0, -1.0), v(5.0, 1.0, 1.0)));
    let scene = scene([wall, behind]);
    assert_eq!(names(&scene, DVec3::ZERO, NEAR).0, ["wall"]);
    // The farthest corner of the screen is sqrt(3) times as far away as the near plane.
    assert_eq!(names(&scene, DVec3::ZERO, 1.15).0, ["wall"]);
    assert_eq!(names(&scene, DVec3::ZERO, 1.16).0, ["wall", "behind"]);
    for off in [0.0, 1e-12, 1e-6, 0.01] {
        assert!(names(&scene, v(2.0 - off, 0.3, 0.2), NEAR).0.contains(&"behind"), "{off} m before the wall");
    }
}

#[test]
fn sides_of_a_box_hide_together_what_neither_hides_alone() {
    // Seen along a diagonal, it is 2.8 m wide; neither side is more than half of that.
    let turn = DMat3::from_rotation_y(std::f64::consts::FRAC_PI_4);
    let turned: Vec<Triangle> =
        cuboid(v(-1.0, -1.0, -1.0), v(1.0, 1.0, 1.0)).iter().map(|t| t.map(|p| turn * p + v(5.0, 0.0, 0.0))).collect();
    let scene = scene([
        mesh("box", true, &turned),
        solid("behind", [9.0, -0.5, -1.0], [9.5, 0.5, 1.0]),
        solid("above", [9.0, 2.5, -1.0], [9.5, 3.5, 1.0]),
    ]);
    let occluders = Occluders::find(&scene);
    assert_eq!(occluders.count(), 3, "a box is one occluder");
    assert_eq!(names(&scene, DVec3::ZERO, NEAR).0, ["box", "above"]);
}

#[test]
fn walls_around_the_eye_hide_what_is_outside() {
    // A shell whose triangles face outwards, seen from inside; and one that faces inwards.
    let shell = cuboid(v(-3.0, -3.0, -3.0), v(3.0, 3.0, 3.0));
    let inwards: Vec<Triangle> = shell.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    for triangles in [shell, inwards] {
        let scene = scene([mesh("room", true, &triangles), solid("outside", [6.0, -1.0, -1.0], [7.0, 1.0, 1.0])]);
        assert_eq!(names(&scene, v(0.1, 0.2, 0.3), NEAR).0, ["room"]);
    }
}

/// A wall of ten strips is one occluder, and one that lacks a strip hides nothing through the gap.
#[test]
fn a_wall_of_strips_is_one_occluder_and_a_gap_is_open() {
    let wall = |gap: i32| {
        let strip = |y: i32| plate(2.0, [f64::from(y) * 0.4 - 2.0, -2.0], [f64::from(y + 1) * 0.4 - 2.0, 2.0]);
        mesh("wall", true, &(0..10).filter(|&y| y != gap).flat_map(strip).collect::<Vec<_>>())
    };
    let behind = || mesh("behind", true, &plate(4.0, [0.1, 0.1], [0.7, 0.7]));
    let whole = scene([wall(-1), behind()]);
    assert_eq!(Occluders::find(&whole).count(), 2);
    assert_eq!(names(&whole, DVec3::ZERO, NEAR).0, ["wall"]);
    let open = scene([wall(5), behind()]);
    assert_eq!(Occluders::find(&open).count(), 3);
    assert_eq!(names(&open, DVec3::ZERO, NEAR).0, ["wall", "behind"]);
}

/// Asserts that nothing with a witness is dropped, in two directions from each of some eyes. How many objects of the frusta
/// are.
fn nothing_seen_is_dropped(scene: &Scene, eyes: &[DVec3]) -> [usize; 2] {
    let (tree, occluders) = (Hierarchy::build(scene, &HierarchyOptions::default()), Occluders::find(scene));
    let ready = ExactScene::new(scene);
    let (mut judge, mut all, mut few) = (Judge::new(&ready), ShadowCuller::new(0), ShadowCuller::new(24));
    let mut sums = [0; 2];
    for &eye in eyes {
        let seen = judge.around(eye, MOST_SPLITS);
        for to in [v(0.9, -0.1, 0.4), v(-0.4, 0.05, -0.9)] {
            let view = View::look_at(eye, eye + to, 1.8, 1.5, 1e-3);
            let mut taken = few.cull(&tree, &occluders, &view).to_vec();
            let inside = all.cull(&tree, &occluders, &view).to_vec();
            taken.sort_unstable();
            for witness in &seen.visible {
                let [x, y, w] = [view.x, view.y, view.w].map(|row| row.dot(witness.direction));
                let object = scene.object_of(witness.triangle as usize);
                if x.abs() < w && y.abs() < w && inside.contains(&object) {
                    assert!(taken.binary_search(&object).is_ok(), "{object} is dropped from {eye}");
                }
            }
            sums[0] += inside.len();
            sums[1] += inside.len() - taken.len();
        }
    }
    sums
}

#[test]
fn no_object_with_a_witness_is_dropped_in_an_office() {
    let made = generate(Kind::Office { rooms: 6, storeys: None, furnished: true }, 0).unwrap();
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("shadow-office.glb");
    std::fs::write(&path, &made.glb).unwrap();
    let scene = import(&path, &ImportOptions::default()).unwrap();
    let (bounds, mut random) = (scene.bounds().inflated(1.0), Random::new(1));
    let eyes: Vec<DVec3> = (0..100)
        .map(|_| {
            let share = v(random.real(0.0, 1.0), random.real(0.0, 1.0), random.real(0.0, 1.0));
            bounds.min + bounds.size() * share
        })
        .collect();
    let [inside, dropped] = nothing_seen_is_dropped(&scene, &eyes);
    assert!(dropped * 10 > inside, "{dropped} of {inside} objects: a test of little");
}

/// Boxes at random, turned, some of them overlapping; eyes on corners and in planes of faces, too.
#[test]
fn no_object_with_a_witness_is_dropped_among_turned_boxes() {
    let mut random = Random::new(2);
    let mut meshes = Vec::new();
    for i in 0..120 {
        let half = match i % 3 {
            0 => v(0.02, random.real(1.0, 3.0), random.real(1.0, 3.0)),
            _ => v(random.real(0.1, 0.8), random.real(0.1, 0.8), random.real(0.1, 0.8)),
        };
        let turn = DMat3::from_axis_angle(random.direction(), random.real(0.0, 6.0));
        let at = random.direction() * random.real(1.0, 10.0);
        let corners: Vec<Triangle> = cuboid(-half, half).iter().map(|t| t.map(|p| turn * p + at)).collect();
        meshes.push(mesh(&format!("box {i}"), i % 10 != 9, &corners));
    }
    let scene = scene(meshes);
    let eyes: Vec<DVec3> = (0..100)
        .map(|i| {
            let [a, b, c] = scene.corners(random.below(scene.triangles.len()));
            match i % 4 {
                0 => a,
                1 => a + (b - a) * 2.0 + (c - a) * 1.5,
                _ => random.direction() * random.real(0.0, 9.0),
            }
        })
        .collect();
    let [inside, dropped] = nothing_seen_is_dropped(&scene, &eyes);
    assert!(dropped * 20 > inside, "{dropped} of {inside} objects: a test of little");
}
