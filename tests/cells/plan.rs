//! The plan strategy on hand-made scenes: which rooms there are, which of them are joined, and a line of sight through each opening.
//!
//! Metres, +Y up. Walls are 0.2 m thick unless something else is said, storeys 2.8 m high, doorways 0.9 x 2.1 m.

use enfilade::CellId;
use enfilade::cells::{CellGraph, Locator, PortalKind, SplitOptions, Strategy, split, validate};
use enfilade::geom::{Plane, newell};
use enfilade::scene::rays::RayScene;
use enfilade::scene::{ImportOptions, Mesh, Role, Scene, SceneBuilder, Source};
use glam::{DVec2, DVec3};
use std::collections::{BTreeMap, BTreeSet};
use testing::solids::{Box3, less};

const HIGH: f64 = 2.8;
const WALL: f64 = 0.2;
const EYE: f64 = 1.5;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A building as closed solids.
struct Building {
    builder: SceneBuilder,
    parts: usize,
}

impl Building {
    fn new() -> Self {
        Self { builder: SceneBuilder::new(&ImportOptions::default(), Source::default()), parts: 0 }
    }

    fn mesh(&mut self, node: &str, role: Role, opaque: bool, polygons: &[Vec<DVec3>]) {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for polygon in polygons {
            let first = positions.len() as u32;
            triangles.extend((2..polygon.len() as u32).map(|k| [first, first + k - 1, first + k]));
            positions.extend(polygon);
        }
        self.parts += 1;
        let node = if node.is_empty() { format!("part {}", self.parts) } else { node.to_owned() };
        self.builder.add(Mesh { node, role, opaque, positions, triangles }).unwrap();
    }

    /// What lies between a convex polygon and the same polygon moved by `by`.
    fn swept(&mut self, base: &[DVec3], by: DVec3) {
        self.swept_as("", Role::Structure, true, base, by);
    }

    fn swept_as(&mut self, node: &str, role: Role, opaque: bool, base: &[DVec3], by: DVec3) {
        // Counter-clockwise from outside, so from below where it goes up.
        let mut base = base.to_vec();
        if newell(&base.iter().map(|&p| p - base[0]).collect::<Vec<_>>()).dot(by) > 0.0 {
            base.reverse();
        }
        let top: Vec<DVec3> = base.iter().map(|&p| p + by).collect();
        let sides = (0..base.len()).map(|i| (i, (i + 1) % base.len())).map(|(i, j)| vec![base[j], base[i], top[i], top[j]]);
        let mut polygons: Vec<Vec<DVec3>> = sides.collect();
        polygons.extend([base, top.into_iter().rev().collect()]);
        self.mesh(node, role, opaque, &polygons);
    }

    fn solid_as(&mut self, node: &str, role: Role, opaque: bool, [min, max]: Box3) {
        let base = [min, v(max.x, min.y, min.z), v(max.x, min.y, max.z), v(min.x, min.y, max.z)];
        self.swept_as(node, role, opaque, &base, DVec3::Y * (max.y - min.y));
    }

    fn solid(&mut self, min: DVec3, max: DVec3) {
        self.solid_as("", Role::Structure, true, [min, max]);
    }

    /// A box less some others.
    fn holed(&mut self, min: DVec3, max: DVec3, holes: &[Box3]) {
        let parts =
            holes.iter().fold(vec![[min, max]], |parts, &hole| parts.into_iter().flat_map(|p| less(p, hole)).collect());
        parts.into_iter().for_each(|[min, max]| self.solid(min, max));
    }

    /// Outer walls around the inside of a box, and slabs under and over it; all less `holes`.
    fn shell(&mut self, min: DVec3, max: DVec3, holes: &[Box3]) {
        let (a, b) = (min - WALL, max + WALL);
        self.holed(v(a.x, min.y, a.z), v(min.x, max.y, b.z), holes);
        self.holed(v(max.x, min.y, a.z), v(b.x, max.y, b.z), holes);
        self.holed(v(min.x, min.y, a.z), v(max.x, max.y, min.z), holes);
        self.holed(v(min.x, min.y, max.z), v(max.x, max.y, b.z), holes);
        self.holed(a, v(b.x, min.y, b.z), holes);
        self.holed(v(a.x, max.y, a.z), b, holes);
    }

    /// One side of a box that is flat along one axis, less some others.
    fn sheet(&mut self, a: DVec3, c: DVec3, holes: &[Box3]) {
        let parts =
            holes.iter().fold(vec![[a, c]], |parts, &hole| parts.into_iter().flat_map(|p| less_flat(p, hole)).collect());
        for [a, c] in parts {
            let flat = (0..3).find(|&k| a[k] == c[k]).unwrap();
            let (s, t) = ((flat + 1) % 3, (flat + 2) % 3);
            let corner = |k: usize, p: DVec3| {
                let mut q = a;
                q[k] = p[k];
                q
            };
            self.mesh("", Role::Structure, true, &[vec![a, corner(s, c), c, corner(t, c)]]);
        }
    }

    /// An upright wall along a line of the plan, `from` to `to`, `thick` to its left, with a doorway from `door[0]` to `door[1]`
    /// along it.
    fn wall_along(&mut self, from: DVec2, to: DVec2, heights: [f64; 2], thick: f64, door: Option<[f64; 2]>) {
        let along = (to - from).normalize();
        let across = along.perp() * thick;
        let mut part = |a: f64, b: f64, low: f64, high: f64| {
            let base = [from + along * a, from + along * b, from + along * b + across, from + along * a + across];
            self.swept(&base.map(|p| v(p.x, low, p.y)), DVec3::Y * (high - low));
        };
        let ([low, high], length) = (heights, from.distance(to));
        match door {
            Some([a, b]) => {
                part(0.0, a, low, high);
                part(b, length, low, high);
                part(a, b, low + 2.1, high);
            }
            None => part(0.0, length, low, high),
        }
    }

