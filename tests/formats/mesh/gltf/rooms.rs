//! Rooms and portals of the author.

use super::{assert_triangles, names, scene};
use enfilade::math::geom;
use enfilade::scene::{ImportOptions, OpeningKind};
use glam::DVec3;
use serde_json::{Value, json};
use testing::glb::Glb;

/// A unit square facing +Z, as two triangles.
const SQUARE: [[f32; 3]; 6] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn rooms_and_portals_are_read_from_node_names() {
    let mut glb = Glb::new();
    let square = glb.mesh(&SQUARE);
    let room =
        |name: &str, children: &[usize], x: f64| json!({"name": name, "children": children, "translation": [x, 0, 0]});
    glb.json["scenes"] = json!([{"nodes": [0, 4, 9]}]);
    glb.node(room("kitchen-room", &[1, 2, 3], 0.0));
    glb.node(json!({"name": "floor", "mesh": square, "scale": [4, 3, 1]}));
    glb.node(json!({"name": "hall*1-portal", "mesh": square, "translation": [1, 0, 1]}));
    glb.node(json!({"name": "attic-portal", "mesh": square}));
    glb.node(room("hall-room.001", &[5, 6, 7], 10.0));
    glb.node(json!({"name": "wall", "mesh": square}));
    glb.node(json!({"name": "hall-bound", "mesh": square, "scale": [2, 2, 1]}));
    glb.node(json!({"name": "-portal", "children": [8]}));
    glb.node(json!({"name": "-portal", "mesh": square}));
    glb.node(json!({"name": "outside-roomgroup", "children": [10]}));
    glb.node(json!({"name": "yard-room", "mesh": square, "translation": [0, 0, 20]}));
    let scene = scene(&glb);

    assert_eq!(names(&scene), ["floor", "wall", "yard-room"]);
    let rooms: Vec<_> = scene.hints.rooms.iter().map(|r| (r.id.as_str(), r.name.as_str(), r.outside)).collect();
    assert_eq!(rooms, [("kitchen-room", "kitchen", false), ("hall-room.001", "hall", false), ("yard-room", "yard", true)]);
    let surface = |room: usize| -> Vec<[DVec3; 3]> {
        scene.hints.rooms[room].surface.iter().map(|t| t.map(|p| p + scene.origin)).collect()
    };
    let kitchen = geom::Aabb::of(surface(0).into_iter().flatten());
    assert_eq!((surface(0).len(), kitchen.min, kitchen.max), (12, DVec3::ZERO, DVec3::new(4.0, 3.0, 0.0)));
    assert_triangles(
        &surface(1),
        &[[[10.0, 0.0, 0.0], [12.0, 0.0, 0.0], [12.0, 2.0, 0.0]], [[10.0, 0.0, 0.0], [12.0, 2.0, 0.0], [10.0, 2.0, 0.0]]],
    );

    let openings = &scene.hints.openings;
    let joined: Vec<_> = openings.iter().map(|o| (o.id.as_str(), o.kind, o.rooms)).collect();
    assert_eq!(
        joined,
        [
            ("hall*1-portal", OpeningKind::Opening, [Some(0), Some(1)]),
            ("attic-portal", OpeningKind::Opening, [Some(0), None]),
            ("-portal", OpeningKind::Opening, [Some(1), None]),
        ]
    );
    let mut winding: Vec<[i64; 3]> =
        openings[0].winding.iter().map(|p| (p + scene.origin).round().to_array().map(|x| x as i64)).collect();
    winding.sort_unstable();
    assert_eq!(winding, [[1, 0, 1], [1, 1, 1], [2, 0, 1], [2, 1, 1]]);
    assert_eq!(geom::newell(&openings[0].winding).normalize(), DVec3::Z);
    assert_eq!(scene.source.notes, ["attic-portal: leads to `attic`: there is no such room"]);
}

#[test]
fn rooms_and_portals_are_read_from_extras() {
    let mut glb = Glb::new();
    let square = glb.mesh(&SQUARE);
    let node = |name: &str, ours: Value, z: f64| json!({"name": name, "mesh": square, "translation": [0, 0, z], "extras": {"enfilade": ours}});
    glb.node(node("way", json!({"portal": ["b", "a"]}), 1.0));
    glb.node(node("a", json!({"room": true}), 0.0));
    glb.node(node("wall 1", json!({"room": "b", "role": "structure"}), 2.0));
    glb.node(node("wall 2", json!({"room": "b"}), 4.0));
    glb.node(node("gate", json!({"portal": ["a", ""]}), 0.5));
    glb.node(node("not-room", json!({"room": false}), 9.0));
    let scene = scene(&glb);
    assert_eq!(names(&scene), ["a", "wall 1", "wall 2", "not-room"]);
    let rooms: Vec<_> = scene.hints.rooms.iter().map(|r| (r.id.as_str(), r.name.as_str())).collect();
    assert_eq!(rooms, [("a", "a"), ("wall 1", "b")]);
    let b = geom::Aabb::of(scene.hints.rooms[1].surface.iter().flatten().map(|p| p + scene.origin));
    assert_eq!((b.min.z, b.max.z), (2.0, 4.0));
    let joined: Vec<_> = scene.hints.openings.iter().map(|o| (o.id.as_str(), o.rooms)).collect();
    assert_eq!(joined, [("way", [Some(1), Some(0)]), ("gate", [Some(0), None])]);
}

