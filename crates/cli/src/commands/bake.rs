//! `enfilade bake`.

use super::files::Files;
use super::kinds::Kind;
use super::resume::{Kept, Of, StateFlags, WorkerFlags, catch_interrupts, state_path};
use super::scene::{RAYS, SceneFlags};
use super::{CliError, Outcome, RunFlags, at};
use clap::ValueEnum;
use enfilade::bake::{BakeError, BakeOptions, BakeReport, Baked, Last, ObjectSizes, bake, digest};
use enfilade::cells::{SplitOptions, ViewCell, read_view_cells};
use enfilade::file::{PvsFile, load_bytes, replace_file};
use enfilade::pvs::{Guarantee, PvsOptions};
use enfilade::scene::{ImportOptions, LeakHint, Scene};
use enfilade_formats::import;
use enfilade_measure::walkthrough::expected::expected_draw;
use glam::DVec3;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    #[arg(help = format!("The scene: {}. Cell spaces of a .gml are its cells", enfilade_formats::all_extensions()))]
    input: PathBuf,
    /// The file to write [default: INPUT with the extension .pvs]
    #[arg(short, long, value_name = "OUT.pvs")]
    output: Option<PathBuf>,
    /// The last bake of this model, before it was changed: what is hidden in it is tried first, which is quicker [default: what is in OUT.pvs]
    #[arg(long, value_name = "OLD.pvs", conflicts_with_all = ["fresh", "with"])]
    from: Option<PathBuf>,
    /// Print JSON to stdout; docs/cli.md lists the keys
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    scene: SceneFlags,
    /// Sample until the unseen share of a cell's visible objects, averaged over cells, is below this with 95 % confidence, as in 0.01%
    #[arg(long, value_name = "PERCENT%", value_parser = percent, help_heading = "Rows")]
    unseen: Option<f64>,
    /// The bound in the rows; both: conservative rows, and the file keeps both bounds and the witnesses for `why`
    #[arg(long, value_enum, default_value = "conservative", help_heading = "Rows")]
    rows: Rows,
    /// Also rows for servers: what may be seen from wherever somebody in a cell may be after so many metres through doors, as in 2m
    #[arg(long, value_name = "METRES", value_parser = metres, help_heading = "Rows")]
    relevance: Option<f64>,
    /// A module that is joined with others at run time: also a row for each portal that leads outside
    #[arg(long, help_heading = "Rows")]
    module: bool,
    /// Memory for rows and proofs during the bake, as in 512M; cells are joined to fit
    #[arg(long, value_name = "SIZE", value_parser = size, default_value = "8G", help_heading = "Run")]
    memory: u64,
    #[command(flatten)]
    view_cells: ViewCellsFlag,
    #[command(flatten)]
    run: RunFlags,
    #[command(flatten)]
    state: StateFlags,
    #[command(flatten)]
    workers: WorkerFlags,
}

/// The bound in the rows.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Rows {
    Conservative,
    Sampled,
    Both,
}

/// Flag for view cells.
#[derive(clap::Args)]
pub struct ViewCellsFlag {
    /// More regions with rows: camera volumes from a file, or those that save most triangles for this many bytes
    #[arg(long, value_name = "V.json|auto[:BYTES]", value_parser = view_cells_of, help_heading = "Rows")]
    pub view_cells: Option<ViewCells>,
}

/// Regions with rows besides the cells.
#[derive(Clone)]
pub enum ViewCells {
    /// Camera volumes in a file.
    File(PathBuf),
    /// Chosen regions, at most this many bytes.
    Auto(u64),
}

impl ViewCells {
    /// The path of the file of camera volumes.
    pub(super) fn path(&self) -> Option<&PathBuf> {
        if let Self::File(path) = self { Some(path) } else { None }
    }

    /// The view cells from a file, and the bytes for chosen ones.
    pub(super) fn read(this: Option<&Self>, scene: &Scene) -> Result<(Vec<ViewCell>, Option<u64>), CliError> {
        Ok(match this {
            None => (Vec::new(), None),
            Some(Self::Auto(bytes)) => (Vec::new(), Some(*bytes)),
            Some(Self::File(path)) => (view_cells(path, scene)?, None),
        })
    }
}

