//! The lower bound: rays, clearance, placement, witnesses, repairs, each against what is known without them.

use enfilade::cells::{Locator, place_objects};
use enfilade::job::Job;
use enfilade::math::geom::Aabb;
use enfilade::pvs::{Pvs, PvsOptions, bake};
use enfilade::scene::rays::{Hit, RayScene};
use enfilade::scene::{ImportOptions, Mesh, Role, Scene};
use enfilade::{CellId, ObjectId};
use enfilade_formats::import;
use glam::DVec3;
use std::path::{Path, PathBuf};
use testing::bakes::on;
use testing::data::data;
use testing::meshes::{scene, solid, soup as mesh};
use testing::plain::{meets, nearest};
use testing::random::Places;
use testing::rooms;

/// A place in a cube of this side around the origin.
fn place(random: &mut Places, side: f64) -> DVec3 {
    random.point() * (side / 2.0)
}

/// Objects of ten random triangles each, every third one see-through.
fn soup(random: &mut Places, objects: usize, extent: f64) -> Scene {
    scene((0..objects).map(|i| {
        let triangles: Vec<[DVec3; 3]> = (0..10)
            .map(|_| {
                let p = place(random, extent);
                [p, p + place(random, 0.3 * extent), p + place(random, 0.3 * extent)]
            })
            .collect();
        mesh(&format!("soup {i}"), Role::Unknown, i % 3 != 0, &triangles)
    }))
}

fn opaque_triangles(scene: &Scene) -> Vec<usize> {
    scene.objects.iter().filter(|o| o.opaque).flat_map(|o| o.triangles.clone()).map(|t| t as usize).collect()
}

#[test]
fn rays_hit_what_a_loop_over_all_triangles_hits_at_every_scale() {
    for extent in [1e-3, 30.0, 1e5] {
        let mut random = Places::new(7);
        let scene = soup(&mut random, 60, extent);
        let rays = RayScene::new(&scene);
        let opaque = opaque_triangles(&scene);
        let mut hits = 0;
        for i in 0..3000 {
            // From inside, and from far away.
            let origin = place(&mut random, extent * if i % 4 == 0 { 1000.0 } else { 1.5 });
            let direction = (place(&mut random, extent) - origin) * random.unit();
            let limit = if i % 2 == 0 { f64::INFINITY } else { 1.0 };
            let of = |t: usize| meets(origin, direction, scene.corners(t)).filter(|&x| x <= limit).map(|x| (x, t));
            let first = opaque.iter().filter_map(|&t| of(t)).min_by(|a, b| a.0.total_cmp(&b.0));
            let found = rays.first_opaque(origin, direction, limit);
            assert_eq!(found.map(|h| h.triangle as usize), first.map(|f| f.1), "extent {extent} ray {i}");
            if let (Some(h), Some((t, triangle))) = (found, first) {
                assert!((h.t - t).abs() <= 1e-9 * t.max(1.0) && h.object == scene.object_of(triangle));
                hits += 1;
            }
            let mut passed = Vec::new();
            rays.see_through(origin, direction, limit, &mut passed);
            let glass = (0..scene.objects.len()).filter(|&o| !scene.objects[o].opaque);
            let mut expected: Vec<(f64, usize)> = glass
                .filter_map(|o| {
                    let range = scene.objects[o].triangles.clone();
                    range.filter_map(|t| of(t as usize)).map(|f| f.0).min_by(f64::total_cmp).map(|t| (t, o))
                })
                .collect();
            expected.sort_by(|a, b| a.0.total_cmp(&b.0));
            assert_eq!(
                passed.iter().map(|h: &Hit| h.object.index()).collect::<Vec<_>>(),
                expected.iter().map(|e| e.1).collect::<Vec<_>>()
            );
        }
        assert!(hits > 500, "{hits} hits at extent {extent}");
    }
}

