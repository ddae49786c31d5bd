//! What stands within a cell hides, too: two rooms with a door between them, and a cupboard behind which a box stands.

use enfilade::cells::Strategy;
use enfilade::job::Job;
use enfilade::pvs::{Pvs, PvsOptions, bake};
use enfilade::scene::{Mesh, Scene};
use testing::meshes::solid;
use testing::rooms::row;

/// A bake of two rooms in a row with `extra` in the second, whose door is at x = 4.2, z = 1.8 to 2.7.
fn baked(extra: Vec<Mesh>, ray_budget: u64) -> (Scene, Pvs) {
    let (scene, graph) = row(2, extra, &[]);
    let pvs = bake(&scene, graph, &PvsOptions { ray_budget, ..PvsOptions::default() }, &Job::quiet()).unwrap();
    assert_eq!((pvs.repairs.len(), pvs.stats.contradictions), (0, 0));
    (scene, pvs)
}

/// Whether the first room is proven to see an object, and whether it is not proven not to.
fn seen(scene: &Scene, pvs: &Pvs, node: &str) -> (bool, bool) {
    let object = scene.objects.iter().position(|o| o.node == node).expect("an object of that name");
    (pvs.objects_lower.get(0, object), pvs.objects_upper.get(0, object))
}

fn hidden() -> Mesh {
    solid("hidden", [7.0, 0.0, 2.1], [7.2, 0.3, 2.4])
}

fn beside() -> Mesh {
    solid("beside", [7.0, 0.0, 0.05], [7.2, 0.3, 0.3])
}

#[test]
fn a_cupboard_hides_what_stands_behind_it() {
    // 2.5 m high in a room of 2.6 m, and the door's head is at 2.1 m: nothing behind it is seen over it.
    let cupboard = || solid("cupboard", [6.0, 0.0, 0.9], [6.4, 2.5, 3.4]);
    let (scene, pvs) = baked(vec![cupboard(), hidden(), beside()], 0);
    assert_eq!(seen(&scene, &pvs, "hidden"), (false, true), "portals don't tell");
    let (scene, pvs) = baked(vec![cupboard(), hidden(), beside()], 2_000_000);
    assert_eq!(seen(&scene, &pvs, "hidden"), (false, false));
    assert_eq!(seen(&scene, &pvs, "beside"), (true, true));
    assert_eq!(seen(&scene, &pvs, "cupboard"), (true, true));
}

#[test]
fn crates_that_touch_hide_as_one() {
    let crates = (0..5).flat_map(|i| {
        let z = 0.9 + 0.5 * f64::from(i);
        // Staggered, so that no corner meets another.
        let split = 1.0 + 0.2 * f64::from(i % 2);
        [
            solid(&format!("low {i}"), [6.0, 0.0, z], [6.4, split, z + 0.5]),
            solid(&format!("high {i}"), [6.0, split, z], [6.4, 2.5, z + 0.5]),
        ]
    });
    let (scene, pvs) = baked(crates.chain([hidden(), beside()]).collect(), 2_000_000);
    assert_eq!(seen(&scene, &pvs, "hidden"), (false, false));
    assert_eq!(seen(&scene, &pvs, "beside"), (true, true));
}

#[test]
fn a_slit_in_it_does_not() {
    // 5 mm wide; the scene's clearance is 0.1 mm.
    let slit = vec![
        solid("south", [6.0, 0.0, 0.9], [6.4, 2.5, 2.25]),
        solid("north", [6.0, 0.0, 2.255], [6.4, 2.5, 3.4]),
        hidden(),
    ];
    for rays in [0, 1000, 2_000_000] {
        let (scene, pvs) = baked(slit.clone(), rays);
        assert!(seen(&scene, &pvs, "hidden").1, "{rays} rays");
    }
}

#[test]
fn through_a_declared_keyhole_slits_of_any_width_count() {
    // Two leaves leave 0.15 mm of the door, less than twice the clearance, and that is declared.
    let leaf = |name, z: [f64; 2]| solid(name, [4.2, 0.0, z[0]], [4.4, 2.1, z[1]]);
    let leaves = [leaf("left", [1.8, 2.249925]), leaf("right", [2.250075, 2.7])];
    let keyhole = |extra: Vec<Mesh>| {
        let (scene, mut graph) = row(2, extra.into_iter().chain(leaves.clone()), &[]);
        graph.strategy = Strategy::Given;
        let middle = 2.25 - scene.origin.z;
        for corner in &mut graph.portals[0].winding {
            corner.z = middle + 0.75e-4 * (corner.z - middle).signum();
        }
        let options = PvsOptions { ray_budget: 2_000_000, ..PvsOptions::default() };
        let pvs = bake(&scene, graph, &options, &Job::quiet()).unwrap();
        seen(&scene, &pvs, "hidden").1
    };
    let half = |name, z: [f64; 2]| solid(name, [6.0, 0.0, z[0]], [6.4, 2.5, z[1]]);
    assert!(!keyhole(vec![half("cupboard", [0.9, 3.4]), hidden()]));
    assert!(keyhole(vec![half("south", [0.9, 2.24992]), half("north", [2.25007, 3.4]), hidden()]));
}
