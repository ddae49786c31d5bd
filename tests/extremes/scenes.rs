//! The worlds, each with what is known about it. Metres; doors are holes in walls without thickness.

use super::world::Known::{Hidden, Visible};
use super::world::{Room, World, p};
use glam::DVec3;

/// A closet and a hall of `size` metres behind a keyhole of `hole` metres; a thing in the hall, one in another closet that has no way in.
pub fn keyhole(size: f64, hole: f64) -> World {
    let mut w = World::new("keyhole");
    let closet = w.room(p(-4.0, 0.0, -2.0), p(0.0, 3.0, 2.0));
    let hall = w.room(p(0.0, -size / 20.0, -size / 2.0), p(size, size / 20.0, size / 2.0));
    let shut = w.room(p(-4.0, 0.0, 2.0), p(0.0, 3.0, 6.0));
    w.door(closet, hall, p(0.0, 1.0, 0.0), p(0.0, 1.0 + hole, hole));
    let far = w.thing(p(size * 0.5, -2.0, -5.0), p(size * 0.5 + 5.0, 4.0, 5.0));
    let near = w.thing(p(-3.0, 0.5, -1.0), p(-2.5, 1.0, -0.5));
    let inside = w.thing(p(-3.0, 0.5, 3.0), p(-2.0, 1.5, 4.0));
    for room in [closet, hall] {
        w.knows(room, far, Visible);
        w.knows(room, inside, Hidden);
    }
    w.knows(hall, near, Visible);
    w.knows(shut, far, Hidden);
    let eye = p(-1.0, 1.0 + hole / 2.0, hole / 2.0);
    w.views = vec![
        [eye, eye + DVec3::X],
        [p(-hole, 1.0 + hole / 2.0, hole / 2.0), p(size, 1.0, 0.0)],
        [p(size * 0.4, 0.0, 0.0), p(0.0, 1.0, 0.0)],
    ];
    w
}

/// A closet and a hall of `size` metres behind a keyhole of 5 mm, and a way round through a lobby: what stands in the hall shows through the
/// keyhole only.
pub fn keyhole_and_a_way_round(name: &'static str, size: f64) -> World {
    let mut w = World::new(name);
    let closet = w.room(p(-4.0, 0.0, -2.0), p(0.0, 3.0, 2.0));
    let hall = w.room(p(0.0, -size / 20.0, -size / 2.0), p(size, size / 20.0, size / 2.0));
    let lobby = w.room(p(-4.0, 0.0, -6.0), p(0.0, 3.0, -2.0));
    w.door(closet, hall, p(0.0, 1.0, 0.0), p(0.0, 1.005, 0.005));
    w.door(lobby, closet, p(-4.0, 0.0, -2.0), p(-3.0, 2.0, -2.0));
    w.door(lobby, hall, p(0.0, 0.0, -6.0), p(0.0, 2.0, -5.0));
    let far = w.thing(p(size * 0.5, -2.0, -5.0), p(size * 0.5 + 5.0, 4.0, 5.0));
    for room in [closet, hall, lobby] {
        w.knows(room, far, Visible);
    }
    let eye = p(-1.0, 1.0025, 0.0025);
    w.views = vec![[eye, eye + DVec3::X], [p(-3.5, 1.0, -4.0), p(-3.5, 1.0, 0.0)]];
    w
}

/// Rooms of `long` metres in a row along x with doors in line, or turn by turn on the left and on the right.
pub fn row(name: &'static str, n: usize, long: f64, in_line: bool) -> World {
    let mut w = World::new(name);
    for k in 0..n {
        let [x, next] = [k, k + 1].map(|k| long * k as f64);
        w.room(p(x, 0.0, 0.0), p(next, 3.0, 4.0));
        if k > 0 {
            let z = if in_line || k % 2 == 0 { 0.5 } else { 3.0 };
            w.door(k - 1, k, p(x, 0.0, z), p(x, 2.0, z + 0.5));
        }
    }
    let last = long * (n - 1) as f64;
    let end = w.thing(p(last + long * 0.4, 0.5, 0.55), p(last + long * 0.6, 1.5, 0.95));
    let start = w.thing(p(long * 0.4, 0.5, 0.55), p(long * 0.6, 1.5, 0.95));
    // Through doors half a metre wide, 2 m apart across: after three walls no line is left, whatever the rooms' length.
    let known = if in_line { Visible } else { Hidden };
    w.knows(0, end, known);
    w.knows(n - 1, start, known);
    w.knows(0, start, Visible);
    let middle = 0.75;
    w.views =
        vec![[p(0.2 * long, 1.0, middle), p(last, 1.0, middle)], [p(last + 0.9 * long, 1.0, middle), p(0.0, 1.0, middle)]];
    w
}

