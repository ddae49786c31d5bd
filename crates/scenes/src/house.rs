//! Villa Almerico Capra, *La Rotonda* (Andrea Palladio, Vicenza, begun about 1566): the piano nobile, its dome and its four
//! porticoes.
//!
//! Based on: A. Palladio, *I Quattro Libri dell'Architettura*, Venice 1570, book II, plan of the house of Paolo Almerico. From
//! it: the layout, and the sizes in Vicentine feet (0.357 m) of the round hall (30 across), the large rooms (26 x 15), the small
//! rooms (15 x 11) and the porticoes (30 x 12). The block's side, 24.7 m, is that of the existing house. The rest is estimated:
//! wall thicknesses (the remainder of the block), widths of passages, all heights, positions of doors and windows, columns,
//! steps, roof and dome. Left out: vaults, mezzanines, attic, basement, the stairs inside the hall's masonry, ornament.
//!
//! The plan is symmetric in x and in z, so each part is made once for every sign of x and z. The large rooms' doors are aligned
//! along x, those of large and small rooms along z, and those of the porticoes through the hall along both.

mod portico;

use super::building::Building;
use super::facts::{Facts, Fill, Opening, Room};
use super::furniture;
use super::model::{Material, Model, Placement};
use super::path::CameraPath;
use super::plan::{leaf, pane};
use super::solid::{Solid, cuboid, extrude, lathe, turn};
use enfilade::math::geom::Aabb;
use enfilade::math::random::Prng;
use enfilade::scene::Role;
use glam::{DVec2, DVec3};
use portico::portico;

/// A Vicentine foot, metres.
const FOOT: f64 = 0.357;

// In plan, feet from the middle.
/// Outer and inner face of the outer walls.
const BLOCK: f64 = 12.35 / FOOT;
const INSIDE: f64 = 33.0;
/// Half the side of the square around the hall.
const CORE: f64 = 18.0;
/// Radius of the hall.
const HALL: f64 = 15.0;
/// Half the width of the passages along z and along x.
const PASSAGE_Z: f64 = 4.0;
const PASSAGE_X: f64 = 3.0;
/// Start of the large rooms in x, and range of the small rooms in z.
const LARGE: f64 = 7.0;
const SMALL: [f64; 2] = [5.0, 16.0];
/// Half the porticoes' width, and their front.
const PORTICO: f64 = 15.0;
const PORTICO_FRONT: f64 = BLOCK + 12.0;
/// Door axes: of the large rooms along x (at this z), of large and small rooms along z (at this x).
const ENFILADE_X: f64 = 25.5;
const ENFILADE_Z: f64 = 28.0;
/// Centre lines of walls: beside passages along z, beside passages along x, and between rooms.
const AXIS_Z: f64 = (PASSAGE_Z + LARGE) / 2.0;
const AXIS_X: f64 = (PASSAGE_X + SMALL[0]) / 2.0;
const AXIS_ROOMS: f64 = (SMALL[1] + CORE) / 2.0;

// Heights, metres.
/// Heights of the piano nobile's floor, its rooms' ceiling, and the top of the hall's masonry.
const FLOOR: f64 = 3.0;
const CEILING: f64 = FLOOR + 6.4;
const SLAB: f64 = 0.4;
const DRUM: f64 = CEILING + SLAB + 2.8;
const DOME_THICKNESS: f64 = 0.45;
/// Doors between rooms, doors to the porticoes, passages into the hall: width and height.
const DOOR: [f64; 2] = [1.2, 2.6];
const GATE: [f64; 2] = [1.6, 3.4];
const HALL_OPENING: f64 = 3.2;
/// Windows: width, sill, head.
const WINDOW: [f64; 3] = [1.2, 0.9, 3.0];

/// Segments of the hall's wall between two passages.
const ARC: u32 = 8;

struct House {
    model: Model,
    facts: Facts,
}