    fn finish(self) -> Scene {
        self.builder.finish("hand-made").unwrap()
    }
}

/// A doorway through walls across x: 0.9 m wide around `z`, 2.1 m high from `y`, wherever a wall stands between `x` and `x + 0.2`.
fn door_x(x: f64, y: f64, z: f64) -> Box3 {
    [v(x - 0.01, y, z - 0.45), v(x + WALL + 0.01, y + 2.1, z + 0.45)]
}

/// The same through walls across z.
fn door_z(x: f64, y: f64, z: f64) -> Box3 {
    [v(x - 0.45, y, z - 0.01), v(x + 0.45, y + 2.1, z + WALL + 0.01)]
}

/// What is open is called so.
const OPEN: [&str; 3] = ["outside", "west court", "east court"];

/// What is known about a scene.
#[derive(Default)]
struct Known {
    /// Every cell by a name, with points in it.
    cells: Vec<(&'static str, Vec<DVec3>)>,
    /// Lines of sight from one cell straight into another, through a portal between the two; no other two are joined.
    sights: Vec<(&'static str, &'static str, [DVec3; 2])>,
    /// Lines of sight that stay in one cell.
    within: Vec<[DVec3; 2]>,
}

fn plan(scene: &Scene) -> CellGraph {
    split(scene, &SplitOptions { strategy: Some(Strategy::Plan), ..SplitOptions::default() }).unwrap()
}

fn inside(winding: &[DVec3], normal: DVec3, p: DVec3) -> bool {
    let edges = winding.iter().zip(winding.iter().cycle().skip(1));
    edges.into_iter().all(|(&a, &b)| normal.cross(b - a).normalize_or_zero().dot(p - a) >= -1e-6)
}

/// True where the segment goes through a portal between the two cells.
fn goes_through(graph: &CellGraph, a: CellId, b: CellId, [from, to]: [DVec3; 2]) -> bool {
    let between = graph.portals.iter().filter(|p| p.cells == [a, b] || p.cells == [b, a]);
    let crosses = |plane: &Plane| {
        let (s, t) = (plane.distance(from), plane.distance(to));
        (s * t < 0.0).then(|| from.lerp(to, s / (s - t)))
    };
    between.into_iter().any(|p| crosses(&p.plane).is_some_and(|at| inside(&p.winding, p.plane.n, at)))
}

/// Everything that is known holds, and the graph is sound. Returns the graph and the cells by name.
fn assert_known(scene: &Scene, known: &Known) -> (CellGraph, BTreeMap<&'static str, CellId>) {
    let graph = plan(scene);
    let locator = Locator::new(&graph);
    let mut of: BTreeMap<&str, CellId> = BTreeMap::new();
    for (name, points) in &known.cells {
        for &p in points {
            let Some((cell, _)) = locator.locate(p - scene.origin) else { panic!("{name}: {p} is in no cell") };
            let first = *of.entry(name).or_insert(cell);
            assert_eq!(cell, first, "{name}: {p} and {} are in two cells: {}", points[0], told(&graph, scene));
        }
    }
    let different: BTreeSet<CellId> = of.values().copied().collect();
    assert_eq!(different.len(), of.len(), "some are one: {of:?}, {}", told(&graph, scene));
    assert_eq!(graph.cells.len(), of.len(), "cells: {of:?}, {}", told(&graph, scene));
    for (name, cell) in &of {
        assert_eq!(graph.cells[cell.index()].open, OPEN.contains(name), "{name}: {}", told(&graph, scene));
    }
    let pair = |a: CellId, b: CellId| if a < b { [a, b] } else { [b, a] };
    let joined: BTreeSet<[CellId; 2]> = graph.portals.iter().map(|p| pair(p.cells[0], p.cells[1])).collect();
    let expected: BTreeSet<[CellId; 2]> = known.sights.iter().map(|(a, b, _)| pair(of[a], of[b])).collect();
    assert_eq!(joined, expected, "joined: {of:?}, {}", told(&graph, scene));
    let rays = RayScene::new(scene);
    let free = |[from, to]: [DVec3; 2]| rays.first_opaque(from, (to - from).normalize(), from.distance(to)).is_none();
    for &(a, b, line) in &known.sights {
        let line = line.map(|p| p - scene.origin);
        assert!(free(line), "{a} to {b}: something stands in the way");
        assert_eq!([0, 1].map(|k| locator.locate(line[k]).map(|f| f.0)), [Some(of[a]), Some(of[b])], "{a} to {b}");
        assert!(goes_through(&graph, of[a], of[b], line), "{a} to {b}: through no portal: {}", told(&graph, scene));
    }
    for line in &known.within {
        let line = line.map(|p| p - scene.origin);
        assert!(free(line), "something stands in the way");
        let found: BTreeSet<Option<CellId>> =
            (0..=100).map(|k| locator.locate(line[0].lerp(line[1], f64::from(k) / 100.0)).map(|f| f.0)).collect();
        assert_eq!(found.len(), 1, "{line:?} goes through {found:?}: {}", told(&graph, scene));
    }
    let faults = validate::structure(&graph, scene.tolerance().coplanar.max(1e-9));
    assert!(faults.is_empty(), "{faults:?}");
    let sealing = validate::sealing(&graph, &rays, 100_000, 1);
    assert!(sealing.segments > 10_000, "only {} segments were followed", sealing.segments);
    let leaks: Vec<String> = sealing.leaks.iter().map(ToString::to_string).collect();
    assert!(leaks.is_empty(), "{leaks:?}");
    (graph, of)
}

/// Cells by volume and middle of their largest piece, portals by place and size, for messages.
fn told(graph: &CellGraph, scene: &Scene) -> String {
    let cell = |(i, c): (usize, &enfilade::cells::Cell)| {
        let size = |p: &enfilade::cells::Piece| p.bounds.size().element_product();
        let bounded = c.pieces.iter().filter(|p| size(p).is_finite());
        let largest = bounded.max_by(|a, b| size(a).total_cmp(&size(b))).map(|p| p.bounds.centre() + scene.origin);
        format!("\n  cell {i} {} of {} pieces around {largest:.2?}", if c.open { "open" } else { "closed" }, c.pieces.len())
    };
    let portal = |p: &enfilade::cells::Portal| {
        let at = enfilade::geom::middle(&p.winding) + scene.origin;
        format!("\n  portal {:?} {:?} {:.2} m2 at {at:.2}", p.cells.map(|c| c.0), p.kind, enfilade::geom::area(&p.winding))
    };
    let cells: String = graph.cells.iter().enumerate().map(cell).collect();
    cells + &graph.portals.iter().map(portal).collect::<String>()
}

const FAR: DVec3 = DVec3::new(-3.0, EYE, -2.0);

/// Two rooms of 4 x 5 m along x, parted by a wall at x = 4 with what `holes` leave of it, and without a way out.
fn two_rooms(holes: &[Box3]) -> Building {
    let mut b = Building::new();
    b.shell(v(0., 0., 0.), v(8.2, HIGH, 5.), &[]);
    b.holed(v(4., 0., 0.), v(4. + WALL, HIGH, 5.), holes);
    b
}

fn two_known(sight: [DVec3; 2]) -> Known {
    Known {
        cells: vec![
            ("west", vec![v(2., EYE, 2.5), v(0.1, 0.1, 0.1), v(3.9, 2.7, 4.9)]),
            ("east", vec![v(6., EYE, 2.5), v(4.3, 0.1, 0.1), v(8.1, 2.7, 4.9)]),
            ("outside", vec![FAR]),
        ],
        sights: vec![("west", "east", sight)],
        within: vec![],
    }
}

fn between(graph: &CellGraph, a: CellId, b: CellId) -> Vec<&enfilade::cells::Portal> {
    graph.portals.iter().filter(|p| p.cells == [a, b] || p.cells == [b, a]).collect()
}

const THROUGH: [DVec3; 2] = [DVec3::new(2., 1.2, 2.4), DVec3::new(6., 1.2, 2.6)];

#[test]
fn a_gallery_open_to_its_hall_is_part_of_it() {
    let mut b = Building::new();
    b.shell(v(0., 0., 0.), v(9., 5.8, 6.), &[door_z(2., 0., -WALL)]);
    // A slab at half height over a third of it, without anything at its edge.
    b.solid(v(6., 2.6, 0.), v(9., 2.9, 6.));
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("hall", vec![v(3., EYE, 3.), v(7.5, EYE, 3.), v(7.5, 4.4, 3.), v(3., 5.5, 5.8), v(8.9, 0.1, 5.9)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("hall", "outside", [v(2., EYE, 2.), v(2., EYE, -2.)])],
            within: vec![[v(1., EYE, 3.), v(8., 4.9, 3.)], [v(1., EYE, 3.), v(8.5, 0.5, 3.)]],
        },
    );
}

