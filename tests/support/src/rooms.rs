//! Hand-made rooms: a grid of boxes with doors between neighbours, each with a wall of finite thickness, and its cell graph.

use crate::meshes::{Triangle, cuboid, flat_along, scene, solid};
use enfilade::CellId;
use enfilade::cells::{Cell, CellGraph, Piece, Portal, PortalKind, PortalState, Strategy};
use enfilade::math::geom;
use enfilade::math::geom::{Aabb, Plane};
use enfilade::scene::{Mesh, Role, Scene};
use glam::DVec3;

/// A sphere of `16 * rings * rings` triangles or so.
pub fn ball(node: &str, centre: DVec3, radius: f64, rings: u32) -> Mesh {
    let (rows, columns) = (rings * 2, rings * 4);
    let at = |i: u32, j: u32| {
        let (a, b) = (
            f64::from(i) / f64::from(rows) * std::f64::consts::PI,
            f64::from(j) / f64::from(columns) * std::f64::consts::TAU,
        );
        let ring = if i == rows { 0.0 } else { a.sin() };
        centre + radius * DVec3::new(ring * b.cos(), a.cos(), ring * b.sin())
    };
    let positions = (0..=rows).flat_map(|i| (0..columns).map(move |j| at(i, j))).collect();
    let id = |i: u32, j: u32| i * columns + j % columns;
    let quads = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    let triangles = quads
        .flat_map(|(i, j)| [[id(i, j), id(i, j + 1), id(i + 1, j)], [id(i, j + 1), id(i + 1, j + 1), id(i + 1, j)]])
        .filter(|t| t[0] >= columns || t[1] >= columns)
        .filter(|t| t[1] < rows * columns || t[2] < rows * columns)
        .collect();
    Mesh { node: node.to_owned(), role: Role::Furnishing, opaque: true, positions, triangles }
}

/// A box as a piece, relative to `origin`.
pub fn box_piece(min: [f64; 3], max: [f64; 3], origin: DVec3) -> Piece {
    let bounds = Aabb { min: DVec3::from(min) - origin, max: DVec3::from(max) - origin };
    let planes = [DVec3::X, DVec3::Y, DVec3::Z]
        .iter()
        .flat_map(|&n| [Plane { n, d: n.dot(bounds.max) }, Plane { n: -n, d: -n.dot(bounds.min) }])
        .collect();
    Piece { planes, bounds }
}

/// Solids of two rooms, 4 x 5 m along x and 2.8 m high, walls of 0.2 m, and a doorway of 0.9 x 2.1 m between them.
pub const HOUSE: [[[f64; 3]; 2]; 9] = [
    [[-0.2, -0.2, -0.2], [8.4, 0.0, 5.2]],
    [[-0.2, 2.8, -0.2], [8.4, 3.0, 5.2]],
    [[-0.2, 0.0, -0.2], [0.0, 2.8, 5.2]],
    [[8.2, 0.0, -0.2], [8.4, 2.8, 5.2]],
    [[0.0, 0.0, -0.2], [8.2, 2.8, 0.0]],
    [[0.0, 0.0, 5.0], [8.2, 2.8, 5.2]],
    [[4.0, 0.0, 0.0], [4.2, 2.8, 2.0]],
    [[4.0, 0.0, 2.9], [4.2, 2.8, 5.0]],
    [[4.0, 2.1, 2.0], [4.2, 2.8, 2.9]],
];

/// The same as triangles, solid by solid.
pub fn house() -> Vec<Vec<Triangle>> {
    HOUSE.map(|[min, max]| cuboid(min.into(), max.into())).to_vec()
}

