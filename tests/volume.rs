//! Splitting scenes that aren't like a plan by voxels; their spaces and openings are known because they are made here.

use enfilade::CellId;
use enfilade::cells::{CellGraph, Locator, Portal, SplitOptions, Strategy, split, validate};
use enfilade::geom::{Aabb, area};
use enfilade::scene::rays::RayScene;
use enfilade::scene::{Role, Scene};
use glam::{DMat3, DVec2, DVec3};
use std::collections::BTreeMap;
use testing::meshes::{self, Triangle, cuboid, halves, soup};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A turn about +Y, then a move.
#[derive(Clone, Copy)]
struct Place {
    turn: DMat3,
    shift: DVec3,
}

const HERE: Place = Place { turn: DMat3::IDENTITY, shift: DVec3::ZERO };

fn turned(degrees: f64) -> Place {
    Place { turn: DMat3::from_rotation_y(degrees.to_radians()), shift: v(3.0, -1.0, 7.0) }
}

impl Place {
    fn of(&self, scene: &Scene, p: DVec3) -> DVec3 {
        self.turn * p + self.shift - scene.origin
    }
}

fn scene(parts: &[Vec<Triangle>], place: Place) -> Scene {
    let put = |triangle: &Triangle| triangle.map(|p| place.turn * p + place.shift);
    let part = |(i, part): (usize, &Vec<Triangle>)| {
        soup(&format!("part {i}"), Role::Structure, true, &part.iter().map(put).collect::<Vec<_>>())
    };
    meshes::scene(parts.iter().enumerate().map(part))
}

/// A convex outline in (z, y), counter-clockwise seen from +x, swept from `x[0]` to `x[1]`: a closed solid, wound outwards.
fn prism(outline: &[DVec2], x: [f64; 2]) -> Vec<Triangle> {
    let at = |x: f64, p: DVec2| v(x, p.y, p.x);
    let n = outline.len();
    let mut out = Vec::new();
    for i in 0..n {
        let (a, b) = (outline[i], outline[(i + 1) % n]);
        out.extend(halves(&[[at(x[0], a), at(x[1], a), at(x[1], b), at(x[0], b)]]));
        if i > 1 {
            let (o, p) = (outline[0], outline[i - 1]);
            out.push([at(x[1], o), at(x[1], a), at(x[1], p)]);
            out.push([at(x[0], o), at(x[0], p), at(x[0], a)]);
        }
    }
    out
}

/// The surface between `free` (negative) and solid, on a lattice of tetrahedra (Doi, Koide, *An efficient method of
/// triangulating equi-valued surfaces*, 1991); fronts look into free space.
fn surface(free: impl Fn(DVec3) -> f64, bounds: Aabb, step: f64) -> Vec<Triangle> {
    let n = (bounds.size() / step).ceil();
    let mut out: Vec<Triangle> = Vec::new();
    // Six tetrahedra around a cube's diagonal.
    let paths = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    for z in 0..n.z as usize {
        for y in 0..n.y as usize {
            for x in 0..n.x as usize {
                for path in paths {
                    // On whole numbers, so that neighbours share corners to the bit.
                    let mut t = [v(x as f64, y as f64, z as f64); 4];
                    for (k, &axis) in path.iter().enumerate() {
                        t[k + 1] = t[k] + DVec3::AXES[axis];
                    }
                    let t = t.map(|p| bounds.min + p * step);
                    let value = t.map(&free);
                    let (inside, outside): (Vec<usize>, Vec<usize>) = (0..4).partition(|&i| value[i] < 0.0);
                    // One formula for each lattice edge.
                    let cut = |i: usize, j: usize| {
                        let (i, j) = if t[i].to_array() < t[j].to_array() { (i, j) } else { (j, i) };
                        t[i] + (t[j] - t[i]) * (value[i] / (value[i] - value[j]))
                    };
                    let ring: Vec<DVec3> = match (&inside[..], &outside[..]) {
                        (&[a], &[b, c, d]) | (&[b, c, d], &[a]) => vec![cut(a, b), cut(a, c), cut(a, d)],
                        (&[a, b], &[c, d]) => vec![cut(a, c), cut(a, d), cut(b, d), cut(b, c)],
                        _ => continue,
                    };
                    let towards = t[inside[0]] - t[outside[0]];
                    for k in 2..ring.len() {
                        let (a, b, c) = (ring[0], ring[k - 1], ring[k]);
                        let n = (b - a).cross(c - a);
                        if n.length() > 1e-12 {
                            out.push(if n.dot(towards) > 0.0 { [a, b, c] } else { [a, c, b] });
                        }
                    }
                }
            }
        }
    }
    out
}