/// A box from two corners in plan (feet) and two heights (metres).
fn feet(a: [f64; 2], b: [f64; 2], y: [f64; 2]) -> Aabb {
    Aabb::of([DVec3::new(a[0] * FOOT, y[0], a[1] * FOOT), DVec3::new(b[0] * FOOT, y[1], b[1] * FOOT)])
}

/// An opening of a wall: position along it (feet); width, sill and head (metres above the floor); fill.
type Pierced = (f64, [f64; 3], Fill);

impl House {
    /// A wall between two corners in plan (feet), with its openings; its thickness is along z if `along_x`. `sides`: the rooms at
    /// lower and higher coordinates. `into`: see [`super::plan::Hole::into`].
    fn wall(
        &mut self,
        name: &str,
        along_x: bool,
        [a, b]: [[f64; 2]; 2],
        holes: &[Pierced],
        sides: [Option<usize>; 2],
        into: usize,
    ) {
        let bounds = feet(a, b, [FLOOR, CEILING]);
        let (along, across) = if along_x { (0, 2) } else { (2, 0) };
        let cuts: Vec<Aabb> = holes
            .iter()
            .map(|&(at, [width, sill, head], _)| {
                let mut cut = bounds;
                (cut.min[along], cut.max[along]) = (at * FOOT - width / 2.0, at * FOOT + width / 2.0);
                (cut.min.y, cut.max.y) = (FLOOR + sill, FLOOR + head);
                cut
            })
            .collect();
        let solid = super::solid::perforated(bounds.min, bounds.max, across, &cuts);
        self.model.add(format!("wall {name}"), Role::Structure, Material::Plaster, solid);
        for (i, (cut, &(_, [width, sill, head], fill))) in cuts.iter().zip(holes).enumerate() {
            let normal = if along_x { DVec3::Z } else { DVec3::X };
            let size = DVec3::new(width, head - sill, cut.size()[across]);
            self.facts.openings.push(Opening {
                fill,
                storey: 0,
                centre: cut.centre(),
                size,
                normal,
                rooms: [sides[1], sides[0]],
            });
            match fill {
                Fill::Glass => pane(&mut self.model, &format!("window {name} {i}"), along_x, cut),
                Fill::Door => leaf(&mut self.model, &format!("door {name} {i}"), along_x, cut, into, false),
                Fill::Nothing => {}
            }
        }
    }

    fn solid(&mut self, name: impl Into<String>, material: Material, solid: Solid) {
        self.model.add(name, Role::Structure, material, solid);
    }

    /// A rectangular room between two corners in plan, feet.
    fn room(&mut self, name: &str, a: [f64; 2], b: [f64; 2]) -> usize {
        let Aabb { min, max } = feet(a, b, [FLOOR, CEILING]);
        let footprint =
            [(min.x, min.z), (max.x, min.z), (max.x, max.z), (min.x, max.z)].map(|(x, z)| DVec2::new(x, z)).to_vec();
        self.push_room(name, footprint, CEILING)
    }

    fn push_room(&mut self, name: &str, footprint: Vec<DVec2>, ceiling: f64) -> usize {
        let id = format!("0.{}", self.facts.rooms.len());
        self.facts.rooms.push(Room { id, name: name.into(), storey: 0, height: [FLOOR, ceiling], footprint });
        self.facts.rooms.len() - 1
    }

    /// Floor and ceiling between two corners in plan, feet.
    fn slabs(&mut self, name: &str, a: [f64; 2], b: [f64; 2]) {
        let floor = feet(a, b, [FLOOR - SLAB, FLOOR]);
        let ceiling = feet(a, b, [CEILING, CEILING + SLAB]);
        self.solid(format!("floor {name}"), Material::Stone, cuboid(floor.min, floor.max));
        self.solid(format!("ceiling {name}"), Material::Plaster, cuboid(ceiling.min, ceiling.max));
    }
}

