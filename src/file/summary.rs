//! The summary of a file in numbers: one type for the prose and JSON of `info` and `bake` (docs/cli.md documents the keys).

use super::{CONFIDENCE, Container, Gap, Import, PvsFile, SectionId, VERSION, entropy_bits_per_pair};
use crate::BitMatrix;
use crate::types::guarantee::Guarantee;
use crate::types::portal::{PortalKind, PortalState};
use crate::types::stats::PvsStats;
use crate::types::strategy::Strategy;
use serde::Serialize;

/// Confidence bounds of the unseen part; fractions of the sphere.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct UnseenSummary {
    /// Bound of the mean over all cells.
    pub mean: f64,
    /// Largest bound of a closed cell; `None` without closed cells.
    pub max_closed: Option<f64>,
    /// Each bound holds with this probability.
    pub confidence: f64,
}

/// Undecided cell-object pairs by kind.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct GapSummary {
    /// Undecided pairs of closed cells, as a share of those not proven hidden: 0 to 1.
    pub closed: f64,
    /// Pairs of closed cells not proven hidden; `None` if the file does not state it.
    pub closed_upper_pairs: Option<u64>,
    /// See [`Gap::tolerance`].
    pub tolerance_pairs: u64,
    /// See [`Gap::inside`].
    pub inside_pairs: u64,
    /// See [`Gap::budget`].
    pub budget_pairs: u64,
    /// See [`Gap::open`].
    pub open_cells_pairs: u64,
}

/// Sets of a file: pairs, bytes, bounds.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct PvsSummary {
    /// The bound that the rows take.
    pub guarantee: Guarantee,
    /// `None` if sampling was not tested.
    pub unseen: Option<UnseenSummary>,
    /// `None` if unknown.
    pub gap: Option<GapSummary>,
    /// Cell-object pairs with a witness.
    pub lower_pairs: u64,
    /// Those not proven hidden.
    pub upper_pairs: u64,
    /// Those between.
    pub undecided_pairs: u64,
    /// All.
    pub total_pairs: u64,
    /// Cell-cell pairs with a witness.
    pub cell_lower_pairs: u64,
    /// Those not proven hidden.
    pub cell_upper_pairs: u64,
    /// Those between.
    pub cell_undecided_pairs: u64,
    /// All.
    pub cell_total_pairs: u64,
    /// Bytes of the rows of objects.
    pub row_bytes: u64,
    /// Bits for each cell-object pair.
    pub bits_per_pair: f64,
    /// Zero-order entropy of the rows, bits for each cell-object pair.
    pub entropy_bits_per_pair: f64,
    /// Bytes of the rows of cells.
    pub cell_row_bytes: u64,
    /// Bits for each cell-cell pair.
    pub cell_bits_per_pair: f64,
    /// Zero-order entropy of the rows of cells, bits for each cell-cell pair.
    pub cell_entropy_bits_per_pair: f64,
}

impl PvsSummary {
    /// Of a file and its bytes.
    pub fn of(container: &Container<'_>, file: &PvsFile) -> Self {
        let (cells, objects) = (file.cells.len() as u64, file.objects.len() as u64);
        let (pairs, total, cell_total) = (&file.pairs, cells * objects, cells * cells);
        let row_bytes = |id| container.section(id).map_or(0, |s| s.bytes);
        let (object_bytes, cell_bytes) = (row_bytes(SectionId::ObjectRows), row_bytes(SectionId::CellRows));
        let bits = |bytes: u64, pairs: u64| if pairs == 0 { 0.0 } else { bytes as f64 * 8.0 / pairs as f64 };
        let set = |rows: &Option<BitMatrix>, all| rows.as_ref().map_or(all, BitMatrix::count_ones);
        Self {
            guarantee: file.guarantee,
            unseen: unseen(file),
            gap: gap(file),
            lower_pairs: pairs.lower,
            upper_pairs: pairs.upper,
            undecided_pairs: pairs.upper - pairs.lower,
            total_pairs: total,
            cell_lower_pairs: pairs.cell_lower,
            cell_upper_pairs: pairs.cell_upper,
            cell_undecided_pairs: pairs.cell_upper - pairs.cell_lower,
            cell_total_pairs: cell_total,
            row_bytes: object_bytes,
            bits_per_pair: bits(object_bytes, total),
            entropy_bits_per_pair: entropy_bits_per_pair(set(&file.object_rows, total), total),
            cell_row_bytes: cell_bytes,
            cell_bits_per_pair: bits(cell_bytes, cell_total),
            cell_entropy_bits_per_pair: entropy_bits_per_pair(set(&file.cell_rows, cell_total), cell_total),
        }
    }
}

fn unseen(file: &PvsFile) -> Option<UnseenSummary> {
    let unseen = file.unseen.as_ref()?;
    let closed = unseen.cells.iter().zip(&file.cells).filter(|(_, cell)| !cell.open).map(|(&bound, _)| bound);
    Some(UnseenSummary { mean: unseen.mean, max_closed: closed.reduce(f32::max).map(f64::from), confidence: CONFIDENCE })
}

