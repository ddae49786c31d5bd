//! Three rooms in a row, and places in them.
#![allow(dead_code, reason = "not every test needs all")]

use bevy_math::Vec3;
use bevy_transform::components::Transform;
use enfilade::cells::PortalKind;
use enfilade::file::PvsFile;
use glam::DVec3;
use testing::boxes;
use testing::boxes::{block, p};

/// The corner of the first room, metres: far enough from zero that the file's origin matters.
pub const CORNER: DVec3 = DVec3::new(100.0, 20.0, -300.0);
/// Eyes in the three rooms, metres from [`CORNER`].
pub const EYES: [f32; 3] = [1.0, 6.0, 11.0];

/// Their objects.
pub const THINGS: [&str; 3] = ["bed", "table", "bath"];

/// Three rooms in a row along x, each 4 m square and 3 m high, with a door between neighbours and an object in each. The doors are in line,
/// but the rows say that the outer rooms don't see each other.
pub fn three_rooms() -> PvsFile {
    rooms_with([0, 1, 2])
}

/// The same with its objects in another order.
pub fn rooms_with(order: [usize; 3]) -> PvsFile {
    let mut b = boxes::Building::default();
    let at = |x: f64, y: f64, z: f64| CORNER + p(x, y, z);
    let rooms = [0., 4., 8.].map(|x| b.cell("", vec![block(at(x, 0., 0.), at(x + 4., 3., 4.))]));
    for i in 0..2 {
        let x = rooms[1 + i].0 as f64 * 4.0;
        b.portal(rooms[i], rooms[i + 1], at(x, 0., 1.5), at(x, 2.1, 2.5), PortalKind::Door);
    }
    for room in order {
        let x = 1.5 + 4.0 * room as f64;
        b.thing(THINGS[room], at(x, 0.01, 3.), at(x + 1., 0.8, 3.8));
    }
    let thing_in = |room: usize| order.iter().position(|&r| r == room).unwrap();
    let (_, file) = b.finish_with(|cells, objects| {
        for (a, b) in [(0, 2), (2, 0)] {
            cells.clear(a, b);
            objects.clear(a, thing_in(b));
        }
    });
    file
}

pub fn bevy(v: DVec3) -> Vec3 {
    Vec3::from_array(v.as_vec3().to_array())
}

/// Where an eye at `x` in the row of rooms is: off the doors' line.
pub fn at(x: f32) -> Transform {
    Transform::from_translation(bevy(CORNER) + Vec3::new(x, 1.6, 3.5))
}