/// Default bytes of view cells.
const VIEW_CELL_BYTES: u64 = 256 << 10;

/// A file, `auto` or `auto:64K`.
fn view_cells_of(text: &str) -> Result<ViewCells, String> {
    match text.strip_prefix("auto") {
        Some("") => Ok(ViewCells::Auto(VIEW_CELL_BYTES)),
        Some(rest) if rest.starts_with(':') => size(&rest[1..]).map(ViewCells::Auto),
        _ => Ok(ViewCells::File(text.into())),
    }
}

impl Args {
    /// The output file.
    fn output(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| self.input.with_extension("pvs"))
    }

    /// Input and output files.
    pub fn files(&self) -> Files {
        let output = self.output();
        let alone = self.workers.folder().is_none();
        let state = state_path((&output, "bake-state")).filter(|_| alone);
        let files = Files::new().model(&self.input).reads_too(self.scene.paths());
        let files = files.reads_too(self.view_cells.view_cells.as_ref().and_then(ViewCells::path)).reads_too(&self.from);
        let files = files.writes(&state, Kind::State).writes(&output, Kind::Pvs).writes(&self.leak(), Kind::Points);
        files.fills(&self.workers.folder())
    }

    /// The point file of a leaking map.
    fn leak(&self) -> Option<PathBuf> {
        let is_map = self.input.extension().is_some_and(|e| e.eq_ignore_ascii_case("map"));
        is_map.then(|| self.output().with_extension("pts"))
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    args.scene.check(&args.input)?;
    catch_interrupts()?;
    super::pool(args.run.threads)?.install(|| bake_file(&args))
}

/// Writes the point file of a leaking map for map editors: the path to the outside, a line per point.
fn write_leak(path: Option<&Path>, leak: Option<&LeakHint>) -> Result<(), CliError> {
    let (Some(path), Some(LeakHint { from, way, .. })) = (path, leak) else { return Ok(()) };
    let line = |out: &mut dyn Write, p: &DVec3| writeln!(out, "{} {} {}", p.x, p.y, p.z);
    replace_file(path, |out| std::iter::once(from).chain(way).try_for_each(|p| line(out, p))).map_err(|e| at(path, e))?;
    eprintln!("note: the map leaks; {} is its point file: load it in your map editor and close the hole", path.display());
    Ok(())
}

/// The options of the bake.
fn options(args: &Args, scene: &Scene, import: ImportOptions) -> Result<BakeOptions, CliError> {
    let given = args.scene.given(&args.input, scene)?;
    let (view_cells, view_cell_bytes) = ViewCells::read(args.view_cells.view_cells.as_ref(), scene)?;
    Ok(BakeOptions {
        split: SplitOptions { memory: args.memory / FOR_THE_SPLIT, module: args.module, ..args.scene.split() },
        pvs: PvsOptions {
            rows_from: match args.rows {
                Rows::Conservative | Rows::Both => Guarantee::Conservative,
                Rows::Sampled => Guarantee::Sampled,
            },
            seed: args.run.seed,
            ray_budget: args.scene.rays.unwrap_or(if args.unseen.is_some() { RAYS_TO_A_GOAL } else { RAYS }),
            unseen: args.unseen,
            ..PvsOptions::default()
        },
        keep_bounds: args.rows == Rows::Both,
        given,
        smallest_hole: args.scene.smallest_hole,
        clusters: None,
        view_cells,
        view_cell_bytes,
        relevance: args.relevance,
        import,
        memory: args.memory,
        last: None,
    })
}