fn gap(file: &PvsFile) -> Option<GapSummary> {
    let known = (file.pairs.upper == file.pairs.lower).then(Gap::default);
    let gap = file.gap.or(known)?;
    Some(GapSummary {
        closed: gap.closed() as f64 / gap.closed_upper.max(1) as f64,
        closed_upper_pairs: file.gap.map(|_| gap.closed_upper),
        tolerance_pairs: gap.tolerance,
        inside_pairs: gap.inside,
        budget_pairs: gap.budget,
        open_cells_pairs: gap.open,
    })
}

/// Portals of a kind, by state.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct PortalsSummary {
    /// Number of portals.
    pub count: usize,
    /// Open portals.
    pub open: usize,
    /// Portals shut by a leaf or a pane.
    pub shut: usize,
    /// Portals that are see-through even if shut.
    pub see_through: usize,
    /// Portals with something that can shut them.
    pub closable: usize,
    /// Shut, with a gap.
    pub ajar: usize,
}

impl PortalsSummary {
    fn of(file: &PvsFile, kind: PortalKind) -> Self {
        let of = file.portals.iter().filter(|p| p.kind == kind).map(|p| p.state);
        let count = |wanted: fn(&PortalState) -> bool| of.clone().filter(wanted).count();
        Self {
            count: of.clone().count(),
            open: count(|s| !s.shut),
            shut: count(|s| s.shut),
            see_through: count(|s| s.see_through),
            closable: count(|s| s.closable),
            ajar: count(|s| s.ajar),
        }
    }
}

/// A section of the container.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct SectionSummary {
    /// Its number in the file.
    pub id: u32,
    /// Its name, or its number.
    pub name: String,
    /// Bytes in the file.
    pub bytes: u64,
    /// Bytes when decompressed.
    pub decoded_bytes: u64,
}

/// View cells and the size of their rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct ViewCellsSummary {
    /// View cells.
    pub count: usize,
    /// Pairs with objects in their rows.
    pub pairs: u64,
    /// All pairs with objects.
    pub total_pairs: u64,
    /// Bytes of their rows.
    pub row_bytes: u64,
}

/// The output of `info`.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct FileSummary {
    /// Version of the format.
    pub version: u32,
    /// Length of the file.
    pub file_bytes: usize,
    /// [`crate::types::scene::Scene::hash`] of the model, in hexadecimal.
    pub model_hash: String,
    /// The bound that the rows take.
    pub guarantee: Guarantee,
    /// The clearance of the guarantee, metres.
    pub clearance: f64,
    /// The strategy of the split.
    pub strategy: Strategy,
    /// The reason for it.
    pub reason: String,
    /// Narrower openings may have been sealed, metres.
    pub smallest_hole: f64,
    /// Number of holes that count as opaque: below the user's limit, or undrawn walls of a level.
    pub closed_holes: usize,
    /// Added to positions to get the model's own coordinates, metres.
    pub origin: [f64; 3],
    /// Options of the import.
    pub import: Import,
    /// Cells.
    pub cells: u64,
    /// Number of open cells.
    pub open_cells: usize,
    /// Portals.
    pub portals: usize,
    /// Portals that are doors.
    pub doors: PortalsSummary,
    /// Portals that are windows.
    pub windows: PortalsSummary,
    /// Objects.
    pub objects: u64,
    /// Their triangles.
    pub triangles: u64,
    /// The sets.
    pub pvs: PvsSummary,
    /// The bake's counters.
    pub stats: PvsStats,
    /// The container's sections.
    pub sections: Vec<SectionSummary>,
    /// Omissions of the file, and the reasons.
    pub left_out: Vec<String>,
    /// Notes of the import and the split.
    pub notes: Vec<String>,
    /// Repaired holes in the cell graph.
    pub repairs: usize,
    /// View cells.
    pub view_cells: ViewCellsSummary,
}

impl FileSummary {
    /// Of a file and its bytes.
    pub fn of(container: &Container<'_>, file: &PvsFile) -> Self {
        let sections = container.sections().iter().map(|s| SectionSummary {
            id: s.number,
            name: s.name(),
            bytes: s.bytes,
            decoded_bytes: s.decoded,
        });
        let total_pairs = (file.views.cells.len() * file.objects.len()) as u64;
        Self {
            version: VERSION,
            file_bytes: container.file_bytes(),
            model_hash: format!("{:032x}", file.model_hash),
            guarantee: file.guarantee,
            clearance: file.clearance(),
            strategy: file.strategy,
            reason: file.reason.clone(),
            smallest_hole: file.smallest_hole,
            closed_holes: file.closed_holes.len(),
            origin: file.origin.to_array(),
            import: file.import,
            cells: file.cells.len() as u64,
            open_cells: file.cells.iter().filter(|c| c.open).count(),
            portals: file.portals.len(),
            doors: PortalsSummary::of(file, PortalKind::Door),
            windows: PortalsSummary::of(file, PortalKind::Window),
            objects: file.objects.len() as u64,
            triangles: file.objects.iter().map(|o| u64::from(o.triangles)).sum(),
            pvs: PvsSummary::of(container, file),
            stats: file.stats,
            sections: sections.collect(),
            left_out: file.left_out.clone(),
            notes: file.notes.clone(),
            repairs: file.repairs.len(),
            view_cells: ViewCellsSummary {
                count: file.views.cells.len(),
                pairs: file.views.rows.as_ref().map_or(total_pairs, BitMatrix::count_ones),
                total_pairs,
                row_bytes: container.section(SectionId::ViewRows).map_or(0, |s| s.bytes),
            },
        }
    }
}
