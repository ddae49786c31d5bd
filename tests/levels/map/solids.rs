//! Brushes of a map, read anew, and rays between them: whether a map leaks.

use super::imported;
use enfilade::math::geom::Plane;
use glam::DVec3;
use testing::data::data;
use testing::random::Places;

/// A brush by its planes.
pub type Solid = Vec<Plane>;

/// The brushes of the world, and where point entities are; read anew, without the library.
pub fn solids(text: &str) -> (Vec<Solid>, Vec<DVec3>) {
    let (mut solids, mut origins, mut depth, mut class) = (Vec::new(), Vec::new(), 0, String::new());
    let mut brush: Option<(Solid, bool)> = None;
    for line in text.lines().map(str::trim) {
        let quoted: Vec<&str> = line.split('"').collect();
        match line.chars().next() {
            Some('{') => {
                depth += 1;
                brush = (depth == 2).then(|| (Vec::new(), true));
            }
            Some('}') => {
                depth -= 1;
                let is_world = matches!(class.as_str(), "worldspawn" | "func_group" | "func_illusionary_visblocker");
                if let Some((planes, true)) = brush.take().filter(|_| is_world) {
                    solids.push(planes);
                }
            }
            Some('"') if quoted[1] == "classname" => class = quoted[3].to_owned(),
            Some('"') if quoted[1] == "origin" => {
                let at: Vec<f64> = quoted[3].split(' ').map(|w| w.parse().unwrap()).collect();
                origins.push(DVec3::new(at[0], at[1], at[2]));
            }
            Some('(') => {
                let (planes, is_solid) = brush.as_mut().expect("within a brush");
                let numbers: Vec<f64> = line.split(['(', ')', ' ']).filter_map(|w| w.parse().ok()).collect();
                let [a, b, c] = [0, 3, 6].map(|k| DVec3::new(numbers[k], numbers[k + 1], numbers[k + 2]));
                planes.push(Plane::through(b, (a - b).cross(c - b).normalize()));
                let texture = line.split(')').nth(3).unwrap().split_whitespace().next().unwrap().to_lowercase();
                let texture = texture.rsplit('/').next().unwrap();
                let is_open = texture.starts_with(['*', '{']) && class != "func_illusionary_visblocker";
                *is_solid &= !is_open && !["clip", "trigger", "hint"].contains(&texture);
                // Detail, windows, liquids and areaportals of Quake 2 are not walls.
                let tail = line.rsplit(['(', ']']).next().unwrap().rsplit(')').next().unwrap();
                let numbers: Vec<f64> = tail.split_whitespace().filter_map(|w| w.parse().ok()).collect();
                let own = if line.contains(']') { 3 } else { 5 };
                let contents = numbers.get(own).map_or(0, |&n| n as u32);
                *is_solid &= contents & 0x1903_807a == 0;
            }
            _ => {}
        }
    }
    (solids, origins)
}

/// How far a ray goes before it meets a solid.
pub fn free_way(solids: &[Solid], from: DVec3, direction: DVec3) -> f64 {
    let into = |planes: &Solid| {
        let (mut near, mut far) = (0.0f64, f64::INFINITY);
        for plane in planes {
            let (distance, slope) = (plane.distance(from), plane.n.dot(direction));
            match slope {
                s if s < 0.0 => near = near.max(-distance / s),
                s if s > 0.0 => far = far.min(-distance / s),
                // Along a face is not inside.
                _ if distance > -1e-9 => return f64::INFINITY,
                _ => {}
            }
        }
        if near <= far { near } else { f64::INFINITY }
    };
    solids.iter().map(into).fold(f64::INFINITY, f64::min)
}

/// Whether a walk of random straight steps from an entity gets out of the map.
fn gets_out(solids: &[Solid], from: DVec3, seed: u64) -> bool {
    let mut random = Places::new(seed);
    let mut at = from;
    for _ in 0..20_000 {
        let direction = DVec3::from(std::array::from_fn(|_| 2.0 * random.unit() - 1.0)).normalize();
        let way = free_way(solids, at, direction);
        if way == f64::INFINITY {
            return true;
        }
        at += direction * way * random.unit() * 0.999;
    }
    false
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn maps_leak_where_a_random_walk_gets_out_of_them() {
    let folder = data();
    let folder = folder.join("ericw-testmaps-gpl");
    let (mut maps, mut leaks) = (0, 0);
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "map") {
            continue;
        }
        maps += 1;
        let text = std::fs::read_to_string(&path).unwrap();
        let (solids, origins) = solids(&text);
        let out = origins
            .iter()
            .enumerate()
            .any(|(i, &from)| free_way(&solids, from, DVec3::X) > 0.0 && gets_out(&solids, from, i as u64));
        let is_leak = imported(&text).unwrap().hints.leak.is_some();
        assert_eq!(is_leak, out, "{}", path.display());
        leaks += usize::from(is_leak);
    }
    assert_eq!((maps, leaks), (18, 0));
}