#[test]
fn a_room_under_a_gallery_is_one_of_its_own() {
    let mut b = Building::new();
    b.shell(v(0., 0., 0.), v(9., 5.8, 6.), &[]);
    b.solid(v(6., 2.6, 0.), v(9., 2.9, 6.));
    // A wall under its edge, with a doorway.
    b.holed(v(6., 0., 0.), v(6. + WALL, 2.6, 6.), &[door_x(6., 0., 3.)]);
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("hall", vec![v(3., EYE, 3.), v(7.5, 4.4, 3.), v(3., 5.5, 5.8)]),
                ("store", vec![v(7.5, EYE, 3.), v(8.9, 0.1, 5.9), v(6.3, 2.5, 0.1)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("hall", "store", [v(3., 1.2, 3.), v(8., 1.2, 3.1)])],
            within: vec![[v(1., EYE, 3.), v(8., 4.9, 3.)]],
        },
    );
}

#[test]
fn split_levels_joined_by_half_a_stair_are_two_rooms() {
    let mut b = Building::new();
    let way: Box3 = [v(3.9, 1.4, 2.), v(4.3, 3.4, 3.)];
    // Floors at 0 and 1.4 m, each 3.6 m high; the wall between stands from the lower floor to the upper roof.
    b.shell(v(0., 0., 0.), v(4., 3.6, 5.), &[way]);
    b.shell(v(4.2, 1.4, 0.), v(8.2, 5., 5.), &[way]);
    for step in 0..8 {
        let s = f64::from(step);
        b.solid_as("stair", Role::Stair, true, [v(2. + 0.25 * s, 0., 2.), v(2.25 + 0.25 * s, 0.175 * (s + 1.), 3.)]);
    }
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("lower", vec![v(1., EYE, 2.5), v(0.1, 0.1, 0.1), v(3.9, 3.5, 4.9), v(3., 2., 2.5), v(3., EYE, 4.)]),
                ("upper", vec![v(6., 3., 2.5), v(4.3, 1.5, 0.1), v(8.1, 4.9, 4.9)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("lower", "upper", [v(1., 1.9, 2.4), v(6., 2.9, 2.6)])],
            within: vec![[v(0.5, 2., 4.5), v(3.5, 3., 1.)]],
        },
    );
}