#[test]
fn a_closed_surface_leaks_no_ray_at_its_edges_and_corners() {
    let scene = scene([rooms::ball("ball", DVec3::new(0.3, 0.7, -0.2), 1.7, 9)]);
    let rays = RayScene::new(&scene);
    let mut random = Places::new(3);
    for triangle in 0..scene.triangles.len() {
        let [a, b, c] = scene.corners(triangle);
        for target in [a, b, c, a.midpoint(b), b.midpoint(c), c.midpoint(a), a.lerp(b, random.unit())] {
            let from = place(&mut random, 1.0);
            assert!(rays.first_opaque(from, target - from, f64::INFINITY).is_some(), "out through triangle {triangle}");
            assert!(rays.first_opaque(target + (target - from) * 50.0, from - target, f64::INFINITY).is_some());
        }
    }
}

#[test]
fn clearance_agrees_with_distances_measured_point_by_point() {
    let mut random = Places::new(11);
    let scene = soup(&mut random, 40, 20.0);
    let rays = RayScene::new(&scene);
    let opaque = opaque_triangles(&scene);
    let (mut clear, mut blocked) = (0, 0);
    for i in 0..1000 {
        let a = place(&mut random, 20.0);
        let b = if i % 10 == 0 { a } else { a + place(&mut random, 6.0) };
        let clearance = 0.6 * random.unit();
        let steps = 200;
        let nearest = (0..=steps)
            .map(|k| a.lerp(b, f64::from(k) / f64::from(steps)))
            .flat_map(|p| opaque.iter().map(move |&t| (p, t)))
            .filter(|&(p, t)| Aabb::of(scene.corners(t)).inflated(1.0).contains(p))
            .map(|(p, t)| nearest(scene.corners(t), p).distance(p))
            .fold(1.0, f64::min);
        // The nearest point lies within half a step of one that was measured.
        let step = a.distance(b) / f64::from(steps) * 0.5;
        if nearest <= clearance {
            assert!(!rays.keeps_clearance(a, b, clearance));
            blocked += 1;
        } else if nearest - step > clearance {
            assert!(rays.keeps_clearance(a, b, clearance));
            clear += 1;
        }
    }
    assert!(clear > 100 && blocked > 100, "{clear} clear, {blocked} blocked");
}

#[test]
fn no_segment_is_clear_through_a_crack_and_one_may_end_on_its_target() {
    // A wall of two panels with a 0.1 mm crack at x = 0 (tolerance at this size: 0.15 mm), a plate behind it.
    let panels =
        [solid("left", [-5.0, 0.0, 0.0], [-0.000_05, 3.0, 0.1]), solid("right", [0.000_05, 0.0, 0.0], [5.0, 3.0, 0.1])];
    let scene = scene(panels.into_iter().chain([solid("plate", [-1.0, 1.0, 4.0], [1.0, 2.0, 4.1])]));
    let rays = RayScene::new(&scene);
    let clearance = scene.tolerance().clearance;
    let (from, to) = (DVec3::new(0.0, 1.5, -3.0) - scene.origin, DVec3::new(0.0, 1.5, 4.0) - scene.origin);
    let plate = Some(ObjectId(2));
    assert_eq!(rays.first_opaque(from, to - from, 2.0).map(|h| h.object), plate, "the crack is open to a ray");
    assert!(!rays.is_clear(from, to, clearance, plate));
    let past = DVec3::new(0.0, 1.5, 0.2) - scene.origin;
    assert!(rays.is_clear(past, to, clearance, plate));
    assert!(rays.is_clear(past, to, clearance, None), "ends on the surface");
    assert!(!rays.is_clear(past, to + DVec3::Z * 0.05, clearance, None), "ends in the plate");
    assert!(rays.is_clear(past, to + DVec3::Z * 0.05, clearance, plate), "an object does not hide itself");
    assert!(!rays.is_clear(past, DVec3::NAN, clearance, None));
}

