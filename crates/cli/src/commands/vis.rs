//! `enfilade vis`.

use super::backup::backed_up;
use super::bake::{peak_rss_mb, progress_bar};
use super::compare::{Audit, other_rows};
use super::files::Files;
use super::kinds::Kind;
use super::level::{Input, SearchFlags};
use super::resume::{Kept, Of, StateFlags, WorkerFlags, catch_interrupts, state_path};
use super::stage_times::Stages;
use super::{CliError, Outcome, RunFlags, at, lost};
use enfilade::BitMatrix;
use enfilade::file::replace_file;
use enfilade::job::Job;
use enfilade_levels::compare::against;
use enfilade_levels::far::limit;
use enfilade_levels::rows::{write_lists, write_rows};
use enfilade_levels::{Level, Vis, VisError, VisOptions, VisRows, VisStats, digest, pairs_on_digits, vis, vis_rows};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// The level: .prt or .bsp
    #[arg(value_name = "LEVEL.prt|LEVEL.bsp", value_parser = level_of)]
    input: PathBuf,
    /// Write the rows as text: a line per cluster, `c n: id id ...`
    #[arg(long, value_name = "FILE")]
    rows: Option<PathBuf>,
    /// The level to write, for a .bsp [default: LEVEL.bsp itself, with a backup LEVEL.bsp.old]
    #[arg(short, long, value_name = "OUT.bsp")]
    output: Option<PathBuf>,
    /// Keep the ambient levels of a .bsp: the loudness of water, sky and lava in each leaf
    #[arg(long)]
    no_ambient: bool,
    /// Only the flood through portals: a first look in a moment, with about twice the pairs
    #[arg(long)]
    fast: bool,
    /// Leave out clusters farther apart than this, in the level's units; farz: than Source's fog lets a player see
    #[arg(long, value_name = "UNITS|farz", conflicts_with = "against")]
    visdist: Option<String>,
    /// Keep no copy of the level that is written over
    #[arg(long, conflicts_with = "output")]
    no_backup: bool,
    #[command(flatten)]
    search: SearchFlags,
    /// Write the pairs that the rows of --against lack: a page (.html), or a point file for map editors (.pts, .lin). May be repeated
    #[arg(long, value_name = "FILE", requires = "against")]
    lost: Vec<PathBuf>,
    /// Print JSON to stdout; docs/cli.md lists the keys
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    run: RunFlags,
    #[command(flatten)]
    state: StateFlags,
    #[command(flatten)]
    workers: WorkerFlags,
}

impl Args {
    /// Whether the level is written in place.
    fn is_in_place(&self) -> bool {
        let is_bsp = self.input.extension().is_some_and(|e| e.eq_ignore_ascii_case("bsp"));
        is_bsp && self.output.is_none()
    }

    /// The level to write, if any.
    fn level_to_write(&self, input: &Input) -> Result<Option<PathBuf>, CliError> {
        match (&self.output, &input.bsp) {
            (Some(out), None) => Err(at(out, "-o writes a .bsp; the rows of a .prt go to --rows")),
            (Some(out), Some(_)) => Ok(Some(out.clone())),
            (None, _) => Ok(self.is_in_place().then(|| self.input.clone())),
        }
    }

    /// The greatest distance of pairs, if it is limited.
    fn farthest(&self, input: &Input) -> Result<Option<f64>, CliError> {
        let Some(word) = &self.visdist else { return Ok(None) };
        if word == "farz" {
            let bsp =
                input.bsp.as_ref().ok_or_else(|| at(&self.input, "is no level with a fog; give --visdist a number"))?;
            let far = bsp.far_z().map_err(|e| at(&self.input, e))?;
            return far.map(Some).ok_or_else(|| at(&self.input, "has no fog with a farz; give --visdist a number"));
        }
        match word.parse() {
            Ok(units) if units > 0.0 && f64::is_finite(units) => Ok(Some(units)),
            _ => Err(CliError(format!("--visdist {word}: takes a distance in the level's units, as 4096, or farz"))),
        }
    }

    /// The files that it writes besides its state.
    fn written<'p>(&'p self, level: Option<&'p Path>) -> impl Iterator<Item = &'p Path> {
        self.rows.as_deref().into_iter().chain(level).chain(self.lost.iter().map(PathBuf::as_path))
    }