/// A house of 6 x 8 m whose roof, 0.2 m thick, goes from 1 m at the eaves to 4 m along the ridge at x = 3.
fn attic(b: &mut Building) {
    let gable = |x0: f64, x1: f64, low: f64| {
        let top = |x: f64| 4.0 - (x - 3.0).abs();
        let mut ring = vec![v(x0, low, 0.), v(x1, low, 0.), v(x1, top(x1), 0.)];
        if x0 < 3.0 && x1 > 3.0 {
            ring.push(v(3., 4., 0.));
        }
        ring.push(v(x0, top(x0), 0.));
        ring
    };
    let at = |ring: Vec<DVec3>, z: f64| ring.into_iter().map(|p| p + DVec3::Z * z).collect::<Vec<_>>();
    b.solid(v(-WALL, -WALL, -WALL), v(6. + WALL, 0., 8. + WALL));
    for side in [-1.0, 1.0] {
        let at = |x: f64, y: f64| v(3. + side * x, y, -WALL);
        b.swept(&[at(3., 0.), at(3. + WALL, 0.), at(3. + WALL, 1. - WALL), at(3., 1.)], v(0., 0., 8. + 2. * WALL));
        b.swept(
            &[at(0., 4.), at(3. + WALL, 4. - 3. - WALL), at(3. + WALL, 4.3 - 3. - WALL), at(0., 4.3)],
            v(0., 0., 8. + 2. * WALL),
        );
    }
    b.swept(&at(gable(0., 6., 0.), -WALL), v(0., 0., WALL));
    b.swept(&at(gable(0., 6., 0.), 8.), v(0., 0., WALL));
    // A partition at z = 4 with a doorway in the middle.
    for part in [gable(0., 2.55, 0.), gable(3.45, 6., 0.), gable(2.55, 3.45, 2.1)] {
        b.swept(&at(part, 4.), v(0., 0., WALL));
    }
}

#[test]
fn an_attic_has_rooms_under_its_slopes() {
    let mut b = Building::new();
    attic(&mut b);
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("front", vec![v(3., EYE, 2.), v(0.1, 0.1, 0.1), v(5.9, 0.5, 3.9), v(3., 3.8, 2.), v(1.5, 2.2, 3.)]),
                ("back", vec![v(3., EYE, 6.), v(0.1, 0.1, 4.3), v(5.9, 0.5, 7.9), v(3., 3.8, 6.), v(4.5, 2.2, 5.)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("front", "back", [v(2.9, 1.2, 1.), v(3.1, 1.2, 7.)])],
            within: vec![[v(0.2, 0.2, 2.), v(3., 3.8, 2.)], [v(0.2, 0.2, 2.), v(5.8, 0.9, 2.)]],
        },
    );
}

#[test]
fn a_round_room_is_one() {
    let mut b = Building::new();
    let corner = |i: usize, r: f64| DVec2::from_angle(i as f64 * std::f64::consts::TAU / 16.0 + 0.05) * r;
    for (low, thick) in [(-WALL, WALL), (HIGH, WALL)] {
        b.swept(&(0..16).map(|i| corner(i, 3.3)).map(|p| v(p.x, low, p.y)).collect::<Vec<_>>(), DVec3::Y * thick);
    }
    let at = |p: DVec2, y: f64| v(p.x, y, p.y);
    for i in 0..16 {
        let (a, c) = ((corner(i, 3.0), corner(i, 3.3)), (corner(i + 1, 3.0), corner(i + 1, 3.3)));
        let along = |t: f64| (a.0.lerp(c.0, t), a.1.lerp(c.1, t));
        let mut part = |s: (DVec2, DVec2), t: (DVec2, DVec2), low: f64| {
            b.swept(&[at(s.0, low), at(t.0, low), at(t.1, low), at(s.1, low)], DVec3::Y * (HIGH - low));
        };
        if i == 3 {
            // The facet's inner side is 1.17 m long: a doorway of 0.9 m.
            part(a, along(0.115), 0.0);
            part(along(0.885), c, 0.0);
            part(along(0.115), along(0.885), 2.1);
        } else {
            part(a, c, 0.0);
        }
    }
    let out = corner(3, 1.0).lerp(corner(4, 1.0), 0.5);
    let (near, far) = (out * 1.0, out * 5.0);
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("round", vec![v(0., EYE, 0.), v(2.8, 0.1, 0.), v(0., 2.7, -2.8), v(-2., EYE, 1.9)]),
                ("outside", vec![v(-8., EYE, 0.)]),
            ],
            sights: vec![("round", "outside", [at(near, 1.2), at(far, 1.2)])],
            within: vec![[v(-2.8, EYE, 0.), v(2.8, EYE, 0.3)]],
        },
    );
}

#[test]
fn a_slanted_wall_parts_rooms_as_a_straight_one_does() {
    let mut b = Building::new();
    b.shell(v(0., 0., 0.), v(9., HIGH, 6.), &[]);
    // From the front wall at x = 3 to the back wall at x = 6, its doorway in the middle.
    let (from, to) = (DVec2::new(3., -0.05), DVec2::new(6., 6.05));
    let middle = 0.5 * from.distance(to);
    b.wall_along(from, to, [0., HIGH], WALL, Some([middle - 0.45, middle + 0.45]));
    let across = (to - from).normalize().perp();
    let centre = from.midpoint(to);
    let sight = [centre + across * 1.5, centre - across * 1.5].map(|p| v(p.x, 1.2, p.y));
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("west", vec![v(1., EYE, 3.), v(0.1, 0.1, 0.1), v(5.5, 2.7, 5.9), v(2.5, EYE, 0.1)]),
                ("east", vec![v(8., EYE, 3.), v(3.3, 0.1, 0.1), v(8.9, 2.7, 5.9), v(6.3, EYE, 5.9)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("west", "east", sight)],
            within: vec![],
        },
    );
}

/// A pane over the whole of the wall between two rooms.
fn glass_wall(role: Role) {
    let mut b = two_rooms(&[[v(3.9, 0., 0.), v(4.3, HIGH, 5.)]]);
    b.solid_as("glass", role, false, [v(4.09, 0., 0.), v(4.11, HIGH, 5.)]);
    let (graph, of) = assert_known(&b.finish(), &two_known(THROUGH));
    let area: f64 = between(&graph, of["west"], of["east"]).iter().map(|p| enfilade::geom::area(&p.winding)).sum();
    assert!((area - 5.0 * HIGH).abs() < 0.1, "the whole wall is open to the eye, not {area} m2");
}