/// Ground of 60 x 20 m with walls across it at x = 20 and x = 40, 12 m high and longer than it is wide, and twenty pebbles between each two.
pub fn three_yards() -> Vec<(String, [f64; 3], [f64; 3])> {
    let mut boxes = vec![("ground".to_owned(), [0.0, -1.0, 0.0], [60.0, 0.0, 20.0])];
    boxes.extend([20.0, 40.0].map(|x| ("wall".to_owned(), [x - 0.1, -0.5, -3.0], [x + 0.1, 12.0, 23.0])));
    for (yard, i) in (0..3).flat_map(|yard| (0..20).map(move |i| (yard, i))) {
        let (x, z) = (f64::from(20 * yard + 4 * (i % 4) + 3), f64::from(3 * (i / 4) + 3));
        boxes.push((format!("pebble of yard {yard}"), [x, 0.0, z], [x + 0.3, 0.3, z + 0.3]));
    }
    boxes
}

/// A rectangular portal across `axis` from the cell on the low side to the one on the high side.
pub fn portal(cells: [u32; 2], axis: usize, min: [f64; 3], max: [f64; 3], origin: DVec3) -> Portal {
    let winding = flat_along(axis, DVec3::from(min) - origin, DVec3::from(max) - origin).to_vec();
    let plane = Plane::through(winding[0], geom::newell(&winding).normalize());
    Portal {
        cells: cells.map(CellId),
        plane,
        winding,
        kind: PortalKind::Opening,
        state: PortalState::default(),
        source: None,
    }
}

/// A graph of cells that are boxes.
pub fn graph(pieces: Vec<Vec<Piece>>, portals: Vec<Portal>) -> CellGraph {
    let cells =
        pieces.into_iter().enumerate().map(|(i, pieces)| Cell { name: format!("cell {i}"), pieces, ..Cell::default() });
    let mut graph = CellGraph {
        strategy: Strategy::Given,
        reason: "hand-made".into(),
        cells: cells.collect(),
        portals,
        smallest_hole: 0.0,
        closed_holes: Vec::new(),
        notes: Vec::new(),
    };
    graph.link();
    graph
}

/// Sizes of [`office`]: from room to room, of walls, of rooms.
const OFFICE: [f64; 3] = [4.2, 0.2, 2.6];

/// x and z for each other, or not.
fn swap(flip: bool, [x, y, z]: [f64; 3]) -> [f64; 3] {
    if flip { [z, y, x] } else { [x, y, z] }
}

fn office_meshes(n: u32, rings: u32) -> Vec<Mesh> {
    let [pitch, wall, height] = OFFICE;
    let side = f64::from(n) * pitch + wall;
    let mut meshes = vec![
        solid("floor", [0.0, -0.2, 0.0], [side, 0.0, side]),
        solid("ceiling", [0.0, height, 0.0], [side, height + 0.2, side]),
    ];
    for flip in [false, true] {
        for i in 0..=n {
            for j in 0..n {
                let (x, z) = (f64::from(i) * pitch, f64::from(j) * pitch);
                let mut part = |what: &str, y0: f64, y1: f64, z0: f64, z1: f64| {
                    meshes.push(solid(
                        &format!("{what} {flip} {i} {j}"),
                        swap(flip, [x, y0, z0]),
                        swap(flip, [x + wall, y1, z1]),
                    ));
                };
                if i == 0 || i == n {
                    part("wall", 0.0, height, z, z + pitch + wall);
                } else {
                    part("wall", 0.0, height, z, z + 1.8);
                    part("wall", 0.0, height, z + 2.7, z + pitch + wall);
                    part("lintel", 2.1, height, z + 1.8, z + 2.7);
                }
            }
        }
    }
    for i in 0..n {
        for j in 0..n {
            let centre = DVec3::new(f64::from(i) * pitch + 1.2, 0.6, f64::from(j) * pitch + 1.1);
            meshes.push(ball(&format!("ball {i} {j}"), centre, 0.5, rings));
            meshes.push(ball(&format!("lamp {i} {j}"), centre + DVec3::new(2.0, 1.6, 2.0), 0.2, rings / 2 + 1));
        }
    }
    meshes
}