#[test]
fn placement_is_triangle_box_overlap() {
    let mut random = Places::new(5);
    let scene = soup(&mut random, 300, 10.0);
    let boxes: Vec<Aabb> = (0..60).map(|_| Aabb::of([place(&mut random, 10.0), place(&mut random, 10.0)])).collect();
    let pieces = boxes.iter().map(|b| vec![rooms::box_piece(b.min.into(), b.max.into(), DVec3::ZERO)]).collect();
    let graph = rooms::graph(pieces, Vec::new());
    let (mut set, mut held) = (0, 0);
    for margin in [0.0, 0.25] {
        let placement = place_objects(&scene, &graph, margin);
        // A point of an object that is in a cell is in the object's box there, and boxes are much less than the objects'.
        let placed = placement.boxes.as_ref().expect("triangles reach beyond small cells");
        assert_eq!(placed.len() as u64, placement.matrix.count_ones());
        let pairs = (0..boxes.len()).flat_map(|cell| placement.matrix.ones(cell).map(move |object| (cell, object)));
        for ((cell, object), placed) in pairs.zip(placed) {
            let part = placed.of_box(scene.objects[object].bounds);
            for t in scene.objects[object].triangles.clone() {
                let [a, b, c] = scene.corners(t as usize);
                for (i, j) in (0..=8).flat_map(|i| (0..=8 - i).map(move |j| (f64::from(i) / 8.0, f64::from(j) / 8.0))) {
                    let p = a + (b - a) * i + (c - a) * j;
                    if boxes[cell].contains(p) {
                        assert!(part.inflated(1e-9).contains(p), "cell {cell} object {object}: {p} is not in {part:?}");
                        held += 1;
                    }
                }
            }
        }
        for (cell, bounds) in boxes.iter().enumerate() {
            for (object, o) in scene.objects.iter().enumerate() {
                let expected = o.triangles.clone().any(|t| overlaps(scene.corners(t as usize), bounds.inflated(margin)));
                assert_eq!(placement.matrix.get(cell, object), expected, "cell {cell} object {object} margin {margin}");
                set += usize::from(expected);
            }
        }
    }
    assert!(set > 1000 && set < 30_000 && held > 10_000, "{set} pairs, {held} points");
}