#[test]
fn a_window_from_wall_to_wall_parts_rooms_that_see_each_other() {
    glass_wall(Role::Window);
}

#[test]
fn a_wall_of_glass_parts_rooms_that_see_each_other() {
    glass_wall(Role::Structure);
}

#[test]
fn double_doors_are_one_door() {
    // 1.8 m wide.
    let way: Box3 = [v(3.9, 0., 1.6), v(4.3, 2.1, 3.4)];
    for open in [false, true] {
        let mut b = two_rooms(&[way]);
        for (name, hinge, side) in [("left", 1.6, 1.0), ("right", 3.4, -1.0)] {
            let along = if open { v(0.9, 0., 0.) } else { v(0., 0., 0.89 * side) };
            let thick = if open { v(0., 0., 0.04 * side) } else { v(0.04, 0., 0.) };
            let (a, c) = (v(4.1, 0.01, hinge), v(4.1, 2.09, hinge) + along + thick);
            b.solid_as(name, Role::Door, false, [a.min(c), a.max(c)]);
        }
        let (graph, of) = assert_known(&b.finish(), &two_known(THROUGH));
        let portals = between(&graph, of["west"], of["east"]);
        assert_eq!(portals.len(), 1, "{portals:?}");
        assert_eq!((portals[0].kind, portals[0].state.shut), (PortalKind::Door, !open), "{portals:?}");
        assert!((enfilade::geom::area(&portals[0].winding) - 1.8 * 2.1).abs() < 0.05);
    }
}

#[test]
fn an_arch_without_a_leaf_parts_rooms() {
    // 1.4 m wide, half round from 1.6 m up to 2.3 m.
    let mut b = two_rooms(&[[v(3.9, 0., 1.8), v(4.3, 2.4, 3.2)]]);
    let on = |k: usize| DVec2::from_angle(k as f64 * std::f64::consts::PI / 8.0) * 0.7 + DVec2::new(2.5, 1.6);
    for k in 0..8 {
        let (p, q) = (on(k), on(k + 1));
        b.swept(&[v(4., p.y, p.x), v(4., q.y, q.x), v(4., 2.4, q.x), v(4., 2.4, p.x)], v(WALL, 0., 0.));
    }
    let scene = b.finish();
    let (graph, of) = assert_known(&scene, &two_known(THROUGH));
    let portals = between(&graph, of["west"], of["east"]);
    assert!(portals.iter().all(|p| p.kind == PortalKind::Opening), "{portals:?}");
    // All of the arch is open, and at most the rectangle around it: its facets are too small to cut the plan.
    let area: f64 = portals.iter().map(|p| enfilade::geom::area(&p.winding)).sum();
    let arch = 1.4 * 1.6 + 4.0 * 0.7 * 0.7 * (std::f64::consts::PI / 8.0).sin();
    assert!(area >= arch - 0.01 && area <= 1.4 * 2.4 + 0.05, "{area} m2, the arch has {arch}");
}

#[test]
fn a_wide_opening_parts_rooms_and_a_missing_wall_does_not() {
    // 2 of 5 m.
    assert_known(&two_rooms(&[[v(3.9, 0., 1.5), v(4.3, HIGH, 3.5)]]).finish(), &two_known(THROUGH));
    // 4.4 of 5 m: what is left are pilasters.
    let scene = two_rooms(&[[v(3.9, 0., 0.3), v(4.3, HIGH, 4.7)]]).finish();
    let all = Known {
        cells: vec![("room", vec![v(2., EYE, 2.5), v(6., EYE, 2.5), v(8.1, 0.1, 4.9)]), ("outside", vec![FAR])],
        sights: vec![],
        within: vec![THROUGH],
    };
    assert_known(&scene, &all);
}

#[test]
fn an_l_shaped_room_is_one() {
    let mut b = Building::new();
    let yard: Box3 = [v(4.2, -1., 4.2), v(9., 9., 9.)];
    b.shell(v(0., 0., 0.), v(8., HIGH, 8.), &[yard]);
    b.solid(v(4., 0., 4.), v(4. + WALL, HIGH, 8. + WALL));
    b.solid(v(4. + WALL, 0., 4.), v(8. + WALL, HIGH, 4. + WALL));
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("room", vec![v(2., EYE, 2.), v(7.9, 0.1, 0.1), v(0.1, 2.7, 7.9)]),
                ("outside", vec![FAR, v(6., EYE, 6.)]),
            ],
            sights: vec![],
            within: vec![[v(6., EYE, 1.5), v(1.5, EYE, 6.)]],
        },
    );
}

#[test]
fn a_massive_pier_is_no_room() {
    let mut b = Building::new();
    b.shell(v(0., 0., 0.), v(8., HIGH, 8.), &[]);
    b.solid(v(4., 0., 4.), v(8., HIGH, 8.));
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![("room", vec![v(2., EYE, 2.), v(7.9, 0.1, 0.1), v(0.1, 2.7, 7.9)]), ("outside", vec![FAR])],
            sights: vec![],
            within: vec![[v(6., EYE, 1.5), v(1.5, EYE, 6.)]],
        },
    );
}

