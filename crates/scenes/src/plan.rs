//! One storey of rectangular rooms: the position and construction of its walls.
//!
//! Rooms are rectangles between wall axes, in whole millimetres, so that two rooms agree on their common wall. Every stretch of
//! axis with one room (or none) on either side is a wall of its own. At junctions, walls along x run through and walls along z
//! stop at their faces: solids touch in whole faces or overlap, so there are no gaps and no visible coplanar faces.

use super::facts::{Facts, Fill, Opening, Room};
use super::model::{Material, Model, Placement};
use super::solid::{Solid, cuboid, perforated};
use enfilade::math::geom::Aabb;
use enfilade::scene::Role;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Thickness of a door's leaf, of a pane; metres.
const LEAF: f64 = 0.04;
/// Overlap of a shut leaf with the wall beside and above it, so that there is no gap; metres.
const REBATE: f64 = 0.005;
const PANE: f64 = 0.03;

/// Millimetres to metres.
pub(super) fn metres(mm: i32) -> f64 {
    f64::from(mm) / 1000.0
}

/// Thicknesses and heights, millimetres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Style {
    /// Walls with outside on one side.
    pub(super) outer: i32,
    /// Walls between rooms.
    pub(super) inner: i32,
    /// Floor to ceiling.
    pub(super) clear: i32,
    /// Floor slabs and roof.
    pub(super) slab: i32,
}

impl Style {
    /// Floor to floor.
    pub(super) fn storey(&self) -> i32 {
        self.clear + self.slab
    }
}

/// A room between wall axes, millimetres.
#[derive(Clone, Debug)]
pub(super) struct PlanRoom {
    pub(super) name: String,
    pub(super) x: [i32; 2],
    pub(super) z: [i32; 2],
}

/// An opening in a wall; millimetres, heights above the floor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hole {
    pub(super) fill: Fill,
    /// Middle, along the wall.
    pub(super) at: i32,
    pub(super) width: i32,
    pub(super) sill: i32,
    pub(super) head: i32,
    /// The side to which a door's leaf opens: 0 for lower coordinates, 1 for higher.
    pub(super) into: usize,
}

/// A stretch of wall with one room, or outside, on either side.
#[derive(Clone, Debug)]
pub(super) struct Wall {
    /// True along x (at a fixed z), false along z.
    pub(super) along_x: bool,
    /// The axis: its z, or its x.
    pub(super) line: i32,
    /// Start and end along the axis.
    pub(super) span: [i32; 2],
    /// Rooms at lower and higher coordinates.
    pub(super) sides: [Option<usize>; 2],
    pub(super) holes: Vec<Hole>,
}

impl Wall {
    /// True if one side is outside.
    pub(super) fn is_outer(&self) -> bool {
        self.sides.contains(&None)
    }

    fn thickness(&self, style: &Style) -> i32 {
        if self.is_outer() { style.outer } else { style.inner }
    }

    fn point(&self, along: i32) -> (i32, i32) {
        if self.along_x { (along, self.line) } else { (self.line, along) }
    }

    /// Metres: along the wall, up, and across it from its axis.
    fn place(&self, along: f64, y: f64, across: f64) -> DVec3 {
        let line = metres(self.line) + across;
        if self.along_x { DVec3::new(along, y, line) } else { DVec3::new(line, y, along) }
    }
}

/// One side of a room: the room's side of the line (0: lower coordinates), and its extent along it.
#[derive(Clone, Copy)]
struct Edge {
    side: usize,
    span: [i32; 2],
    room: usize,
}

/// Walls of one direction that end at a junction: their number, the least and the greatest thickness.
#[derive(Clone, Copy, Default)]
struct Ends {
    count: u32,
    least: i32,
    most: i32,
}

/// A storey's rooms and walls.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) style: Style,
    pub(super) rooms: Vec<PlanRoom>,
    pub(super) walls: Vec<Wall>,
    /// The walls around each room, ascending.
    around: Vec<Vec<usize>>,
}

