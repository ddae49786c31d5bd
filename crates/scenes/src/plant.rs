//! A process plant: sheds with gates, tanks, structures of slabs and gratings, racks of pipes along the roads between.
//!
//! Unlike a plan, most of it is open to the sky, many parts are round or hang in the air, and much of the surface separates
//! nothing. Blocks of 50 m form a grid; their contents are random. Pipes, tanks and gratings are closed solids with shared
//! meshes.

use super::building::Building;
use super::facts::{Facts, Fill, Opening, Room};
use super::model::{Material, Model, Pipe, Placement};
use super::path::CameraPath;
use super::solid::{Solid, cuboid, extrude, lathe, perforated, pipe, turn};
use enfilade::math::geom::Aabb;
use enfilade::math::random::Prng;
use enfilade::scene::Role;
use glam::{DVec2, DVec3};

/// Last start of a pipe across a rack, metres.
const RACK_END: f64 = 4.6;

/// Edge of a block including its share of the roads, metres.
const BLOCK: f64 = 50.0;
/// Random stream of the blocks' contents.
const PLOTS: u64 = 1;
/// Thickness of a shed's walls and roof, metres.
const SHEET: f64 = 0.2;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A plant on a square site of `size` metres, 60 or more.
pub(super) fn plant(size: usize, seed: u64) -> Building {
    let rng = &mut Prng::new(seed, PLOTS);
    let (mut model, mut facts) = (Model::default(), Facts { storeys: vec![("Ground".into(), 0.0)], ..Facts::default() });
    let (edge, blocks) = (size as f64, size / BLOCK as usize);
    let margin = 0.5 * (edge - blocks as f64 * BLOCK);
    model.add("ground", Role::Structure, Material::Ground, cuboid(v(0.0, -0.5, 0.0), v(edge, 0.0, edge)));
    for i in 0..blocks * blocks {
        let at = v(margin + (i % blocks) as f64 * BLOCK, 0.0, margin + (i / blocks) as f64 * BLOCK);
        let mut block = Block { model: &mut model, facts: &mut facts, at, number: i };
        // The first block of every plant is a shed.
        match if i == 0 { 0 } else { rng.below(10) } {
            0..=2 => block.shed(rng),
            3..=5 => block.tanks(rng),
            _ => block.structure(rng),
        }
        block.rack(0.0, rng);
        block.rack(0.25, rng);
    }
    // Along the first road, through the first shed's gates, and back.
    let gates: Vec<DVec3> = facts.openings.iter().take(3).map(|o| v(o.centre.x, 0.0, o.centre.z)).collect();
    let road = margin + 4.0;
    let (from, to) = (v(road, 0.0, edge - margin - 4.0), v(road, 0.0, gates[0].z));
    let way = [&[from, to], &gates[..], &[gates[2] + v(3.0, 0.0, 0.0)]].concat();
    let path = CameraPath::along(&way, 0.5);
    Building { name: "plant".into(), seed, counted: vec![("size_metres", size)], model, facts, path }
}

struct Block<'p> {
    model: &'p mut Model,
    facts: &'p mut Facts,
    at: DVec3,
    number: usize,
}