#[test]
fn paper_walls_part_rooms() {
    let mut b = Building::new();
    let (lo, hi) = (v(0., 0., 0.), v(12., HIGH, 5.));
    b.sheet(lo, hi.with_y(0.), &[]);
    b.sheet(lo.with_y(HIGH), hi, &[]);
    b.sheet(lo, hi.with_x(0.), &[]);
    b.sheet(lo.with_x(12.), hi, &[[v(11.9, 0., 2.), v(12.1, 2.1, 3.)]]);
    b.sheet(lo, hi.with_z(0.), &[]);
    b.sheet(lo.with_z(5.), hi, &[]);
    for x in [4., 8.] {
        b.sheet(lo.with_x(x), hi.with_x(x), &[[v(x - 0.1, 0., 2.), v(x + 0.1, 2.1, 2.9)]]);
    }
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("first", vec![v(2., EYE, 2.5), v(0.1, 0.1, 0.1), v(3.9, 2.7, 4.9)]),
                ("second", vec![v(6., EYE, 2.5), v(4.1, 0.1, 0.1), v(7.9, 2.7, 4.9)]),
                ("third", vec![v(10., EYE, 2.5), v(8.1, 0.1, 0.1), v(11.9, 2.7, 4.9)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![
                ("first", "second", [v(2., 1.2, 2.4), v(6., 1.2, 2.6)]),
                ("second", "third", [v(6., 1.2, 2.4), v(10., 1.2, 2.6)]),
                ("third", "outside", [v(10., 1.2, 2.4), v(15., 1.2, 2.6)]),
            ],
            within: vec![],
        },
    );
}

/// Two sheets of a floor lie over each other for 2 m, one 40 micrometres above the other. What leads between them is too narrow for a portal.
#[test]
fn a_floor_of_two_sheets_parts_storeys() {
    let mut b = Building::new();
    let (lo, hi) = (v(0., 0., 0.), v(10., 6., 5.));
    for (a, c) in [
        (lo, hi.with_y(0.)),
        (lo.with_y(6.), hi),
        (lo, hi.with_x(0.)),
        (lo.with_x(10.), hi),
        (lo, hi.with_z(0.)),
        (lo.with_z(5.), hi),
        (v(0., 3., 0.), v(6., 3., 5.)),
        (v(4., 3.00004, 0.), v(10., 3.00004, 5.)),
    ] {
        b.sheet(a, c, &[]);
    }
    let known = Known {
        cells: vec![
            ("lower", vec![v(2., EYE, 2.5), v(9.9, 2.9, 0.1)]),
            ("upper", vec![v(2., 3. + EYE, 2.5), v(9.9, 3.1, 0.1)]),
            ("outside", vec![FAR]),
        ],
        ..Known::default()
    };
    assert_known(&b.finish(), &known);
}

/// As [`less`], for boxes that are flat along one axis.
fn less_flat([a, c]: Box3, hole: Box3) -> Vec<Box3> {
    let flat = (0..3).find(|&k| a[k] == c[k]).unwrap();
    let (mut low, mut high) = (a, c);
    (low[flat], high[flat]) = (a[flat] - 0.01, a[flat] + 0.01);
    let back = |mut p: DVec3| {
        p[flat] = a[flat];
        p
    };
    less([low, high], hole).into_iter().map(|p| p.map(back)).collect()
}

#[test]
fn a_room_inside_a_room_is_another() {
    let mut b = Building::new();
    b.shell(v(0., 0., 0.), v(11., HIGH, 9.), &[]);
    // 3 x 3 m inside, walls up to the ceiling, a doorway towards -x.
    let (lo, hi, door) = (v(4., 0., 3.), v(7., HIGH, 6.), door_x(3.8, 0., 4.5));
    b.holed(v(3.8, 0., 2.8), v(4., HIGH, 6.2), &[door]);
    b.solid(v(7., 0., 2.8), v(7.2, HIGH, 6.2));
    b.solid(lo.with_z(2.8), hi.with_z(3.));
    b.solid(lo.with_z(6.), hi.with_z(6.2));
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("core", vec![v(5.5, EYE, 4.5), v(4.1, 0.1, 3.1), v(6.9, 2.7, 5.9)]),
                ("around", vec![v(2., EYE, 4.5), v(9., EYE, 4.5), v(5.5, EYE, 1.), v(5.5, EYE, 8.), v(0.1, 0.1, 0.1)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("core", "around", [v(6., 1.2, 4.5), v(2., 1.2, 4.6)])],
            within: vec![[v(1., EYE, 1.), v(10., EYE, 1.)], [v(10., EYE, 1.), v(10., EYE, 8.)]],
        },
    );
}

#[test]
fn a_cabin_in_a_hall_is_a_room_of_its_own() {
    let mut b = Building::new();
    b.shell(v(0., 0., 0.), v(14., 6., 10.), &[]);
    let door = door_x(4.8, 0., 5.);
    // 4 x 3 m inside, 2.5 m high, with a roof of its own.
    b.shell(v(5., 0.1, 3.5), v(9., 2.6, 6.5), &[door, [v(4., -1., 3.), v(10., -0.0, 7.)]]);
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("cabin", vec![v(7., EYE, 5.), v(5.1, 0.2, 3.6), v(8.9, 2.5, 6.4)]),
                ("hall", vec![v(2., EYE, 5.), v(12., EYE, 5.), v(7., 4., 5.), v(7., EYE, 1.), v(13.9, 5.9, 9.9)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("cabin", "hall", [v(7., 1.2, 5.), v(2., 1.2, 5.1)])],
            within: vec![[v(1., 5., 1.), v(13., 4., 9.)]],
        },
    );
}