/// Triangle and box by separating axes (Akenine-Möller 2001).
fn overlaps(corners: [DVec3; 3], bounds: Aabb) -> bool {
    let (half, t) = (bounds.size() * 0.5, corners.map(|p| p - bounds.centre()));
    let edges = [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let crossed = axes.iter().flat_map(|a| edges.iter().map(move |e| a.cross(*e)));
    axes.iter().copied().chain([edges[0].cross(edges[1])]).chain(crossed).all(|axis| {
        let (low, high) =
            t.iter().map(|p| p.dot(axis)).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let reach = half.dot(axis.abs());
        low <= reach && high >= -reach
    })
}

fn options(ray_budget: u64) -> PvsOptions {
    PvsOptions { ray_budget, ..PvsOptions::default() }
}

fn object(scene: &Scene, node: &str) -> usize {
    scene.objects.iter().position(|o| o.node == node).expect("an object of this name")
}

/// What holds for every bake: lower within upper, a checked witness for every pair of lower, in order.
fn assert_proven(scene: &Scene, pvs: &Pvs) {
    let graph = &pvs.graph;
    assert_eq!(pvs.objects_lower.first_outside(&pvs.objects_upper), None);
    assert_eq!(pvs.cells_lower.first_outside(&pvs.cells_upper), None);
    let pairs: Vec<(usize, usize)> =
        (0..graph.cells.len()).flat_map(|c| pvs.objects_lower.ones(c).map(move |o| (c, o))).collect();
    assert_eq!(pvs.witnesses.iter().map(|w| (w.cell.index(), w.object.index())).collect::<Vec<_>>(), pairs);
    let (rays, locator, tolerance) = (RayScene::new(scene), Locator::new(graph), scene.tolerance());
    for w in &pvs.witnesses {
        assert!(locator.holds(w.cell, w.from), "{w:?} starts in its cell");
        assert!(rays.is_near(w.to, w.object, tolerance.coplanar), "{w:?} ends on its object");
        assert!(rays.is_clear(w.from, w.to, tolerance.clearance, Some(w.object)), "{w:?} is clear");
    }
}

#[test]
fn two_rooms_and_a_door() {
    let extra = [
        // Straight across from the door.
        solid("facing", [7.9, 0.0, 2.0], [8.0, 1.0, 2.4]),
        // Beside the door, flat on its wall: from the first room, no line through the 0.2 m deep doorway bends so far.
        solid("tucked", [4.42, 0.0, 3.7], [4.5, 1.0, 3.9]),
        solid("near", [1.0, 0.0, 1.0], [1.3, 0.3, 1.3]),
        // In the wall's thickness.
        solid("buried", [4.25, 1.0, 0.5], [4.35, 1.2, 0.9]),
    ];
    let (scene, graph) = rooms::row(2, extra, &[]);
    let pvs = bake(&scene, graph, &options(300_000), &Job::quiet()).unwrap();
    assert_proven(&scene, &pvs);
    assert_eq!((pvs.repairs.len(), pvs.stats.contradictions), (0, 0));
    assert!(pvs.stats.rays <= 300_000);
    let sees = |cell: usize, node: &str| pvs.objects_lower.get(cell, object(&scene, node));
    for (node, from_first, from_second) in [
        ("facing", true, true),
        ("tucked", false, true),
        ("near", true, true),
        ("buried", false, false),
        ("floor", true, true),
        ("east", true, true),
        ("west", true, true),
        ("wall 1 south", true, true),
        ("lintel 1", true, true),
    ] {
        assert_eq!((sees(0, node), sees(1, node)), (from_first, from_second), "{node}");
    }
    assert!(pvs.cells_lower.get(0, 1) && pvs.cells_lower.get(1, 0));
}

#[test]
fn a_portal_left_out_is_found_and_mended() {
    let extra = [solid("goal", [11.9, 0.5, 2.0], [12.0, 1.5, 2.5])];
    let (scene, graph) = rooms::row(3, extra, &[1]);
    let portals = graph.portals.len();
    let pvs = bake(&scene, graph, &options(300_000), &Job::quiet()).unwrap();
    assert_proven(&scene, &pvs);
    assert!(!pvs.repairs.is_empty());
    for repair in &pvs.repairs {
        let mut cells = repair.cells;
        cells.sort();
        assert_eq!(cells, [CellId(1), CellId(2)], "the two cells without a portal");
        // On the face of the second wall, in the doorway.
        let at = repair.at + scene.origin;
        assert!((at.x - 8.4).abs() < 1e-6 && (1.8..=2.7).contains(&at.z) && (0.0..=2.1).contains(&at.y), "{at}");
    }
    for portal in &pvs.graph.portals[portals..] {
        let area = enfilade::math::geom::area(&portal.winding);
        assert!((area - 0.9 * 2.1).abs() < 0.01, "the doorway, no more: {area} m2");
        let (behind, ahead) = (portal.cells[0], portal.plane.n.x > 0.0);
        assert_eq!(behind == CellId(1), ahead, "the normal points out of cells[0]");
        assert!(enfilade::math::geom::newell(&portal.winding).dot(portal.plane.n) > 0.0);
    }
    let goal = object(&scene, "goal");
    assert!(pvs.objects_upper.get(0, goal) && pvs.cells_upper.get(0, 2) && pvs.cells_upper.get(2, 0));

    // With the portal, nothing is to be mended.
    let (scene, graph) = rooms::row(3, [solid("goal", [11.9, 0.5, 2.0], [12.0, 1.5, 2.5])], &[]);
    assert_eq!(bake(&scene, graph, &options(300_000), &Job::quiet()).unwrap().repairs, []);
}

#[test]
fn a_gap_between_cells_is_bridged() {
    // The second room's cell doesn't reach its doorway: 0.2 m of free space are in no cell.
    let (scene, mut graph) = rooms::row(2, [], &[0]);
    graph.cells[1].pieces.pop();
    let pvs = bake(&scene, graph, &options(200_000), &Job::quiet()).unwrap();
    assert_proven(&scene, &pvs);
    assert!(!pvs.repairs.is_empty() && pvs.stats.contradictions == 0);
    assert!(pvs.cells_lower.get(0, 1) && pvs.cells_upper.get(0, 1));
}

#[test]
fn one_thread_and_two_give_the_same() {
    let run = |threads: usize, seed: u64| {
        let (scene, graph) = rooms::office(3, 4);
        let options = PvsOptions { ray_budget: 400_000, seed, ..PvsOptions::default() };
        on(threads, || bake(&scene, graph, &options, &Job::quiet()).unwrap())
    };
    assert_eq!(run(1, 0), run(2, 0));
    assert_ne!(run(2, 0).witnesses, run(2, 1).witnesses, "the seed matters");
}

#[test]
fn more_rays_prove_more_and_fewer_than_the_budget_are_cast() {
    let mut before = 0;
    for budget in [0, 1000, 100_000, 1_000_000] {
        let (scene, graph) = rooms::office(4, 3);
        let pvs = bake(&scene, graph, &options(budget), &Job::quiet()).unwrap();
        assert!(pvs.stats.rays <= budget, "{} of {budget}", pvs.stats.rays);
        assert_proven(&scene, &pvs);
        assert!(pvs.witnesses.len() >= before);
        before = pvs.witnesses.len();
    }
    assert!(before > 1000, "{before} pairs");
}

#[test]
fn glass_is_seen_and_seen_through() {
    let pane = Mesh { opaque: false, ..solid("pane", [4.25, 0.0, 1.8], [4.26, 2.1, 2.7]) };
    let (scene, graph) = rooms::row(2, [pane, solid("goal", [7.9, 0.5, 2.0], [8.0, 1.5, 2.5])], &[]);
    let pvs = bake(&scene, graph, &options(200_000), &Job::quiet()).unwrap();
    assert_proven(&scene, &pvs);
    for node in ["pane", "goal"] {
        assert!((0..2).all(|c| pvs.objects_lower.get(c, object(&scene, node))), "{node}");
    }
}

#[test]
fn an_unbounded_outside_sees_in_and_is_seen() {
    // A shed, open to the east; the outside is two half-spaces.
    let meshes = [
        solid("floor", [0.0, -0.2, 0.0], [4.2, 0.0, 4.0]),
        solid("roof", [0.0, 2.6, 0.0], [4.2, 2.8, 4.0]),
        solid("south", [0.0, -0.2, -0.2], [4.2, 2.8, 0.0]),
        solid("north", [0.0, -0.2, 4.0], [4.2, 2.8, 4.2]),
        solid("west", [0.0, -0.2, -0.2], [0.2, 2.8, 4.2]),
        solid("lamp", [1.0, 2.0, 1.0], [1.2, 2.2, 1.2]),
        solid("tree", [20.0, 0.0, 1.0], [21.0, 5.0, 2.0]),
        solid("sign", [-3.0, 1.0, 1.0], [-2.9, 2.0, 2.0]),
    ];
    let scene = scene(meshes);
    let room = rooms::box_piece([0.2, 0.0, 0.0], [4.2, 2.6, 4.0], scene.origin);
    let half_space = |n: DVec3, at: DVec3| {
        let bounds = Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
        enfilade::cells::Piece { planes: vec![enfilade::math::geom::Plane::through(at - scene.origin, n)], bounds }
    };
    let outside = vec![half_space(DVec3::NEG_X, DVec3::X * 4.2), half_space(DVec3::X, DVec3::ZERO)];
    let door = rooms::portal([0, 1], 0, [4.2, 0.0, 0.0], [4.2, 2.6, 4.0], scene.origin);
    let graph = rooms::graph(vec![vec![room], outside], vec![door]);
    let pvs = bake(&scene, graph, &options(200_000), &Job::quiet()).unwrap();
    assert_proven(&scene, &pvs);
    assert_eq!(pvs.repairs, []);
    let sees = |cell: usize, node: &str| pvs.objects_lower.get(cell, object(&scene, node));
    for (node, from_room, from_outside) in
        [("tree", true, true), ("lamp", true, true), ("west", true, true), ("sign", false, true), ("roof", true, true)]
    {
        assert_eq!((sees(0, node), sees(1, node)), (from_room, from_outside), "{node}");
    }
}

/// The scenes with exact answers.
fn exact_scenes() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(data().join("exact")).expect("the scenes with exact answers");
    let mut scenes: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(|p| p.is_dir()).collect();
    scenes.sort();
    scenes
}