    /// Input and output files.
    pub fn files(&self) -> Files {
        let alone = self.workers.folder().is_none();
        let state = state_path((&self.input, "vis-state")).filter(|_| alone);
        let files = Files::new().reads_too(&[self.input.clone(), self.input.with_extension("prt")]);
        let files = files.reads_too(&lost::of_compilers(&self.input)).reads_too(&self.search.against);
        let files = self.lost.iter().fold(files, |files, path| files.writes(path, lost::kind(path)));
        let files = files.writes(&self.rows, Kind::Rows).writes(&self.output, Kind::Bsp);
        let files = files.writes(&state, Kind::State).fills(&self.workers.folder());
        if self.is_in_place() { files.writes_back(&self.input, Kind::Bsp) } else { files }
    }
}

/// The level that a word names. Of a map, it is the one beside it, as for q3map2, whose place `vis` has in an editor's menu.
fn level_of(word: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(word);
    let level = path.with_extension("bsp");
    let is_map = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("map"));
    Ok(if is_map && level.is_file() { level } else { path })
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let pool = super::pool(args.run.threads)?;
    catch_interrupts()?;
    pool.install(|| vis_file(&args))
}

fn vis_file(args: &Args) -> Result<Outcome, CliError> {
    let begin = Instant::now();
    // 1. The level, and errors of flags, before the long part.
    let input = Input::read(&args.input)?;
    input.notes.iter().for_each(|n| eprintln!("{n}"));
    lost::check(&args.lost)?;
    let output = args.level_to_write(&input)?;
    let theirs = args.search.against.as_deref().map(|path| other_rows(path, &input)).transpose()?;
    let read = begin.elapsed().as_secs_f64();

    // 2. Both bounds.
    let far = args.farthest(&input)?;
    let options = VisOptions { fast: args.fast, ..args.search.options(args.run.seed) };
    let outputs: Vec<&Path> = args.written(output.as_deref()).collect();
    let of = Of { digest: digest(&input.level, &options), beside: (&args.input, "vis-state"), outputs: &outputs };
    let kept = Kept::open(&args.state, Some(&args.workers), &of)?;
    if kept.is_done() {
        return kept.stopped();
    }
    let mut stages = Stages::default();
    let is_whole = output.is_some() || theirs.is_some() || far.is_some();
    let result = followed(&kept, &mut stages, |work| match is_whole {
        true => vis(&input.level, &options, None, work).map(Found::Whole),
        false => vis_rows(&input.level, &options, work).map(Found::Rows),
    });
    let mut result = match result {
        Err(VisError::Stopped(_)) => return kept.stopped(),
        result => result.map_err(|e| CliError(e.to_string()))?,
    };
    let too_far = match (&mut result, far) {
        (Found::Whole(vis), Some(units)) => Some(limit(&input.level, vis, units)),
        _ => None,
    };

    // 3. Output files. The state is deleted last.
    kept.ends();
    let writing = Instant::now();
    let whole = if let Found::Whole(whole) = &result { Some(whole) } else { None };
    let written = write(args, &input, output.as_deref(), &result)?;
    let totals = result.totals(&input.level);
    let beside = audited(args, &input, &totals, theirs.zip(whole))?;
    kept.done()?;
    let write = writing.elapsed().as_secs_f64();

    // 4. The report.
    let mut report = report(&input, &totals);
    written.tell(&mut report);
    if let Some(pairs) = too_far {
        report["too_far_pairs"] = pairs.into();
    }
    report["stage_seconds"] = stage_seconds(read, &stages, write);
    report["seconds"] = begin.elapsed().as_secs_f64().into();
    report["peak_rss_mb"] = peak_rss_mb().into();
    if let Some(audit) = &beside {
        report["against"] = audit.told();
    }
    if args.json {
        super::answer(&format!("{report:#}"))?;
    }
    super::prose(&prose(&report, args.written(output.as_deref())), args.json)?;
    if let (Some(path), Some(audit)) = (&args.search.against, &beside) {
        super::prose(&audit.prose(path), args.json)?;
    }
    let lacks = beside.is_some_and(|audit| !audit.found.lost.is_empty());
    Ok(if lacks { Outcome::Failed } else { Outcome::Done })
}