fn split_by(scene: &Scene, voxel: Option<f64>) -> CellGraph {
    split(scene, &SplitOptions { strategy: Some(Strategy::Volume), voxel, ..SplitOptions::default() }).unwrap()
}

fn sound(graph: &CellGraph, scene: &Scene, segments: u64) {
    let faults = validate::structure(graph, scene.tolerance().coplanar.max(1e-9));
    assert!(faults.is_empty(), "{faults:?}");
    let sealing = validate::sealing(graph, &RayScene::new(scene), segments, 1);
    assert!(sealing.segments > segments / 10, "only {} segments were followed", sealing.segments);
    let leaks: Vec<String> = sealing.leaks.iter().map(ToString::to_string).collect();
    assert!(leaks.is_empty(), "{leaks:?}");
}

fn between(graph: &CellGraph, a: CellId, b: CellId) -> Vec<&Portal> {
    graph.portals.iter().filter(|p| p.cells == [a, b] || p.cells == [b, a]).collect()
}

fn total(portals: &[&Portal]) -> f64 {
    portals.iter().map(|p| area(&p.winding)).sum()
}

/// All portals between two cells are one rectangle of this size, to a centimetre.
fn assert_opening(portals: &[&Portal], size: DVec2) {
    assert_eq!(portals.len(), 1, "{portals:?}");
    let found = total(portals);
    assert!((found - size.x * size.y).abs() <= 0.01 * (size.x + size.y), "{found} m2 for {size} m");
    let bounds = Aabb::of(portals[0].winding.iter().copied()).size();
    let found = DVec2::new(bounds.x.hypot(bounds.z), bounds.y);
    assert!((found - size).abs().max_element() <= 0.01, "{found} m for {size} m");
}

/// Two caves of 4 m radius, 14 m apart, joined by a tunnel of 1 m radius.
fn caves() -> Vec<Vec<Triangle>> {
    let free = |p: DVec3| {
        let cave = |x: f64| p.distance(v(x, 0.0, 0.0)) - 4.0;
        let tunnel = p.distance(v(p.x.clamp(-7.0, 7.0), 0.0, 0.0)) - 1.0;
        cave(-7.0).min(cave(7.0)).min(tunnel)
    };
    vec![surface(free, Aabb { min: v(-12.03, -5.02, -5.01), max: v(12.0, 5.0, 5.0) }, 0.47)]
}