/// The hall's wall between two passages, in the quarter with positive x and z: from the x axis to the z axis.
fn quarter_arc() -> Vec<DVec2> {
    let ends = [
        DVec2::new((HALL * HALL - PASSAGE_X * PASSAGE_X).sqrt(), PASSAGE_X),
        DVec2::new(PASSAGE_Z, (HALL * HALL - PASSAGE_Z * PASSAGE_Z).sqrt()),
    ];
    // The ends are at 0.032 and 0.207 turns; the corners between them are evenly spaced.
    let mut arc = vec![ends[0]];
    arc.extend((1..ARC).map(|k| {
        let (cos, sin) = turn(0.032 + 0.175 * f64::from(k) / f64::from(ARC));
        DVec2::new(HALL * cos, HALL * sin)
    }));
    arc.push(ends[1]);
    arc
}

/// The house.
pub(super) fn house() -> Building {
    let mut house = House { model: Model::default(), facts: Facts::default() };
    house.facts.storeys.push(("Piano nobile".into(), FLOOR));
    let hall = hall(&mut house);
    // Rooms by the signs of x and z: [west, east], [north, south].
    let signs = [-1.0, 1.0];
    let words = [["north-west", "south-west"], ["north-east", "south-east"]];
    let along_z = [0, 1].map(|j| {
        let s = signs[j];
        house.room(["North passage", "South passage"][j], [-PASSAGE_Z, CORE * s], [PASSAGE_Z, INSIDE * s])
    });
    let along_x = [0, 1].map(|i| {
        let s = signs[i];
        house.room(["West passage", "East passage"][i], [CORE * s, -PASSAGE_X], [INSIDE * s, PASSAGE_X])
    });
    for i in 0..2 {
        for j in 0..2 {
            let passages = [along_z[j], along_x[i]];
            quarter(&mut house, [signs[i], signs[j]], words[i][j], passages);
        }
    }
    for (k, passage) in along_z.into_iter().chain(along_x).enumerate() {
        axis(&mut house, k < 2, signs[k % 2], passage, hall);
    }
    let roof = ["north", "west", "south", "east"].map(|n| format!("roof {n}"));
    for (k, name) in roof.into_iter().enumerate() {
        let (cos, sin) = turn(k as f64 / 4.0);
        let solid = hip(DVec3::new(-sin, 0.0, -cos), DVec3::new(cos, 0.0, -sin));
        house.solid(name, Material::Roof, solid);
    }
    let block = feet([-BLOCK, -BLOCK], [BLOCK, BLOCK], [0.0, FLOOR - SLAB]);
    house.solid("basement", Material::Stone, cuboid(block.min, block.max));
    house.solid("ground", Material::Ground, cuboid(DVec3::new(-40.0, -0.5, -40.0), DVec3::new(40.0, 0.0, 40.0)));
    let House { model, facts } = house;
    Building { name: "villa_rotonda".into(), seed: 0, counted: vec![("houses", 1)], model, facts, path: walk() }
}