impl Plan {
    /// Finds the walls of rooms that don't overlap.
    pub(super) fn new(style: Style, rooms: Vec<PlanRoom>) -> Self {
        // For each line: the rooms that end there (side 0) or start there (side 1), with their extent along it.
        let mut lines: BTreeMap<(bool, i32), Vec<Edge>> = BTreeMap::new();
        for (i, room) in rooms.iter().enumerate() {
            for side in 0..2 {
                lines.entry((true, room.z[1 - side])).or_default().push(Edge { side, span: room.x, room: i });
                lines.entry((false, room.x[1 - side])).or_default().push(Edge { side, span: room.z, room: i });
            }
        }
        let mut walls = Vec::new();
        for (&(along_x, line), edges) in &lines {
            let mut cuts: Vec<i32> = edges.iter().flat_map(|e| e.span).collect();
            cuts.sort_unstable();
            cuts.dedup();
            let mut pieces = vec![[None; 2]; cuts.len()];
            for &Edge { side, span, room } in edges {
                let from = cuts.partition_point(|&c| c < span[0]);
                let to = cuts.partition_point(|&c| c < span[1]);
                for piece in &mut pieces[from..to] {
                    piece[side] = Some(room);
                }
            }
            for (span, sides) in cuts.windows(2).zip(pieces) {
                if sides != [None; 2] {
                    walls.push(Wall { along_x, line, span: [span[0], span[1]], sides, holes: Vec::new() });
                }
            }
        }
        let mut around = vec![Vec::new(); rooms.len()];
        for (w, wall) in walls.iter().enumerate() {
            for room in wall.sides.into_iter().flatten() {
                around[room].push(w);
            }
        }
        Self { style, rooms, walls, around }
    }

    /// The walls between a room and another, or outside.
    pub(super) fn between(&self, a: usize, b: Option<usize>) -> Vec<usize> {
        let a_b = [[Some(a), b], [b, Some(a)]];
        self.around[a].iter().copied().filter(|&w| a_b.contains(&self.walls[w].sides)).collect()
    }

    /// The walls around a room, ascending.
    pub(super) fn around(&self, room: usize) -> &[usize] {
        &self.around[room]
    }

    /// The range along a wall for openings or furniture: clear of crossing walls by `margin` millimetres.
    pub(super) fn clear_span(&self, wall: usize, margin: i32) -> [i32; 2] {
        let [from, to] = self.walls[wall].span;
        let off = self.style.outer.max(self.style.inner) / 2 + margin;
        [from + off, to - off]
    }

    /// A room's clear floor, millimetres: `[x0, x1], [z0, z1]`.
    pub(super) fn clear(&self, room: usize) -> [[i32; 2]; 2] {
        let mut off = [[0; 2]; 2];
        for wall in self.around[room].iter().map(|&w| &self.walls[w]) {
            for side in 0..2 {
                if wall.sides[side] == Some(room) {
                    // The wall is the far end of the room on its lower side.
                    let off = &mut off[usize::from(wall.along_x)][1 - side];
                    *off = (*off).max(wall.thickness(&self.style) / 2);
                }
            }
        }
        let r = &self.rooms[room];
        [[r.x[0] + off[0][0], r.x[1] - off[0][1]], [r.z[0] + off[1][0], r.z[1] - off[1][1]]]
    }

    /// Ends of each wall along its axis with closed junctions, see the module's documentation.
    fn extents(&self) -> Vec<[i32; 2]> {
        // At each junction: the walls along z, the walls along x.
        let mut junctions: BTreeMap<(i32, i32), [Ends; 2]> = BTreeMap::new();
        for wall in &self.walls {
            let t = wall.thickness(&self.style);
            for end in wall.span {
                let ends = &mut junctions.entry(wall.point(end)).or_default()[usize::from(wall.along_x)];
                ends.least = if ends.count == 0 { t } else { t.min(ends.least) };
                (ends.count, ends.most) = (ends.count + 1, t.max(ends.most));
            }
        }
        self.walls
            .iter()
            .map(|wall| {
                let off = |end: i32| {
                    let [z_walls, x_walls] = junctions[&wall.point(end)];
                    match (wall.along_x, x_walls.count) {
                        (true, 1) => z_walls.most / 2,
                        (true, _) | (false, 0) => 0,
                        (false, _) => -x_walls.least / 2,
                    }
                };
                [wall.span[0] - off(wall.span[0]), wall.span[1] + off(wall.span[1])]
            })
            .collect()
    }

