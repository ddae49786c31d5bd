//! Places to look from in generated offices.

use enfilade::scene::Scene;
use enfilade_scenes::Generated;
use glam::DVec3;
use serde_json::Value;

/// Ten in offices, five in corridors, five in doorways, 1.5 m above the floor.
pub fn of_an_office(office: &Generated, scene: &Scene) -> Vec<DVec3> {
    let number = |value: &Value| value.as_f64().expect("a number");
    let list = |key: &str| office.rooms[key].as_array().expect("a list");
    let spread = |all: Vec<DVec3>, count: usize| (0..count).map(move |i| all[i * all.len() / count]).collect::<Vec<_>>();
    let rooms = |name: &str| {
        let of_name = list("rooms").iter().filter(|r| r["name"].as_str().is_some_and(|n| n.starts_with(name)));
        let middle = |room: &Value| {
            let ring = room["footprint"][0][0].as_array().expect("a ring");
            let mean = |k: usize| ring.iter().map(|p| number(&p[k])).sum::<f64>() / ring.len() as f64;
            DVec3::new(mean(0), number(&room["floor_y"]) + 1.5, mean(1))
        };
        of_name.map(middle).collect::<Vec<_>>()
    };
    let doors = list("doors")
        .iter()
        .filter(|d| d["kind"] == "door")
        .map(|d| DVec3::from_array([0, 1, 2].map(|k| number(&d["centre"][k]))));
    let doors = doors.map(|centre| centre + DVec3::Y * 0.45).collect();
    let all = [spread(rooms("Office"), 10), spread(rooms("Corridor"), 5), spread(doors, 5)].concat();
    // Off the axes of symmetry, where surfaces line up with pixels.
    all.into_iter().map(|eye| eye + DVec3::new(0.0137, 0.0071, 0.0213) - scene.origin).collect()
}
