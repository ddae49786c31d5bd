//! `enfilade report` of a building.

use super::super::scene::RAYS;
use super::{Args, command, name, write};
use crate::commands::bake::{ViewCells, peak_rss_mb, progress_bar};
use crate::commands::resume::{Kept, Of};
use crate::commands::stage_times::{Clock, Stages};
use crate::commands::{CliError, Outcome, at};
use enfilade::CellId;
use enfilade::bake::{BakeError, BakeOptions, BakeReport, Baked, ObjectSizes, bake, digest, find_cells};
use enfilade::cells::CellGraph;
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::proof::{Asker, Goal};
use enfilade::pvs::sampling::{Strategy, sample_alone};
use enfilade::pvs::{self, PvsOptions};
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use enfilade_measure::pages::building::{BuildingReport, Stage};
use enfilade_measure::pages::curves::{Curve, CurvePoint, Views, held_out};
use enfilade_measure::pages::html::Remark;
use enfilade_measure::pages::splits::Splits;
use enfilade_measure::pages::tubes::{TubeView, TubesFound, measure};
use enfilade_measure::pages::undecided::{Pairs, closed_and_open, hardest};
use enfilade_measure::walkthrough::expected::expected_draw;
use enfilade_measure::walkthrough::portal_costs::{PortalCost, portal_costs};
use enfilade_measure::walkthrough::tour::tour;
use enfilade_measure::why::Pair;
use glam::Vec3;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

/// Shares of the rays for runs of the curve; the last point is the bake itself.
const BUDGETS: [f64; 3] = [1.0 / 64.0, 1.0 / 16.0, 1.0 / 4.0];
/// Most views for the error of tubes, and the size of their pictures, pixels.
const TUBE_VIEWS: usize = 24;
const TUBE_PICTURE: [f64; 2] = [960.0, 540.0];
/// Undecided pairs that are explained.
const ASKED: usize = 12;

/// Bakes and writes the report: `output` is the page, `table` stands beside it.
pub(super) fn report(args: &Args, output: &Path, table: &Path) -> Result<Outcome, CliError> {
    let begin = Instant::now();
    let watch = Watch::new();
    let progress = |stage: &str, done: f64| watch.show(stage, done);

    // 1. The scene.
    progress("import", 0.0);
    let import_options = args.scene.import();
    let scene = import(&args.input, &import_options).map_err(|e| at(&args.input, e))?;
    let import_seconds = begin.elapsed().as_secs_f64();

    // 2. Cells, object sizes and rows, as `bake` computes them.
    let mut options = options(args, &scene, import_options)?;
    let of = Of { digest: digest(&scene, &options), beside: (output, super::STATE), outputs: &[] };
    let kept = Kept::open(&args.state, None, &of)?;
    let clock = Clock::start();
    let work = kept.work(&progress);
    let Worked { scene, sizes, graph, mut baked } = match Worked::new(args, scene, &mut options, &work) {
        Ok(worked) => worked,
        Err(BakeError::Stopped(_)) => return kept.stopped(),
        Err(e) => {
            kept.vain()?;
            return Err(at(&args.input, e));
        }
    };
    let cpu = clock.seconds();
    baked.file.bake = Some(of.digest.of_this_build().of_and_how());

    // 3. Comparisons.
    let measured = Measured::new(args, &scene, &graph, &options, (&baked, cpu), &progress)?;

    // 4. The page and the tables.
    progress("bytes", 0.0);
    let bytes = baked.file.write();
    let stages = watch.finish();
    let seconds = [import_seconds, begin.elapsed().as_secs_f64()];
    let report = BakeReport::new(&scene, &baked, &bytes, expected_draw(&baked.file), seconds, peak_rss_mb())
        .map_err(|e| at(&args.input, e))?;
    let report = BakeReport { object_sizes: sizes, ..report };
    let (building, line) = (name(&args.input), again(args));
    let command = Command { building: &building, line: &line, seed: args.run.seed, stages: &stages };
    let page = measured.page(command, &scene, &baked, &report);
    let files = files(&page, output, table);
    kept.ends();
    write(&files)?;
    kept.done()?;
    print_result(args, &report, &page, &files)?;
    Ok(Outcome::Done)
}

/// A scene with objects of the chosen size, its cells, and its bake.
struct Worked {
    scene: Scene,
    sizes: Option<ObjectSizes>,
    graph: CellGraph,
    baked: Baked,
}

