//! Ways to ask less in CHC, on the platform with the study's best tree: as in Ivson's tables 6.6. His share of the leaves
//! that showed and aren't asked about is a number here, that share of the mean.

use crate::platform;
use crate::study::{Start, Study, chc, frames};
use crate::trees::LEAST_TRIANGLES;
use enfilade::occlusion::chc::Chc;
use enfilade::occlusion::hierarchy::Hierarchy;
use enfilade_scenes::Kind;
use enfilade_studies::boxes::Fit;
use enfilade_studies::reductions::{ReducedChc, Reduction};
use enfilade_studies::trees::{Split, TreeOptions, binary};
use std::cell::Cell;

/// Frames of a stretch, and runs.
const FRAMES: [usize; 2] = [10, 2];

pub fn table(is_test: bool) {
    let study = Study::new(Kind::Deck { objects: platform(is_test) }, "deck", frames(is_test, FRAMES), |scene| scene);
    let options = TreeOptions { fit: Fit::Aligned, split: Split::EqualComplexity, least_triangles: LEAST_TRIANGLES };
    let tree = binary(study.scene, &options);
    let leaves = leaves_shown(&study, &tree);
    println!("{leaves:.0} leaves show in the mean\n");
    println!("| not asked about again | ms a frame | triangles | queries | of CHC's time |");
    println!("|{}", " --- |".repeat(5));
    let nearest =
        |share: f64| (format!("the nearest {:.0} %", share * 100.0), Reduction::NotNearest((share * leaves) as u32));
    let mut ways: Vec<(String, Reduction)> = Vec::new();
    ways.extend([2, 5, 10, 15].map(|n| (format!("for {n} frames"), Reduction::EveryNth(n))));
    ways.extend(
        [0.1, 0.2, 0.3, 0.5, 0.6, 0.7, 0.8, 0.9]
            .map(|p| (format!("{:.0} % at random", p * 100.0), Reduction::AtRandom(1.0 - p))),
    );
    ways.extend([0.1, 0.2, 0.3, 0.5].map(nearest));
    let (names, reductions): (Vec<String>, Vec<Reduction>) = ways.into_iter().unzip();
    let mut methods = vec![chc(&tree)];
    methods.extend(reductions.into_iter().map(|reduction| reduced(&tree, reduction)));
    let costs = study.compare(&methods);
    for (name, cost) in std::iter::once("nothing (CHC)").chain(names.iter().map(String::as_str)).zip(&costs) {
        println!(
            "| {name} | {:.2} | {:.0} | {:.0} | {:.3} |",
            cost.mean * 1e3,
            cost.triangles,
            cost.queries,
            cost.mean / costs[0].mean
        );
    }
}

fn reduced(tree: &Hierarchy, reduction: Reduction) -> Start<'_> {
    Box::new(move || {
        let mut culler = ReducedChc::new(reduction, 0);
        Box::new(move |frustum, buffer| (culler.cull(tree, frustum, buffer).to_vec(), culler.stats().queries))
    })
}

/// Leaves of which something is drawn, in the mean.
fn leaves_shown(study: &Study, tree: &Hierarchy) -> f64 {
    let mut leaf_of = vec![0; study.scene.objects.len()];
    for node in (0..tree.nodes().len() as u32).filter(|&node| tree.nodes()[node as usize].is_leaf()) {
        tree.objects(node).iter().for_each(|o| leaf_of[o.index()] = node);
    }
    let (leaf_of, sum, frames) = (&leaf_of, Cell::new(0), Cell::new(0));
    let (sum, frames) = (&sum, &frames);
    study.compare(&[Box::new(move || {
        let mut culler = Chc::default();
        Box::new(move |frustum, buffer| {
            let drawn = culler.cull(tree, frustum, buffer).to_vec();
            let mut leaves: Vec<u32> = drawn.iter().map(|o| leaf_of[o.index()]).collect();
            leaves.sort_unstable();
            leaves.dedup();
            sum.set(sum.get() + leaves.len());
            frames.set(frames.get() + 1);
            (drawn, 0)
        })
    })]);
    sum.get() as f64 / f64::from(frames.get())
}