fn bake_file(args: &Args) -> Result<Outcome, CliError> {
    let begin = Instant::now();
    let output = args.output();
    let bar = progress_bar();
    bar.set_message("import");
    let import_options = args.scene.import();
    let scene = import(&args.input, &import_options).map_err(|e| at(&args.input, e))?;
    write_leak(args.leak().as_deref(), scene.hints.leak.as_ref())?;
    let import_seconds = begin.elapsed().as_secs_f64();
    let mut options = options(args, &scene, import_options)?;
    let progress = |stage: &str, done: f64| {
        bar.set_message(stage.to_owned());
        bar.set_position((done * 1000.0) as u64);
    };
    let of_and_how = digest(&scene, &options).of_this_build().of_and_how();
    let is_alone = args.workers.folder().is_none();
    if !args.state.fresh && is_alone {
        let last = last(args, &output)?;
        if args.from.is_none() && last.as_ref().is_some_and(|last| last.file().bake == Some(of_and_how)) {
            bar.finish_and_clear();
            return unchanged(args, &output);
        }
        options.last = last.filter(|last| is_of_use(last, args, of_and_how[1]));
    }
    let of = Of { digest: digest(&scene, &options), beside: (&output, "bake-state"), outputs: &[&output] };
    let kept = Kept::open(&args.state, Some(&args.workers), &of)?;
    if kept.is_done() {
        return kept.stopped();
    }
    let has_last = options.last.is_some();
    let work = kept.work(&progress);
    let since = Instant::now();
    let baked = args.scene.sized(scene, &mut options, &work).and_then(|(scene, sizes)| {
        let cells = since.elapsed().as_secs_f64();
        let mut baked = bake(&scene, options, &work)?;
        baked.seconds.cells += cells;
        Ok((scene, sizes, baked))
    });
    bar.finish_and_clear();
    let (scene, sizes, mut baked) = match baked {
        Ok(baked) => baked,
        Err(BakeError::Stopped(so_far)) => return leave(kept, so_far.filter(|_| is_alone), &output),
        Err(e) => {
            kept.vain()?;
            return Err(at(&args.input, e));
        }
    };
    kept.ends();
    baked.file.bake = Some(of_and_how);
    baked.file.save(&output).map_err(|e| at(&output, e))?;
    kept.done()?;
    if has_last && baked.since.is_none() {
        let path = args.from.as_ref().unwrap_or(&output);
        eprintln!("note: all is baked, and nothing taken from {}: the two models have too little in common", path.display());
    }
    let seconds = [import_seconds, begin.elapsed().as_secs_f64()];
    report(args, &output, (&scene, sizes, &baked), seconds)
}

/// Prints what a bake found and wrote. `seconds`: of the import, and in all.
fn report(
    args: &Args,
    output: &Path,
    (scene, sizes, baked): (&Scene, Option<ObjectSizes>, &Baked),
    seconds: [f64; 2],
) -> Result<Outcome, CliError> {
    let bytes = load_bytes(output)?;
    let report = BakeReport::new(scene, baked, &bytes, expected_draw(&baked.file), seconds, peak_rss_mb())
        .map_err(|e| at(output, e))?;
    let report = BakeReport { object_sizes: sizes, ..report };
    super::answer(&if args.json { super::json(&report)? } else { report.prose(&output.display().to_string()) })?;
    Ok(Outcome::Done)
}

/// Ends a bake that was stopped: writes what is known so far, where no whole file lies.
fn leave(kept: Kept, so_far: Option<Box<PvsFile>>, output: &Path) -> Result<Outcome, CliError> {
    kept.ends();
    if let Some(file) = so_far.filter(|_| may_leave(output)) {
        file.save(output).map_err(|e| at(output, e))?;
        eprintln!("{}: {SO_FAR}", output.display());
    }
    kept.stopped()
}

/// What a bake that was stopped says of its file.
const SO_FAR: &str =
    "what was known so far: it can be walked in, nothing that is visible is missing, and more than needed is drawn";

/// Whether nothing lies there, or what another bake left that was stopped. Who stops a bake may have given it the wrong output.
fn may_leave(output: &Path) -> bool {
    !output.exists() || output.is_file() && PvsFile::load(output).is_ok_and(|file| file.is_cut_short())
}

/// The last bake of this model: the file that was named, or what lies where the new one will.
fn last(args: &Args, output: &Path) -> Result<Option<Last>, CliError> {
    if let Some(path) = &args.from {
        return Last::read(&load_bytes(path)?).map(Some).map_err(|e| at(path, e));
    }
    if !output.is_file() {
        return Ok(None);
    }
    let last = load_bytes(output).ok().map(|bytes| Last::read(&bytes));
    if let Some(Err(e)) = &last {
        eprintln!("note: {}: all is baked, and nothing taken from what was there: {e}", output.display());
    }
    Ok(last.and_then(Result::ok))
}

