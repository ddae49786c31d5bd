//! `vis` on real levels, beside the reference (ericw-tools vis 2.0.0-alpha11, level 4). The counts are checked before anything
//! is timed: fewer upper pairs than the reference's rows, at most a thousandth of them undecided, and the lower set within the
//! upper one. Not run without the data folder.

use criterion::{Criterion, criterion_group, criterion_main};
use enfilade::job::Job;
use enfilade_levels::{Level, Vis, VisOptions, vis};
use std::hint::black_box;
use testing::bakes::on;
use testing::prt;

/// Levels, and the CPU seconds that the reference takes for each at one thread, on a machine that is not this one.
const LEVELS: [(&str, f64); 7] = [
    ("lqdm12", 0.20),
    ("id_dm4", 0.72),
    ("lq_e0m1", 0.59),
    ("id_e1m3", 4.7),
    ("lq_e0m3", 11.4),
    ("lq_e0m2", 34.0),
    ("lqdm13", 51.3),
];

fn run(level: &Level) -> Vis {
    vis(level, &VisOptions::default(), None, &Job::quiet()).expect("a sound level")
}

fn vis_over_levels(criterion: &mut Criterion) {
    let Some(folder) = prt::folder() else {
        eprintln!("not run: vis_over_levels: no data folder");
        return;
    };
    let mut group = criterion.benchmark_group("vis");
    group.sample_size(10);
    for (name, reference_seconds) in LEVELS {
        let level = prt::level(&folder.join(format!("{name}.prt")));
        let reference = prt::rows(&folder.join(format!("{name}.vis.txt.gz")), level.cells);
        let result = on(1, || run(&level));
        let (upper, lower) = (result.upper.count_ones(), result.lower.count_ones());
        assert!(upper < reference.count_ones(), "{name}: {upper} upper pairs");
        assert!((upper - lower) * 1000 <= upper, "{name}: {} undecided", upper - lower);
        assert_eq!(result.lower.first_outside(&result.upper), None, "{name}");
        let pairs = || (0..level.cells).flat_map(|i| result.upper.ones(i).map(move |j| (i, j)));
        let only_ours = pairs().filter(|&(i, j)| !reference.get(i, j)).count();
        let lost = pairs().filter(|&(i, j)| !reference.get(i, j) && result.lower.get(i, j)).count();
        let refuted = reference.count_ones() - (upper - only_ours as u64);
        println!(
            "{name}: {upper} upper pairs, the reference {}; {} undecided; {refuted} of the reference's refuted; {lost} that it lacks \
             lie on a line, {} may; {} steps; the reference took {reference_seconds} CPU seconds",
            reference.count_ones(),
            upper - lower,
            only_ours - lost,
            result.stats.steps,
        );
        for threads in [1, 2] {
            group.bench_function(format!("{name}/{threads}"), |b| on(threads, || b.iter(|| black_box(run(&level)))));
        }
    }
    group.finish();
}

criterion_group!(benches, vis_over_levels);
criterion_main!(benches);