/// The round hall: floor, masonry with four passages, dome, four statues.
fn hall(house: &mut House) -> usize {
    let arc = quarter_arc();
    let mut ring = Vec::new();
    for (i, (sx, sz)) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].into_iter().enumerate() {
        let mut corners: Vec<DVec2> = arc.iter().map(|p| DVec2::new(p.x * sx, p.y * sz) * FOOT).collect();
        let mut outline = corners.clone();
        outline.extend([(PASSAGE_Z, CORE), (CORE, CORE), (CORE, PASSAGE_X)].map(|(x, z)| DVec2::new(x * sx, z * sz) * FOOT));
        // z x x is y: upwards.
        let outline: Vec<DVec2> = outline.iter().map(|p| DVec2::new(p.y, p.x)).collect();
        let solid = extrude(&outline, DVec3::Y * FLOOR, DVec3::Z, DVec3::X, DRUM - FLOOR);
        house.solid(format!("masonry {i}"), Material::Plaster, solid);
        if sx * sz < 0.0 {
            corners.reverse();
        }
        ring.extend(corners);
        let (at, spin) = (DVec3::new(sx, 0.0, sz) * (9.0 * FOOT) + DVec3::Y * FLOOR, i as f64 / 4.0 + 0.125);
        house.model.place(
            format!("plinth {i}"),
            Role::Furnishing,
            Placement { at, turns: spin },
            "plinth",
            Material::Stone,
            furniture::plinth,
        );
        let make = || furniture::sculpture(&mut Prng::new(i as u64, 0));
        let turned = Placement { at: at + DVec3::Y, turns: spin };
        house.model.place(format!("statue {i}"), Role::Furnishing, turned, &format!("statue {i}"), Material::Bronze, make);
    }
    let floor = feet([-CORE, -CORE], [CORE, CORE], [FLOOR - SLAB, FLOOR]);
    house.solid("floor hall", Material::Stone, cuboid(floor.min, floor.max));
    // The dome: up the outside, down the inside.
    const RINGS: u32 = 8;
    let shell = |radius: f64| {
        (0..RINGS).map(move |k| turn(f64::from(k) / f64::from(4 * RINGS))).map(move |(c, s)| (radius * c, DRUM + radius * s))
    };
    let (inner, outer) = (HALL * FOOT, HALL * FOOT + DOME_THICKNESS);
    let mut profile = vec![(0.0, DRUM + outer)];
    profile.extend(shell(outer).collect::<Vec<_>>().into_iter().rev());
    profile.extend(shell(inner));
    profile.push((0.0, DRUM + inner));
    profile.reverse();
    house.solid("dome", Material::Roof, lathe(&profile, 32));
    house.push_room("Hall", ring, DRUM + inner)
}

/// A large and a small room and the walls around them. `s`: the signs of x and z. `passages`: along z, along x.
fn quarter(house: &mut House, s: [f64; 2], direction: &str, passages: [usize; 2]) {
    let quarter = Quarter { s, direction };
    let p = |x: f64, z: f64| quarter.at(x, z);
    let large = house.room(&quarter.name("Large room"), p(LARGE, CORE), p(INSIDE, INSIDE));
    let small = house.room(&quarter.name("Small room"), p(CORE, SMALL[0]), p(INSIDE, SMALL[1]));
    quarter.outer_walls(house, large, small);
    quarter.inner_walls(house, large, small, passages);
    house.slabs(&quarter.name("large"), p(AXIS_Z, CORE), p(BLOCK, BLOCK));
    house.slabs(&quarter.name("small"), p(CORE, AXIS_X), p(BLOCK, CORE));
    quarter.furnish(house);
}

/// A quarter of the block.
struct Quarter<'q> {
    /// The signs of x and z.
    s: [f64; 2],
    /// Its direction in words.
    direction: &'q str,
}