impl Worked {
    fn new(args: &Args, scene: Scene, options: &mut BakeOptions, work: &Job<'_>) -> Result<Self, BakeError> {
        let since = Instant::now();
        let (scene, sizes) = args.scene.sized(scene, options, work)?;
        let graph = match options.given.take() {
            Some(graph) => graph,
            None => find_cells(&scene, &options.split, work)?,
        };
        options.given = Some(graph.clone());
        let seconds = since.elapsed().as_secs_f64();
        let mut baked = bake(&scene, options.clone(), work)?;
        baked.seconds.cells += seconds;
        Ok(Self { scene, sizes, graph, baked })
    }
}

/// The command, as the page shows it.
struct Command<'a> {
    building: &'a str,
    /// The line that repeats it.
    line: &'a str,
    seed: u64,
    stages: &'a [Stage],
}

/// Prints the written files, or the report as JSON.
fn print_result(
    args: &Args,
    report: &BakeReport,
    page: &BuildingReport<'_>,
    files: &[(PathBuf, String)],
) -> Result<(), CliError> {
    if args.json {
        crate::commands::answer(&numbers(report, page, files)?)?;
    }
    let written: Vec<String> = files.iter().map(|(path, _)| format!("{} written", path.display())).collect();
    crate::commands::prose(&written.join("\n"), args.json)
}

/// Options of the page's bake.
fn options(args: &Args, scene: &Scene, import: ImportOptions) -> Result<BakeOptions, CliError> {
    let pvs = PvsOptions { seed: args.run.seed, ray_budget: args.scene.rays.unwrap_or(RAYS), ..PvsOptions::default() };
    let (view_cells, view_cell_bytes) = ViewCells::read(args.view_cells.view_cells.as_ref(), scene)?;
    Ok(BakeOptions {
        split: args.scene.split(),
        pvs,
        keep_bounds: true,
        smallest_hole: args.scene.smallest_hole,
        // The page compares rows of the original cells.
        clusters: Some(0.0),
        import,
        given: args.scene.given(&args.input, scene)?,
        view_cells,
        view_cell_bytes,
        ..BakeOptions::default()
    })
}

/// Shows progress on the terminal and records the time of each stage.
struct Watch {
    bar: indicatif::ProgressBar,
    stages: Mutex<Stages>,
}

impl Watch {
    fn new() -> Self {
        Self { bar: progress_bar(), stages: Mutex::default() }
    }

    /// Enters a stage; `done` is its progress, 0 to 1.
    fn show(&self, stage: &str, done: f64) {
        if let Ok(mut stages) = self.stages.lock()
            && stages.enter(stage)
        {
            self.bar.reset();
            self.bar.set_message(stage.to_owned());
        }
        self.bar.set_position((done * 1000.0) as u64);
    }

    /// Ends the last stage and returns all stages.
    fn finish(self) -> Vec<Stage> {
        let mut stages = self.stages.into_inner().unwrap_or_default();
        stages.leave();
        self.bar.finish_and_clear();
        stages.done
    }
}

/// Comparisons for a bake: held-out views, runs with fewer rays, and reasons of undecided pairs.
struct Measured {
    curves: Vec<Curve>,
    tubes: Option<TubesFound>,
    splits: Option<Splits>,
    /// Number of held-out views.
    views: usize,
    /// Pixels of these views that show objects not in the file's rows.
    missed_pixels: u64,
    portal_costs: Vec<PortalCost>,
    hardest: Vec<Remark>,
}

impl Measured {
    /// `options`: of the page's bake. `baked`: that bake and its processor time, seconds.
    fn new(
        args: &Args,
        scene: &Scene,
        graph: &CellGraph,
        options: &BakeOptions,
        (baked, cpu): (&Baked, f64),
        progress: &(impl Fn(&str, f64) + Sync),
    ) -> Result<Self, CliError> {
        progress("held-out views", 0.0);
        let (file, pvs) = (&baked.file, &options.pvs);
        let views = held_out(scene, file, args.run.seed, args.views);
        progress("runs with fewer rays", 0.0);
        let bench = Bench { scene, graph, options: pvs, views: &views };
        let mut curves = vec![bench.everything(file, cpu)?, bench.flow()?];
        curves.extend(Strategy::ALL.map(|strategy| bench.alone(strategy)));
        progress("tubes", 0.0);
        let tubes = tubes(scene, file, args.run.seed);
        let found = baked.partition.as_ref().zip(options.view_cell_bytes);
        let splits = found.map(|(found, bytes)| Splits::new(bytes, found.full, &found.curve));
        progress("why", 0.0);
        let hardest = reasons(file, scene).map_err(|e| at(&args.input, e))?;
        let missed_pixels = file.object_rows.as_ref().map_or(0, |rows| views.missed_pixels(rows));
        let (views, portal_costs) = (views.count(), portal_costs(file, args.run.seed));
        Ok(Self { curves, tubes, splits, views, missed_pixels, portal_costs, hardest })
    }

