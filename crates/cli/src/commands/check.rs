//! `enfilade check`.

use super::files::Files;
use super::kinds::Kind;
use super::level::Input;
use super::{CliError, Outcome, RunFlags, at, say};
use enfilade::CellId;
use enfilade::file::{PvsFile, replace_file};
use enfilade::pvs::Guarantee;
use enfilade::scene::Scene;
use enfilade_formats::import;
use enfilade_levels::rows::read_rows;
use enfilade_measure::verify::level_lines::{CLEARANCE, LineOptions, LineReport, check_rows};
use enfilade_measure::verify::rooms::{RoomScore, RoomsFile};
use enfilade_measure::verify::{
    CheckError, CheckOptions, CheckReport, ExactReport, Leak, LeakKind, Violation, check, check_exact, score_rooms,
};
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// The file from `bake`, or a level.
    #[arg(value_name = "OUT.pvs|LEVEL.prt|LEVEL.bsp")]
    file: PathBuf,
    /// The file's model; not for levels.
    #[arg(long, value_name = "INPUT", conflicts_with = "rows")]
    model: Option<PathBuf>,
    #[command(flatten)]
    files: super::FilesFlag,
    /// Rows of a level, from `vis --rows` [default: those in LEVEL.bsp].
    #[arg(long, value_name = "FILE", conflicts_with = "views")]
    rows: Option<PathBuf>,
    /// Rays; each is tested against the rows and followed through the portals.
    #[arg(long, value_name = "COUNT", value_parser = super::count::parse, default_value = "1M")]
    rays: u64,
    /// Views of 96 x 54 rays; not for levels.
    #[arg(long, value_name = "N", default_value_t = CheckOptions::default().views)]
    views: u32,
    /// Random eyes with exact visibility: all objects visible from an eye must be in its cell's row; not for levels.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=100_000), conflicts_with = "rows")]
    exact: u32,
    /// True rooms and doors, to score the cells and portals; not for levels.
    #[arg(long, value_name = "ROOMS.json", conflicts_with = "rows")]
    rooms: Option<PathBuf>,
    /// Write every hole as a polyline in the model's coordinates; holes fail the check. Not for levels.
    #[arg(long, value_name = "LEAK.obj", requires = "model")]
    leak: Option<PathBuf>,
    /// Print JSON to stdout; docs/cli.md lists the keys
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    run: RunFlags,
}

impl Args {
    /// Input and output files.
    pub fn files(&self) -> Files {
        let files = Files::new().reads(&self.file, &["pvs", "prt", "bsp"]).reads_too(&[self.file.with_extension("prt")]);
        let files = self.model.iter().fold(files, |files, model| files.model(model));
        let files = files.reads_too(self.files.paths()).reads_too(&self.rows).reads_too(&self.rooms);
        files.writes(&self.leak, Kind::Leaks)
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let pool = super::pool(args.run.threads)?;
    let is_level = args.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("prt") || e.eq_ignore_ascii_case("bsp"));
    pool.install(|| if is_level { check_level(&args) } else { check_file(&args) })
}

fn check_file(args: &Args) -> Result<Outcome, CliError> {
    if let Some(rows) = &args.rows {
        return Err(at(rows, "--rows are tested with a .prt or .bsp, not with a .pvs"));
    }
    let Some(model) = &args.model else { return Err(at(&args.file, "is tested against its model: --model INPUT")) };
    let file = PvsFile::load(&args.file)?;
    let scene = import(model, &args.files.again(&file.import)).map_err(|e| at(model, e))?;
    let options = CheckOptions { rays: args.rays, views: args.views, seed: args.run.seed, leaks: args.leak.is_some() };
    let report = check(&file, &scene, &options).map_err(|e| match e {
        CheckError::OtherModel { .. } => at(model, e),
        _ => at(&args.file, e),
    })?;
    let score = args.rooms.as_deref().map(|path| rooms(path, &file, &scene)).transpose()?;
    let exact = (args.exact > 0).then(|| check_exact(&file, &scene, args.exact, args.run.seed)).transpose();
    let exact = exact.map_err(|e| at(&args.file, e))?;
    let kept = exact.as_ref().is_none_or(|e| e.passed);
    let tight = report.leaks.as_ref().is_none_or(|l| l.leak_count == 0);
    let passed = report.passed && tight && kept;
    if args.json {
        let mut value = serde_json::to_value(&report).map_err(|e| CliError(e.to_string()))?;
        if let Some(exact) = &exact {
            value["exact"] = serde_json::to_value(exact).map_err(|e| CliError(e.to_string()))?;
        }
        if let Some(score) = &score {
            value["rooms"] = serde_json::to_value(score).map_err(|e| CliError(e.to_string()))?;
        }
        value["passed"] = passed.into();
        super::answer(&value.to_string())?;
    }
    if let (Some(path), Some(leaks)) = (&args.leak, &report.leaks) {
        replace_file(path, |out| leak_lines(&leaks.leaks, out)).map_err(|e| at(path, e))?;
    }
    let mut told = String::new();
    score.iter().for_each(|score| tell_rooms(score, &mut told));
    tell(&report, &file, &mut told);
    tell_free_space(&report, &mut told);
    tell_faults(&report, &mut told);
    tell_examples(&report, &file, &scene, &mut told);
    exact.iter().for_each(|exact| tell_exact(exact, &file, &scene, &mut told));
    let seconds = report.seconds + exact.as_ref().map_or(0.0, |exact| exact.seconds);
    say!(told, "{} in {seconds:.1} s", if passed { "passed" } else { "failed" });
    super::prose(&told, args.json)?;
    Ok(if passed { Outcome::Done } else { Outcome::Failed })
}