fn check_caves(place: Place) {
    let scene = scene(&caves(), place);
    let graph = split_by(&scene, None);
    let locator = Locator::new(&graph);
    let at = |x: f64, y: f64, z: f64| locator.locate(place.of(&scene, v(x, y, z))).map(|l| l.0);
    let (a, b) = (at(-7.0, 0.0, 0.0).unwrap(), at(7.0, 0.0, 0.0).unwrap());
    assert_ne!(a, b);
    assert_eq!(graph.cells.len(), 2, "the rock around is no cell");
    assert_eq!((at(-9.0, 2.0, 1.0), at(9.0, -2.0, -1.0)), (Some(a), Some(b)));
    assert_eq!((at(0.0, 4.0, 0.0), at(-11.9, 4.0, 4.0)), (None, None), "rock is in no cell");
    let portals = between(&graph, a, b);
    assert_eq!(portals.len(), 1, "one crisp portal");
    // The tunnel's cross-section, a polygon in a circle of 1 m.
    let found = total(&portals);
    assert!((2.6..3.4).contains(&found), "{found} m2");
    assert!(portals[0].plane.n.dot(place.turn * DVec3::X).abs() > 0.98);
    sound(&graph, &scene, 200_000);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn two_caves_and_a_tunnel_are_two_cells_and_one_portal() {
    check_caves(HERE);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn two_caves_turned_are_the_same() {
    check_caves(turned(37.0));
}

#[test]
fn a_cavern_is_one_cell() {
    let ball = surface(|p| p.length() - 5.0, Aabb { min: v(-6.1, -6.2, -6.3), max: v(6.0, 6.0, 6.0) }, 0.9);
    let scene = scene(&[ball], HERE);
    let graph = split_by(&scene, None);
    assert_eq!((graph.cells.len(), graph.portals.len()), (1, 0));
    assert_eq!(Locator::new(&graph).locate(-scene.origin).map(|l| l.0), Some(CellId(0)));
    sound(&graph, &scene, 50_000);
}

/// Rooms of 6 x 3 x 5 m, one 4 m above the other, joined by a ramp 1.5 m wide and 2.2 m high: single sheets that look inward.
fn ramp() -> Vec<Vec<Triangle>> {
    let mut out: Vec<Triangle> = Vec::new();
    // Every quad is turned to look at a point in the space that it bounds.
    let mut sheet = |q: [DVec3; 4], inside: DVec3| {
        let n = (q[1] - q[0]).cross(q[2] - q[0]);
        out.extend(halves(&[if n.dot(inside - q[0]) > 0.0 { q } else { [q[3], q[2], q[1], q[0]] }]));
    };
    for (x, y, mouth) in [([0.0, 6.0], 0.0, 6.0), ([14.0, 20.0], 4.0, 14.0)] {
        let inside = v((x[0] + x[1]) / 2.0, y + 1.5, 2.5);
        for z in [0.0, 5.0] {
            sheet([v(x[0], y, z), v(x[1], y, z), v(x[1], y + 3.0, z), v(x[0], y + 3.0, z)], inside);
        }
        for y in [y, y + 3.0] {
            sheet([v(x[0], y, 0.0), v(x[1], y, 0.0), v(x[1], y, 5.0), v(x[0], y, 5.0)], inside);
        }
        let mut wall = |x: f64, z: [f64; 2], up: [f64; 2]| {
            sheet([v(x, up[0], z[0]), v(x, up[0], z[1]), v(x, up[1], z[1]), v(x, up[1], z[0])], inside);
        };
        wall(x[0] + x[1] - mouth, [0.0, 5.0], [y, y + 3.0]);
        wall(mouth, [0.0, 2.0], [y, y + 3.0]);
        wall(mouth, [3.5, 5.0], [y, y + 3.0]);
        wall(mouth, [2.0, 3.5], [y + 2.2, y + 3.0]);
    }
    let inside = v(10.0, 3.1, 2.75);
    let rise = |z: f64, up: f64| [v(6.0, up, z), v(14.0, 4.0 + up, z)];
    for up in [0.0, 2.2] {
        let ([a, b], [c, d]) = (rise(2.0, up), rise(3.5, up));
        sheet([a, b, d, c], inside);
    }
    for z in [2.0, 3.5] {
        let ([a, b], [c, d]) = (rise(z, 0.0), rise(z, 2.2));
        sheet([a, b, d, c], inside);
    }
    vec![out]
}

#[test]
fn a_ramp_joins_two_levels_by_one_upright_portal() {
    for place in [HERE, turned(37.0)] {
        let scene = scene(&ramp(), place);
        let graph = split_by(&scene, None);
        let locator = Locator::new(&graph);
        let at = |x: f64, y: f64, z: f64| locator.locate(place.of(&scene, v(x, y, z))).expect("free space is in a cell").0;
        let (low, high) = (at(3.0, 1.5, 2.5), at(17.0, 5.5, 2.5));
        assert_ne!(low, high);
        assert_eq!(graph.cells.len(), 2, "the ramp is no wider than its mouths, so it belongs to a room");
        let portals = between(&graph, low, high);
        assert_opening(&portals, DVec2::new(1.5, 2.2));
        assert!(portals[0].plane.n.y.abs() < 1e-6);
        sound(&graph, &scene, 100_000);
    }
}

/// A hull of three compartments of 6 m: 3 m wide at the keel, 6 m at the deck 3 m above, plates of 10 cm, bulkheads of 5 cm with
/// doors of 0.8 x 1.9 m, 0.2 m above the keel.
fn ship() -> Vec<Vec<Triangle>> {
    let p = DVec2::new;
    let side = |s: f64| {
        let mut outline = vec![p(1.5 * s, 0.0), p(1.6 * s, 0.0), p(3.1 * s, 3.0), p(3.0 * s, 3.0)];
        if s < 0.0 {
            outline.reverse();
        }
        outline
    };
    let mut parts = vec![
        prism(&side(1.0), [0.0, 18.0]),
        prism(&side(-1.0), [0.0, 18.0]),
        cuboid(v(-0.1, -0.1, -1.6), v(18.1, 0.0, 1.6)),
        cuboid(v(-0.1, 3.0, -3.1), v(18.1, 3.1, 3.1)),
    ];
    let whole = [p(-1.6, 0.0), p(1.6, 0.0), p(3.1, 3.0), p(-3.1, 3.0)];
    parts.extend([prism(&whole, [-0.1, 0.0]), prism(&whole, [18.0, 18.1])]);
    for x in [5.95, 11.95] {
        let x = [x, x + 0.05];
        parts.push(prism(&[p(-1.5, 0.0), p(-0.4, 0.0), p(-0.4, 3.0), p(-3.0, 3.0)], x));
        parts.push(prism(&[p(0.4, 0.0), p(1.5, 0.0), p(3.0, 3.0), p(0.4, 3.0)], x));
        parts.push(prism(&[p(-0.4, 0.0), p(0.4, 0.0), p(0.4, 0.2), p(-0.4, 0.2)], x));
        parts.push(prism(&[p(-0.4, 2.1), p(0.4, 2.1), p(0.4, 3.0), p(-0.4, 3.0)], x));
    }
    parts
}

#[test]
fn a_hull_with_slanted_sides_has_a_cell_for_each_compartment() {
    for place in [HERE, turned(37.0)] {
        let scene = scene(&ship(), place);
        let graph = split_by(&scene, None);
        let locator = Locator::new(&graph);
        let at = |x: f64, y: f64, z: f64| locator.locate(place.of(&scene, v(x, y, z))).expect("free space is in a cell").0;
        let compartments = [3.0, 9.0, 15.0].map(|x| at(x, 1.5, 0.0));
        let outside = at(9.0, 1.0, 5.0);
        assert_eq!(graph.cells.len(), 4, "three compartments and the sea");
        assert!(graph.cells[outside.index()].open);
        for (i, x) in [3.0, 9.0, 15.0].into_iter().enumerate() {
            // Under the slanted sides, and outside of them.
            assert_eq!(at(x, 2.9, 2.9), compartments[i]);
            assert_eq!(at(x, 0.05, -1.4), compartments[i]);
            assert_eq!(at(x, 0.5, 2.2), outside);
        }
        assert_eq!(graph.portals.len(), 2, "two doors and nothing else");
        for pair in compartments.windows(2) {
            assert_opening(&between(&graph, pair[0], pair[1]), DVec2::new(0.8, 1.9));
        }
        sound(&graph, &scene, 100_000);
    }
}

/// Rooms of 4 x 5 x 2.8 m in a closed box, a wall of `thickness` between them with a door of 0.9 x 2.1 m, turned about the door's
/// middle by `degrees`.
fn two_rooms(thickness: f64, degrees: f64) -> Vec<Vec<Triangle>> {
    let mut parts = vec![
        cuboid(v(-0.3, 0.0, -0.3), v(0.0, 2.8, 5.3)),
        cuboid(v(8.0, 0.0, -0.3), v(8.3, 2.8, 5.3)),
        cuboid(v(0.0, 0.0, -0.3), v(8.0, 2.8, 0.0)),
        cuboid(v(0.0, 0.0, 5.0), v(8.0, 2.8, 5.3)),
        cuboid(v(-0.3, -0.2, -0.3), v(8.3, 0.0, 5.3)),
        cuboid(v(-0.3, 2.8, -0.3), v(8.3, 3.0, 5.3)),
    ];
    // Longer than the room is deep, so that its ends are inside the outer walls.
    let reach = 2.5 + 0.2 + if degrees == 0.0 { 0.0 } else { 2.5 * (1.0 / degrees.to_radians().cos() - 1.0) };
    let turn = DMat3::from_rotation_y(degrees.to_radians());
    for (z, y) in [([-reach, -0.45], [0.0, 2.8]), ([0.45, reach], [0.0, 2.8]), ([-0.45, 0.45], [2.1, 2.8])] {
        let part = if thickness > 0.0 {
            cuboid(v(-thickness / 2.0, y[0], z[0]), v(thickness / 2.0, y[1], z[1]))
        } else {
            halves(&[[v(0.0, y[0], z[0]), v(0.0, y[0], z[1]), v(0.0, y[1], z[1]), v(0.0, y[1], z[0])]])
        };
        parts.push(part.iter().map(|t| t.map(|p| turn * p + v(4.0, 0.0, 2.5))).collect());
    }
    parts
}

#[test]
fn a_thin_wall_has_a_door_and_no_other_portal() {
    for (thickness, degrees, place) in
        [(0.01, 0.0, HERE), (0.0, 0.0, HERE), (0.1, 0.0, turned(37.0)), (0.01, 23.7, HERE), (0.2, -11.3, turned(61.0))]
    {
        let scene = scene(&two_rooms(thickness, degrees), place);
        let graph = split_by(&scene, None);
        let locator = Locator::new(&graph);
        let at = |x: f64, y: f64, z: f64| locator.locate(place.of(&scene, v(x, y, z))).expect("free space is in a cell").0;
        let (first, second) = (at(1.0, 1.5, 2.5), at(7.0, 1.5, 2.5));
        assert_ne!(first, second);
        assert_eq!((at(0.05, 0.05, 0.05), at(7.95, 2.75, 4.95)), (first, second), "corners belong to their rooms");
        assert_eq!(graph.cells.len(), 3, "two rooms and the outside; {thickness} m at {degrees} degrees");
        assert_eq!(graph.portals.len(), 1, "a door; {thickness} m at {degrees} degrees");
        assert_opening(&between(&graph, first, second), DVec2::new(0.9, 2.1));
        sound(&graph, &scene, 100_000);
    }
}

#[test]
fn what_stands_free_in_a_room_cuts_nothing() {
    let mut parts = two_rooms(0.1, 0.0);
    let plain = split_by(&scene(&parts, HERE), None);
    // Near a wall, so that they narrow nothing.
    for x in [1.3, 2.6, 6.1] {
        parts.push(cuboid(v(x, 0.7, 0.25), v(x + 0.2, 1.9, 0.35)));
    }
    let scene = scene(&parts, HERE);
    let graph = split_by(&scene, None);
    let pieces = |g: &CellGraph| g.cells.iter().map(|c| c.pieces.len()).sum::<usize>();
    assert_eq!(
        (graph.cells.len(), graph.portals.len(), pieces(&graph)),
        (plain.cells.len(), plain.portals.len(), pieces(&plain))
    );
    sound(&graph, &scene, 50_000);
}

/// Coarse voxels find less, but what they find is as sound.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn any_voxel_is_sound() {
    for voxel in [0.07, 0.45, 3.0] {
        for parts in [two_rooms(0.1, 23.7), ship(), caves()] {
            let scene = scene(&parts, HERE);
            sound(&split_by(&scene, Some(voxel)), &scene, 30_000);
        }
    }
}

/// A crack from one cave to the void around the level: nothing leaks, and the caves stay two.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn a_missing_triangle_leaks_nowhere() {
    let mut parts = caves();
    let hole = parts[0].iter().position(|t| t[0].x < -9.0 && t[0].y > 2.0).unwrap();
    parts[0].remove(hole);
    let scene = scene(&parts, HERE);
    let graph = split_by(&scene, None);
    let locator = Locator::new(&graph);
    let at = |x: f64| locator.locate(v(x, 0.0, 0.0) - scene.origin).map(|l| l.0);
    assert_ne!(at(-7.0), at(7.0));
    sound(&graph, &scene, 100_000);
}

#[test]
fn threads_change_nothing() {
    let scene = scene(&ship(), turned(12.0));
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| split_by(&scene, None))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(5));
}

/// The hand-made surfaces are closed: every edge has as many triangles one way as the other.
#[test]
fn hand_made_surfaces_are_closed() {
    for parts in [caves(), vec![cuboid(DVec3::ZERO, DVec3::ONE)]] {
        let mut edges: BTreeMap<[[u64; 3]; 2], i32> = BTreeMap::new();
        let key = |p: DVec3| (p + 0.0).to_array().map(f64::to_bits);
        for t in parts.iter().flatten() {
            for i in 0..3 {
                let (a, b) = (key(t[i]), key(t[(i + 1) % 3]));
                let (edge, way) = if a < b { ([a, b], 1) } else { ([b, a], -1) };
                *edges.entry(edge).or_default() += way;
            }
        }
        assert!(edges.values().all(|&n| n == 0));
    }
}