#[test]
fn doubled_and_crossing_walls_change_nothing() {
    let way = door_x(4., 0., 2.5);
    let mut b = two_rooms(&[way]);
    // The wall again; again, shifted within its thickness; and once more, through both outer walls and the slabs.
    b.holed(v(4., 0., 0.), v(4. + WALL, HIGH, 5.), &[way]);
    b.holed(v(4.05, 0., 0.), v(4.15, HIGH, 5.), &[way]);
    b.holed(v(4., -0.1, -0.1), v(4. + WALL, HIGH + 0.1, 5.1), &[way]);
    // Outer walls through each other at the corners, and all of them twice.
    for _ in 0..2 {
        b.solid(v(-0.5, 0., -WALL), v(8.7, HIGH, 0.));
        b.solid(v(-WALL, 0., -0.5), v(0., HIGH, 5.5));
    }
    // A flat sheet along the side of the wall, and one in the middle of it; in pieces that overlap.
    for (x, ends) in [(4., [0., 1.5]), (4., [1., 2.05]), (4.1, [2.95, 4.]), (4.1, [3.5, 5.])] {
        let [a, c] = [v(x, 0., ends[0]), v(x, HIGH, ends[1])];
        b.mesh("", Role::Structure, true, &[vec![a, a.with_y(c.y), c, c.with_y(0.)]]);
    }
    let (graph, of) = assert_known(&b.finish(), &two_known(THROUGH));
    let portals = between(&graph, of["west"], of["east"]);
    let area: f64 = portals.iter().map(|p| enfilade::geom::area(&p.winding)).sum();
    assert!(portals.len() == 1 && (area - 0.9 * 2.1).abs() < 0.02, "{portals:?}");
}

#[test]
fn a_courtyard_is_outside() {
    let mut b = Building::new();
    // A ring 4 m wide around a yard of 5 x 5 m: the roof has a hole, and a wall stands around it.
    let yard: Box3 = [v(4.2, -1., 4.2), v(9.2, 9., 9.2)];
    b.shell(v(0., 0., 0.), v(13.4, HIGH, 13.4), &[[yard[0].with_y(HIGH), yard[1]]]);
    let (lo, hi) = (v(4., 0., 4.), v(9.4, HIGH, 9.4));
    b.holed(lo, hi, &[yard, [v(6.2, 0., 3.9), v(7.1, 2.1, 4.3)]]);
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("ring", vec![v(2., EYE, 2.), v(11., EYE, 2.), v(11., EYE, 11.), v(2., EYE, 11.), v(6.7, EYE, 2.)]),
                ("outside", vec![FAR, v(6.7, EYE, 6.7), v(4.3, 0.1, 4.3), v(6.7, 6., 6.7)]),
            ],
            sights: vec![("ring", "outside", [v(6.6, 1.2, 2.), v(6.7, 1.2, 6.)])],
            within: vec![[v(1., EYE, 2.), v(12., EYE, 2.)], [v(6.7, EYE, 6.7), v(6.7, 9., 6.7)]],
        },
    );
}

#[test]
fn a_balcony_is_outside() {
    let mut b = Building::new();
    let out = door_x(6., 3., 2.5);
    // Two storeys of one room each, without a stair; on the upper one a door to a balcony with parapets.
    b.shell(v(0., 0., 0.), v(6., HIGH, 5.), &[]);
    b.shell(v(0., 3., 0.), v(6., 3. + HIGH, 5.), &[out]);
    b.solid(v(6.2, 2.8, 1.), v(8., 3., 4.));
    for (a, c) in [(v(7.9, 3., 1.), v(8., 4., 4.)), (v(6.2, 3., 1.), v(7.9, 4., 1.1)), (v(6.2, 3., 3.9), v(7.9, 4., 4.))] {
        b.solid(a, c);
    }
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("lower", vec![v(3., EYE, 2.5), v(0.1, 0.1, 0.1)]),
                ("upper", vec![v(3., 4.5, 2.5), v(5.9, 5.7, 4.9)]),
                ("outside", vec![FAR, v(7., 4.5, 2.5), v(7., 3.1, 2.5), v(7., 1., 2.5)]),
            ],
            sights: vec![("upper", "outside", [v(3., 4.2, 2.5), v(7.5, 4.2, 2.6)])],
            within: vec![[v(7., 3.2, 2.5), v(7., 6., 2.5)]],
        },
    );
}

#[test]
fn stairs_join_two_storeys_through_the_floor() {
    let mut b = Building::new();
    let hole: Box3 = [v(4., HIGH - 0.1, 0.5), v(5., HIGH + 0.3, 4.)];
    b.shell(v(0., 0., 0.), v(7., HIGH, 6.), &[hole]);
    b.shell(v(0., HIGH + WALL, 0.), v(7., 2. * HIGH + WALL, 6.), &[hole]);
    for step in 0..15 {
        let s = f64::from(step);
        let z = 0.5 + 3.5 * s / 15.0;
        b.solid_as("stair", Role::Stair, true, [v(4., 0.2 * s, z), v(5., 0.2 * (s + 1.), z + 3.5 / 15.0)]);
    }
    let (graph, of) = assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("lower", vec![v(1., EYE, 3.), v(6.9, 0.1, 5.9), v(4.5, 2.5, 0.8), v(0.1, 2.7, 0.1)]),
                ("upper", vec![v(1., 4.5, 3.), v(6.9, 3.1, 5.9), v(4.5, 4.5, 2.)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("lower", "upper", [v(4.5, 1.8, 0.7), v(4.5, 4.8, 0.8)])],
            within: vec![[v(1., EYE, 1.), v(6.5, EYE, 5.5)]],
        },
    );
    let portals = between(&graph, of["lower"], of["upper"]);
    assert!(portals.iter().all(|p| p.plane.n.y.abs() > 0.999), "level, all of them: {portals:?}");
}

