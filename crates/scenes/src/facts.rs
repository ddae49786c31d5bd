//! Known contents of a generated building: rooms, doors, windows, stairs, a path through it.
//!
//! The facts come from the plan that the walls are built from, never from the finished mesh, so that the search for rooms and
//! doors can be scored against them.

use glam::{DVec2, DVec3};
use serde_json::{Value, json};

/// The fill of an opening in a wall.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Fill {
    /// A leaf: passable.
    Door,
    /// Nothing: passable.
    Nothing,
    /// Glass.
    Glass,
}

/// A room; `id` is unique in the building.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Room {
    pub(super) id: String,
    pub(super) name: String,
    /// Index into [`Facts::storeys`].
    pub(super) storey: usize,
    /// Heights of floor and ceiling, metres.
    pub(super) height: [f64; 2],
    /// Clear floor: a simple polygon in (x, z), metres.
    pub(super) footprint: Vec<DVec2>,
}

impl Room {
    /// Area of the footprint, square metres.
    fn area(&self) -> f64 {
        let ring = &self.footprint;
        (0..ring.len()).map(|i| ring[i].perp_dot(ring[(i + 1) % ring.len()])).sum::<f64>().abs() / 2.0
    }

    /// Mean of the corners, on the floor.
    pub(super) fn middle(&self) -> DVec3 {
        let m = self.footprint.iter().sum::<DVec2>() / self.footprint.len() as f64;
        DVec3::new(m.x, self.height[0], m.y)
    }
}

/// A hole in a wall.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Opening {
    pub(super) fill: Fill,
    pub(super) storey: usize,
    /// Middle of the hole, in the middle of the wall.
    pub(super) centre: DVec3,
    /// Width, height and depth of the hole, metres.
    pub(super) size: DVec3,
    /// Horizontal unit vector through the wall.
    pub(super) normal: DVec3,
    /// The room that the normal points to, the room behind; `None` is outside.
    pub(super) rooms: [Option<usize>; 2],
}

/// Stairs from one room up to another, and a path over them.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Stair {
    /// Lower room, upper room.
    pub(super) rooms: [usize; 2],
    /// Points on the treads from the lower landing to the upper.
    pub(super) way: Vec<DVec3>,
    /// The hole in the upper slab: least and greatest corner.
    pub(super) hole: [DVec3; 2],
}

/// All facts.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Facts {
    /// Name and height of the floor.
    pub(super) storeys: Vec<(String, f64)>,
    pub(super) rooms: Vec<Room>,
    pub(super) openings: Vec<Opening>,
    pub(super) stairs: Vec<Stair>,
    /// Other holes in slabs (lift shafts).
    pub(super) shafts: Vec<[DVec3; 2]>,
}

fn list(p: DVec3) -> [f64; 3] {
    p.to_array().map(rounded)
}

/// Rounds to a tenth of a millimetre, for readable files.
fn rounded(x: f64) -> f64 {
    // Adding zero turns -0 into 0.
    (x * 1e4).round() / 1e4 + 0.0
}

impl Facts {
    pub(super) fn count(&self, fill: Fill) -> usize {
        self.openings.iter().filter(|o| o.fill == fill).count()
    }

    /// Rooms, doors and voids in the form of `*.rooms.json` files.
    pub(super) fn rooms_json(&self, source: &str) -> Value {
        let id = |room: Option<usize>| room.map(|r| self.rooms[r].id.clone());
        let rooms: Vec<Value> = self
            .rooms
            .iter()
            .map(|r| {
                let ring: Vec<[f64; 2]> = r.footprint.iter().map(|p| [rounded(p.x), rounded(p.y)]).collect();
                json!({
                    "id": r.id, "name": r.name, "storey": self.storeys[r.storey].0,
                    "floor_y": rounded(r.height[0]), "ceiling_y": rounded(r.height[1]), "area_m2": rounded(r.area()),
                    "footprint": [[ring]], "clear_floor_y": rounded(r.height[0]), "clear_ceiling_y": rounded(r.height[1]),
                })
            })
            .collect();
        let doors: Vec<Value> = self
            .openings
            .iter()
            .enumerate()
            .map(|(i, o)| {
                let kind = match o.fill {
                    Fill::Door => "door",
                    Fill::Nothing => "opening",
                    Fill::Glass => "window",
                };
                json!({
                    "id": format!("{kind}-{i}"), "kind": kind, "storey": self.storeys[o.storey].0,
                    "centre": list(o.centre), "width": rounded(o.size.x), "height": rounded(o.size.y),
                    "thickness": rounded(o.size.z), "normal": list(o.normal), "rooms": o.rooms.map(id),
                })
            })
            .collect();
        let voids: Vec<Value> = (self.stairs.iter().map(|s| s.hole))
            .chain(self.shafts.iter().copied())
            .enumerate()
            .map(|(i, [a, b])| json!({ "id": format!("void-{i}"), "kind": "slab_opening", "bbox": ([list(a), list(b)].concat()) }))
            .collect();
        json!({
            "source": source, "units": "m", "up": "+Y",
            "note": "from the generator's own plan; door.rooms = [on the side the normal points to, on the other side]",
            "storeys": self.storeys.iter().map(|(n, y)| json!({ "name": n, "elevation": rounded(*y) })).collect::<Vec<_>>(),
            "rooms": rooms, "doors": doors, "voids": voids,
        })
    }
}
