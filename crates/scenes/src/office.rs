//! An office building: wings of offices on both sides of a corridor, joined by a spine with stairs, a lift and a lobby.
//!
//! Seen from above (x to the right, z down), one wing and its core; further wings follow along the spine, with courts between:
//!
//! ```text
//!   stairs         | s | office | office  | office |
//!   store   | lift | p +---------------------------+
//!   lobby or       | i   corridor                  |
//!   meeting room   | n +---------------------------+
//!                  | e | office  | office | office |
//! ```

use super::building::{Building, ground};
use super::facts::{Facts, Fill, Stair};
use super::furniture;
use super::model::{Material, Model, Placement};
use super::path::CameraPath;
use super::plan::{Hole, Plan, PlanRoom, Style, metres};
use super::solid::{Solid, cuboid, extrude};
use enfilade::math::geom::Aabb;
use enfilade::math::random::Prng;
use enfilade::scene::Role;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Least distance between the middles of a cupboard and a door, metres.
const FREE_OF_DOOR: f64 = 1.3;

/// Random streams.
const PLAN: u64 = 3;
const DOORS: u64 = 4;
const FURNITURE: u64 = 5;

const STYLE: Style = Style { outer: 300, inner: 150, clear: 3000, slab: 300 };
/// Most offices on one side of a corridor.
const SIDE: usize = 14;
/// Offices per storey if the number of storeys isn't given.
const PER_STOREY: usize = 50;

// Axes, millimetres.
const CORE: i32 = -5700;
const LIFT: i32 = -2300;
const SPINE: i32 = 3000;
const OFFICE_DEPTH: i32 = 5200;
const CORRIDOR: i32 = 2200;
const WING: i32 = 2 * OFFICE_DEPTH + CORRIDOR;
const COURT: i32 = 9000;
const BAY: i32 = 4200;
/// Depths of the core's rooms: stairs, lift and store; the lobby takes the rest.
const STAIRS: i32 = 2900;
const SHAFT: i32 = 5200;
/// Start of the stairs' flights, from the spine, and their end.
const FLIGHT: [i32; 2] = [-1500, -4200];
const RISERS: i32 = 20;

/// Use of a room.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Use {
    Office,
    Corridor,
    Spine,
    Stairs,
    Lift,
    Store,
    Lobby,
    Meeting,
}

/// One storey: its plan and the uses of its rooms.
struct Storey {
    plan: Plan,
    uses: Vec<Use>,
    /// The wing of each room.
    wings: Vec<usize>,
}

impl Storey {
    /// Rooms of one storey; `sides`: number of offices on each side of each wing's corridor.
    fn new(level: usize, sides: &[[usize; 2]], bays: usize, rng: &mut Prng) -> Self {
        let (mut rooms, mut uses, mut wings) = (Vec::new(), Vec::new(), Vec::new());
        let mut add = |name: String, x: [i32; 2], z: [i32; 2], what: Use, wing: usize| {
            rooms.push(PlanRoom { name, x, z });
            uses.push(what);
            wings.push(wing);
        };
        let end = SPINE + bays.max(1) as i32 * BAY;
        let depth = (sides.len() as i32 - 1) * (WING + COURT) + WING;
        add("Spine".into(), [0, SPINE], [0, depth], Use::Spine, 0);
        for (wing, counts) in sides.iter().enumerate() {
            let z = wing as i32 * (WING + COURT);
            let letter = wing + 1;
            add(
                format!("Corridor {letter}"),
                [SPINE, end],
                [z + OFFICE_DEPTH, z + OFFICE_DEPTH + CORRIDOR],
                Use::Corridor,
                wing,
            );
            add(format!("Stairs {letter}"), [CORE, 0], [z, z + STAIRS], Use::Stairs, wing);
            add(format!("Lift {letter}"), [LIFT, 0], [z + STAIRS, z + SHAFT], Use::Lift, wing);
            add(format!("Store {letter}"), [CORE, LIFT], [z + STAIRS, z + SHAFT], Use::Store, wing);
            let lobby = if level == 0 && wing == 0 { Use::Lobby } else { Use::Meeting };
            add(format!("{lobby:?} {letter}"), [CORE, 0], [z + SHAFT, z + WING], lobby, wing);
            for (side, &count) in counts.iter().enumerate() {
                let from = z + side as i32 * (OFFICE_DEPTH + CORRIDOR);
                let mut lines: Vec<i32> =
                    (0..=count as i32).map(|i| SPINE + (end - SPINE) * i / count.max(1) as i32 / 50 * 50).collect();
                for line in lines.iter_mut().take(count).skip(1) {
                    *line += rng.steps(-500, 500, 50);
                }
                for (i, pair) in lines.windows(2).enumerate() {
                    let name = format!("Office {level}{letter}{:02}", side * SIDE + i + 1);
                    add(name, [pair[0], pair[1]], [from, from + OFFICE_DEPTH], Use::Office, wing);
                }
            }
        }
        let mut storey = Self { plan: Plan::new(STYLE, rooms), uses, wings };
        storey.cut(rng);
        storey
    }