    /// The page.
    fn page<'a>(
        &'a self,
        command: Command<'a>,
        scene: &'a Scene,
        baked: &'a Baked,
        report: &'a BakeReport,
    ) -> BuildingReport<'a> {
        let Command { building, line, seed, stages } = command;
        BuildingReport {
            building,
            command: line,
            seed,
            scene,
            file: &baked.file,
            pvs: &report.pvs.summary,
            expected: report.expected_draw,
            curves: &self.curves,
            tubes: self.tubes.as_ref(),
            splits: self.splits.as_ref(),
            views: self.views,
            missed_pixels: self.missed_pixels,
            portal_costs: &self.portal_costs,
            hardest: &self.hardest,
            stages,
            threads: rayon::current_num_threads(),
        }
    }
}

/// Errors of drawn tubes from views along the tour, if the scene has tubes.
fn tubes(scene: &Scene, file: &PvsFile, seed: u64) -> Option<TubesFound> {
    let count = scene.tube_count()?;
    let path = tour(file, seed);
    let view = |frame: usize| {
        let camera = path.camera(frame, scene.origin, TUBE_PICTURE[0] / TUBE_PICTURE[1]);
        let rows = [camera.x, camera.y, camera.w].map(Vec3::as_dvec3);
        TubeView { eye: camera.eye.as_dvec3(), rows, near: path.near, size: TUBE_PICTURE }
    };
    let views: Vec<TubeView> =
        (0..path.frames.len()).step_by(path.frames.len().div_ceil(TUBE_VIEWS).max(1)).map(view).collect();
    Some(TubesFound { count, views: views.len(), errors: measure(scene, &views, seed) })
}

/// The page first, then the tables beside it.
fn files(page: &BuildingReport<'_>, output: &Path, table: &Path) -> Vec<(PathBuf, String)> {
    let mut files = vec![
        (output.to_owned(), page.html()),
        (table.to_owned(), page.csv()),
        (output.with_extension("cells.csv"), page.cells_csv()),
    ];
    files.extend(page.tubes.map(|tubes| (output.with_extension("tubes.csv"), tubes.csv())));
    files.extend(page.splits.map(|splits| (output.with_extension("view-cells.csv"), splits.csv())));
    files
}

/// The command's JSON.
fn numbers(report: &BakeReport, page: &BuildingReport<'_>, files: &[(PathBuf, String)]) -> Result<String, CliError> {
    let mut paths = files.iter().map(|(path, _)| path.to_string_lossy());
    let [closed_cells, open_cells_apart] = closed_and_open(page.file).map(PairsLine::from);
    crate::commands::json(&ReportLine {
        bake: report,
        closed_cells,
        open_cells_apart,
        views: page.views,
        missed_pixels: page.missed_pixels,
        portal_costs: page.portal_costs,
        curves: page.curves,
        tube_errors: page.tubes,
        view_cell_splits: page.splits,
        stages: page.stages,
        page: paths.next().unwrap_or_default(),
        tables: paths.collect(),
    })
}

/// The command's JSON.
#[derive(serde::Serialize)]
struct ReportLine<'a> {
    #[serde(flatten)]
    bake: &'a BakeReport,
    closed_cells: PairsLine,
    open_cells_apart: PairsLine,
    views: usize,
    missed_pixels: u64,
    portal_costs: &'a [PortalCost],
    curves: &'a [Curve],
    #[serde(skip_serializing_if = "Option::is_none")]
    tube_errors: Option<&'a TubesFound>,
    #[serde(skip_serializing_if = "Option::is_none")]
    view_cell_splits: Option<&'a Splits>,
    stages: &'a [Stage],
    page: Cow<'a, str>,
    tables: Vec<Cow<'a, str>>,
}

