//! Seven choices of levels to query in scene graphs of four, as in the table 2 of Cunha and Leitão, in both of their cities
//! and on the platform, beside a binary tree that needs no choice. Buildings have as many triangles as theirs.

use crate::platform;
use crate::study::{Cost, Start, Study, chc, chc_plus, frames};
use crate::trees::LEAST_TRIANGLES;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::scene::{Object, Scene};
use enfilade_scenes::Kind;
use enfilade_studies::levels::{C1_TO_C7, LevelCuller, LevelOptions};
use enfilade_studies::trees::graph;
use glam::DVec3;

/// Frames of a stretch, and runs.
pub const IN_CITIES: [usize; 2] = [30, 5];
const ON_THE_DECK: [usize; 2] = [10, 3];
/// How often a building's triangles are divided in four, so that they are as many as in the study: 45 million in the dense
/// city.
const DETAIL: u32 = 3;

pub fn table(is_test: bool) {
    if !is_test {
        scene(&Study::new(Kind::City { dense: false }, "city, sparse", IN_CITIES, detailed));
        scene(&Study::new(Kind::City { dense: true }, "city, dense", IN_CITIES, detailed));
    }
    scene(&Study::new(Kind::Deck { objects: platform(is_test) }, "deck", frames(is_test, ON_THE_DECK), |scene| scene));
}

fn scene(study: &Study) {
    // Objects are named after where they are: `g00/a0000/b00`, `d0/m00/valve 7`; a city's ground is in no group.
    let part = |object: &Object, at: usize| {
        let number = object.node.split('/').nth(at).and_then(|p| p[1..].parse().ok());
        number.unwrap_or(u32::MAX)
    };
    let levels: Vec<Vec<u32>> = (0..2).map(|at| study.scene.objects.iter().map(|o| part(o, at)).collect()).collect();
    let graph = graph(study.scene, &levels);
    let known = study.known();
    println!("known, in the middle frames: {:.2} ms, {:.0} triangles\n", known.middle * 1e3, known.triangles);
    let tree = Hierarchy::build(study.scene, &HierarchyOptions::default());
    let coarse = Hierarchy::build(study.scene, &HierarchyOptions { least_triangles: LEAST_TRIANGLES });
    let parts = tree.clone().with_parts(study.scene);
    let automatic: [(&str, Start<'_>); 5] = [
        ("CHC", chc(&tree)),
        ("CHC, with parts", chc(&parts)),
        ("CHC, leaves of 2,000 triangles", chc(&coarse)),
        ("CHC++", chc_plus(&tree)),
        ("CHC++, with parts", chc_plus(&parts)),
    ];
    let (names, starts): (Vec<&str>, Vec<Start<'_>>) = automatic.into_iter().unzip();
    let methods: Vec<Start<'_>> = C1_TO_C7.iter().map(|&levels| chosen(&graph, levels)).chain(starts).collect();
    let costs = study.compare(&methods);
    let (by_choice, automatic) = costs.split_at(C1_TO_C7.len());
    println!("| culler | ms a frame | slowest | deviation | triangles | queries | gain |");
    println!("|{}", " --- |".repeat(7));
    by_choice.iter().enumerate().for_each(|(i, cost)| row(&format!("C{}", i + 1), cost, &costs[0]));
    names.iter().zip(automatic).for_each(|(name, cost)| row(name, cost, &costs[0]));
    let best = |of: fn(&Cost) -> f64| {
        let (i, least) = by_choice.iter().map(of).enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).expect("seven");
        (format!("C{}", i + 1), least)
    };
    let ((fastest, time), (fewest, triangles)) = (best(|cost| cost.mean), best(|cost| cost.triangles));
    println!("\nagainst the best chosen levels (time: {fastest}; triangles: {fewest}):");
    for (name, cost) in names.iter().zip(automatic) {
        println!("{name}: {:.3} of the time, {:.3} of the triangles", cost.mean / time, cost.triangles / triangles);
    }
}

fn row(name: &str, cost: &Cost, frustum: &Cost) {
    let [mean, slowest, deviation] = [cost.mean, cost.slowest, cost.deviation].map(|s| s * 1e3);
    let (triangles, queries, gain) = (cost.triangles, cost.queries, frustum.mean / cost.mean);
    println!("| {name} | {mean:.2} | {slowest:.2} | {deviation:.2} | {triangles:.0} | {queries:.0} | {gain:.2} |");
}

/// The seven choices.
fn chosen(graph: &Hierarchy, levels: u32) -> Start<'_> {
    Box::new(move || {
        let mut culler = LevelCuller::new(LevelOptions::new(levels));
        Box::new(move |frustum, buffer| (culler.cull(graph, frustum, buffer).to_vec(), culler.stats().queries))
    })
}

/// The same scene with the triangles of its buildings divided in four, [`DETAIL`] times.
pub fn detailed(scene: Scene) -> Scene {
    let mut new = Scene { positions: Vec::new(), triangles: Vec::new(), objects: Vec::new(), ..scene.clone() };
    for object in &scene.objects {
        let start = new.triangles.len() as u32;
        let is_building = object.node.split('/').nth(2).is_some_and(|name| name.starts_with('b'));
        for t in object.triangles.clone() {
            divide(scene.corners(t as usize), if is_building { DETAIL } else { 0 }, &mut new);
        }
        new.objects.push(Object { triangles: start..new.triangles.len() as u32, ..object.clone() });
    }
    new
}

fn divide([a, b, c]: [DVec3; 3], times: u32, scene: &mut Scene) {
    if times == 0 {
        let first = scene.positions.len() as u32;
        scene.positions.extend([a, b, c]);
        scene.triangles.push([first, first + 1, first + 2]);
        return;
    }
    // The same point from either end, so that neighbours meet.
    let [ab, bc, ca] = [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5];
    for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
        divide(part, times - 1, scene);
    }
}