#[test]
fn bounds_that_are_open_become_their_hull_and_closed_ones_stay() {
    let mut glb = Glb::new();
    let c = |i: usize| [(i & 1) as f32 * 4.0, (i >> 1 & 1) as f32 * 3.0, (i >> 2 & 1) as f32 * 5.0];
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [0, 4, 6, 2], [1, 3, 7, 5], [2, 6, 7, 3]];
    let corners = |quads: &[[usize; 4]]| -> Vec<[f32; 3]> {
        quads.iter().flat_map(|q| [q[0], q[1], q[2], q[0], q[2], q[3]]).map(c).collect()
    };
    let (closed, open) = (glb.mesh(&corners(&quads)), glb.mesh(&corners(&quads[..5])));
    let square = glb.mesh(&SQUARE);
    glb.json["scenes"] = json!([{"nodes": [0, 3]}]);
    glb.node(json!({"name": "closed-room", "children": [1, 2]}));
    glb.node(json!({"name": "a-bound", "mesh": closed}));
    glb.node(json!({"name": "floor", "mesh": square}));
    glb.node(json!({"name": "open-room", "children": [4]}));
    glb.node(json!({"name": "b-bound", "mesh": open}));
    let scene = scene(&glb);
    for room in &scene.hints.rooms {
        let volume: f64 = room.surface.iter().map(|[a, b, c]| a.cross(*b).dot(*c) / 6.0).sum();
        assert!(room.drawn && (volume.abs() - 60.0).abs() < 1e-9, "{}: {volume}", room.id);
    }
    assert_eq!(scene.source.notes, ["open-room: its bound is not closed; its convex hull is used"]);
}

#[test]
fn what_is_odd_about_rooms_and_portals_is_told() {
    let mut glb = Glb::new();
    let square = glb.mesh(&SQUARE);
    // An arrow: its hull is twice as large.
    let arrow =
        glb.mesh(&[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 2.0, 0.0]]);
    glb.json["scenes"] = json!([{"nodes": [0, 4, 5]}]);
    glb.node(json!({"name": "hall-room", "children": [1, 2, 3]}));
    glb.node(json!({"name": "floor", "mesh": square}));
    glb.node(json!({"name": "hall-portal", "mesh": square}));
    glb.node(json!({"name": "-portal", "mesh": arrow}));
    glb.node(json!({"name": "hall*2-Portal", "mesh": square}));
    glb.node(json!({"name": "void-room"}));
    let scene = scene(&glb);
    assert!(!scene.hints.rooms[0].drawn, "a room without a bound is the box around its meshes");
    let joined: Vec<_> = scene.hints.openings.iter().map(|o| o.rooms).collect();
    assert_eq!(joined, [[Some(0), None], [Some(0), None], [None, Some(0)]]);
    assert_eq!(
        scene.source.notes,
        [
            "-portal: a portal that is not convex; its convex hull is used",
            "hall*2-Portal: a portal in no room; geometry decides its near side",
            "void-room: a room without meshes, ignored",
            "hall-portal: a portal from a room into itself; its other side is left open",
        ]
    );
}

#[test]
fn metres_per_unit_scales_everything() {
    let mut glb = Glb::new();
    let square = glb.mesh(&SQUARE);
    glb.node(json!({"name": "hall-room", "mesh": square, "children": [1], "translation": [100, 0, 0]}));
    glb.node(json!({"name": "x-portal", "mesh": square}));
    let options = ImportOptions { metres_per_unit: Some(0.01), ..ImportOptions::default() };
    let scene = enfilade_formats::gltf::from_slice(&glb.bytes(), "cm", None, &options).unwrap();
    let bounds = scene.bounds();
    assert!((bounds.min + scene.origin).distance(DVec3::new(1.0, 0.0, 0.0)) < 1e-12);
    assert!(bounds.size().distance(DVec3::new(0.01, 0.01, 0.0)) < 1e-12);
    assert!((geom::area(&scene.hints.openings[0].winding) - 1e-4).abs() < 1e-12);
    assert_eq!(scene.source.metres_per_unit, 0.01);
}