/// A scene with the exact answer: its triangles, its cells' boxes, its pairs.
fn read_exact(folder: &Path) -> (Scene, Vec<Aabb>, Vec<serde_json::Value>) {
    let text = |name: &str| std::fs::read_to_string(folder.join(name)).expect("a file of the scene");
    let options = ImportOptions { object_triangles: u32::MAX, ..ImportOptions::default() };
    let scene = import(&folder.join("scene.obj"), &options).expect("a scene");
    let json = |name: &str| serde_json::from_str::<serde_json::Value>(&text(name)).expect("JSON");
    let cells = json("cells.json")["cells"]
        .as_array()
        .expect("cells")
        .iter()
        .map(|c| Aabb::of([point(&c["min"]), point(&c["max"])]))
        .collect();
    let pairs = json("exact.json")["pairs"].as_array().expect("pairs").clone();
    (scene, cells, pairs)
}

fn point(value: &serde_json::Value) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|k| value[k].as_f64().expect("a coordinate")))
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn exact_scenes_visible_pairs_have_clear_witnesses() {
    let folders = exact_scenes();
    let mut checked = 0;
    for folder in folders {
        let (scene, _, pairs) = read_exact(&folder);
        let rays = RayScene::new(&scene);
        let clearance = scene.tolerance().clearance;
        for pair in
            pairs.iter().filter(|p| p["visible"] == true && p["clearance_m"].as_f64().is_some_and(|c| c > 4.0 * clearance))
        {
            let [from, to] = [0, 1].map(|k| point(&pair["witness"][k]) - scene.origin);
            let object = ObjectId(pair["object"].as_u64().expect("an id") as u32);
            assert!(rays.is_clear(from, to, clearance, Some(object)), "{}: {pair}", folder.display());
            checked += 1;
        }
    }
    assert!(checked > 400, "{checked} witnesses");
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn exact_scenes_hidden_pairs_have_no_clear_segment() {
    let folders = exact_scenes();
    let mut random = Places::new(17);
    let mut checked = 0;
    for folder in folders {
        let (scene, cells, pairs) = read_exact(&folder);
        let rays = RayScene::new(&scene);
        let clearance = scene.tolerance().clearance;
        for pair in pairs.iter().filter(|p| p["visible"] == false) {
            let cell = cells[pair["cell"].as_u64().expect("an id") as usize];
            let object = ObjectId(pair["object"].as_u64().expect("an id") as u32);
            let triangles = &scene.objects[object.index()].triangles;
            for _ in 0..1500 {
                let from = cell.min + (place(&mut random, 1.0) + 0.5) * cell.size() - scene.origin;
                let [a, b, c] = scene.corners(triangles.start as usize + random.below(triangles.len()));
                let (x, y) = (random.unit(), random.unit());
                let (x, y) = if x + y > 1.0 { (1.0 - x, 1.0 - y) } else { (x, y) };
                let to = a + (b - a) * x + (c - a) * y;
                assert!(!rays.is_clear(from, to, clearance, Some(object)), "{}: {pair} {from} {to}", folder.display());
            }
            checked += 1;
        }
    }
    assert!(checked > 100, "{checked} pairs");
}
