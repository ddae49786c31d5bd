//! From a scene to a file, in numbered stages; the command line, the tests and the viewer share this one.

mod choose_cells;
mod last;
mod portal_benefit;
mod prose;
mod report;
mod sizes;
mod why_open;
mod without_rows;

pub use choose_cells::find_cells;
pub use last::{Changes, Last, Since};
pub use prose::LINES;
pub use report::{AuthoredReport, BakeReport, PvsReport, SecondsReport, StrategyReport, ViewCellsReport};
pub use sizes::{DRAW_CALL, ObjectSize, ObjectSizes, size_objects};
pub use without_rows::without_rows;

use crate::cells::small_holes;
use crate::cells::validate::stage;
use crate::cells::{Audit, CellGraph, SplitError, SplitOptions, Strategy, ViewCell, audit, coarsen};
use crate::file::{FileRelevance, PvsFile};
use crate::job::{Digest, Job, Stopped};
use crate::pvs::budget::Budget;
use crate::pvs::clusters;
use crate::pvs::partition::{self, Partition};
use crate::pvs::view_cells::{self, ViewRows};
use crate::pvs::ways_in;
use crate::pvs::{self, Guarantee, Pvs, PvsOptions, SamplingEnd};
use crate::runtime::{Culler, Doors, Relevance};
use crate::scene::rays::RayScene;
use crate::scene::{ImportOptions, Scene};
use crate::types::note::{Note, details};
use choose_cells::choose;
use serde::Serialize;
use std::time::Instant;
use xxhash_rust::xxh3::xxh3_128;

/// How to bake.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct BakeOptions {
    /// How to split the scene into cells.
    pub split: SplitOptions,
    /// How to compute visibility.
    pub pvs: PvsOptions,
    /// Whether the file keeps both bounds and the witnesses.
    pub keep_bounds: bool,
    /// The options of the import: the file keeps them, so that the model can be imported again in the same way.
    pub import: ImportOptions,
    /// Given cells and portals, from the user or a previous split, instead of splitting.
    pub given: Option<CellGraph>,
    /// Portals narrower than this, metres, are closed: objects visible only through them are culled. `None` closes none.
    pub smallest_hole: Option<f64>,
    /// Neighbouring cells share a row while the expected number of triangles in a row grows by at most this share; see [`pvs::clusters`].
    /// `None`: 0.05 if the cells are found as a level's leaves; otherwise 0, which joins none.
    pub clusters: Option<f64>,
    /// View cells: additional regions with rows.
    pub view_cells: Vec<ViewCell>,
    /// If set, space is divided into view cells by cost, with about this many bytes in the file; see [`pvs::partition`].
    pub view_cell_bytes: Option<u64>,
    /// If set, the file keeps rows for bodies that go so many metres ([`Relevance`]).
    pub relevance: Option<f64>,
    /// Memory limit for rows and proofs during the bake, bytes. If matrices over all cells would take more than half of it, neighbouring
    /// cells are merged; proofs beyond a quarter of it are left out, and their pairs stay undecided. The split has its own limit,
    /// [`SplitOptions::memory`]; neither includes the scene and its hierarchies.
    pub memory: u64,
    /// The file of the last bake of a model that has changed since: what it hid is tried first, what it left is not tried again. The result
    /// depends on it, and keeps the guarantee whatever is in it.
    #[serde(skip)]
    pub last: Option<Last>,
}

/// Default of [`BakeOptions::memory`]: 8 GiB.
pub const MEMORY: u64 = 8 << 30;

impl Default for BakeOptions {
    fn default() -> Self {
        Self {
            split: SplitOptions::default(),
            pvs: PvsOptions::default(),
            keep_bounds: false,
            import: ImportOptions::default(),
            given: None,
            smallest_hole: None,
            clusters: None,
            view_cells: Vec::new(),
            view_cell_bytes: None,
            relevance: None,
            memory: MEMORY,
            last: None,
        }
    }
}

/// Wall-clock seconds of each stage.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Seconds {
    /// Splitting into cells.
    pub cells: f64,
    /// Computing visibility.
    pub pvs: f64,
}

/// A bake's result: the file's content and how long it took.
#[derive(Clone, PartialEq, Debug)]
pub struct Baked {
    /// The content of the file.
    pub file: PvsFile,
    /// Details of the import and the bake; not part of the file.
    pub details: Vec<String>,
    /// The audit of the author's rooms, if the cells are these rooms; not part of the file.
    pub audit: Option<Audit>,
    /// Both bounds of view cells, if there are any.
    pub views: Option<ViewRows>,
    /// The partition into view cells, if requested.
    pub partition: Option<Partition>,
    /// Original number of cells, if cells were joined: for lack of memory, or by [`BakeOptions::clusters`].
    pub cells_found: Option<usize>,
    /// The reason for the end of sampling.
    pub sampling_end: SamplingEnd,
    /// The shares of its rays.
    pub budget: Budget,
    /// Times of the stages; not part of the file.
    pub seconds: Seconds,
    /// What changed since the last bake, and what was taken from it; `None` without one, or if it has too little in common with the scene.
    pub since: Option<Since>,
}

