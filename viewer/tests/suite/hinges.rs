//! Hinges of leaves that were modelled by hand, whose axes are known; frames that stay where they are; leaves that are made.

use enfilade::math::geom::Aabb;
use enfilade::scene::{Role, Scene};
use enfilade_viewer::doors::hinge::Motion;
use enfilade_viewer::doors::leaves::{Leaf, leaves};
use enfilade_viewer::doors::opening::Opening;
use enfilade_viewer::doors::pieces::pieces;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use testing::boxes::p;
use testing::meshes::{self, cuboid, soup};

/// Doors, each a mesh of boxes.
fn scene(doors: &[Vec<[DVec3; 2]>]) -> Scene {
    let boxes = |door: &[[DVec3; 2]]| door.iter().flat_map(|&[min, max]| cuboid(min, max)).collect::<Vec<_>>();
    meshes::scene(doors.iter().map(|door| soup("door", Role::Door, true, &boxes(door))))
}

/// A doorway from x = 0 to `width`, y = 0 to 2.1 m, in the plane z = 0; its leaves, of which everything is in the model's coordinates.
fn hung(width: f64, doors: &[Vec<[DVec3; 2]>], is_shut: bool) -> (Opening, Vec<Leaf>, DVec3) {
    let scene = scene(doors);
    let winding = [(0.0, 0.0), (width, 0.0), (width, 2.1), (0.0, 2.1)];
    let winding = winding.map(|(x, y)| DVec3::new(x, y, 0.0) - scene.origin).to_vec();
    let opening = Opening::new(&[winding], DVec3::Z, 0.002);
    let all = pieces(&scene);
    let found = leaves(&opening, &all.iter().collect::<Vec<_>>(), is_shut);
    (opening, found, scene.origin)
}

/// Around a leaf, as it is open by a share.
fn around(leaf: &Leaf, share: f64, origin: DVec3) -> Aabb {
    Aabb::of(leaf.facets.iter().flat_map(|f| f.corners).map(|c| leaf.motion.place(c, share) + origin))
}

/// Where the axis is.
fn axis(leaf: &Leaf, origin: DVec3) -> DVec3 {
    match leaf.motion {
        Motion::Swing { axis, .. } => axis + origin,
        Motion::Slide { .. } => panic!("it slides: {:?}", leaf.motion),
    }
}

#[test]
fn a_leaf_hangs_from_the_jamb_that_its_edge_is_at() {
    // 3 cm of air at the lock.
    for (from, to, hinge) in [(0.0, 0.87, 0.0), (0.03, 0.9, 0.9)] {
        let (_, leaves, origin) = hung(0.9, &[vec![[p(from, 0.0, -0.02), p(to, 2.1, 0.02)]]], true);
        let [leaf] = &leaves[..] else { panic!("{} leaves", leaves.len()) };
        assert!((axis(leaf, origin).x - hinge).abs() < 0.025 && axis(leaf, origin).z.abs() < 1e-6, "{}", axis(leaf, origin));
        // Open by a quarter turn, it stands in the doorway beside its jamb, on one side of the wall.
        let open = around(leaf, 1.0, origin);
        assert!((open.size().x - 0.04).abs() < 1e-6 && (open.size().z - 0.87).abs() < 1e-6, "{open:?}");
        assert!((open.centre().x - hinge).abs() < 0.025 && open.min.x > -1e-6 && open.max.x < 0.9 + 1e-6, "{open:?}");
        assert!(around(leaf, 0.0, origin).size().x > 0.8);
    }
}

#[test]
fn a_leaf_opens_away_to_either_side() {
    let (_, mut leaves, origin) = hung(0.9, &[vec![[p(0.0, 0.0, -0.02), p(0.87, 2.1, 0.02)]]], true);
    for (is_forward, side) in [(true, 1.0), (false, -1.0)] {
        leaves[0].motion.open_to(is_forward);
        let open = around(&leaves[0], 1.0, origin);
        assert!(open.centre().z * side > 0.4, "to {side}: {open:?}");
        // Half open is half a quarter turn.
        let half = around(&leaves[0], 0.5, origin);
        assert!((half.size().x - half.size().z).abs() < 1e-6 && half.centre().z * side > 0.2, "{half:?}");
    }
}

#[test]
fn a_handle_tells_where_no_hinge_is() {
    for (handle, hinge) in [(0.1, 0.9), (0.8, 0.0)] {
        let leaf = [p(0.0, 0.0, -0.02), p(0.9, 2.1, 0.02)];
        let knob = [p(handle - 0.02, 1.0, 0.03), p(handle + 0.02, 1.04, 0.07)];
        let (_, leaves, origin) = hung(0.9, &[vec![leaf, knob]], true);
        assert_eq!((leaves.len(), leaves[0].facets.len()), (1, 24), "the handle goes with the leaf");
        assert!((axis(&leaves[0], origin).x - hinge).abs() < 0.025, "{}", axis(&leaves[0], origin));
    }
}

#[test]
fn two_leaves_hang_from_a_jamb_each() {
    let halves = [[p(0.0, 0.0, -0.02), p(0.79, 2.1, 0.02)], [p(0.81, 0.0, -0.02), p(1.6, 2.1, 0.02)]];
    // In one mesh, or in two.
    for doors in [vec![halves.to_vec()], halves.iter().map(|half| vec![*half]).collect()] {
        let (_, mut leaves, origin) = hung(1.6, &doors, true);
        leaves.sort_by(|a, b| axis(a, origin).x.total_cmp(&axis(b, origin).x));
        let at: Vec<f64> = leaves.iter().map(|leaf| axis(leaf, origin).x).collect();
        assert!(at.len() == 2 && at[0].abs() < 0.025 && (at[1] - 1.6).abs() < 0.025, "{at:?}");
        // Both to one side.
        assert!(leaves.iter().all(|leaf| around(leaf, 1.0, origin).centre().z > 0.3), "forward");
    }
}