/// Compares a result with the rows of another tool, and writes the files of what these lack.
fn audited<'a>(
    args: &Args,
    input: &'a Input,
    totals: &'a Totals,
    both: Option<(BitMatrix, &Vis)>,
) -> Result<Option<Audit<'a>>, CliError> {
    let (Some((theirs, vis)), Some(path)) = (both, &args.search.against) else { return Ok(None) };
    let found = against(&input.level, vis, &theirs);
    let audit = Audit { level: &input.level, on_digits: totals.on_digits(), found };
    args.lost.iter().try_for_each(|file| lost::write(file, &audit, [&args.input, path]))?;
    Ok(Some(audit))
}

/// Output besides rows.
#[derive(Default)]
struct Written {
    /// The level's new ambient levels, if any.
    ambient: Option<Vec<[u8; 4]>>,
    /// The copy of the old level, if it was written in place.
    backup: Option<PathBuf>,
    /// Bytes of the visibility lump.
    lump: Option<usize>,
    /// The game's name for what can be heard, and its ordered pairs.
    heard: Option<(&'static str, u64)>,
}

impl Written {
    /// Adds it to a report.
    fn tell(&self, report: &mut Value) {
        if let Some(levels) = &self.ambient {
            let hear = |sound: usize| levels.iter().filter(|leaf| leaf[sound] > 0).count();
            report["ambient_leaves"] = json!({ "water": hear(0), "sky": hear(1), "slime": hear(2), "lava": hear(3) });
        }
        if let Some(lump) = self.lump {
            report["lump_bytes"] = lump.into();
        }
        if let Some((name, pairs)) = self.heard {
            let clusters = report["clusters"].as_f64().unwrap_or_default().max(1.0);
            report["heard"] = json!({ "name": name, "pairs": pairs, "mean": pairs as f64 / clusters });
        }
        if let Some(backup) = &self.backup {
            report["backup"] = backup.to_string_lossy().into();
        }
    }
}

/// Writes the requested files.
fn write(args: &Args, input: &Input, output: Option<&Path>, result: &Found) -> Result<Written, CliError> {
    if let Some(path) = &args.rows {
        let written = replace_file(path, |out| match result {
            Found::Whole(whole) => write_rows(&whole.upper, out),
            Found::Rows(rows) => write_lists(&rows.rows, out),
        });
        written.map_err(|e| at(path, e))?;
    }
    let (Some(path), Some(bsp), Found::Whole(whole)) = (output, &input.bsp, result) else {
        return Ok(Written::default());
    };
    let ambient = (!args.no_ambient).then(|| bsp.ambient_levels(&whole.upper, &input.clusters));
    let ambient = ambient.transpose().map_err(|e| at(&args.input, e))?.flatten();
    let new = bsp.with_rows(&whole.upper, &input.clusters, ambient.as_deref()).map_err(|e| at(&args.input, e))?;
    let backup = if args.is_in_place() && !args.no_backup { backed_up(path, &new.bytes)? } else { None };
    replace_file(path, |out| out.write_all(&new.bytes)).map_err(|e| at(path, e))?;
    let heard = bsp.second().zip(new.heard_pairs);
    Ok(Written { ambient, backup, lump: Some(new.lump), heard })
}

/// The result: complete if an output needs that, or rows only.
enum Found {
    Whole(Vis),
    Rows(VisRows),
}

/// Numbers for the report.
pub(super) struct Totals {
    lower: u64,
    upper: u64,
    lines: usize,
    on_digits: Vec<[u32; 2]>,
    stats: VisStats,
}

impl Totals {
    /// Pairs that see each other only if the last digits of the level's file are right, ascending.
    pub(super) fn on_digits(&self) -> &[[u32; 2]] {
        &self.on_digits
    }

