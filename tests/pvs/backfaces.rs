//! What is seen from one side only: a room beside a pit, and a crawlway at the bottom of it, whose pairs are known.

use enfilade::bake::BakeOptions;
use enfilade::file::PvsFile;
use enfilade::proof::{Asker, Goal, Why};
use enfilade::scene::{Mesh, Role, Scene};
use enfilade::{CellId, ObjectId};
use glam::{DMat3, DVec3};
use testing::bakes;
use testing::meshes::{builder, flat};
use testing::rooms::{box_piece, graph, portal};

/// x from 1: the room, 3 m long; the pit, 2 m long and deep; the crawlway, 1 m long and high. All are 2 m wide.
const ROOM: u32 = 0;
const PIT: u32 = 1;
const CRAWLWAY: u32 = 2;

/// Name, corners, whether it is opaque.
const WALLS: [(&str, [f64; 3], [f64; 3], bool); 17] = [
    ("room's floor", [1., 0., 0.], [4., 0., 2.], true),
    ("room's end", [1., 0., 0.], [1., 2., 2.], true),
    ("room's left", [1., 0., 0.], [4., 2., 0.], true),
    ("room's right", [1., 0., 2.], [4., 2., 2.], true),
    ("room's ceiling", [1., 2., 0.], [4., 2., 2.], true),
    ("riser", [4., -2., 0.], [4., 0., 2.], true),
    ("pit's floor", [4., -2., 0.], [6., -2., 2.], true),
    ("pit's end", [6., -1., 0.], [6., 2., 2.], true),
    ("pit's left", [4., -2., 0.], [6., 2., 0.], true),
    ("pit's right", [4., -2., 2.], [6., 2., 2.], true),
    ("pit's ceiling", [4., 2., 0.], [6., 2., 2.], true),
    ("crawlway's floor", [6., -2., 0.], [7., -2., 2.], true),
    ("crawlway's ceiling", [6., -1., 0.], [7., -1., 2.], true),
    ("crawlway's sides", [6., -2., 0.], [7., -1., 0.], true),
    ("crawlway's end", [7., -2., 0.], [7., -1., 2.], true),
    ("glass", [6., -2., 0.], [6., -1., 2.], false),
    // In the midst of the pit, seen from all around.
    ("sign", [5., -0.75, 0.75], [5., -0.25, 1.25], true),
];

/// Pairs that no line joins, although each object touches what portals show of the pit.
const HIDDEN: [(u32, &str); 4] =
    [(ROOM, "riser"), (ROOM, "crawlway's ceiling"), (CRAWLWAY, "room's floor"), (CRAWLWAY, "pit's end")];

fn scene(turn: DMat3, is_flipped: bool) -> Scene {
    let mut builder = builder();
    for (node, min, max, opaque) in WALLS {
        let mut corners = vec![flat(min.into(), max.into())];
        if node == "crawlway's sides" {
            corners.push(flat([6., -2., 2.].into(), [7., -1., 2.].into()));
        }
        let positions = corners.concat().into_iter().map(|p| turn * p).collect();
        let halves = (0..corners.len() as u32).flat_map(|q| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k| 4 * q + k)));
        let triangles = halves.map(|[a, b, c]| if is_flipped { [a, c, b] } else { [a, b, c] }).collect();
        builder.add(Mesh { node: node.into(), role: Role::Unknown, opaque, positions, triangles }).unwrap();
    }
    builder.finish("pit").unwrap()
}

fn baked(scene: &Scene, turn: DMat3) -> PvsFile {
    let cells = [([1., 0., 0.], [4., 2., 2.]), ([4., -2., 0.], [6., 2., 2.]), ([6., -2., 0.], [7., -1., 2.])];
    let pieces = cells.map(|(min, max)| vec![box_piece(min, max, DVec3::ZERO)]).to_vec();
    let portals = vec![
        portal([ROOM, PIT], 0, [4., 0., 0.], [4., 2., 2.], DVec3::ZERO),
        portal([PIT, CRAWLWAY], 0, [6., -2., 0.], [6., -1., 2.], DVec3::ZERO),
    ];
    let mut given = graph(pieces, portals);
    let place = |p: DVec3| turn * p - scene.origin;
    for plane in given.cells.iter_mut().flat_map(|cell| &mut cell.pieces).flat_map(|piece| &mut piece.planes) {
        let at = place(plane.n * plane.d);
        plane.n = turn * plane.n;
        plane.d = plane.n.dot(at);
    }
    for (cell, (min, max)) in given.cells.iter_mut().zip(cells) {
        let corners =
            (0..8).map(|i| place(DVec3::from(std::array::from_fn(|k| if i >> k & 1 == 0 { min[k] } else { max[k] }))));
        cell.pieces[0].bounds = enfilade::math::geom::Aabb::of(corners);
    }
    for portal in &mut given.portals {
        portal.winding.iter_mut().for_each(|p| *p = place(*p));
        portal.plane = enfilade::math::geom::Plane::through(portal.winding[0], turn * portal.plane.n);
    }
    bakes::baked(scene, BakeOptions { given: Some(given), keep_bounds: true, ..bakes::with_rays(200_000) })
}

#[test]
fn what_faces_away_is_hidden_however_it_is_wound_and_turned_and_all_else_is_seen() {
    let turned = DMat3::from_rotation_y(0.4) * DMat3::from_rotation_x(0.3);
    for (turn, is_flipped) in [(DMat3::IDENTITY, false), (DMat3::IDENTITY, true), (turned, false)] {
        let scene = scene(turn, is_flipped);
        let file = baked(&scene, turn);
        let bounds = file.bounds.as_ref().unwrap();
        let [asker, blind] = [Some(&scene), None].map(|model| Asker::new(&file, model).unwrap());
        for cell in [ROOM, PIT, CRAWLWAY] {
            for (o, object) in scene.objects.iter().enumerate() {
                let is_hidden = HIDDEN.contains(&(cell, object.node.as_str()));
                let pair = format!("{cell} {} {turn} {is_flipped}", object.node);
                assert_eq!(bounds.objects_upper.get(cell as usize, o), !is_hidden, "{pair}");
                assert_eq!(bounds.objects_lower.get(cell as usize, o), !is_hidden, "{pair}");
                let ask = |asker: &Asker<'_>| asker.why(CellId(cell), Goal::Object(ObjectId(o as u32))).unwrap();
                // Without the model nobody can tell which way an object faces.
                assert_eq!(matches!(ask(&asker), Why::Behind), is_hidden, "{pair}");
                assert_eq!(matches!(ask(&blind), Why::Occluded(_)), is_hidden, "{pair}");
            }
        }
    }
}
