//! What a bake found, in numbers: one typed answer, from which `prose` makes words, the command line JSON, and pages their figures.

use super::why_open::why_open;
use super::{Baked, ObjectSizes};
use crate::cells::Finding;
use crate::file::{Container, FileError, PvsSummary};
use crate::pvs::budget::Budget;
use crate::scene::{Scene, TubeCount};
use crate::types::bounds::SamplingEnd;
use crate::types::expected::ExpectedDraw;
use crate::types::proof::Repair;
use crate::types::stats::PvsStats;
use crate::types::strategy::Strategy;
use serde::Serialize;

/// How the cells were found.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct StrategyReport {
    /// By which strategy.
    pub cells: Strategy,
    /// Why by that one.
    pub reason: String,
}

/// The sets, and the bake's counters.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct PvsReport {
    /// The sets.
    #[serde(flatten)]
    pub summary: PvsSummary,
    /// The counters.
    #[serde(flatten)]
    pub stats: PvsStats,
}

/// Wall-clock seconds.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct SecondsReport {
    /// Reading the model.
    pub import: f64,
    /// Splitting into cells.
    pub cells: f64,
    /// Working out what can be seen.
    pub pvs: f64,
    /// From the start of the command to its report.
    pub total: f64,
}

/// Both sides of what is seen from view cells.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct ViewCellsReport {
    /// View cells.
    pub count: usize,
    /// Pairs with objects that have a witness.
    pub lower_pairs: u64,
    /// Those not proven hidden.
    pub upper_pairs: u64,
    /// Those between.
    pub undecided_pairs: u64,
    /// All.
    pub total_pairs: usize,
    /// View cells that lie in no cell.
    pub in_no_cell: usize,
    /// As [`crate::types::bounds::Unseen::cells`], for each view cell.
    pub unseen: Vec<f64>,
    /// Of the mean over them.
    pub unseen_mean: f64,
    /// Where they were chosen by cost: after each split the bytes that they were expected to take, and the triangles of a row.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub curve: Vec<(u64, f64)>,
    /// Rays cast.
    pub rays: u64,
    /// Searches of flow that ran out of steps.
    pub flow_over_budget: u64,
    /// Pairs proven visible that flow took for hidden; they are kept.
    pub contradictions: u64,
}

/// The author's rooms.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct AuthoredReport {
    /// Rooms that the author drew.
    pub rooms: usize,
    /// Those that can name space.
    pub sound_rooms: usize,
    /// Of the free space indoors, the share in cells that are rooms.
    pub claimed: f64,
}

/// Everything that `bake` says; docs/cli.md documents the keys.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct BakeReport {
    /// Of the scene.
    pub triangles: usize,
    /// Objects.
    pub objects: usize,
    /// What their size was chosen by, where it was a choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object_sizes: Option<ObjectSizes>,
    /// Where the scene has tubes: what is in [`Self::triangles`] of them is prisms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tubes: Option<TubeCount>,
    /// Cells.
    pub cells: usize,
    /// Of these, open ones.
    pub open_cells: usize,
    /// Portals.
    pub portals: usize,
    /// How the cells were found.
    pub strategy: StrategyReport,
    /// What isn't in the file, and why.
    pub left_out: Vec<String>,
    /// The importer's and the split's notes, what matters most first.
    pub notes: Vec<String>,
    /// How the import and the bake went.
    pub details: Vec<String>,
    /// The sets, and the bake's counters.
    pub pvs: PvsReport,
    /// The shares of the rays that were asked for.
    pub rays: Budget,
    /// What ended sampling: `rays`, `unseen` or `memory`.
    pub sampling_ended_by: SamplingEnd,
    /// The clearance that the guarantee holds for, metres.
    pub clearance: f64,
    /// Openings narrower than this, metres, may have been sealed.
    pub smallest_hole: f64,
    /// Holes that count as opaque: too small for the user, or walls of a level that are not drawn.
    pub closed_holes: usize,
    /// What opens the model, where no cell is closed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_open: Option<String>,
    /// What culling is expected to save; `None` where there is nothing to draw.
    pub expected_draw: Option<ExpectedDraw>,
    /// Holes in the cell graph that were found and mended.
    pub repairs: Vec<Repair>,
    /// Cells before any were joined: for lack of memory, or to share rows.
    pub cells_found: usize,
    /// Times.
    pub seconds: SecondsReport,
    /// Most memory held, MiB, where the system says so.
    pub peak_rss_mb: Option<f64>,
    /// Length of the file.
    pub file_bytes: usize,
    /// With view cells only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view_cells: Option<ViewCellsReport>,
    /// Where the cells are the author's rooms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub authored: Option<AuthoredReport>,
    /// Likewise: what is wrong in what the author wrote.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub findings: Option<Vec<Finding>>,
}

impl BakeReport {
    /// Of a bake and the bytes of its file. `import` and `total` are seconds, `peak_rss_mb` MiB; `expected_draw` is that of the file.
    ///
    /// # Errors
    ///
    /// Where the bytes are no container.
    pub fn new(
        scene: &Scene,
        baked: &Baked,
        bytes: &[u8],
        expected_draw: Option<ExpectedDraw>,
        [import, total]: [f64; 2],
        peak_rss_mb: Option<f64>,
    ) -> Result<Self, FileError> {
        let file = &baked.file;
        let summary = PvsSummary::of(&Container::parse(bytes)?, file);
        let audit = baked.audit.as_ref();
        Ok(Self {
            triangles: scene.triangles.len(),
            objects: file.objects.len(),
            object_sizes: None,
            tubes: scene.tube_count(),
            cells: file.cells.len(),
            open_cells: file.cells.iter().filter(|c| c.open).count(),
            portals: file.portals.len(),
            strategy: StrategyReport { cells: file.strategy, reason: file.reason.clone() },
            left_out: file.left_out.clone(),
            notes: file.notes.clone(),
            details: baked.details.clone(),
            pvs: PvsReport { summary, stats: file.stats },
            rays: baked.budget,
            sampling_ended_by: baked.sampling_end,
            clearance: file.clearance(),
            smallest_hole: file.smallest_hole,
            closed_holes: file.closed_holes.len(),
            why_open: file.cells.iter().all(|c| c.open).then(|| why_open(scene)),
            expected_draw,
            repairs: file.repairs.clone(),
            cells_found: baked.cells_found.unwrap_or(file.cells.len()),
            seconds: SecondsReport { import, cells: baked.seconds.cells, pvs: baked.seconds.pvs, total },
            peak_rss_mb,
            file_bytes: bytes.len(),
            view_cells: view_cells(baked),
            authored: audit.map(|a| AuthoredReport { rooms: a.rooms, sound_rooms: a.sound_rooms, claimed: a.claimed }),
            findings: audit.map(|a| a.findings.clone()),
        })
    }
}

fn view_cells(baked: &Baked) -> Option<ViewCellsReport> {
    let views = baked.views.as_ref()?;
    let (lower, upper) = (views.lower.count_ones(), views.upper.count_ones());
    Some(ViewCellsReport {
        count: views.upper.rows(),
        lower_pairs: lower,
        upper_pairs: upper,
        undecided_pairs: upper - lower,
        total_pairs: views.upper.rows() * views.upper.columns(),
        in_no_cell: views.in_no_cell.len(),
        unseen: views.unseen.clone(),
        unseen_mean: views.unseen_mean,
        curve: baked.partition.as_ref().map(|found| found.curve.clone()).unwrap_or_default(),
        rays: views.rays,
        flow_over_budget: views.capped,
        contradictions: views.contradictions,
    })
}