    pub(super) fn of(level: &Level, vis: &Vis) -> Self {
        let Vis { lower, upper, lines, stats } = vis;
        let on_digits = pairs_on_digits(level, vis);
        Self { lower: lower.count_ones(), upper: upper.count_ones(), lines: lines.len(), on_digits, stats: *stats }
    }
}

impl Found {
    fn totals(&self, level: &Level) -> Totals {
        match self {
            Self::Whole(vis) => Totals::of(level, vis),
            Self::Rows(rows) => Totals {
                lower: rows.lower_pairs,
                upper: rows.upper_pairs,
                lines: rows.lines,
                on_digits: rows.on_digits.clone(),
                stats: rows.stats,
            },
        }
    }
}

/// Runs with a progress bar.
fn followed(
    kept: &Kept,
    stages: &mut Stages,
    run: impl FnOnce(&Job<'_>) -> Result<Found, VisError>,
) -> Result<Found, VisError> {
    let bar = progress_bar();
    let clock = Mutex::new(std::mem::take(stages));
    let progress = |stage: &str, done: f64| {
        if let Ok(mut clock) = clock.lock()
            && clock.enter(stage)
        {
            bar.reset();
            bar.set_message(stage.to_owned());
        }
        bar.set_position((done * 1000.0) as u64);
    };
    let result = run(&kept.work(&progress));
    bar.finish_and_clear();
    *stages = clock.into_inner().unwrap_or_default();
    stages.leave();
    result
}

/// Seconds by stage.
fn stage_seconds(read: f64, stages: &Stages, write: f64) -> Value {
    let mut seconds = serde_json::Map::new();
    seconds.insert("read".into(), read.into());
    stages.done.iter().for_each(|s| _ = seconds.insert(s.name.clone(), s.seconds.into()));
    seconds.insert("write".into(), write.into());
    seconds.into()
}

/// The keys of `vis --json`, as in docs/cli.md.
pub(super) fn report(input: &Input, found: &Totals) -> Value {
    let cells = input.level.cells;
    let Totals { lower, upper, lines, on_digits, stats } = found;
    json!({
        "clusters": cells,
        "portals": input.level.portals.len(),
        "leaves": input.clusters.len(),
        "portals_from": input.portals_from,
        "slivers": input.slivers,
        "lower_pairs": lower,
        "upper_pairs": upper,
        "undecided_pairs": upper - lower,
        "on_last_digit": on_digits,
        "total_pairs": cells as u64 * cells as u64,
        "mean_visible": *upper as f64 / cells.max(1) as f64,
        "lines": stats.lines,
        "steps": stats.steps,
        "capped": stats.capped,
        "exact_asked": stats.exact_asked,
        "exact_refuted": stats.exact_refuted,
        "exact_lines": stats.exact_lines,
        "witnesses": lines,
        "notes": input.notes,
    })
}

fn prose<'p>(report: &Value, files: impl Iterator<Item = &'p Path>) -> String {
    let n = |p: &str| report.pointer(p).map(ToString::to_string).unwrap_or_default();
    let s = |p: &str| report.pointer(p).and_then(Value::as_f64).unwrap_or_default();
    let from = report["portals_from"].as_str().unwrap_or_default();
    let kept = 100.0 * s("/upper_pairs") / s("/total_pairs").max(1.0);
    let mut lines = vec![
        format!("{} clusters, {} portals ({from}), {} leaves", n("/clusters"), n("/portals"), n("/leaves")),
        format!("{kept:.0} % of the pairs of clusters are kept: {:.1} clusters per row on average", s("/mean_visible")),
    ];
    if s("/slivers") > 0.0 {
        lines.push(format!("{} portals narrower than the level's rounding are left out", n("/slivers")));
    }
    let on_digits = report["on_last_digit"].as_array().map_or(0, Vec::len);
    if on_digits > 0 {
        lines.push(format!(
            "{on_digits} pairs see each other only if the last digits of the file are right (--json lists them)"
        ));
    }
    if s("/capped") > 0.0 {
        lines.push(format!("{} searches ran out of steps (--steps): their undecided pairs stay in the rows", n("/capped")));
    }
    if let Some(name) = report.pointer("/heard/name").and_then(Value::as_str) {
        lines.push(format!("{:.1} clusters are heard on average ({name})", s("/heard/mean")));
    }
    if s("/lump_bytes") > 0.0 {
        lines.push(format!("{} bytes of visibility", n("/lump_bytes")));
    }
    if report["too_far_pairs"].is_u64() {
        lines.push(format!("{} pairs of clusters are too far apart (--visdist) and left out", n("/too_far_pairs")));
    }
    lines.extend(files.map(|f| format!("{} written", f.display())));
    lines.extend(report["backup"].as_str().map(|backup| format!("{backup}: a copy of the old level")));
    lines.join("\n")
}

/// A chain of portals (`2 * portal + side`) as pairs of a portal number and the entered side.
pub(super) fn chain(portals: &[u32]) -> Value {
    portals.iter().map(|p| json!([p / 2, p % 2])).collect()
}