#[test]
fn a_lift_shaft_is_one_cell_over_its_storeys() {
    let mut b = Building::new();
    let (lo, hi) = (v(6.2, 0., 2.), v(8.2, 8.8, 4.));
    let mut known = Known { within: vec![[v(7.2, 0.3, 3.), v(7.2, 8.5, 3.)]], ..Known::default() };
    let doors: Vec<Box3> =
        (0..3).map(|storey| 3.0 * f64::from(storey)).map(|y| [v(5.9, y, 2.5), v(6.3, y + 2.1, 3.5)]).collect();
    b.shell(lo, hi, &doors);
    for (storey, name) in ["ground", "first", "second"].into_iter().enumerate() {
        let y = 3.0 * storey as f64;
        b.shell(v(0., y, 0.), v(6., y + HIGH, 6.), &doors);
        known.cells.push((name, vec![v(2., y + EYE, 3.), v(0.1, y + 0.1, 0.1), v(5.9, y + 2.7, 5.9)]));
        known.sights.push((name, "shaft", [v(3., y + 1.2, 2.9), v(7.5, y + 1.2, 3.1)]));
    }
    known.cells.push(("shaft", vec![v(7.2, 0.5, 3.), v(7.2, 2.9, 3.), v(7.2, 8.7, 3.)]));
    known.cells.push(("outside", vec![FAR]));
    assert_known(&b.finish(), &known);
}

/// Wings of three rooms side by side, 6 m apart, each room with a window into what lies between two wings, with or without ground below.
fn wings(count: usize, ground: bool) -> (Building, Known) {
    const ROOMS: [[&str; 3]; 3] = [["a1", "a2", "a3"], ["b1", "b2", "b3"], ["c1", "c2", "c3"]];
    let (mut b, mut known) = (Building::new(), Known::default());
    let west = |wing: usize| 11.0 * wing as f64;
    let window = |x: f64, z: f64| [v(x - 0.01, 0.9, z - 0.7), v(x + WALL + 0.01, 2.2, z + 0.7)];
    let court = |wing: usize| if count < 3 { "outside" } else { OPEN[1 + wing] };
    for (wing, names) in ROOMS.iter().enumerate().take(count) {
        let (x, mut holes) = (west(wing), Vec::new());
        for (room, name) in names.iter().enumerate() {
            let z = 2.0 + 4.2 * room as f64;
            known.cells.push((name, vec![v(x + 2.5, EYE, z), v(x + 0.1, 0.1, z - 1.9), v(x + 4.9, 2.7, z + 1.9)]));
            if wing > 0 {
                holes.push(window(x - WALL, z));
                known.sights.push((name, court(wing - 1), [v(x + 2., 1.5, z), v(x - 3., 1.6, z)]));
            }
            if wing + 1 < count {
                holes.push(window(x + 5., z));
                known.sights.push((name, court(wing), [v(x + 3., 1.5, z), v(x + 8., 1.6, z)]));
            }
        }
        b.shell(v(x, 0., 0.), v(x + 5., HIGH, 12.4), &holes);
        b.solid(v(x, 0., 4.), v(x + 5., HIGH, 4.2));
        b.solid(v(x, 0., 8.2), v(x + 5., HIGH, 8.4));
        if count == 3 && wing < 2 {
            known.cells.push((court(wing), vec![v(x + 8., EYE, 6.), v(x + 5.5, 0.1, 1.), v(x + 10.5, 2.7, 11.)]));
            known.sights.push((court(wing), "outside", [v(x + 8., EYE, 6.), v(x + 8., 9., 6.)]));
            if !ground {
                known.sights.push((court(wing), "outside", [v(x + 8., EYE, 6.), v(x + 8., -3., 6.)]));
            }
        }
    }
    if ground {
        b.solid(v(-6., -WALL - 0.4, -6.), v(west(count), -WALL, 18.));
    }
    known.cells.push(("outside", vec![FAR, v(3., 8., 3.)]));
    (b, known)
}

/// Between two wings there is one court, and nothing that it is shut off from; with three there are two.
#[test]
fn courts_between_wings_are_cells_of_their_own() {
    for (count, ground) in [(2, true), (2, false), (3, true), (3, false)] {
        let (building, known) = wings(count, ground);
        assert_known(&building.finish(), &known);
    }
}

/// Files turn their triangles either way.
#[test]
fn two_rooms_of_solids_turned_inside_out_are_two_rooms() {
    let right = two_rooms(&[door_x(4., 0., 2.5)]).finish();
    let mut b = SceneBuilder::new(&ImportOptions::default(), Source::default());
    for object in &right.objects {
        let corners = object.triangles.clone().flat_map(|t| right.corners(t as usize));
        let positions: Vec<DVec3> = corners.map(|p| p + right.origin).collect();
        let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 2, 3 * t + 1]).collect();
        let mesh = Mesh { node: object.node.clone(), role: object.role, opaque: object.opaque, positions, triangles };
        b.add(mesh).unwrap();
    }
    assert_known(&b.finish("inside out").unwrap(), &two_known(THROUGH));
}

/// The same two rooms and their door, in units that a person's metre is so many of.
#[test]
fn two_rooms_in_other_units_are_two_rooms() {
    for unit in [1e-3, 0.01, 0.3, 1.0 / 0.3048, 1.0 / 0.0254, 40.0, 100.0, 1e3] {
        let metres = two_rooms(&[door_x(4., 0., 2.5)]).finish();
        let mut b = SceneBuilder::new(&ImportOptions::default(), Source::default());
        for object in &metres.objects {
            let corners = object.triangles.clone().flat_map(|t| metres.corners(t as usize));
            let positions: Vec<DVec3> = corners.map(|p| (p + metres.origin) * unit).collect();
            let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            let mesh = Mesh { node: object.node.clone(), role: object.role, opaque: object.opaque, positions, triangles };
            b.add(mesh).unwrap();
        }
        let known = two_known(THROUGH);
        let scale = |p: &DVec3| *p * unit;
        let scaled = Known {
            cells: known.cells.iter().map(|(n, p)| (*n, p.iter().map(scale).collect())).collect(),
            sights: known.sights.iter().map(|(a, c, l)| (*a, *c, l.map(|p| p * unit))).collect(),
            within: vec![],
        };
        eprintln!("{unit} units to a metre");
        assert_known(&b.finish("scaled").unwrap(), &scaled);
    }
}