/// Whether something can be taken from the last bake for what is asked for now; if it was named, says why not.
fn is_of_use(last: &Last, args: &Args, how: u128) -> bool {
    let is_other = last.file().bake.is_none_or(|[_, was]| was != how);
    let is_sampled = args.rows == Rows::Sampled || args.unseen.is_some();
    let why = last
        .is_of_no_use()
        .or_else(|| is_other.then_some("it was baked with other options, or by another build of this program"));
    let why = why.or_else(|| is_sampled.then_some("rows that are sampled, or to a goal, are sampled anew"));
    if let Some((path, why)) = args.from.as_ref().zip(why) {
        eprintln!("note: all is baked, and nothing taken from {}: {why}", path.display());
    }
    why.is_none()
}

/// Says that there is nothing to do.
fn unchanged(args: &Args, output: &Path) -> Result<Outcome, CliError> {
    super::answer(&if args.json {
        super::json(&serde_json::json!({ "unchanged": true }))?
    } else {
        format!(
            "{}: unchanged; model, options and program are those that it was baked with (--fresh bakes again)",
            output.display()
        )
    })?;
    Ok(Outcome::Done)
}

/// The split may use `--memory` divided by this; rows come after it.
const FOR_THE_SPLIT: u64 = 2;

/// Default number of rays with `--unseen`.
pub(super) const RAYS_TO_A_GOAL: u64 = 1_000_000_000;

/// A share, as `0.01%`, as a fraction.
fn percent(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('%').and_then(|number| number.trim_end().parse::<f64>().ok());
    number.map(|p| p / 100.0).filter(|&p| p > 0.0 && p < 1.0).ok_or_else(|| "takes a percentage, as in 0.01%".into())
}

/// A length, as `2m` or `2`.
fn metres(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('m').unwrap_or(text).trim_end().parse::<f64>().ok();
    number.filter(|&m| (0.0..=f64::MAX).contains(&m)).ok_or_else(|| "takes metres, 0 or more, as in 2m".into())
}

/// Bytes, as `512M`; powers of 1024.
pub(super) fn size(text: &str) -> Result<u64, String> {
    let (digits, power) = match text.char_indices().next_back() {
        Some((at, 'K' | 'k')) => (&text[..at], 10),
        Some((at, 'M' | 'm')) => (&text[..at], 20),
        Some((at, 'G' | 'g')) => (&text[..at], 30),
        _ => (text, 0),
    };
    let bytes = digits.parse::<u64>().ok().and_then(|n| n.checked_mul(1 << power)).filter(|&n| n > 0);
    bytes.ok_or_else(|| "takes bytes, above 0, as in 512M".into())
}

fn view_cells(path: &Path, scene: &Scene) -> Result<Vec<ViewCell>, CliError> {
    let text = std::fs::read_to_string(path).map_err(|e| at(path, e))?;
    read_view_cells(&text, scene).map_err(|e| at(path, e))
}

/// A progress bar with an estimate of the remaining time; visible only on a terminal.
pub(super) fn progress_bar() -> indicatif::ProgressBar {
    let style = indicatif::ProgressStyle::with_template("{msg:12} [{bar:40}] {percent:>3} %  {elapsed} ({left} left)");
    let bar = indicatif::ProgressBar::new(1000);
    if let Ok(style) = style {
        let left = |state: &indicatif::ProgressState, out: &mut dyn std::fmt::Write| {
            // The stage has reported no progress.
            let _ = match state.pos() {
                0 => out.write_str("?"),
                _ => write!(out, "{:#}", indicatif::HumanDuration(state.eta())),
            };
        };
        bar.set_style(style.progress_chars("=> ").with_key("left", left));
    }
    // Long searches report rarely; the clock keeps running.
    bar.enable_steady_tick(std::time::Duration::from_millis(500));
    bar
}

/// Peak memory of this process, MiB, if the system reports it.
pub(super) fn peak_rss_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some((kib / 1024.0 * 10.0).round() / 10.0)
}
