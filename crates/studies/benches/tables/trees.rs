//! Trees, and frames by them: as in Ivson's tables 6.4. Frames are the middle ones of the stretches.

use crate::platform;
use crate::study::{Cost, Study, chc, frames};
use enfilade::occlusion::frustum::FrustumCuller;
use enfilade_scenes::Kind;
use enfilade_studies::boxes::Fit;
use enfilade_studies::trees::{Split, TreeOptions, binary};
use std::time::Instant;

/// Frames of a stretch, and runs.
const FRAMES: [usize; 2] = [5, 1];
/// Triangles of a leaf: about the study's 1,000 vertices. Teapots have more.
pub const LEAST_TRIANGLES: u64 = 2_000;
/// Scenes of so many triangles have boxes of about the least volume in one tree only: each takes minutes.
const LARGE: usize = 5_000_000;

pub fn table(is_test: bool) {
    scene(Kind::Deck { objects: platform(is_test) }, "deck", frames(is_test, FRAMES));
    let teapots = if is_test { &[(20, 20)][..] } else { &[(500, 30), (5000, 3), (5000, 20)] };
    for &(count, scale) in teapots {
        scene(Kind::Teapots { count, scale }, &format!("Teapots({count}, {scale})"), frames(is_test, FRAMES));
    }
}

fn scene(kind: Kind, name: &str, frames: [usize; 2]) {
    let study = Study::new(kind, name, frames, |scene| scene);
    let (plain, known) = (study.plain(), study.known());
    println!(
        "plain: {:.2} ms a frame, {:.0} triangles; known: {:.2} ms, {:.0} triangles\n",
        plain.middle * 1e3,
        plain.triangles,
        known.middle * 1e3,
        known.triangles
    );
    println!("Gains are everything's time over the method's, and likewise of triangles.\n");
    print!("| box | tree | s | area, m2 | height | nodes | leaves | frustum, ms | gain | in triangles ");
    println!("| CHC, ms | gain | in triangles |");
    println!("|{}", " --- |".repeat(13));
    for fit in [Fit::Aligned, Fit::Covariance, Fit::Minimum] {
        for split in Split::ALL {
            let is_slow = fit == Fit::Minimum && study.scene.triangles.len() > LARGE;
            // The platform has many times the objects: its hulls would take longest of all.
            if is_slow && (split != Split::ObjectMedian || matches!(kind, Kind::Deck { .. })) {
                continue;
            }
            let start = Instant::now();
            let tree = binary(study.scene, &TreeOptions { fit, split, least_triangles: LEAST_TRIANGLES });
            let built = start.elapsed().as_secs_f64();
            let mut culler = FrustumCuller::default();
            let frustum = study.middles(|_, frustum| culler.cull(&tree, frustum).to_vec());
            let chc = study.compare(&[chc(&tree)])[0];
            let area: f64 = tree.nodes().iter().map(|node| node.bounds.area()).sum();
            let leaves = tree.nodes().iter().filter(|node| node.is_leaf()).count();
            println!(
                "| {fit:?} | {split:?} | {built:.2} | {area:.0} | {} | {} | {leaves} | {} | {} |",
                tree.depth(),
                tree.nodes().len(),
                gain(&plain, &frustum),
                gain(&plain, &chc)
            );
        }
    }
}

fn gain(plain: &Cost, cost: &Cost) -> String {
    let (time, triangles) = (plain.middle / cost.middle, plain.triangles / cost.triangles);
    format!("{:.2} | {time:.2} | {triangles:.2}", cost.middle * 1e3)
}