impl Quarter<'_> {
    fn name(&self, what: &str) -> String {
        format!("{what} {}", self.direction)
    }

    /// A point in plan, feet, mirrored to this quarter from positive x and z.
    fn at(&self, x: f64, z: f64) -> [f64; 2] {
        [x * self.s[0], z * self.s[1]]
    }

    /// Rooms on the lower and higher side of a wall, from the rooms nearer to and farther from the middle.
    fn order(&self, axis: usize, near: Option<usize>, far: Option<usize>) -> [Option<usize>; 2] {
        if self.s[axis] > 0.0 { [near, far] } else { [far, near] }
    }

    /// Walls with windows.
    fn outer_walls(&self, house: &mut House, large: usize, small: usize) {
        let s = self.s;
        let p = |x: f64, z: f64| self.at(x, z);
        let window = |at: f64| (at, WINDOW, Fill::Glass);
        let mut wall = |what: &str, axis: usize, ends: [[f64; 2]; 2], windows: &[Pierced], room: usize| {
            house.wall(&self.name(what), axis == 1, ends, windows, self.order(axis, Some(room), None), 0);
        };
        let windows = [window(11.0 * s[0]), window(ENFILADE_Z * s[0])];
        wall("front", 1, [p(AXIS_Z, INSIDE), p(BLOCK, BLOCK)], &windows, large);
        let windows = [window(ENFILADE_X * s[1])];
        wall("side large", 0, [p(INSIDE, AXIS_ROOMS), p(BLOCK, INSIDE)], &windows, large);
        let windows = [window(10.5 * s[1])];
        wall("side small", 0, [p(INSIDE, AXIS_X), p(BLOCK, AXIS_ROOMS)], &windows, small);
    }

    /// Walls with doors; the leaves open away from the middle.
    fn inner_walls(&self, house: &mut House, large: usize, small: usize, passages: [usize; 2]) {
        let p = |x: f64, z: f64| self.at(x, z);
        let mut wall = |what: &str, axis: usize, ends: [[f64; 2]; 2], at: f64, [near, far]: [usize; 2]| {
            let door = (at, [DOOR[0], 0.0, DOOR[1]], Fill::Door);
            let sides = self.order(axis, Some(near), Some(far));
            house.wall(&self.name(what), axis == 1, ends, &[door], sides, usize::from(self.s[axis] > 0.0));
        };
        let [in_x, in_z] = [ENFILADE_X * self.s[1], ENFILADE_Z * self.s[0]];
        wall("passage large", 0, [p(PASSAGE_Z, CORE), p(LARGE, INSIDE)], in_x, [passages[0], large]);
        wall("large small", 1, [p(CORE, SMALL[1]), p(INSIDE, CORE)], in_z, [small, large]);
        wall("passage small", 1, [p(CORE, PASSAGE_X), p(INSIDE, SMALL[0])], in_z, [passages[1], small]);
    }

    fn furnish(&self, house: &mut House) {
        let s = self.s;
        let mut put = |what: &str, x: f64, z: f64, turns: f64, material: Material, make: fn() -> Solid| {
            let at = DVec3::new(x * s[0] * FOOT, FLOOR, z * s[1] * FOOT);
            let name = format!("{} {x}", self.name(what));
            house.model.place(name, Role::Furnishing, Placement { at, turns }, what, material, make);
        };
        put("table", 15.0, 30.5, 0.0, Material::Wood, || furniture::table(2.4));
        put("bench", 15.0, 19.5, 0.0, Material::Wood, furniture::bench);
        put("bench", 19.6, 10.5, 0.25, Material::Wood, furniture::bench);
        for x in [13.0, 17.0] {
            put("chair", x, 28.0, 0.25 + 0.25 * s[1], Material::Fabric, furniture::chair);
        }
        // A picture on the masonry, seen from the large room.
        let at = DVec3::new(11.0 * s[0] * FOOT, FLOOR + 1.9, CORE * s[1] * FOOT);
        let placement = Placement { at, turns: if s[1] > 0.0 { 0.0 } else { 0.5 } };
        let make = || furniture::picture(1.8, 1.2);
        house.model.place(self.name("picture"), Role::Furnishing, placement, "picture", Material::Picture, make);
    }
}