impl Block<'_> {
    fn name(&self, what: &str) -> String {
        format!("{what} {}", self.number)
    }

    /// Two bays of 18 x 28 m, 9 to 12 m high, with a gate at each end and a smaller one between them.
    fn shed(&mut self, rng: &mut Prng) {
        let height = f64::from(rng.steps(90, 120, 5)) / 10.0;
        let (low, high) = (self.at + v(8.0, 0.0, 12.0), self.at + v(44.0, height, 40.0));
        let middle = 0.5 * (low.x + high.x);
        let first = self.facts.rooms.len();
        let gate_z = low.z + f64::from(rng.steps(60, 220, 10)) / 10.0;
        for (i, x) in [low.x, middle, high.x].into_iter().enumerate() {
            let (width, head) = if i == 1 { (2.4, 2.6) } else { (4.0, 4.5) };
            let z = if i == 1 { low.z + 0.5 * (high.z - low.z) } else { gate_z };
            let (wall_low, wall_high) = (v(x - 0.5 * SHEET, 0.0, low.z), v(x + 0.5 * SHEET, height, high.z));
            let hole = Aabb { min: v(x - 1.0, -1.0, z - 0.5 * width), max: v(x + 1.0, head, z + 0.5 * width) };
            let solid = perforated(wall_low, wall_high, 0, &[hole]);
            self.model.add(self.name(&format!("shed wall {i} of block")), Role::Structure, Material::Metal, solid);
            let rooms = [(i < 2).then_some(first + i), i.checked_sub(1).map(|i| first + i)];
            self.facts.openings.push(Opening {
                fill: Fill::Nothing,
                storey: 0,
                centre: v(x, 0.5 * head, z),
                size: v(width, head, SHEET),
                normal: DVec3::X,
                rooms,
            });
        }
        for (i, z) in [low.z - SHEET, high.z].into_iter().enumerate() {
            let solid = cuboid(v(low.x - 0.5 * SHEET, 0.0, z), v(high.x + 0.5 * SHEET, height, z + SHEET));
            self.model.add(self.name(&format!("shed side {i} of block")), Role::Structure, Material::Metal, solid);
        }
        let roof =
            cuboid(v(low.x - 0.5 * SHEET, height, low.z - SHEET), v(high.x + 0.5 * SHEET, height + SHEET, high.z + SHEET));
        self.model.add(self.name("shed roof of block"), Role::Structure, Material::Roof, roof);
        for (i, x) in [[low.x, middle], [middle, high.x]].into_iter().enumerate() {
            let x = [x[0] + 0.5 * SHEET, x[1] - 0.5 * SHEET];
            let footprint = [(x[0], low.z), (x[1], low.z), (x[1], high.z), (x[0], high.z)];
            self.facts.rooms.push(Room {
                id: format!("bay-{}-{i}", self.number),
                name: format!("Bay {} of block {}", i + 1, self.number),
                storey: 0,
                height: [0.0, height],
                footprint: footprint.map(|(x, z)| DVec2::new(x, z)).to_vec(),
            });
        }
        // Machines, clear of the gates.
        for i in 0..6 {
            let at = v(low.x + 4.0 + 5.6 * f64::from(i), 0.0, if i % 2 == 0 { low.z + 2.0 } else { high.z - 4.0 });
            let place = Placement { at, turns: 0.0 };
            let make = || cuboid(v(-1.0, 0.0, -0.8), v(1.0, 1.6, 0.8));
            self.model.place(
                self.name(&format!("machine {i} of block")),
                Role::Structure,
                place,
                "machine",
                Material::Metal,
                make,
            );
        }
    }

    /// Four tanks with flat conical roofs.
    fn tanks(&mut self, rng: &mut Prng) {
        let (radius, height) = (rng.steps(5, 8, 1), rng.steps(8, 16, 2));
        for i in 0..4 {
            let at = self.at + v(16.0 + 19.0 * f64::from(i % 2), 0.0, 16.0 + 19.0 * f64::from(i / 2));
            let (r, h) = (f64::from(radius), f64::from(height));
            let make = || lathe(&[(0.0, 0.05), (r, 0.05), (r, h), (0.0, h + 0.15 * r)], 32);
            let (name, key) = (self.name(&format!("tank {i} of block")), format!("tank {radius} {height}"));
            self.model.place(name, Role::Structure, Placement { at, turns: 0.0 }, &key, Material::Metal, make);
        }
    }

    /// 24 x 24 m, four levels 5 m apart on columns 6 m apart: slabs, gratings, vessels, a ramp between levels.
    fn structure(&mut self, rng: &mut Prng) {
        let low = self.at + v(14.0, 0.0, 14.0);
        let column = || cuboid(v(-0.2, 0.0, -0.2), v(0.2, 21.0, 0.2));
        for i in 0..25 {
            let at = low + v(6.0 * f64::from(i % 5), 0.0, 6.0 * f64::from(i / 5));
            let name = self.name(&format!("column {i} of block"));
            self.model.place(name, Role::Structure, Placement { at, turns: 0.0 }, "column", Material::Metal, column);
        }
        let grating = || {
            let bar = |i: i32| cuboid(v(0.12 * f64::from(i), -0.04, 0.25), v(0.12 * f64::from(i) + 0.03, 0.0, 5.75));
            Solid::of(&(3..46).map(bar).collect::<Vec<_>>())
        };
        for level in 1..=4 {
            let y = 5.0 * f64::from(level);
            let slab = level % 2 == 1;
            for bay in 0..16 {
                let (column, row) = (bay % 4, bay / 4);
                // The ramp stays clear; every other bay has a grating.
                if row == 0 || (!slab && (column + row) % 2 == 0) {
                    continue;
                }
                let at = low + v(6.0 * f64::from(column), y, 6.0 * f64::from(row));
                let name = self.name(&format!("bay {bay} on level {level} of block"));
                let place = Placement { at, turns: 0.0 };
                if slab {
                    let make = || cuboid(v(0.0, -0.2, 0.0), v(6.0, 0.0, 6.0));
                    self.model.place(name, Role::Structure, place, "slab", Material::Concrete, make);
                } else {
                    self.model.place(name, Role::Structure, place, "grating", Material::Metal, grating);
                }
            }
            let outline = [(0.0, -5.0), (18.0, 0.0), (24.0, 0.0), (24.0, -0.2), (18.2, -0.2), (0.7, -5.0)];
            let make = || extrude(&outline.map(|(x, y)| DVec2::new(x, y)), v(0.0, 0.0, 1.0), DVec3::X, DVec3::Y, 2.0);
            let turns = if level % 2 == 1 { 0.0 } else { 0.5 };
            let at = low + v(0.0, y, 0.0) + if turns == 0.0 { DVec3::ZERO } else { v(24.0, 0.0, 6.0) };
            let name = self.name(&format!("ramp to level {level} of block"));
            self.model.place(name, Role::Structure, Placement { at, turns }, "ramp", Material::Concrete, make);
            if slab {
                let at = low + v(4.0 + 6.0 * f64::from(rng.steps(0, 1, 1)), y + 1.6, 15.0);
                let name = self.name(&format!("vessel on level {level} of block"));
                self.model.place(name, Role::Structure, Placement { at, turns: 0.0 }, "vessel", Material::Metal, || {
                    pipe(8.0, 1.2, 24)
                });
            }
        }
        let r = 0.1 * f64::from(rng.steps(8, 14, 2));
        let key = format!("column of {r:.1} m");
        let at = self.at + v(8.0, 0.0, 44.0);
        let make = || lathe(&[(0.0, 0.0), (r, 0.0), (r, 28.0), (0.0, 29.0)], 24);
        self.model.place(
            self.name("still of block"),
            Role::Structure,
            Placement { at, turns: 0.0 },
            &key,
            Material::Metal,
            make,
        );
    }

    /// Pipes on three levels beside the road, with a trestle every 6 m; along x for `turns` of 0, along z for 1/4.
    fn rack(&mut self, turns: f64, rng: &mut Prng) {
        let (c, s) = turn(turns);
        // At the block's north side or its west side.
        let world = |along: f64, y: f64, across: f64| self.at + v(c * along + s * across, y, c * across + s * along);
        let turns = if turns == 0.0 { 0.0 } else { 0.75 };
        let way = if turns == 0.0 { "x" } else { "z" };
        let mut placed: Vec<(String, DVec3, f64, f64)> = Vec::new();
        for level in 0..3 {
            let mut across = 0.4;
            while across < RACK_END {
                let r = 0.05 * f64::from(rng.steps(1, 5, 1));
                let y = 6.0 + 2.0 * f64::from(level) + r + 0.15;
                let name = self.name(&format!("pipe {} along {way} of block", placed.len()));
                placed.push((name, world(6.2, y, across + r), BLOCK - 6.4, r));
                across += 2.0 * r + 0.25;
            }
        }
        for (name, at, length, r) in placed {
            let key = format!("pipe of {r:.2} m");
            self.model.place(name, Role::Structure, Placement { at, turns }, &key, Material::Metal, || pipe(length, r, 12));
            self.model.last_is_pipe(Pipe { radius: r, smooth: false, points: vec![DVec3::ZERO, v(length, 0.0, 0.0)] });
        }
        for i in 0..8 {
            let at = world(7.0 + 6.0 * f64::from(i), 0.0, 0.0);
            let make = || {
                let legs = [0.0, 5.0].map(|z| cuboid(v(-0.1, 0.0, z - 0.1), v(0.1, 10.15, z + 0.1)));
                let beams = [6.0, 8.0, 10.0].map(|y| cuboid(v(-0.1, y - 0.15, 0.1), v(0.1, y + 0.15, 4.9)));
                let mirror = if turns == 0.0 { 1.0 } else { -1.0 };
                let mut all = Solid::of(&[&legs[..], &beams[..]].concat());
                if mirror < 0.0 {
                    all = all.at(v(0.0, 0.0, -5.0));
                }
                all
            };
            let (name, key) = (self.name(&format!("trestle {i} along {way} of block")), format!("trestle {way}"));
            self.model.place(name, Role::Structure, Placement { at, turns }, &key, Material::Metal, make);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::solid::tests::assert_closed;
    use super::*;

    #[test]
    fn everything_of_a_plant_is_closed() {
        let plant = plant(160, 3);
        for (solid, _) in &plant.model.meshes {
            assert_closed(solid, "a part of a plant");
        }
        // Nothing lies outside the site or below the ground's slab.
        for node in &plant.model.nodes {
            let placement = node.placement.unwrap_or_default();
            for p in &plant.model.meshes[node.mesh].0.positions {
                let q = placement.transform_point3(*p);
                assert!(
                    (0.0..=160.0).contains(&q.x) && (0.0..=160.0).contains(&q.z) && (-0.5..30.0).contains(&q.y),
                    "{} {q}",
                    node.name
                );
            }
        }
    }
}
