//! What not knowing costs: CHC and CHC++ beside one who is told which objects show and draws only these, the nearest first. In the middle frames
//! of the stretches, in both cities of Cunha and Leitão and among Ivson's teapots.

use crate::levels::{IN_CITIES, detailed};
use crate::study::{Start, Study, chc, chc_plus, frames};
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade_scenes::Kind;

/// Frames of a stretch, and runs.
const AMONG_TEAPOTS: [usize; 2] = [10, 3];

pub fn table(is_test: bool) {
    if is_test {
        return scene(&Study::new(Kind::Teapots { count: 20, scale: 20 }, "Teapots(20, 20)", frames(true, [0; 2]), |s| s));
    }
    scene(&Study::new(Kind::City { dense: false }, "city, sparse", IN_CITIES, detailed));
    scene(&Study::new(Kind::City { dense: true }, "city, dense", IN_CITIES, detailed));
    scene(&Study::new(Kind::Teapots { count: 500, scale: 30 }, "Teapots(500, 30)", AMONG_TEAPOTS, |scene| scene));
}

fn scene(study: &Study) {
    let tree = Hierarchy::build(study.scene, &HierarchyOptions::default());
    let parts = tree.clone().with_parts(study.scene);
    let methods: [(&str, Start<'_>); 5] = [
        ("known", study.knowing()),
        ("CHC", chc(&tree)),
        ("CHC, with parts", chc(&parts)),
        ("CHC++", chc_plus(&tree)),
        ("CHC++, with parts", chc_plus(&parts)),
    ];
    let (names, starts): (Vec<&str>, Vec<Start<'_>>) = methods.into_iter().unzip();
    let costs = study.compare(&starts);
    let known = costs[0];
    println!("| method | ms | over known | triangles, over known |");
    println!("|{}", " --- |".repeat(4));
    for (name, cost) in names.iter().zip(&costs) {
        let (time, triangles) = (cost.middle / known.middle, cost.middle_triangles / known.middle_triangles);
        println!("| {name} | {:.2} | {time:.3} | {triangles:.3} |", cost.middle * 1e3);
    }
}