    fn cut(&mut self, rng: &mut Prng) {
        for w in 0..self.plan.walls.len() {
            let wall = &self.plan.walls[w];
            let [a, b] = wall.sides.map(|s| s.map(|r| self.uses[r]));
            let pair = |x: Use, y: Use| [a, b] == [Some(x), Some(y)] || [a, b] == [Some(y), Some(x)];
            // Doors open into the room that isn't a corridor, the spine or outside.
            let into = usize::from(matches!(a, None | Some(Use::Corridor | Use::Spine)));
            let hole = |fill, at, width, head| Hole { fill, at, width, sill: 0, head, into };
            let [from, to] = self.plan.clear_span(w, 600);
            let middle = (wall.span[0] + wall.span[1]) / 2;
            let lesser = wall.span[0];
            let mut holes = Vec::new();
            if pair(Use::Office, Use::Corridor) {
                holes.push(hole(Fill::Door, rng.steps(from, to, 50), 950, 2100));
            } else if pair(Use::Office, Use::Office) {
                if rng.chance(0.25) {
                    // In the half next to the corridor; desks stand at the windows.
                    let first_side = lesser % (WING + COURT) == 0;
                    let off = rng.steps(1500, 2100, 50);
                    holes.push(hole(
                        Fill::Door,
                        if first_side { lesser + OFFICE_DEPTH - off } else { lesser + off },
                        900,
                        2100,
                    ));
                }
            } else if pair(Use::Corridor, Use::Spine) {
                holes.push(hole(Fill::Nothing, middle, 1600, 2400));
            } else if pair(Use::Lobby, Use::Spine) {
                holes.push(hole(Fill::Nothing, middle, 1800, 2400));
            } else if pair(Use::Meeting, Use::Spine) || pair(Use::Store, Use::Lobby) || pair(Use::Store, Use::Meeting) {
                holes.push(hole(Fill::Door, middle, 950, 2100));
            } else if pair(Use::Lift, Use::Spine) {
                // A lift's doors open towards the landing: the open leaf stands in the spine.
                holes.push(Hole { into: 1, ..hole(Fill::Door, middle, 1100, 2100) });
            } else if pair(Use::Stairs, Use::Spine) {
                // Opposite the first flight, so that the leaf clears the landing.
                holes.push(Hole { into: 1, ..hole(Fill::Door, middle, 1000, 2100) });
            } else if wall.is_outer() {
                let inside = a.or(b);
                if inside == Some(Use::Lobby) && !wall.along_x {
                    holes.push(hole(Fill::Door, middle, 1200, 2100));
                    holes.extend([-2200, 2200].map(|off| window(middle + off, 1600)));
                } else if !matches!(inside, Some(Use::Stairs | Use::Lift | Use::Store)) {
                    let [from, to] = self.plan.clear_span(w, 400);
                    let room = to - from;
                    let count = (room / 2200).max(i32::from(room >= 900));
                    let width = if room >= 1600 { 1500 } else { 900 };
                    holes.extend((0..count).map(|i| window(from + room * (2 * i + 1) / (2 * count) / 10 * 10, width)));
                }
            }
            self.plan.walls[w].holes = holes;
        }
    }

    fn wing_count(&self) -> usize {
        self.wings.iter().max().map_or(0, |last| last + 1)
    }