    /// Adds the facts of this storey: its rooms, then its doors and windows. Returns each plan room's index among all rooms.
    /// `known`: rooms through several storeys that were added before.
    pub(super) fn describe(
        &self,
        facts: &mut Facts,
        storey: usize,
        floor: i32,
        known: &BTreeMap<usize, usize>,
    ) -> Vec<usize> {
        let style = &self.style;
        let ids: Vec<usize> = (0..self.rooms.len())
            .map(|i| {
                known.get(&i).copied().unwrap_or_else(|| {
                    let [x, z] = self.clear(i).map(|ends| ends.map(metres));
                    facts.rooms.push(Room {
                        id: format!("{storey}.{i}"),
                        name: self.rooms[i].name.clone(),
                        storey,
                        height: [metres(floor), metres(floor + style.clear)],
                        footprint: [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(a, b)| DVec2::new(x[a], z[b])).to_vec(),
                    });
                    facts.rooms.len() - 1
                })
            })
            .collect();
        for wall in &self.walls {
            for hole in &wall.holes {
                let y = metres(floor) + metres(hole.sill + hole.head) / 2.0;
                facts.openings.push(Opening {
                    fill: hole.fill,
                    storey,
                    centre: wall.place(metres(hole.at), y, 0.0),
                    size: DVec3::new(metres(hole.width), metres(hole.head - hole.sill), metres(wall.thickness(style))),
                    normal: if wall.along_x { DVec3::Z } else { DVec3::X },
                    rooms: [wall.sides[1].map(|r| ids[r]), wall.sides[0].map(|r| ids[r])],
                });
            }
        }
        ids
    }

    /// Builds walls, floor slabs, the roof over rooms with `roofed`, panes and door leaves. `voids`: holes of each room's floor;
    /// `closed`: whether the next leaf is shut, in the order of walls and holes.
    pub(super) fn build(
        &self,
        model: &mut Model,
        storey: usize,
        floor: i32,
        voids: &[Vec<Aabb>],
        roofed: &[bool],
        closed: &mut dyn FnMut() -> bool,
    ) {
        let style = &self.style;
        let (y0, y1) = (metres(floor), metres(floor + style.clear));
        let extents = self.extents();
        for (w, (wall, &[from, to])) in self.walls.iter().zip(&extents).enumerate() {
            let half = metres(wall.thickness(style)) / 2.0;
            let hole_box = |h: &Hole| {
                let [a, b] = [h.at - h.width / 2, h.at + h.width / 2].map(metres);
                Aabb { min: wall.place(a, metres(floor + h.sill), -half), max: wall.place(b, metres(floor + h.head), half) }
            };
            let holes: Vec<Aabb> = wall.holes.iter().map(hole_box).collect();
            let (min, max) = (wall.place(metres(from), y0, -half), wall.place(metres(to), y1, half));
            let solid = perforated(min, max, if wall.along_x { 2 } else { 0 }, &holes);
            model.add(format!("wall {storey}.{w}"), Role::Structure, Material::Plaster, solid);
            for (h, (hole, bounds)) in wall.holes.iter().zip(&holes).enumerate() {
                match hole.fill {
                    Fill::Glass => pane(model, &format!("window {storey}.{w}.{h}"), wall.along_x, bounds),
                    Fill::Door => leaf(model, &format!("door {storey}.{w}.{h}"), wall.along_x, bounds, hole.into, closed()),
                    Fill::Nothing => {}
                }
            }
        }
        for room in 0..self.rooms.len() {
            let slab = |top: i32, voids: &[Aabb]| self.slab(room, &extents, [top - style.slab, top].map(metres), voids);
            let solid = slab(floor, &voids[room]);
            if !solid.triangles.is_empty() {
                model.add(format!("floor {storey}.{room}"), Role::Structure, Material::Concrete, solid);
            }
            if roofed[room] {
                let solid = slab(floor + style.storey(), &[]);
                model.add(format!("roof {storey}.{room}"), Role::Structure, Material::Concrete, solid);
            }
        }
    }