/// Three slits of a centimetre: from the first two the third is met at z from 0.99 to 1.02. Here the third begins at `low`.
pub fn slits(name: &'static str, low: f64, known: super::world::Known) -> World {
    let mut w = World::new(name);
    for (k, z) in [0.0, 0.0, 0.5, low].into_iter().enumerate() {
        let x = 4.0 * k as f64;
        w.room(p(x, 0.0, -2.0), p(x + 4.0, 2.0, 3.0));
        if k > 0 {
            w.door(k - 1, k, p(x, 0.0, z), p(x, 2.0, z + 0.01));
        }
    }
    // All of the last room's far wall stands behind the thing.
    let thing = w.thing(p(15.5, 0.1, -1.9), p(15.6, 1.9, 2.9));
    w.knows(0, thing, known);
    w.knows(1, thing, Visible);
    w.views = vec![[p(2.0, 1.0, -0.25), p(4.0, 1.0, 0.005)], [p(3.9, 1.0, 0.0), p(8.0, 1.0, 0.505)]];
    w
}

/// A lying slit, an upright one, a lying one, each a millimetre: a line through any point of two.
pub fn turned_slits() -> World {
    let mut w = World::new("slits turned against each other");
    for k in 0..4 {
        let x = 4.0 * k as f64;
        w.room(p(x, 0.0, 0.0), p(x + 4.0, 2.0, 2.0));
        if k > 0 {
            let (low, high) = if k == 2 { (p(x, 0.0, 1.0), p(x, 2.0, 1.001)) } else { (p(x, 1.0, 0.0), p(x, 1.001, 2.0)) };
            w.door(k - 1, k, low, high);
        }
    }
    let thing = w.thing(p(15.0, 0.1, 0.1), p(15.5, 1.9, 1.9));
    (0..4).for_each(|room| w.knows(room, thing, Visible));
    w.views = vec![[p(2.0, 1.0005, 1.0005), p(16.0, 1.0005, 1.0005)]];
    w
}

/// A hole of a micrometre beside a gate of 100 m, in one wall.
pub fn hole_and_gate() -> World {
    let mut w = World::new("1e-6 m beside 100 m");
    let a = w.room(p(0.0, 0.0, 0.0), p(150.0, 120.0, 240.0));
    let b = w.room(p(150.0, 0.0, 0.0), p(300.0, 120.0, 240.0));
    let c = w.room(p(300.0, 0.0, 0.0), p(450.0, 120.0, 240.0));
    w.door(a, b, p(150.0, 10.0, 10.0), p(150.0, 110.0, 110.0));
    w.door(a, b, p(150.0, 60.0, 200.0), p(150.0, 60.0 + 1e-6, 200.0 + 1e-6));
    w.door(b, c, p(300.0, 60.0, 200.0), p(300.0, 60.0 + 1e-6, 200.0 + 1e-6));
    let thing = w.thing(p(400.0, 50.0, 190.0), p(410.0, 70.0, 210.0));
    [a, b, c].into_iter().for_each(|room| w.knows(room, thing, Visible));
    w.views = vec![[p(10.0, 60.0, 200.0), p(400.0, 60.0, 200.0)], [p(290.0, 60.0, 200.0), p(400.0, 60.0, 200.0)]];
    w
}