/// `n` x `n` rooms of 4 m with 0.2 m walls; a door in the middle of every wall between neighbours; a ball in every room, and
/// more of them where `rings` is large. Doorways belong to the room on their low side.
pub fn office(n: u32, rings: u32) -> (Scene, CellGraph) {
    let [pitch, wall, height] = OFFICE;
    let scene = scene(office_meshes(n, rings));
    let origin = scene.origin;
    let id = |i: u32, j: u32| i * n + j;
    let (mut pieces, mut portals) = (Vec::new(), Vec::new());
    for i in 0..n {
        for j in 0..n {
            let (x, z) = (f64::from(i) * pitch + wall, f64::from(j) * pitch + wall);
            let mut cell = vec![box_piece([x, 0.0, z], [x + 4.0, height, z + 4.0], origin)];
            for flip in [false, true] {
                let (k, along, across) = if flip { (j, z, x) } else { (i, x, z) };
                if k + 1 < n {
                    let (near, far) = (along + 4.0, along + 4.0 + wall);
                    cell.push(box_piece(
                        swap(flip, [near, 0.0, across + 1.6]),
                        swap(flip, [far, 2.1, across + 2.5]),
                        origin,
                    ));
                    let other = if flip { id(i, j + 1) } else { id(i + 1, j) };
                    let (min, max) = (swap(flip, [far, 0.0, across + 1.6]), swap(flip, [far, 2.1, across + 2.5]));
                    portals.push(portal([id(i, j), other], if flip { 2 } else { 0 }, min, max, origin));
                }
            }
            pieces.push(cell);
        }
    }
    (scene, graph(pieces, portals))
}

/// Rooms of 4 m in a row along x with 0.2 m walls, each with a door at z = 1.8 to 2.7 m to the next. The doorway belongs to
/// the room on its high side, so the portal stands on the wall's low face. `extra` meshes are added; portals whose number is
/// in `left_out` are not in the graph.
pub fn row(n: u32, extra: impl IntoIterator<Item = Mesh>, left_out: &[u32]) -> (Scene, CellGraph) {
    let (pitch, wall, height, depth) = (4.2, 0.2, 2.6, 4.0);
    let length = f64::from(n) * pitch + wall;
    let mut meshes = vec![
        solid("floor", [0.0, -0.2, -0.2], [length, 0.0, depth + 0.2]),
        solid("ceiling", [0.0, height, -0.2], [length, height + 0.2, depth + 0.2]),
        solid("south", [0.0, -0.2, -0.2], [length, height, 0.0]),
        solid("north", [0.0, -0.2, depth], [length, height, depth + 0.2]),
        solid("west", [0.0, -0.2, -0.2], [wall, height, depth + 0.2]),
        solid("east", [length - wall, -0.2, -0.2], [length, height, depth + 0.2]),
    ];
    for i in 1..n {
        let x = f64::from(i) * pitch;
        meshes.push(solid(&format!("wall {i} south"), [x, -0.1, -0.1], [x + wall, height + 0.1, 1.8]));
        meshes.push(solid(&format!("wall {i} north"), [x, -0.1, 2.7], [x + wall, height + 0.1, depth + 0.1]));
        meshes.push(solid(&format!("lintel {i}"), [x, 2.1, 1.7], [x + wall, height + 0.1, 2.8]));
    }
    let scene = scene(meshes.into_iter().chain(extra));
    let origin = scene.origin;
    let (mut pieces, mut portals) = (Vec::new(), Vec::new());
    for i in 0..n {
        let x = f64::from(i) * pitch;
        let mut cell = vec![box_piece([x + wall, 0.0, 0.0], [x + pitch, height, depth], origin)];
        if i > 0 {
            let (min, max) = ([x, 0.0, 1.8], [x + wall, 2.1, 2.7]);
            cell.push(box_piece(min, max, origin));
            if !left_out.contains(&(i - 1)) {
                portals.push(portal([i - 1, i], 0, min, [x, max[1], max[2]], origin));
            }
        }
        pieces.push(cell);
    }
    (scene, graph(pieces, portals))
}
