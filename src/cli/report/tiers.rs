//! `enfilade report --tiers`: bakes a file for each tier, and compares them in the same views.

use crate::cli::bake::RAYS_TO_A_GOAL;
use crate::cli::stage_times::Clock;
use crate::cli::{CliError, at};
use enfilade::bake::{BakeOptions, Baked, bake};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::pages::splits::Splits;
use enfilade::pages::tiers::{self, Outcome, Tier, Tiers};
use enfilade::pvs::{Guarantee, PvsOptions};
use enfilade::scene::Scene;
use enfilade::types::drawn::DrawnOfFile;
use enfilade::verify::random_path;
use enfilade::walkthrough::compare::compare;
use std::path::Path;

/// Bounds of sampled tiers.
const BOUNDS: [f64; 3] = [1e-3, 1e-4, 1e-5];
/// Views are pictures of this size, as those of `walk`.
const SIZE: [usize; 2] = [640, 360];

/// What is to be compared.
pub(super) struct Wanted<'a> {
    /// The model.
    pub input: &'a Path,
    /// Views.
    pub views: u32,
    /// Of the bakes.
    pub seed: u64,
    /// Rays of each bake, where that is said.
    pub rays: Option<u64>,
    /// Seconds after which sampling of a sampled tier ends.
    pub time: Option<f64>,
}

/// Tiers, and how view cells were split for sampled ones, if they were. `options`: of the page's bake, cells given.
pub(super) fn tiers(
    wanted: &Wanted<'_>,
    scene: &Scene,
    options: &BakeOptions,
    progress: &(impl Fn(&str, f64) + Sync),
) -> Result<(Tiers, Vec<Splits>), CliError> {
    let (mut rows, mut files, mut splits): (Vec<Tier>, Vec<PvsFile>, Vec<Splits>) = Default::default();
    for asked in [None].into_iter().chain(BOUNDS.map(Some)) {
        let met = |before: &Tier| asked.zip(before.unseen).is_some_and(|(asked, unseen)| unseen <= asked);
        if let Some(before) = rows.last().filter(|before| met(before)).copied() {
            rows.push(Tier { unseen_asked: asked, outcome: Outcome::AsBefore, ..before });
            continue;
        }
        let name = tiers::name(asked);
        let stage = format!("tier {name}");
        let tell = |_: &str, done: f64| progress(&stage, done);
        tell("", 0.0);
        let clock = Clock::start();
        let baked = bake(scene, tier_options(wanted, options, asked), &Job::new(&tell)).map_err(|e| at(wanted.input, e))?;
        let cpu_seconds = clock.seconds();
        rows.push(tier(&baked, asked, cpu_seconds));
        // Conservative rows are those of the page's own bake.
        let found = baked.partition.as_ref().zip(options.view_cell_bytes).filter(|_| asked.is_some());
        splits.extend(found.map(|(found, bytes)| Splits::new(name, bytes, found.full, &found.curve)));
        files.push(baked.file);
    }
    progress("views of tiers", 0.0);
    let views_seed = wanted.seed.wrapping_add(1);
    let path = random_path(scene, &files[0], wanted.views, views_seed);
    if path.frames.is_empty() {
        return Err(at(wanted.input, "no cell has room for an eye; --tiers has nothing to compare"));
    }
    let compared = compare(scene, &files, &path, SIZE);
    let mut drawn = compared.files.into_iter();
    let mut last = DrawnOfFile::default();
    for row in &mut rows {
        if row.outcome != Outcome::AsBefore {
            last = drawn.next().unwrap_or_default();
        }
        row.drawn = last;
    }
    let exact_triangles_mean = compared.exact_triangles_mean;
    Ok((Tiers { views: compared.views, views_seed, size: SIZE, exact_triangles_mean, rows }, splits))
}

/// As `bake` without flags, or with `--unseen ASKED --ship sampled`.
fn tier_options(wanted: &Wanted<'_>, options: &BakeOptions, asked: Option<f64>) -> BakeOptions {
    let pvs = match asked {
        None => options.pvs.clone(),
        Some(_) => PvsOptions {
            ship: Guarantee::Sampled,
            unseen: asked,
            time: wanted.time,
            ray_budget: wanted.rays.unwrap_or(RAYS_TO_A_GOAL),
            ..options.pvs.clone()
        },
    };
    BakeOptions { pvs, keep_bounds: false, ..options.clone() }
}

/// A tier that was baked, before it is looked at in views.
fn tier(baked: &Baked, asked: Option<f64>, cpu_seconds: f64) -> Tier {
    let (file, views) = (&baked.file, baked.views.as_ref());
    let bound = file.unseen.as_ref().map(|unseen| views.map_or(0.0, |v| v.unseen_mean).max(unseen.mean));
    let outcome = match asked {
        None => Outcome::Proven,
        Some(asked) => Outcome::of(baked.sampling_end, bound.is_some_and(|bound| bound <= asked)),
    };
    Tier {
        ship: file.guarantee,
        unseen_asked: asked,
        outcome,
        file_bytes: file.write().len() as u64,
        cpu_seconds,
        rays: file.stats.rays + views.map_or(0, |v| v.rays),
        unseen: bound.filter(|_| asked.is_some()),
        drawn: DrawnOfFile::default(),
    }
}