/// Two rooms and a corridor, with doors whose planes, edges and corners eyes stand on, and others that lie in the eye's own plane.
pub fn on_the_threshold() -> World {
    let mut w = World::new("eyes on planes, edges, corners");
    let a = w.room(p(0.0, 0.0, 0.0), p(4.0, 3.0, 4.0));
    let b = w.room(p(4.0, 0.0, 0.0), p(8.0, 3.0, 4.0));
    let corridor = w.room(p(0.0, 0.0, 4.0), p(8.0, 3.0, 6.0));
    w.door(a, b, p(4.0, 0.0, 1.0), p(4.0, 2.0, 2.0));
    w.door(a, corridor, p(1.0, 0.0, 4.0), p(2.0, 2.0, 4.0));
    w.door(b, corridor, p(6.0, 0.0, 4.0), p(7.0, 2.0, 4.0));
    let in_a = w.thing(p(0.2, 0.2, 0.2), p(0.8, 1.0, 0.8));
    let in_b = w.thing(p(7.2, 0.2, 0.2), p(7.8, 1.0, 0.8));
    w.knows(a, in_b, Visible);
    w.knows(b, in_a, Visible);
    w.knows(corridor, in_a, Visible);
    let eyes = [
        p(4.0, 1.0, 1.5),
        p(4.0, 0.0, 1.5),
        p(4.0, 2.0, 1.0),
        p(4.0, 1.0, 2.0),
        p(4.0, 1.0, 3.0),
        p(1.5, 1.0, 4.0),
        p(1.0, 2.0, 4.0),
        p(2.0, 0.0, 4.0),
        p(4.0, 1.5, 4.0),
        p(0.0, 0.0, 0.0),
        p(8.0, 3.0, 6.0),
        p(3.0, 1.0, 4.0),
    ];
    let looks = [DVec3::X, -DVec3::X, p(1.0, 0.3, 1.0), p(-1.0, -0.2, -0.7), p(0.01, 1.0, 0.0)];
    w.views = eyes.iter().flat_map(|&eye| looks.map(|look| [eye, eye + look])).collect();
    w.auto = true;
    w
}

/// Four rooms around a pillar, every door in the middle of its wall: each sees its neighbours, and none the thing behind the pillar.
pub fn cycle(name: &'static str) -> World {
    let mut w = World::new(name);
    // Corners of 4 m, passages of 4 m between them, around 4 m of stone.
    let cells = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)];
    for (x, z) in cells {
        let at = p(4.0 * f64::from(x), 0.0, 4.0 * f64::from(z));
        w.room(at, at + p(4.0, 3.0, 4.0));
    }
    for k in 0..8 {
        let (a, b) = (cells[k], cells[(k + 1) % 8]);
        let (low, high) = if b.0 >= a.0 && b.1 >= a.1 { (k, (k + 1) % 8) } else { ((k + 1) % 8, k) };
        let (x, z) = (4.0 * f64::from(cells[high].0), 4.0 * f64::from(cells[high].1));
        if a.1 == b.1 {
            w.door(low, high, p(x, 0.0, z + 1.5), p(x, 2.0, z + 2.5));
        } else {
            w.door(low, high, p(x + 1.5, 0.0, z), p(x + 2.5, 2.0, z));
        }
    }
    let thing = w.thing(p(9.0, 0.2, 9.0), p(11.0, 1.5, 11.0));
    w.knows(4, thing, Visible);
    w.knows(0, thing, Hidden);
    w.knows(3, thing, Visible);
    w.knows(5, thing, Visible);
    w.auto = true;
    w
}

/// A ramp around a core, in steps of a quarter turn and half a metre: what is two turns up is hidden.
pub fn spiral(turns: usize) -> World {
    let mut w = World::new("spiral ramp");
    let quarter = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)];
    // Each room is 0.4 m high over its step, so that the next turn's passes above.
    for k in 0..4 * turns {
        let ((x, z), y) = (quarter[k % 4], 0.5 * k as f64);
        w.room(p(x, y, z), p(x + 4.0, y + 1.5, z + 4.0));
        if k > 0 {
            let (low, high) = if k % 4 == 1 || k % 4 == 2 { (k - 1, k) } else { (k, k - 1) };
            let top = y + 1.0;
            match k % 4 {
                1 => w.door(low, high, p(4.0, y, 1.0), p(4.0, top, 2.0)),
                2 => w.door(low, high, p(6.0, y, 4.0), p(7.0, top, 4.0)),
                3 => w.door(low, high, p(4.0, y, 6.0), p(4.0, top, 7.0)),
                _ => w.door(low, high, p(1.0, y, 4.0), p(2.0, top, 4.0)),
            }
        }
    }
    let top = 4 * turns - 1;
    let y = 0.5 * top as f64;
    let thing = w.thing(p(1.0, y + 0.2, 5.0), p(3.0, y + 1.0, 7.0));
    w.knows(top, thing, Visible);
    w.knows(0, thing, Hidden);
    w
}