    /// The first room of a use in a wing.
    fn find(&self, what: Use, wing: usize) -> Option<usize> {
        (0..self.uses.len()).find(|&r| self.uses[r] == what && self.wings[r] == wing)
    }
}

fn window(at: i32, width: i32) -> Hole {
    Hole { fill: Fill::Glass, at, width, sill: 900, head: 2200, into: 0 }
}

/// Number of offices on each side of each wing, by storey: as even as possible, the remainder from the bottom up.
fn distribute(offices: usize, storeys: usize) -> (Vec<Vec<[usize; 2]>>, usize) {
    let wings = offices.div_ceil(storeys).div_ceil(2 * SIDE);
    let sides = storeys * wings * 2;
    let share = |i: usize| offices / sides + usize::from(i < offices % sides);
    let storey = |s: usize| (0..wings).map(|w| [0, 1].map(|side| share((s * wings + w) * 2 + side))).collect();
    ((0..storeys).map(storey).collect(), offices.div_ceil(sides))
}

/// An office building with `offices` offices; corridors, stairs, lifts, stores, meeting rooms and the lobby are additional. By
/// default `storeys` gives about 50 offices per storey.
pub(super) fn office(offices: usize, storeys: Option<usize>, furnished: bool, seed: u64) -> Building {
    let storeys = storeys.unwrap_or(offices.div_ceil(PER_STOREY));
    let (sides, bays) = distribute(offices, storeys);
    let levels: Vec<Storey> = sides
        .iter()
        .enumerate()
        .map(|(s, sides)| Storey::new(s, sides, bays, &mut Prng::new(seed, PLAN + ((s as u64) << 8))))
        .collect();

    // 1. The facts.
    let (mut facts, ids) = describe(&levels);

    // 2. The path; it decides which leaves stand open.
    let mut model = Model::default();
    climb(&mut model, &mut facts, &levels, &ids);
    let walk = walk(&facts, &levels, &ids);
    let path = CameraPath::along(&facts.way(&walk), 1.2);

    // 3. Walls, slabs, leaves, panes.
    facts.shafts = build(&mut model, &facts, &levels, &walk, &mut Prng::new(seed, DOORS));
    ground(&mut model, &levels[0].plan, 15.0);
    let door = metres(SHAFT + (WING - SHAFT) / 2);
    let (min, max) = (DVec3::new(metres(CORE) - 1.35, -0.3, door - 1.0), DVec3::new(metres(CORE) - 0.15, -0.15, door + 1.0));
    model.add("doorstep", Role::Structure, Material::Stone, cuboid(min, max));
    if furnished {
        for (s, level) in levels.iter().enumerate() {
            let rng = &mut Prng::new(seed, FURNITURE + ((s as u64) << 8));
            furnish(&mut model, level, s, rng);
        }
    }
    Building { name: "office".into(), seed, counted: vec![("offices", offices)], model, facts, path }
}

/// Rooms, doors and windows, by storey; and for each storey, the index of each of its rooms.
fn describe(levels: &[Storey]) -> (Facts, Vec<Vec<usize>>) {
    let mut facts = Facts::default();
    let mut ids: Vec<Vec<usize>> = Vec::new();
    let lifts = |level: &Storey| (0..level.wing_count()).map(|w| level.find(Use::Lift, w)).collect::<Vec<_>>();
    for (s, level) in levels.iter().enumerate() {
        let floor = s as i32 * STYLE.storey();
        facts.storeys.push((format!("Storey {s}"), metres(floor)));
        // A lift's shaft is one room through all storeys.
        let known = match ids.first() {
            None => BTreeMap::new(),
            Some(ids) => {
                lifts(level).into_iter().zip(lifts(&levels[0])).filter_map(|(r, lowest)| Some((r?, ids[lowest?]))).collect()
            }
        };
        ids.push(level.plan.describe(&mut facts, s, floor, &known));
    }
    let top = metres(levels.len() as i32 * STYLE.storey() - STYLE.slab);
    for lift in lifts(&levels[0]).into_iter().flatten() {
        facts.rooms[ids[0][lift]].height[1] = top;
    }
    (facts, ids)
}