/// The end of a passage and the portico in front of it. `z`: the passage runs along z, else along x; `s`: its side.
fn axis(house: &mut House, z: bool, s: f64, passage: usize, hall: usize) {
    let (half, wall_axis) = if z { (PASSAGE_Z, AXIS_Z) } else { (PASSAGE_X, AXIS_X) };
    let direction = match (z, s > 0.0) {
        (true, false) => "north",
        (true, true) => "south",
        (false, false) => "west",
        (false, true) => "east",
    };
    // In feet: across the axis, and outwards along it.
    let p = |across: f64, out: f64| {
        if z { [across, out * s] } else { [out * s, across] }
    };
    let order = |near: Option<usize>, far: Option<usize>| if s > 0.0 { [near, far] } else { [far, near] };
    let gate = (0.0, [GATE[0], 0.0, GATE[1]], Fill::Door);
    let into = usize::from(s < 0.0);
    house.wall(
        &format!("gate {direction}"),
        z,
        [p(-wall_axis, INSIDE), p(wall_axis, BLOCK)],
        &[gate],
        order(Some(passage), None),
        into,
    );
    house.slabs(&format!("passage {direction}"), p(-wall_axis, CORE), p(wall_axis, BLOCK));

    // The masonry above the passage into the hall.
    let chord = (HALL * HALL - half * half).sqrt();
    let lintel = feet(p(-half, chord), p(half, CORE), [FLOOR + HALL_OPENING, DRUM]);
    house.solid(format!("lintel {direction}"), Material::Plaster, cuboid(lintel.min, lintel.max));
    let hole = feet(p(-half, chord), p(half, CORE), [FLOOR, FLOOR + HALL_OPENING]);
    let normal = if z { DVec3::Z } else { DVec3::X };
    let size = DVec3::new(2.0 * half * FOOT, HALL_OPENING, (CORE - chord) * FOOT);
    let [lesser, greater] = order(Some(hall), Some(passage));
    let rooms = [greater, lesser];
    house.facts.openings.push(Opening { fill: Fill::Nothing, storey: 0, centre: hole.centre(), size, normal, rooms });

    portico(house, direction, &p, z, s);
}

/// One slope of the roof as a solid, from eaves to drum: `out` points to its eaves, `right` along them.
fn hip(out: DVec3, right: DVec3) -> Solid {
    let low = DVec3::Y * (CEILING + SLAB);
    let high = DVec3::Y * DRUM;
    let (eave, core) = (BLOCK * FOOT, CORE * FOOT);
    let at = |o: f64, r: f64, y: DVec3| out * o + right * r + y;
    let positions = vec![
        at(eave, -eave, low),
        at(eave, eave, low),
        at(core, core, low),
        at(core, -core, low),
        at(core, core, high),
        at(core, -core, high),
    ];
    let triangles = vec![[0, 4, 1], [0, 5, 4], [0, 1, 2], [0, 2, 3], [3, 4, 5], [3, 2, 4], [1, 4, 2], [0, 3, 5]];
    Solid { positions, triangles }
}

/// From the south up the steps, through the hall, around the eastern and southern rooms, and to the north portico.
fn walk() -> CameraPath {
    let p = |x: f64, z: f64| DVec3::new(x * FOOT, FLOOR, z * FOOT);
    let foot = PORTICO_FRONT * FOOT + 19.0 * 0.3;
    let way = [
        DVec3::new(0.0, 0.0, foot + 9.0),
        DVec3::new(0.0, 0.0, foot + 0.3),
        DVec3::new(0.0, FLOOR, PORTICO_FRONT * FOOT),
        p(0.0, INSIDE),
        p(0.0, 0.0),
        p(ENFILADE_Z, 0.0),
        p(ENFILADE_Z, ENFILADE_X),
        p(-ENFILADE_Z, ENFILADE_X),
        p(-ENFILADE_Z, 0.0),
        p(0.0, 0.0),
        p(0.0, -PORTICO_FRONT + 3.0),
    ];
    CameraPath::along(&way, 0.85)
}

#[cfg(test)]
mod tests {
    use super::super::solid::tests::assert_closed;
    use super::*;

    #[test]
    fn every_part_is_closed() {
        let house = house();
        for node in &house.model.nodes {
            assert_closed(&house.model.meshes[node.mesh].0, &node.name);
        }
    }

    #[test]
    fn rooms_have_palladios_sizes_in_feet() {
        let house = house();
        for (name, long, short) in [("Large", 26.0, 15.0), ("Small", 15.0, 11.0)] {
            let rooms: Vec<_> = house.facts.rooms.iter().filter(|r| r.name.starts_with(name)).collect();
            assert_eq!(rooms.len(), 4);
            for room in rooms {
                let size = (room.footprint[2] - room.footprint[0]).abs() / FOOT;
                assert!((size - DVec2::new(long, short)).length() < 1e-9, "{name}: {size}");
            }
        }
    }
}