/// A room in the middle of a room, which is a cell of six boxes around it, with a door.
pub fn cell_in_a_cell() -> World {
    let mut w = World::new("a cell inside a cell");
    let (a, b) = (p(0.0, 0.0, 0.0), p(12.0, 6.0, 12.0));
    let (c, d) = (p(4.0, 2.0, 4.0), p(8.0, 4.0, 8.0));
    let boxes = vec![
        [a, p(c.x, b.y, b.z)],
        [p(d.x, a.y, a.z), b],
        [p(c.x, a.y, a.z), p(d.x, c.y, b.z)],
        [p(c.x, d.y, a.z), p(d.x, b.y, b.z)],
        [p(c.x, c.y, a.z), p(d.x, d.y, c.z)],
        [p(c.x, c.y, d.z), p(d.x, d.y, b.z)],
    ];
    // Between two boxes everything is open: the parts that they share.
    let mut inner = Vec::new();
    for (i, [p0, p1]) in boxes.iter().enumerate() {
        for [q0, q1] in &boxes[..i] {
            let (low, high) = (p0.max(*q0), p1.min(*q1));
            if (0..3).filter(|&k| low[k] == high[k]).count() == 1 && (0..3).all(|k| low[k] <= high[k]) {
                inner.push([low, high]);
            }
        }
    }
    w.rooms.push(Room { boxes, inner });
    let within = w.room(c, d);
    w.door(0, within, p(4.0, 2.0, 5.0), p(4.0, 3.5, 6.0));
    let inside = w.thing(p(7.0, 2.2, 7.0), p(7.5, 2.8, 7.5));
    let before = w.thing(p(1.0, 0.5, 5.0), p(1.5, 3.0, 6.0));
    let behind = w.thing(p(11.0, 0.5, 0.5), p(11.5, 1.0, 1.0));
    w.knows(0, inside, Visible);
    w.knows(within, before, Visible);
    w.knows(0, behind, Visible);
    w.knows(within, behind, Hidden);
    w.views = vec![
        [p(10.0, 3.0, 6.0), p(0.0, 3.0, 6.0)],
        [p(1.0, 3.0, 5.5), p(8.0, 2.5, 7.3)],
        [p(7.5, 3.0, 5.0), p(0.0, 2.7, 5.6)],
    ];
    w
}

/// A hall with `n` doors on each of two sides, a closet behind each: across the hall they see each other, beside each other they don't.
pub fn doors(n: usize) -> World {
    let mut w = World::new("a hall of doors");
    let length = 2.0 * n as f64;
    let hall = w.room(p(0.0, 0.0, 0.0), p(length, 3.0, 10.0));
    let mut things = Vec::new();
    for side in 0..2 {
        for k in 0..n {
            let x = 2.0 * k as f64;
            let (z, wall) = if side == 0 { (-2.0, 0.0) } else { (10.0, 10.0) };
            let closet = w.room(p(x, 0.0, z), p(x + 2.0, 3.0, z + 2.0));
            let (low, high) = if side == 0 { (closet, hall) } else { (hall, closet) };
            w.door(low, high, p(x + 0.5, 0.0, wall), p(x + 1.5, 2.0, wall));
            if k < 4 {
                things.push((closet, side, w.thing(p(x + 0.8, 0.2, z + 0.8), p(x + 1.2, 1.2, z + 1.2))));
            }
        }
    }
    for &(a, side, _) in &things {
        for &(b, other, thing) in &things {
            let known = if side != other || a == b { Visible } else { Hidden };
            w.knows(a, thing, known);
        }
        w.knows(hall, things[0].2, Visible);
    }
    w
}