/// Adds the stairs from each storey to the next.
fn climb(model: &mut Model, facts: &mut Facts, levels: &[Storey], ids: &[Vec<usize>]) {
    for (s, pair) in levels.windows(2).enumerate() {
        for w in 0..pair[0].wing_count() {
            if let [Some(lower), Some(upper)] = [pair[0].find(Use::Stairs, w), pair[1].find(Use::Stairs, w)] {
                let rooms = [ids[s][lower], ids[s + 1][upper]];
                facts.stairs.push(stairs(model, &pair[0].plan, lower, s, w, rooms));
            }
        }
    }
}

/// Builds all storeys; no leaf on the path is shut. Returns the lift shafts.
fn build(model: &mut Model, facts: &Facts, levels: &[Storey], walk: &[Option<usize>], shut: &mut Prng) -> Vec<[DVec3; 2]> {
    let mut leaves = facts.openings.iter().filter(|o| o.fill == Fill::Door);
    let mut is_shut = |[a, b]: [Option<usize>; 2]| {
        let lift = [a, b].into_iter().flatten().any(|r| facts.rooms[r].name.starts_with("Lift"));
        let walked = walk.windows(2).any(|p| p == [a, b] || p == [b, a]);
        lift || (shut.chance(0.2) && !walked)
    };
    let mut closed = || leaves.next().is_some_and(|leaf| is_shut(leaf.rooms));
    let mut shafts = Vec::new();
    for (s, level) in levels.iter().enumerate() {
        let floor = s as i32 * STYLE.storey();
        let above = levels.get(s + 1);
        let roofed: Vec<bool> = level.plan.rooms.iter().map(|r| above.is_none_or(|a| !covers(&a.plan, r))).collect();
        let voids: Vec<Vec<Aabb>> =
            (0..level.uses.len()).map(|r| if s == 0 { Vec::new() } else { voids(level, r, floor) }).collect();
        let of_lifts = voids.iter().zip(&level.uses).filter(|(_, what)| **what == Use::Lift);
        shafts.extend(of_lifts.flat_map(|(voids, _)| voids.iter().map(|b| [b.min, b.max])));
        level.plan.build(model, s, floor, &voids, &roofed, &mut closed);
    }
    shafts
}

/// True if the storey above has a floor over the room.
fn covers(above: &Plan, room: &PlanRoom) -> bool {
    let (x, z) = ((room.x[0] + room.x[1]) / 2, (room.z[0] + room.z[1]) / 2);
    above.rooms.iter().any(|r| (r.x[0]..r.x[1]).contains(&x) && (r.z[0]..r.z[1]).contains(&z))
}

/// The holes in the floor of a room above the ground floor.
fn voids(level: &Storey, room: usize, floor: i32) -> Vec<Aabb> {
    let [x, z] = level.plan.clear(room);
    let x = match level.uses[room] {
        Use::Lift => x,
        Use::Stairs => [x[0], FLIGHT[0]],
        _ => return Vec::new(),
    };
    let corner = |i: usize, y: i32| DVec3::new(metres(x[i]), metres(y), metres(z[i]));
    vec![Aabb { min: corner(0, floor - STYLE.slab), max: corner(1, floor) }]
}

