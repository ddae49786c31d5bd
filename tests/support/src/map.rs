//! Maps as editors write them, by hand: boxes as brushes.

/// A box as a brush, with one texture.
pub fn block(min: [i32; 3], max: [i32; 3], texture: &str) -> String {
    let mut text = String::from("{\n");
    for axis in 0..3 {
        for above in [false, true] {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            let at = |du: i32, dv: i32| {
                let mut p = min;
                p[axis] = if above { max[axis] } else { min[axis] };
                (p[u], p[v]) = (p[u] + du, p[v] + dv);
                format!("( {} {} {} )", p[0], p[1], p[2])
            };
            // Clockwise from outside.
            let [a, b] = if above { [at(1, 0), at(0, 1)] } else { [at(0, 1), at(1, 0)] };
            text += &format!("{a} {} {b} {texture} 0 0 0 1 1\n", at(0, 0));
        }
    }
    text + "}\n"
}

/// The walls of a closed box, 8 thick, around an inside: six brushes.
pub fn shell(min: [i32; 3], max: [i32; 3], texture: &str) -> Vec<String> {
    let sides = (0..3).flat_map(|axis| [(axis, false), (axis, true)]);
    let wall = |(axis, above): (usize, bool)| {
        let (mut from, mut to) = (min.map(|x| x - 8), max.map(|x| x + 8));
        if above {
            from[axis] = max[axis]
        } else {
            to[axis] = min[axis]
        }
        block(from, to, texture)
    };
    sides.map(wall).collect()
}

/// An entity: its class, lines of other keys, its brushes.
pub fn entity(class: &str, keys: &str, brushes: &[String]) -> String {
    format!("{{\n\"classname\" \"{class}\"\n{keys}{}}}\n", brushes.concat())
}

/// A player's start.
pub fn start(at: &str) -> String {
    entity("info_player_start", &format!("\"origin\" \"{at}\"\n"), &[])
}

/// Two rooms of 128 x 128 x 128, at x from 0 and from 136, and the wall between them with a doorway of 64 x 64 on the floor.
pub fn two_rooms() -> Vec<String> {
    let mut brushes = shell([0, 0, 0], [264, 128, 128], "Brick");
    brushes.extend([
        block([128, 0, 0], [136, 32, 128], "brick"),
        block([128, 96, 0], [136, 128, 128], "brick"),
        block([128, 32, 64], [136, 96, 128], "lintel"),
    ]);
    brushes
}
