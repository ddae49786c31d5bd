//! The report of a bake in numbers: one type for the prose, the JSON of the command line, and the figures of pages.

use super::why_open::why_open;
use super::{Baked, ObjectSizes, Since};
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
    /// The strategy.
    pub cells: Strategy,
    /// The reason for it.
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
    /// Computing visibility.
    pub pvs: f64,
    /// The whole command up to its report.
    pub total: f64,
}

/// Both bounds of view cells.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct ViewCellsReport {
    /// View cells.
    pub count: usize,
    /// Pairs of view cell and object with a witness.
    pub lower_pairs: u64,
    /// Pairs not proven hidden.
    pub upper_pairs: u64,
    /// Undecided pairs.
    pub undecided_pairs: u64,
    /// All pairs.
    pub total_pairs: usize,
    /// View cells in no cell.
    pub in_no_cell: usize,
    /// As [`crate::types::bounds::Unseen::cells`], for each view cell.
    pub unseen: Vec<f64>,
    /// Bound of the mean over view cells.
    pub unseen_mean: f64,
    /// For a partition by cost: after each split, the expected bytes, and the triangles of a row.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub curve: Vec<(u64, f64)>,
    /// Rays cast.
    pub rays: u64,
    /// Searches of flow that ran out of steps.
    pub flow_over_budget: u64,
    /// Pairs proven visible that flow refuted; they are kept.
    pub contradictions: u64,
}

/// The author's rooms.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct AuthoredReport {
    /// Number of authored rooms.
    pub rooms: usize,
    /// Number of sound rooms.
    pub sound_rooms: usize,
    /// Share of the indoor free space in cells that are rooms.
    pub claimed: f64,
}

/// The report of `bake`; docs/cli.md documents the keys.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct BakeReport {
    /// Triangles of the scene.
    pub triangles: usize,
    /// Objects.
    pub objects: usize,
    /// What changed since the last bake, and what was taken from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub since: Option<Since>,
    /// The measurements for the size of objects, if it was chosen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object_sizes: Option<ObjectSizes>,
    /// Counts of tubes, if there are any: [`Self::triangles`] counts their prisms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tubes: Option<TubeCount>,
    /// Cells.
    pub cells: usize,
    /// Number of open cells.
    pub open_cells: usize,
    /// Portals.
    pub portals: usize,
    /// How the cells were found.
    pub strategy: StrategyReport,
    /// What the file leaves out, and the reasons.
    pub left_out: Vec<String>,
    /// Notes of the import and the split, most important first.
    pub notes: Vec<String>,
    /// Details of the import and the bake.
    pub details: Vec<String>,
    /// The sets, and the bake's counters.
    pub pvs: PvsReport,
    /// The shares of the ray budget.
    pub rays: Budget,
    /// The reason for the end of sampling: `rays`, `unseen` or `memory`.
    pub sampling_ended_by: SamplingEnd,
    /// The clearance of the guarantee, metres.
    pub clearance: f64,
    /// Narrower openings may have been sealed, metres.
    pub smallest_hole: f64,
    /// Number of holes that count as opaque: below the user's limit, or undrawn walls of a level.
    pub closed_holes: usize,
    /// Why the model is open, if no cell is closed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_open: Option<String>,
    /// The expected saving of culling; `None` without triangles.
    pub expected_draw: Option<ExpectedDraw>,
    /// Repaired holes in the cell graph.
    pub repairs: Vec<Repair>,
    /// Cells before joining, for lack of memory or for common rows.
    pub cells_found: usize,
    /// Times.
    pub seconds: SecondsReport,
    /// Peak memory, MiB, if the system reports it.
    pub peak_rss_mb: Option<f64>,
    /// Length of the file.
    pub file_bytes: usize,
    /// Only with view cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view_cells: Option<ViewCellsReport>,
    /// Only if the cells are the author's rooms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub authored: Option<AuthoredReport>,
    /// Likewise: the findings of the audit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub findings: Option<Vec<Finding>>,
}

impl BakeReport {
    /// The report of a bake, with the bytes of its file. `import` and `total` are seconds, `peak_rss_mb` MiB; `expected_draw` is that of
    /// the file.
    ///
    /// # Errors
    ///
    /// If the bytes are not a container.
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
            since: baked.since,
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