    /// A room's slab between its axes, and the strips under the outer halves of its outer walls.
    fn slab(&self, room: usize, extents: &[[i32; 2]], [bottom, top]: [f64; 2], voids: &[Aabb]) -> Solid {
        let PlanRoom { x, z, .. } = &self.rooms[room];
        let ([x0, x1], [z0, z1]) = (x.map(metres), z.map(metres));
        let mut parts = vec![perforated(DVec3::new(x0, bottom, z0), DVec3::new(x1, top, z1), 1, voids)];
        let half = metres(self.style.outer) / 2.0;
        for &w in &self.around[room] {
            let wall = &self.walls[w];
            if let Some(outside) = wall.sides.iter().position(Option::is_none) {
                // Along x the strip includes the corners, as the wall does; along z it runs from axis to axis.
                let ends = if wall.along_x { extents[w] } else { wall.span };
                let across = if outside == 0 { [-half, 0.0] } else { [0.0, half] };
                let [a, b] = ends.map(metres);
                parts.push(cuboid(wall.place(a, bottom, across[0]), wall.place(b, top, across[1])));
            }
        }
        Solid::of(&parts)
    }
}

/// A pane in the middle of its hole.
pub(super) fn pane(model: &mut Model, name: &str, along_x: bool, hole: &Aabb) {
    let size = hole.size();
    let half = DVec3::new(if along_x { size.x } else { size.z }, size.y, PANE) / 2.0;
    let placement = Placement { at: hole.centre(), turns: if along_x { 0.0 } else { 0.75 } };
    let key = format!("pane {:.3} {:.3}", half.x, half.y);
    model.place(name, Role::Window, placement, &key, Material::Glass, || cuboid(-half, half));
}

/// A leaf with its hinge at the lower end of its hole, shut or open at a right angle; `into` as in [`Hole::into`].
pub(super) fn leaf(model: &mut Model, name: &str, along_x: bool, hole: &Aabb, into: usize, closed: bool) {
    let size = hole.size();
    // An open leaf is clear of its surroundings; a shut one overlaps the rim of its hole.
    let (side, above) = if closed { (REBATE, REBATE) } else { (-0.01, -0.01) };
    let (width, height) = (if along_x { size.x } else { size.z } + 2.0 * side, size.y + above);
    // +x, -z, -x, +z are 0 to 3 quarter turns.
    let quarter = match (along_x, closed, into) {
        (true, true, _) | (false, false, 1) => 0,
        (true, false, 0) => 1,
        (false, false, _) => 2,
        _ => 3,
    };
    // At the hinge, clear of the hole's side, on the face of the wall to which it opens.
    let mut at = DVec3::new(hole.min.x, hole.min.y, hole.min.z);
    let (along, across) = if along_x { (0, 2) } else { (2, 0) };
    at[along] += if closed { -REBATE } else { LEAF / 2.0 + 0.005 };
    at[across] = match (closed, into) {
        (true, _) => hole.centre()[across],
        (false, 0) => hole.min[across],
        (false, _) => hole.max[across],
    };
    let placement = Placement { at, turns: f64::from(quarter) / 4.0 };
    let key = format!("leaf {width:.3} {height:.3}");
    let (min, max) = (DVec3::new(0.0, 0.0, -LEAF / 2.0), DVec3::new(width, height, LEAF / 2.0));
    model.place(name, Role::Door, placement, &key, Material::Leaf, || cuboid(min, max));
}