/// Writes a polyline per leak.
fn leak_lines(leaks: &[Leak], out: &mut dyn Write) -> io::Result<()> {
    let mut corners = 0;
    for (i, leak) in leaks.iter().enumerate() {
        writeln!(out, "o leak_{i}")?;
        for p in &leak.points {
            writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
        }
        write!(out, "l")?;
        for _ in &leak.points {
            corners += 1;
            write!(out, " {corners}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Scores cells and portals against the true rooms and doors.
fn rooms(path: &Path, file: &PvsFile, scene: &Scene) -> Result<RoomScore, CliError> {
    let text = std::fs::read_to_string(path).map_err(|e| at(path, e))?;
    let written: RoomsFile =
        serde_json::from_str(&text).map_err(|e| at(path, format!("{e}; see docs/cli.md for the form of a rooms file")))?;
    score_rooms(file, scene, &written).map_err(|e| at(path, e))
}

fn tell_rooms(s: &RoomScore, out: &mut String) {
    say!(
        out,
        "rooms: {} of {} found (recall {:.3}), {} of {} cells right (precision {:.3}), mean overlap {:.3}",
        s.rooms_found,
        s.rooms,
        s.recall,
        s.cells_right,
        s.cells,
        s.precision,
        s.mean_iou
    );
    say!(
        out,
        "  {} rooms in several cells, {} cells over several rooms, {} cells in no listed room",
        s.over_segmented,
        s.under_segmented,
        s.unlisted
    );
    for (what, o) in [("doors", &s.doors), ("windows", &s.windows)] {
        say!(out, "  {what}: {} of {} located, {} join the right rooms", o.located, o.count, o.joining);
    }
}

/// The result of exact visibility.
fn tell_exact(r: &ExactReport, file: &PvsFile, scene: &Scene, out: &mut String) {
    say!(
        out,
        "{} eyes, exact visibility: {} missed cell-object pairs, {} seen only through cracks; {:.0} triangles visible, {:.2} undecided ({:.2} %)",
        r.eyes,
        r.missed_pairs,
        r.crack_pairs,
        r.visible_mean,
        r.undecided_mean,
        100.0 * r.undecided_mean / r.visible_mean.max(1.0)
    );
    for m in &r.misses {
        let (cell, object) = (&file.cells[m.cell.index()].name, &scene.objects[m.object.index()].node);
        let (from, towards) = (m.from, m.direction);
        say!(
            out,
            "  cell {} ({cell}) doesn't list object {} ({object}), seen from {from:.3} along {towards:.6}",
            m.cell,
            m.object
        );
    }
}

/// Rows of a level.
fn check_level(args: &Args) -> Result<Outcome, CliError> {
    let model: Option<&Path> = args.model.as_deref();
    if let Some(model) = model {
        return Err(at(model, "a level is tested by its portals, not with --model"));
    }
    if args.exact > 0 {
        return Err(at(&args.file, "a level is tested by its portals, not with --exact"));
    }
    let input = Input::read(&args.file)?;
    let rows = match (&args.rows, &input.bsp) {
        (Some(path), _) => {
            let bytes = std::fs::read(path).map_err(|e| at(path, e))?;
            read_rows(&bytes, input.level.cells).map_err(|e| at(path, e))?
        }
        (None, Some(_)) => input.rows().map_err(|e| at(&args.file, e))?,
        (None, None) => return Err(at(&args.file, "holds no rows; name some with --rows")),
    };
    let report = check_rows(&input.level, &rows, &LineOptions { rays: args.rays, seed: args.run.seed });
    if args.json {
        super::answer(&serde_json::to_string(&report).map_err(|e| CliError(e.to_string()))?)?;
    }
    let mut told = String::new();
    tell_level(&report, &mut told);
    super::prose(&told, args.json)?;
    Ok(if report.passed { Outcome::Done } else { Outcome::Failed })
}

fn tell_level(r: &LineReport, out: &mut String) {
    say!(
        out,
        "{} lines through {} portals, at least {CLEARANCE} from their edges: {} prove pairs missing from the rows, {} pairs",
        r.rays,
        r.crossings,
        r.missed_rays,
        r.missed_pairs
    );
    if r.bent > 0 {
        say!(out, "{} lines ended in cells that aren't convex", r.bent);
    }
    for e in &r.examples {
        let [a, b] = e.cells;
        let portals: Vec<String> = e.portals.iter().map(ToString::to_string).collect();
        let (from, to) = (e.from.to_array(), e.to.to_array());
        say!(out, "  {a} and {b}: the line from {from:?} to {to:?} through portals {}", portals.join(" "));
    }
    say!(out, "{} in {:.1} s", if r.passed { "passed" } else { "failed" }, r.seconds);
}

fn tell(r: &CheckReport, file: &PvsFile, out: &mut String) {
    let promise = match r.guarantee {
        Guarantee::Conservative => "conservative",
        Guarantee::Sampled => "sampled",
    };
    say!(
        out,
        "{} rays ({promise} rows): {} missed, {} cell-object pairs, {} cell-cell pairs",
        r.rays,
        r.missed_rays,
        r.missed_pairs,
        r.missed_cell_pairs
    );
    say!(out, "{} segments: {} left a cell without a portal", r.segments, r.missed_segments);
    if r.crack_rays > 0 {
        say!(
            out,
            "{} rays passed cracks narrower than {:.4} m: rows promise nothing there, so these don't fail the check",
            r.crack_rays,
            file.smallest_hole
        );
    }
    if r.views > 0 {
        let [mean, max] = [r.false_pixels.mean, r.false_pixels.max].map(|share| 100.0 * share);
        say!(out, "{} views: {mean:.4} % of the pixels are missing on average, {max:.4} % in the worst view", r.views);
    }
}

/// Free space outside all cells. There the run time draws everything in the frustum.
fn tell_free_space(r: &CheckReport, out: &mut String) {
    let free = &r.free_outside_cells;
    if free.outside > 0 {
        say!(
            out,
            "{} of {} points of free space indoors are in no cell ({:.4} %): everything in the frustum is drawn there",
            free.outside,
            free.points,
            100.0 * free.share
        );
    }
    for place in &free.places {
        let from = place.from_cell.map_or("an authored room".into(), |c| format!("cell {c}"));
        say!(out, "  {} of them around {:.3}, on the way from {from}", place.points, place.at);
    }
    if r.empty_cells > 0 {
        say!(out, "{} cells have no volume; no ray starts in them", r.empty_cells);
    }
}

/// Faults besides missed rays.
fn tell_faults(r: &CheckReport, out: &mut String) {
    if r.missed_placements > 0 {
        say!(out, "{} objects were hit in a cell that doesn't hold them", r.missed_placements);
    }
    if r.structure.count > 0 {
        say!(out, "{} faults of cells and portals, so the check fails", r.structure.count);
    }
    for fault in &r.structure.faults {
        let [a, b] = fault.cells;
        let portal = fault.portal.map_or(String::new(), |p| format!("portal {p}, "));
        say!(out, "  {:?}: {portal}cells {a} and {b}, at {:.3}", fault.fault, fault.at);
    }
    if let Some(leaks) = &r.leaks {
        say!(out, "{} holes", leaks.leak_count);
        for (i, leak) in leaks.leaks.iter().take(10).enumerate() {
            let what = match leak.kind {
                LeakKind::Segment => "a segment leaves",
                LeakKind::Opening => "an opening, neither door nor window, leads out of",
                LeakKind::Room => "an authored room is open, in",
            };
            say!(out, "  leak_{i}: {what} cell {}, {:.2} m", leak.from_cell, leak.length);
        }
    }
}

fn tell_examples(r: &CheckReport, file: &PvsFile, scene: &Scene, out: &mut String) {
    for e in &r.examples {
        let name =
            |cell: Option<CellId>| cell.map_or("no cell".into(), |c| format!("cell {c} ({})", file.cells[c.index()].name));
        let object = e.object.map_or(String::new(), |o| format!("object {o} ({})", scene.objects[o.index()].node));
        let [a, b] = e.cells.map(name);
        match e.violation {
            Violation::Object => say!(out, "  {a} doesn't list {object}, seen from {:.3} at {:.3}", e.from, e.at),
            Violation::Cell => say!(out, "  {a} doesn't list {b}, seen from {:.3} at {:.3}", e.from, e.at),
            Violation::Placement => {
                say!(out, "  {b} doesn't hold {object}, hit in it at {:.3}, seen from {:.3}", e.at, e.from)
            }
            Violation::Segment => say!(out, "  from {a} into {b} without a portal at {:.3}, seen from {:.3}", e.at, e.from),
        }
    }
}
