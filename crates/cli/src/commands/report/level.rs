//! `enfilade report` of a level.

use super::{Args, command, name, write};
use crate::commands::bake::{peak_rss_mb, progress_bar};
use crate::commands::compare::{Audit, other_rows};
use crate::commands::level::Input;
use crate::commands::resume::{Kept, Of};
use crate::commands::vis::Totals;
use crate::commands::{CliError, Outcome, at};
use enfilade::job::Job;
use enfilade_levels::compare::against;
use enfilade_levels::{Bounds, Level, PairProof, Vis, VisError, VisOptions, digest, vis, why};
use enfilade_measure::pages::html::Remark;
use enfilade_measure::pages::level::{LevelReport, LinesAlone, Moment, Other};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Numbers of random lines from each side of a portal, for comparison.
const LINES_ALONE: [u64; 6] = [1, 4, 16, 64, 256, 1024];
/// Undecided pairs that are explained; each needs a search.
const ASKED: usize = 8;

/// Computes and writes the report: `output` is the page, `table` stands beside it.
pub(super) fn report(args: &Args, output: &Path, table: &Path) -> Result<Outcome, CliError> {
    let begin = Instant::now();
    // 1. Input errors, before the long part.
    let input = Input::read(&args.input)?;
    let theirs = args.search.against.as_deref().map(|path| other_rows(path, &input)).transpose()?;
    let read_seconds = begin.elapsed().as_secs_f64();

    // 2. Both bounds over time.
    let options = args.search.options(args.run.seed);
    let of = Of { digest: digest(&input.level, &options), beside: (output, super::STATE), outputs: &[] };
    let kept = Kept::open(&args.state, None, &of)?;
    let (result, moments) = match timed(&input.level, &options, &kept) {
        Err(VisError::Stopped(_)) => return kept.stopped(),
        found => found.map_err(|e| CliError(e.to_string()))?,
    };
    let peak = peak_rss_mb();

    // 3. Comparisons.
    let lines_alone = lines_alone(&input.level, args.run.seed)?;
    let totals = Totals::of(&input.level, &result);
    let audit =
        |rows| Audit { level: &input.level, on_digits: totals.on_digits(), found: against(&input.level, &result, &rows) };
    let beside = theirs.map(audit);
    let other = args.search.against.as_deref().zip(beside.as_ref()).map(|(path, a)| Other {
        name: name(path),
        pairs: a.found.theirs,
        counts: a.counts(),
    });
    let undecided = undecided(&input.level, &options, &result).map_err(|e| at(&args.input, e))?;

    // 4. The page and the table.
    let page = LevelReport {
        level: &name(&args.input),
        command: &again(args),
        facts: &facts(&input),
        lower: &result.lower,
        upper: &result.upper,
        moments: &moments,
        lines_alone: &lines_alone,
        read_seconds,
        threads: rayon::current_num_threads(),
        peak_rss_mb: peak,
        other: other.as_ref(),
        undecided: &undecided,
        left_out: &left_out(args, &input, &result),
    };
    kept.ends();
    write(&[(output, page.html()), (table, page.csv())])?;
    kept.done()?;

    // 5. The same as JSON.
    if args.json {
        let mut json = crate::commands::vis::report(&input, &totals);
        add_numbers(&mut json, &page, beside.as_ref(), [output, table]);
        json["seconds"] = begin.elapsed().as_secs_f64().into();
        crate::commands::answer(&format!("{json:#}"))?;
    }
    if let (Some(path), Some(a)) = (&args.search.against, &beside) {
        crate::commands::prose(&a.prose(path), args.json)?;
    }
    crate::commands::prose(&format!("{} and {} written", output.display(), table.display()), args.json)?;
    Ok(Outcome::Done)
}

/// The level in a line.
fn facts(input: &Input) -> String {
    format!(
        "{} clusters, {} portals ({}), {} leaves",
        input.level.cells,
        input.level.portals.len(),
        input.portals_from,
        input.clusters.len()
    )
}

/// Adds what the page shows to the keys of `vis`.
fn add_numbers(json: &mut Value, page: &LevelReport<'_>, beside: Option<&Audit<'_>>, [output, table]: [&Path; 2]) {
    let of_lines = |l: &LinesAlone| json!({ "lines": l.lines, "seconds": l.seconds, "lower_pairs": l.lower });
    json["bounds"] = page.moments.iter().map(moment_json).collect();
    json["lines_alone"] = page.lines_alone.iter().map(of_lines).collect();
    if let Some(beside) = beside {
        json["against"] = beside.told();
    }
    json["page"] = output.to_string_lossy().into();
    json["table"] = table.to_string_lossy().into();
    json["peak_rss_mb"] = page.peak_rss_mb.into();
}

fn moment_json(m: &Moment) -> Value {
    json!({ "stage": m.stage, "seconds": m.seconds, "steps": m.steps, "lower_pairs": m.lower, "upper_pairs": m.upper })
}