/// Errors of a bake.
#[derive(Debug, thiserror::Error)]
pub enum BakeError {
    /// The scene can't be split into cells.
    #[error(transparent)]
    Split(SplitError),
    /// No cell was found.
    #[error("no closed space, so no cells; close its walls, or use --cells bsp, which needs none")]
    NoCells,
    /// The caller stopped the job. From the upper bound on there is a file: it keeps its guarantee, and has more in its rows than it would.
    #[error("stopped")]
    Stopped(Option<Box<PvsFile>>),
}

impl From<Stopped> for BakeError {
    fn from(_: Stopped) -> Self {
        Self::Stopped(None)
    }
}

impl From<SplitError> for BakeError {
    fn from(error: SplitError) -> Self {
        match error {
            SplitError::Stopped(_) => Self::Stopped(None),
            error => Self::Split(error),
        }
    }
}

/// Segments for the soundness test of a graph in debug builds.
const SEGMENTS: u64 = 4096;

/// Digest of everything that the result depends on: the key of a [journal](crate::job::Journal).
pub fn digest(scene: &Scene, options: &BakeOptions) -> Digest {
    // Numbers and text: serialization cannot fail.
    let input = postcard::to_stdvec(&(scene.hash(), &scene.name, &scene.hints)).expect("a scene's hints can be written");
    let last = options.last.as_ref().map(Last::hash);
    let options = postcard::to_stdvec(&(options, last)).expect("options can be written");
    Digest { input: xxh3_128(&input), options: xxh3_128(&options), build: 0 }
}

/// Default growth of rows for a level's leaves, for common rows of neighbours.
const LEAVES_GROW: f64 = 0.05;

/// Least proven saving of view cells, as a share of the triangles; below it they cost more, in bytes and bake time, than they save.
const VIEW_CELLS_PAY: f64 = 0.05;

/// Runs all stages: cells, visibility, file.
///
/// The result is the same on every run, for any number of threads, and whether it was interrupted or not.
///
/// # Errors
///
/// [`BakeError`].
pub fn bake(scene: &Scene, options: BakeOptions, work: &Job<'_>) -> Result<Baked, BakeError> {
    // 1. Cells and portals.
    let start = Instant::now();
    work.tell("cells", 0.0);
    let rays = RayScene::new(scene);
    let last = options.last.filter(|last| last.has_in_common(scene));
    let mut graph = cells_and_portals(&rays, options.given, (&options.split, last.as_ref()), options.smallest_hole, work)?;
    let found = graph.strategy != Strategy::Given;
    let audit = (graph.strategy == Strategy::Authored).then(|| audit(scene, &graph));
    if found {
        stage("the split", &graph, scene, 0);
    }
    let in_parts = |graph: &CellGraph| pvs::flow::parts_bytes(graph, scene.tolerance().coplanar);
    let mut cells_found = coarsen(&mut graph, scene.objects.len(), options.memory / 2, in_parts);
    let cells = start.elapsed().as_secs_f64();
    // 2. Both bounds of visibility.
    let start = Instant::now();
    let room = (options.memory / 4 / pvs::WITNESS_BYTES) as usize;
    let mut pvs_options = PvsOptions { most_witnesses: options.pvs.most_witnesses.min(room), ..options.pvs };
    let sees_all = matches!(&graph.cells[..], [only] if only.open) && pvs_options.rows_from == Guarantee::Conservative;
    let has_views = options.view_cell_bytes.is_some() || !options.view_cells.is_empty();
    let budget = budget(pvs_options.ray_budget, has_views, sees_all);
    pvs_options.ray_budget = budget.cells();
    if sees_all && !has_views {
        graph.notes.push(Note::detail(format!("one open cell sees everything: {} rays were cast", budget.cells())));
    }
    let rays = if graph.closed_holes.is_empty() { rays } else { RayScene::with_closed_holes(scene, &graph.closed_holes) };
    let (changes, hints) = last.map(|last| last.hints(scene, &graph)).unzip();
    let mut pvs = pvs::bake_by(&rays, graph, &pvs_options, hints.as_ref(), work)?;
    let since = changes.zip(pvs.again).map(|(objects, pairs)| Since { objects, pairs });
    if !pvs.is_whole {
        // What is asked for besides rows is not there.
        let is_plain = !(has_views || options.split.module || options.relevance.is_some());
        let so_far = || Box::new(PvsFile::from_bake(scene, &options.import, &pvs, options.keep_bounds));
        return Err(BakeError::Stopped(is_plain.then(so_far)));
    }
    if found {
        stage("mending", &pvs.graph, scene, SEGMENTS);
    }
    cells_found = cells_found.or(join_alike(scene, &mut pvs, options.clusters, found));
    let chosen = options.view_cell_bytes.map(|bytes| view_cells_of(scene, &pvs, bytes, &pvs_options, work));
    let partition = chosen.transpose()?;
    let mut view_cells = options.view_cells;
    view_cells.extend(partition.iter().flat_map(|found| &found.views).cloned());
    pvs_options.ray_budget = budget.view_cells;
    let look = || view_cells::bake(scene, &pvs, &view_cells, &pvs_options, work);
    let views = (!view_cells.is_empty()).then(look).transpose()?;
    // 3. The file.
    let mut file = PvsFile::from_bake(scene, &options.import, &pvs, options.keep_bounds);
    if let Some(views) = &views {
        file.add_views(&view_cells, views, options.keep_bounds);
    }
    if options.split.module {
        keep_ways_in(&mut file, scene, &pvs, &pvs_options, work)?;
    }
    file.relevance = options.relevance.map(|metres| relevance(&file, metres));
    let (sampling_end, seconds) = (pvs.sampling_end, Seconds { cells, pvs: start.elapsed().as_secs_f64() });
    file.notes.extend(partition.as_ref().map(|found| found.to_string()));
    let details = details(scene.source.notes.iter().chain(&pvs.graph.notes));
    Ok(Baked { file, details, audit, views, partition, cells_found, sampling_end, budget, seconds, since })
}

