//! `enfilade report`: a level, a building or a ground as a page of one file, with tables beside it.

mod building;
mod files;
mod ground;
mod level;

use super::bake::{ViewCells, ViewCellsFlag};
use super::files::Files;
use super::kinds::Kind;
use super::level::SearchFlags;
use super::resume::{StateFlags, catch_interrupts, state_path};
use super::scene::SceneFlags;
use super::{CliError, Outcome, RunFlags, at};
use enfilade_levels::VisOptions;
use files::{name, write};
use std::path::PathBuf;

/// Extension of the state of an interrupted report.
const STATE: &str = "report-state";
/// Default number of views for counting missed pixels.
const VIEWS: u32 = 1000;

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// A building (any model that bake reads), a level (.prt, .bsp) or a ground (.ground)
    #[arg(value_name = "INPUT|LEVEL.prt|LEVEL.bsp|X.ground")]
    input: PathBuf,
    /// The page; tables go beside it, as .csv [default: the input's name with .report.html]
    #[arg(short, long, value_name = "REPORT.html")]
    output: Option<PathBuf>,
    /// Views for counting missed pixels, for a building
    #[arg(long, value_name = "N", default_value_t = VIEWS)]
    views: u32,
    /// Print JSON to stdout; docs/cli.md lists the keys
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    scene: SceneFlags,
    #[command(flatten)]
    view_cells: ViewCellsFlag,
    #[command(flatten, next_help_heading = "Level")]
    search: SearchFlags,
    #[command(flatten)]
    run: RunFlags,
    #[command(flatten)]
    state: StateFlags,
}

impl Args {
    /// The page.
    fn output(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| self.input.with_extension("report.html"))
    }

    /// Input and output files.
    pub fn files(&self) -> Files {
        let page = self.output();
        let files = Files::new().model_or_level(&self.input, &["ground"]).reads_too(&self.search.against);
        let files =
            files.reads_too(self.scene.paths()).reads_too(self.view_cells.view_cells.as_ref().and_then(ViewCells::path));
        let is = |extension: &str| self.input.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension));
        let is_building = !["prt", "bsp", "ground"].into_iter().any(is);
        let tables = [
            // The same name is an error of its own.
            ("csv", page.with_extension("csv") != page),
            ("cells.csv", is_building),
            ("tubes.csv", is_building),
            ("view-cells.csv", self.view_cells.view_cells.is_some()),
        ];
        let tables = tables.into_iter().filter(|(_, is_written)| *is_written);
        let state = state_path((&page, STATE)).filter(|_| !is("ground"));
        let files = files.writes(&page, Kind::Page).writes(&state, Kind::State);
        tables.fold(files, |files, (extension, _)| files.writes(&page.with_extension(extension), Kind::Table))
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    args.scene.check(&args.input)?;
    catch_interrupts()?;
    super::pool(args.run.threads)?.install(|| report(&args))
}

fn report(args: &Args) -> Result<Outcome, CliError> {
    let is = |extension: &str| args.input.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension));
    let is_level = is("prt") || is("bsp");
    if is("pvs") {
        return Err(at(&args.input, "report bakes a model itself; for a .pvs, use `enfilade info`"));
    }
    // Flags of the other kind would do nothing.
    let default = VisOptions::default();
    let of_levels = [
        ("--against", args.search.against.is_some()),
        ("--steps", args.search.steps != default.steps),
        ("--lines", args.search.lines != default.lines),
    ];
    let more = [("--views", args.views != VIEWS), ("--view-cells", args.view_cells.view_cells.is_some())];
    let of_buildings = args.scene.given_again(&name).into_iter().map(|(flag, _)| (flag, true));
    let of_buildings: Vec<_> = of_buildings.chain(more).collect();
    let given = |flags: &[(&'static str, bool)]| flags.iter().find(|f| f.1).map(|f| f.0);
    let [of_building, of_level] = [given(&of_buildings), given(&of_levels)];
    let wrong = match (is("ground"), is_level) {
        (true, _) => of_building.or(of_level).map(|flag| format!("is a ground; {flag} is for buildings or levels")),
        (false, true) => of_building.map(|flag| format!("is a level; {flag} is for buildings")),
        (false, false) => of_level.map(|flag| format!("is no level; {flag} is for levels")),
    };
    if let Some(line) = wrong {
        return Err(at(&args.input, line));
    }
    let output = args.output();
    let table = output.with_extension("csv");
    if table == output {
        return Err(at(&output, "-o names the page, and the table beside it ends in .csv; give the page another extension"));
    }
    if is("ground") {
        let again = command(args, []);
        return ground::report(&args.input, &again, args.run.seed, [&output, &table], args.json);
    }
    if is_level { level::report(args, &output, &table) } else { building::report(args, &output, &table) }
}

/// The command line that repeats the report: file names without folders, and flags with values; an empty value is a flag without one.
fn command(args: &Args, flags: impl IntoIterator<Item = (&'static str, String)>) -> String {
    let quoted = |text: String| {
        let is_plain = |c: char| c.is_alphanumeric() || "._-,:".contains(c);
        if text.chars().all(is_plain) { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
    };
    let flags = flags
        .into_iter()
        .map(|(flag, value)| if value.is_empty() { format!(" {flag}") } else { format!(" {flag} {}", quoted(value)) });
    format!("enfilade report {}{}", quoted(name(&args.input)), flags.collect::<String>())
}