/// Two flights and a landing between a storey and the next.
fn stairs(model: &mut Model, plan: &Plan, room: usize, storey: usize, wing: usize, rooms: [usize; 2]) -> Stair {
    let [x, z] = plan.clear(room).map(|ends| ends.map(metres));
    let floor = metres(storey as i32 * STYLE.storey());
    let rise = metres(STYLE.storey()) / f64::from(RISERS);
    let [start, end] = FLIGHT.map(metres);
    let half = RISERS / 2;
    let tread = (start - end) / f64::from(half - 1);
    let width = (z[1] - z[0] - 0.1) / 2.0;
    // Steps from right to left in (x, y): up the risers, back down the sloping underside. The last riser is the landing's edge. A
    // flight from a slab or a landing hangs from its edge; the first one stands on the ground floor.
    let flight = |hung: bool| {
        let steps = (1..half)
            .flat_map(|i| [(i - 1, i), (i, i)])
            .map(|(k, level)| DVec2::new(-tread * f64::from(k), rise * f64::from(level)));
        let mut outline = if hung { vec![DVec2::new(0.0, -0.25)] } else { vec![DVec2::new(-tread, 0.0), DVec2::ZERO] };
        outline.extend(steps);
        outline.push(DVec2::new(-tread * f64::from(half - 1), rise * f64::from(half - 1) - 0.22));
        outline
    };
    let middle = floor + rise * f64::from(half);
    let lower = extrude(&flight(storey > 0), DVec3::new(start, floor, z[0]), DVec3::X, DVec3::Y, width);
    // The same rotated about the vertical, so extruded towards lower z.
    let upper = extrude(&flight(true), DVec3::new(end, middle, z[1]), DVec3::NEG_X, DVec3::Y, width);
    let landing = cuboid(DVec3::new(x[0], middle - 0.25, z[0]), DVec3::new(end, middle, z[1]));
    let parts = [("flight.0", Role::Stair, lower), ("landing", Role::Structure, landing), ("flight.1", Role::Stair, upper)];
    for (what, role, solid) in parts {
        model.add(format!("{what} {storey}.{wing}"), role, Material::Concrete, solid);
    }
    let (first, second) = (z[0] + width / 2.0, z[1] - width / 2.0);
    let next = floor + metres(STYLE.storey());
    let way = [
        (start + 0.5, floor, first),
        (end, middle, first),
        (end - 0.6, middle, first),
        (end - 0.6, middle, second),
        (end, middle, second),
        (start, next, second),
        (start + 0.5, next, second),
    ];
    Stair {
        rooms,
        way: way.map(|(x, y, z)| DVec3::new(x, y, z)).to_vec(),
        hole: [DVec3::new(x[0], next - metres(STYLE.slab), z[0]), DVec3::new(start, next, z[1])],
    }
}

/// Into the lobby, along the first corridor and through an office; up flight after flight, through an office on each of the first
/// four storeys, and through a connecting door if there is one.
fn walk(facts: &Facts, levels: &[Storey], ids: &[Vec<usize>]) -> Vec<Option<usize>> {
    let mut stops = Vec::new();
    stops.extend(levels[0].find(Use::Lobby, 0).map(|r| ids[0][r]));
    for (s, level) in levels.iter().enumerate().take(4) {
        let plan = &level.plan;
        let connecting = plan.walls.iter().find_map(|w| {
            let [a, b] = [w.sides[0]?, w.sides[1]?];
            (level.uses[a] == Use::Office && level.uses[b] == Use::Office && !w.holes.is_empty()).then_some([a, b])
        });
        let offices = connecting.map(|c| c.to_vec()).or(level.find(Use::Office, 0).map(|r| vec![r])).unwrap_or_default();
        stops.extend(offices.iter().map(|&r| ids[s][r]));
        stops.extend(level.find(Use::Corridor, 0).map(|r| ids[s][r]));
    }
    facts.tour(&stops)
}

/// Desks, chairs, screens, cupboards and lamps.
fn furnish(model: &mut Model, level: &Storey, storey: usize, rng: &mut Prng) {
    let floor = metres(storey as i32 * STYLE.storey());
    let mut furnishing = Furnishing { model, level, storey, floor, ceiling: floor + metres(STYLE.clear) };
    for room in 0..level.uses.len() {
        let sides = level.plan.clear(room).map(|ends| ends.map(metres));
        match level.uses[room] {
            Use::Office => furnishing.office(room, sides, rng),
            Use::Meeting => furnishing.meeting(room, sides),
            Use::Corridor => furnishing.corridor(room, sides),
            Use::Store => furnishing.store(room, sides),
            Use::Lobby | Use::Spine | Use::Stairs | Use::Lift => {}
        }
    }
}

/// Furnishes the rooms of a storey.
struct Furnishing<'f> {
    model: &'f mut Model,
    level: &'f Storey,
    storey: usize,
    /// Heights, metres.
    floor: f64,
    ceiling: f64,
}