/// Joins neighbours whose rows are alike; the number of cells before, if there are fewer now. `found`: a split found the cells.
fn join_alike(scene: &Scene, pvs: &mut Pvs, growth: Option<f64>, found: bool) -> Option<usize> {
    let growth = growth.unwrap_or(if found && pvs.graph.strategy == Strategy::Leaves { LEAVES_GROW } else { 0.0 });
    if growth <= 0.0 {
        return None;
    }
    let joined = clusters::join(scene, pvs, growth);
    pvs.graph.notes.push(Note::detail(joined.to_string()));
    if found {
        stage("clusters", &pvs.graph, scene, SEGMENTS);
    }
    (joined.cells < joined.found).then_some(joined.found)
}

/// Keeps a row for each portal that leads outside, and notes how many there are.
fn keep_ways_in(file: &mut PvsFile, scene: &Scene, pvs: &Pvs, options: &PvsOptions, work: &Job<'_>) -> Result<(), Stopped> {
    let culler = Culler::new(file);
    let portals: Vec<_> = culler.ways_in().filter_map(|portal| culler.way_in(portal)).collect();
    file.notes.push(match portals.len() {
        0 => "module: no portal leads outside, so it can't be joined; leave a doorway open where another goes on".into(),
        count => format!("module: portals that lead outside, by which it is joined: {count}"),
    });
    file.ways_in = Some(ways_in::rows(scene, pvs, portals, options, work)?);
    Ok(())
}

/// Rows for bodies that go so many metres through doors, all of them open, and through no window.
fn relevance(file: &PvsFile, metres: f64) -> FileRelevance {
    let culler = Culler::new(file);
    let rows = Relevance::new(&culler, metres, &Doors::passable(&culler));
    FileRelevance { metres, cells: rows.cells().clone(), objects: rows.objects().clone() }
}

/// The given cells, or those of the split; without holes narrower than this, metres.
fn cells_and_portals(
    rays: &RayScene<'_>,
    given: Option<CellGraph>,
    (split, last): (&SplitOptions, Option<&Last>),
    smallest_hole: Option<f64>,
    work: &Job<'_>,
) -> Result<CellGraph, BakeError> {
    let mut graph = match (given, last) {
        (Some(graph), _) => graph,
        (None, Some(last)) => work.once(|| last.cells(rays, split, work))?,
        (None, None) => work.once(|| choose(rays, split, work))?,
    };
    if graph.cells.is_empty() {
        return Err(BakeError::NoCells);
    }
    if let Some(metres) = smallest_hole {
        small_holes::close(rays.scene(), &mut graph, metres);
    }
    Ok(graph)
}

/// The shares of the rays.
fn budget(rays: u64, has_views: bool, sees_all: bool) -> Budget {
    match (has_views, sees_all) {
        (true, _) => Budget::with_view_cells(rays),
        (false, true) => Budget::of_one_open_cell(rays),
        (false, false) => Budget::of_cells(rays),
    }
}

/// View cells that fit in so many bytes, unless they save too little.
fn view_cells_of(scene: &Scene, pvs: &Pvs, bytes: u64, options: &PvsOptions, work: &Job<'_>) -> Result<Partition, Stopped> {
    let mut found = partition::partition(scene, pvs, bytes, options.seed, work)?;
    if pvs.guarantee == Guarantee::Conservative && !found.views.is_empty() {
        let saving = view_cells::saving(scene, pvs, &found.views, &found.eyes, options, work)?;
        if saving < VIEW_CELLS_PAY {
            found.reject(saving);
        }
    }
    Ok(found)
}