/// Cell-object pairs of some cells.
#[derive(serde::Serialize)]
struct PairsLine {
    cells: u64,
    total_pairs: u64,
    lower_pairs: u64,
    upper_pairs: u64,
    undecided_pairs: u64,
    gap: f64,
}

impl From<Pairs> for PairsLine {
    fn from(p: Pairs) -> Self {
        let Pairs { cells, total: total_pairs, lower: lower_pairs, upper: upper_pairs } = p;
        Self { cells, total_pairs, lower_pairs, upper_pairs, undecided_pairs: p.undecided(), gap: p.gap() }
    }
}

/// Inputs for measuring strategies.
struct Bench<'b> {
    scene: &'b Scene,
    graph: &'b CellGraph,
    options: &'b PvsOptions,
    views: &'b Views,
}

impl Bench<'_> {
    /// The whole bake with shares of its rays, and with all: `file`, which took `cpu` seconds.
    fn everything(&self, file: &PvsFile, cpu: f64) -> Result<Curve, CliError> {
        let points: Result<Vec<CurvePoint>, CliError> = BUDGETS.iter().map(|part| self.with_part(*part)).collect();
        let mut points = points?;
        if let Some(bounds) = &file.bounds {
            points.push(CurvePoint {
                cpu_seconds: cpu,
                rays: file.stats.rays,
                lower_pairs: file.pairs.lower,
                upper_pairs: Some(file.pairs.upper),
                false_pixels: self.views.false_pixels(&bounds.objects_lower),
            });
        }
        Ok(Curve { strategy: "everything", points })
    }

    /// One sampling strategy with shares of the bake's rays, and with all.
    fn alone(&self, strategy: Strategy) -> Curve {
        let with = |part: &f64| {
            let ray_budget = (self.options.ray_budget as f64 * part) as u64;
            let clock = Clock::start();
            let spent = sample_alone(self.scene, self.graph, strategy, self.options.seed, ray_budget);
            CurvePoint {
                cpu_seconds: clock.seconds(),
                rays: spent.rays,
                lower_pairs: spent.objects.count_ones(),
                upper_pairs: None,
                false_pixels: self.views.false_pixels(&spent.objects),
            }
        };
        Curve { strategy: strategy.name(), points: BUDGETS.iter().chain([&1.0]).map(with).collect() }
    }

    /// Portal flow without rays.
    fn flow(&self) -> Result<Curve, CliError> {
        Ok(Curve { strategy: "flow", points: vec![self.with_part(0.0)?] })
    }

    fn with_part(&self, part: f64) -> Result<CurvePoint, CliError> {
        let ray_budget = (self.options.ray_budget as f64 * part) as u64;
        let clock = Clock::start();
        let options = PvsOptions { ray_budget, ..self.options.clone() };
        let pvs = pvs::bake(self.scene, self.graph.clone(), &options, &Job::quiet()).map_err(|e| CliError(e.to_string()))?;
        Ok(CurvePoint {
            cpu_seconds: clock.seconds(),
            rays: pvs.stats.rays,
            lower_pairs: pvs.objects_lower.count_ones(),
            upper_pairs: Some(pvs.objects_upper.count_ones()),
            false_pixels: self.views.false_pixels(&pvs.objects_lower),
        })
    }
}

/// The hardest undecided pairs with their reasons.
fn reasons(file: &PvsFile, scene: &Scene) -> Result<Vec<Remark>, enfilade::proof::WhyError> {
    let asker = Asker::new(file, Some(scene))?;
    let ask = |(cell, object): (CellId, enfilade::ObjectId)| {
        let goal = Goal::Object(object);
        let why = asker.why(cell, goal)?;
        let text = Pair { file, from: cell, to: goal }.remark(&why);
        Ok(Remark { about: format!("{cell} {object}"), text })
    };
    hardest(file, ASKED).into_iter().map(ask).collect()
}

fn again(args: &Args) -> String {
    let mut flags = args.scene.given_again(&name);
    flags.extend((args.views != super::VIEWS).then(|| ("--views", args.views.to_string())));
    flags.extend(args.view_cells.view_cells.as_ref().map(|v| {
        let value = match v {
            ViewCells::Auto(bytes) => format!("auto:{bytes}"),
            ViewCells::File(path) => name(path),
        };
        ("--view-cells", value)
    }));
    flags.extend((args.run.seed != 0).then(|| ("--seed", args.run.seed.to_string())));
    flags.extend(args.run.threads.map(|n| ("--threads", n.to_string())));
    command(args, flags)
}