/// Runs `vis` and records the bounds over time.
fn timed(level: &Level, options: &VisOptions, kept: &Kept) -> Result<(Vis, Vec<Moment>), VisError> {
    let bar = progress_bar();
    let progress = |stage: &str, done: f64| {
        bar.set_message(stage.to_owned());
        bar.set_position((done * 1000.0) as u64);
    };
    let moments: Mutex<Vec<Moment>> = Mutex::default();
    let begin = Instant::now();
    let bounds = |b: &Bounds| {
        let seconds = begin.elapsed().as_secs_f64();
        if let Ok(mut moments) = moments.lock() {
            let rounds = moments.iter().filter(|m| m.stage.starts_with("flow")).count();
            let stage = if b.stage == "flow" { format!("flow {}", rounds + 1) } else { b.stage.to_owned() };
            moments.push(Moment { stage, seconds, steps: b.steps, lower: b.lower, upper: b.upper });
        }
    };
    let result = vis(level, options, Some(&bounds), &kept.work(&progress))?;
    bar.finish_and_clear();
    Ok((result, moments.into_inner().unwrap_or_default()))
}

/// Runs with random lines only: `vis`, stopped before its searches.
fn lines_alone(level: &Level, seed: u64) -> Result<Vec<LinesAlone>, CliError> {
    let bar = progress_bar();
    bar.set_message("lines alone");
    let sides = 2 * level.portals.len() as u64;
    let mut all: Vec<LinesAlone> = Vec::new();
    for (k, lines) in LINES_ALONE.into_iter().enumerate() {
        bar.set_position((1000 * k / LINES_ALONE.len()) as u64);
        let stop = AtomicBool::new(false);
        let found = Mutex::new(None);
        let begin = Instant::now();
        let bounds = |b: &Bounds| {
            if b.stage == "lines" {
                let seconds = begin.elapsed().as_secs_f64();
                stop.store(true, Ordering::Relaxed);
                if let Ok(mut found) = found.lock() {
                    *found = Some(LinesAlone { lines: lines * sides, seconds, lower: b.lower });
                }
            }
        };
        match vis(level, &VisOptions { seed, steps: 0, lines, fast: false }, Some(&bounds), &Job::quiet().until(&stop)) {
            Ok(_) | Err(VisError::Stopped(_)) => (),
            Err(e) => return Err(CliError(e.to_string())),
        }
        all.extend(found.into_inner().ok().flatten());
    }
    bar.finish_and_clear();
    // A run with more lines includes the work of one with fewer, so later clock noise is removed: times only grow.
    for k in (1..all.len()).rev() {
        all[k - 1].seconds = all[k - 1].seconds.min(all[k].seconds);
    }
    Ok(all)
}

/// Undecided pairs, each once; the first ones with their reasons.
fn undecided(level: &Level, options: &VisOptions, result: &Vis) -> Result<Vec<Remark>, VisError> {
    let n = level.cells;
    let pairs = (0..n).flat_map(|a| {
        let is_open = move |b: &usize| *b > a && !result.lower.get(a, *b);
        result.upper.ones(a).filter(is_open).map(move |b| (a as u32, b as u32))
    });
    let bar = progress_bar();
    bar.set_message("why");
    let mut remarks = Vec::new();
    for (a, b) in pairs {
        let text = if remarks.len() < ASKED { reason(&why(level, options, result, a, b)?) } else { String::new() };
        remarks.push(Remark { about: format!("{a} and {b}"), text });
        bar.set_position((1000 * remarks.len() / ASKED) as u64);
    }
    bar.finish_and_clear();
    Ok(remarks)
}

/// The reason of an undecided pair.
fn reason(why: &PairProof) -> String {
    let way = |portals: &[u32]| portals.iter().map(|p| (p / 2).to_string()).collect::<Vec<_>>().join(" ");
    match why {
        PairProof::Undecided(portals) if portals.is_empty() => "a search ran out of steps".to_owned(),
        PairProof::Undecided(portals) => format!("portals {}: neither a line nor a proof was found", way(portals)),
        // A pair that is searched alone has all the steps for itself.
        PairProof::Separated(_) => "searched alone: proven hidden".to_owned(),
        PairProof::Witnessed(line) => format!("searched alone: a line through portals {}", way(&line.portals)),
    }
}

fn left_out(args: &Args, input: &Input, result: &Vis) -> Vec<String> {
    let mut all = input.notes.clone();
    if input.slivers > 0 {
        all.push(format!("{} portals of the tree are narrower than the level's rounding and are left out", input.slivers));
    }
    if result.stats.capped > 0 {
        all.push(format!(
            "{} searches ran out of steps (--steps {}): their undecided pairs stay in the rows",
            result.stats.capped, args.search.steps
        ));
    }
    if args.search.against.is_none() {
        all.push("no rows of another tool to compare with (--against)".to_owned());
    }
    all.push("rows are not written: `enfilade vis` does that".to_owned());
    all
}

/// The command line that repeats the report.
fn again(args: &Args) -> String {
    let default = VisOptions::default();
    let numbers = [
        ("--steps", args.search.steps, default.steps),
        ("--lines", args.search.lines, default.lines),
        ("--seed", args.run.seed, default.seed),
    ];
    let rows = args.search.against.as_deref().map(|rows| ("--against", name(rows)));
    let numbers = numbers.into_iter().filter(|n| n.1 != n.2).map(|(flag, value, _)| (flag, value.to_string()));
    let threads = args.run.threads.map(|n| ("--threads", n.to_string()));
    command(args, rows.into_iter().chain(numbers).chain(threads))
}