impl Furnishing<'_> {
    fn put(&mut self, what: &str, room: usize, i: usize, at: DVec3, turns: f64) {
        let (material, make): (Material, fn() -> Solid) = match what {
            "desk" => (Material::Wood, furniture::desk),
            "chair" => (Material::Fabric, furniture::chair),
            "screen" => (Material::Metal, furniture::screen),
            "cupboard" => (Material::Wood, furniture::cupboard),
            "table" => (Material::Wood, || furniture::table(3.0)),
            _ => (Material::Lamp, furniture::lamp),
        };
        let name = format!("{what} {}.{room}.{i}", self.storey);
        self.model.place(name, Role::Furnishing, Placement { at, turns }, what, material, make);
    }

    fn office(&mut self, room: usize, [x, z]: [[f64; 2]; 2], rng: &mut Prng) {
        let (level, floor, ceiling) = (self.level, self.floor, self.ceiling);
        // Windows face lower z on the first side of a corridor, higher z on the second.
        let first_side = level.plan.rooms[room].z[0] % (WING + COURT) == 0;
        let (facade, inwards) = if first_side { (z[0], 1.0) } else { (z[1], -1.0) };
        let (width, middle) = (x[1] - x[0], (z[0] + z[1]) / 2.0);
        let desks = ((width / 2.6).floor() as usize).clamp(1, 2);
        for i in 0..desks {
            let at = x[0] + width * (i as f64 + 0.5) / desks as f64;
            let place = |off: f64| DVec3::new(at, floor, facade + inwards * off);
            // People sit with their back to the window.
            let turns = if first_side { 0.5 } else { 0.0 };
            self.put("desk", room, i, place(1.5), turns);
            self.put("chair", room, i, place(0.8), turns + rng.range(-0.06, 0.06));
            self.put("screen", room, i, place(1.62) + DVec3::Y * 0.74, turns);
            self.put("lamp", room, i, DVec3::new(at, ceiling, middle), 0.0);
        }
        cupboards(level, room, [x, z], inwards, |i, at, turns| {
            self.put("cupboard", room, i, DVec3::new(at.x, floor, at.y), turns)
        });
    }

    fn meeting(&mut self, room: usize, [x, z]: [[f64; 2]; 2]) {
        let middle = (z[0] + z[1]) / 2.0;
        // Off the line between the doors of the spine and of the store.
        let at = DVec3::new(x[0] + 1.9, self.floor, middle + 0.9);
        self.put("table", room, 0, at, 0.0);
        for i in 0..6 {
            let side = if i % 2 == 0 { -1.0 } else { 1.0 };
            let off = DVec3::new((f64::from(i / 2) - 1.0) * 0.9, 0.0, 0.85 * side);
            self.put("chair", room, i as usize, at + off, if side < 0.0 { 0.5 } else { 0.0 });
        }
        self.put("lamp", room, 0, DVec3::new((x[0] + x[1]) / 2.0, self.ceiling, middle), 0.0);
    }

    fn corridor(&mut self, room: usize, [x, z]: [[f64; 2]; 2]) {
        let (width, middle) = (x[1] - x[0], (z[0] + z[1]) / 2.0);
        let lamps = (width / 4.0) as usize;
        for i in 0..lamps {
            let at = x[0] + width * (i as f64 + 0.5) / lamps as f64;
            self.put("lamp", room, i, DVec3::new(at, self.ceiling, middle), 0.0);
        }
    }

    fn store(&mut self, room: usize, [x, z]: [[f64; 2]; 2]) {
        for i in 0..2 {
            self.put("cupboard", room, i, DVec3::new(x[0] + 0.6 + i as f64, self.floor, z[0] + 0.25), 0.0);
        }
    }
}

/// One or two cupboards at the corridor's wall, if the door leaves space.
fn cupboards(level: &Storey, room: usize, [x, z]: [[f64; 2]; 2], inwards: f64, mut put: impl FnMut(usize, DVec2, f64)) {
    let wall = level.plan.walls.iter().find(|w| w.sides.contains(&Some(room)) && w.along_x && !w.is_outer());
    let Some(door) = wall.and_then(|w| w.holes.first()) else {
        return;
    };
    let (door, face) = (metres(door.at), if inwards > 0.0 { z[1] - 0.25 } else { z[0] + 0.25 });
    let turns = if inwards > 0.0 { 0.5 } else { 0.0 };
    // The leaf stands at the hinge, on the lower side.
    let mut number = 0;
    for at in [x[0] + 0.5, x[1] - 0.5] {
        if (at - door).abs() > FREE_OF_DOOR {
            put(number, DVec2::new(at, face), turns);
            number += 1;
        }
    }
}