#[test]
fn a_frame_stays_where_it_is() {
    // Jambs and a lintel whose inner edges are the leaf's: one mesh, and edges of four triangles.
    let frame = [
        [p(-0.06, 0.0, -0.05), p(0.0, 2.1, -0.02)],
        [p(0.9, 0.0, -0.05), p(0.96, 2.1, -0.02)],
        [p(-0.06, 2.1, -0.05), p(0.96, 2.16, -0.02)],
    ];
    let leaf = [p(0.0, 0.0, -0.02), p(0.9, 2.1, 0.02)];
    let (_, leaves, origin) = hung(0.9, &[[&frame[..], &[leaf]].concat()], true);
    assert_eq!((leaves.len(), leaves[0].facets.len()), (1, 12));
    let shut = around(&leaves[0], 0.0, origin);
    assert!(shut.min.distance(leaf[0]) < 1e-6 && shut.max.distance(leaf[1]) < 1e-6, "{shut:?}");
}

#[test]
fn a_leaf_that_was_modelled_open_finds_its_doorway() {
    // It stands at a right angle, at either jamb, to either side.
    for (x, hinge) in [(0.02, 0.0), (0.88, 0.9)] {
        for side in [1.0, -1.0] {
            let (a, b) = (p(x - 0.02, 0.0, 0.01 * side), p(x + 0.02, 2.1, 0.88 * side));
            let (_, leaves, origin) = hung(0.9, &[vec![[a.min(b), a.max(b)]]], false);
            assert_eq!(leaves.len(), 1);
            assert!((axis(&leaves[0], origin).x - hinge).abs() < 0.025, "{}", axis(&leaves[0], origin));
            let (open, shut) = (around(&leaves[0], 1.0, origin), around(&leaves[0], 0.0, origin));
            assert!(open.min.distance(a.min(b)) < 1e-6, "it is open where it was modelled: {open:?}");
            assert!(shut.size().x > 0.86 && shut.size().z < 0.05, "{shut:?}");
            assert!(shut.min.x > -0.03 && shut.max.x < 0.93 && shut.centre().z.abs() < 0.05, "{shut:?}");
        }
    }
}

#[test]
fn blocks_and_hatches_slide() {
    // A block as thick as a level's door goes up by its height.
    let (_, leaves, origin) = hung(1.2, &[vec![[p(0.0, 0.0, -0.4), p(1.2, 2.1, 0.4)]]], true);
    let Motion::Slide { .. } = leaves[0].motion else { panic!("{:?}", leaves[0].motion) };
    assert!((around(&leaves[0], 1.0, origin).min.y - 2.1).abs() < 1e-6);
    // A hatch of 1 m in the floor, its lid flush with it: it leaves the hole beside it.
    let scene = scene(&[vec![[p(0.0, -0.04, 0.0), p(1.0, 0.0, 1.0)]]]);
    let winding = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, z)| p(x, 0.0, z) - scene.origin).to_vec();
    let hatch = Opening::new(&[winding], DVec3::Y, 0.002);
    let all = pieces(&scene);
    let found = leaves_of(&hatch, &all);
    let (shut, open) = (around(&found, 0.0, scene.origin), around(&found, 1.0, scene.origin));
    assert!(!hatch.is_upright && (open.centre() - shut.centre()).length() > 0.99 && open.size() == shut.size(), "{open:?}");
    assert!((open.centre() - shut.centre()).y.abs() < 1e-9);
}

fn leaves_of(opening: &Opening, all: &[enfilade_viewer::doors::pieces::Piece]) -> Leaf {
    let mut found = leaves(opening, &all.iter().collect::<Vec<_>>(), true);
    assert_eq!(found.len(), 1);
    found.remove(0)
}

#[test]
fn a_doorway_without_a_leaf_gets_one_that_covers_it() {
    for (width, count) in [(0.9, 1), (1.8, 2), (4.0, 1)] {
        let opening = {
            let winding = [(0.0, 0.0), (width, 0.0), (width, 2.1), (0.0, 2.1)].map(|(x, y)| p(x, y, 0.0)).to_vec();
            Opening::new(&[winding], DVec3::Z, 0.002)
        };
        let made = leaves(&opening, &[], false);
        assert_eq!(made.len(), count, "{width} m");
        let shut = made.iter().map(|leaf| around(leaf, 0.0, DVec3::ZERO)).fold(Aabb::EMPTY, Aabb::union);
        assert!(shut.min.x <= 0.0 && shut.max.x >= width && shut.min.y <= 0.0 && shut.max.y >= 2.1, "{shut:?}");
        assert!((shut.size().z - 0.04).abs() < 1e-9, "four centimetres: {shut:?}");
        // Open, no leaf is before the middle of either half.
        for leaf in &made {
            let open = around(leaf, 1.0, DVec3::ZERO);
            let is_before = |x: f64| open.min.x < x && open.max.x > x && open.min.y < 1.0 && open.max.y > 1.0;
            assert!(!is_before(0.25 * width) && !is_before(0.75 * width), "{width} m: {open:?}");
        }
        if let Motion::Swing { open, .. } = made[0].motion {
            assert!((open.abs() - FRAC_PI_2).abs() < 1e-9);
        }
    }
}
