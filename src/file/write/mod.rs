//! Writes files: from fields to sections.

mod container;
mod encoder;
mod from_bake;
mod put;
mod replace;
mod rows;

pub use replace::{replace_file, replace_file_by};
pub use rows::encode_rows;

use super::codes::{HOLE, NO_TUBES, TUBE_RADIUS, UNIT, Z_UP, portal_kind_code, state_code, strategy_code};
use super::format::SectionId;
use super::rows::Guide;
use super::{FileRelevance, FileWaysIn, Gap, Import, PvsFile};
use crate::types::bounds::Unseen;
use crate::types::portal::PortalState;
use crate::types::stats::PvsStats;
use crate::{BitMatrix, DirectedPortal};
use container::assemble;
use glam::{DVec3, Vec4};
use put::Put;
use rows::encode_guided;

impl PvsFile {
    /// The file's bytes; the same fields give the same bytes. The fields must be consistent as documented (ids in range, [`PvsFile::pairs`]
    /// as counted, a witness for each lower pair in order), or [`PvsFile::read`] rejects the file.
    ///
    /// # Panics
    /// If lower and upper matrices of [`PvsFile::bounds`] differ in shape.
    pub fn write(&self) -> Vec<u8> {
        let mut sections = vec![(SectionId::Meta, self.meta())];
        let mut add = |id, wanted: bool, bytes: &dyn Fn() -> Vec<u8>| {
            if wanted {
                sections.push((id, bytes()));
            }
        };
        let portals = || self.portals.iter().map(|p| p.cells.map(|cell| cell.0));
        add(SectionId::Notes, !(self.left_out.is_empty() && self.notes.is_empty()), &|| self.lines());
        add(SectionId::Cells, !self.cells.is_empty(), &|| self.cell_list());
        add(SectionId::Portals, !self.portals.is_empty(), &|| self.portal_list());
        add(SectionId::Objects, !self.objects.is_empty(), &|| self.object_list());
        add(SectionId::Placement, !(self.cells.is_empty() || self.objects.is_empty()), &|| encode_rows(&self.placement));
        if let Some(rows) = &self.cell_rows {
            add(SectionId::CellRows, true, &|| encode_guided(rows, &Guide::cells(self.cells.len(), portals())));
        }
        if let Some(rows) = &self.object_rows {
            let guide = || Guide::objects(portals(), &self.placement, self.cell_rows.as_ref());
            add(SectionId::ObjectRows, true, &|| encode_guided(rows, &guide()));
        }
        if let Some(bounds) = &self.bounds {
            add(SectionId::CellBounds, true, &|| encode_rows(&both(&bounds.cells_upper, &bounds.cells_lower)));
            add(SectionId::ObjectBounds, true, &|| encode_rows(&both(&bounds.objects_upper, &bounds.objects_lower)));
            add(SectionId::Witnesses, true, &|| segments(bounds.witnesses.iter().map(|w| [w.from, w.to])));
        }
        add(SectionId::Repairs, !self.repairs.is_empty(), &|| self.repair_list());
        add(SectionId::Stats, self.stats != Default::default(), &|| self.counters());
        let usual = self.portals.iter().all(|p| p.state == PortalState::of_kind(p.kind));
        add(SectionId::PortalStates, !usual, &|| self.portals.iter().map(|p| state_code(p.state)).collect());
        let views = &self.views;
        add(SectionId::ViewCells, !views.cells.is_empty(), &|| self.view_cell_list());
        add(SectionId::ViewRows, views.rows.is_some(), &|| views.rows.as_ref().map(encode_rows).unwrap_or_default());
        if let Some(bounds) = &views.bounds {
            add(SectionId::ViewBounds, true, &|| encode_rows(&both(&bounds.upper, &bounds.lower)));
            let segments = || segments(bounds.witnesses.iter().copied());
            add(SectionId::ViewWitnesses, true, &segments);
        }
        add(SectionId::Unseen, self.unseen.is_some(), &|| self.bounds_of_unseen());
        add(SectionId::Gap, self.gap.is_some(), &|| self.undecided());
        let placed = || self.placed.iter().flatten().flat_map(|placed| placed.0).collect();
        add(SectionId::Placed, self.placed.is_some(), &placed);
        add(SectionId::ClosedHoles, !self.closed_holes.is_empty(), &|| self.closed_hole_list());
        let clusters = || self.clusters.iter().flat_map(|cells| cells.to_le_bytes()).collect();
        add(SectionId::Clusters, !self.clusters.is_empty(), &clusters);
        if let Some(FileRelevance { metres, cells, objects }) = &self.relevance {
            add(SectionId::Relevance, true, &|| metres.to_le_bytes().to_vec());
            add(SectionId::RelevantCells, true, &|| encode_rows(cells));
            add(SectionId::RelevantObjects, true, &|| encode_rows(objects));
        }
        if let Some(FileWaysIn { portals, cells, objects }) = &self.ways_in {
            add(SectionId::WaysIn, true, &|| directed(portals));
            add(SectionId::WayInCells, true, &|| encode_rows(cells));
            add(SectionId::WayInObjects, true, &|| encode_rows(objects));
        }
        let bake = || self.bake.iter().flatten().flat_map(|digest| digest.to_le_bytes()).collect();
        add(SectionId::Bake, self.bake.is_some(), &bake);
        assemble(self.model_hash, self.guarantee, &sections)
    }

    fn meta(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.f64s(self.origin.to_array());
        out.f64s([self.smallest_hole]);
        out.u8(strategy_code(self.strategy));
        out.u32(self.import.object_triangles);
        let Import { metres_per_unit, z_up, tube_radius, tubes, smallest_hole, .. } = self.import;
        let given = [(UNIT, metres_per_unit), (TUBE_RADIUS, tube_radius), (HOLE, smallest_hole)];
        let flags =
            given.map(|(flag, metres)| (flag, metres.is_some())).into_iter().chain([(NO_TUBES, !tubes), (Z_UP, z_up)]);
        out.u8(flags.filter(|(_, is_set)| *is_set).map(|(flag, _)| flag).sum());
        given.into_iter().filter_map(|(_, metres)| metres).for_each(|metres| out.f64s([metres]));
        out.count(self.cells.len());
        out.count(self.portals.len());
        out.count(self.objects.len());
        let p = &self.pairs;
        [p.lower, p.upper, p.cell_lower, p.cell_upper].into_iter().for_each(|n| out.u64(n));
        out.string(&self.reason);
        out
    }

    fn lines(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for lines in [&self.left_out, &self.notes] {
            out.count(lines.len());
            lines.iter().for_each(|line| out.string(line));
        }
        out
    }

    fn cell_list(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.count(self.cells.len());
        for cell in &self.cells {
            out.string(&cell.name);
            out.option(cell.source.as_deref());
            out.u8(u8::from(cell.open));
            pieces(&cell.pieces, &mut out);
        }
        out
    }

    fn view_cell_list(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.count(self.views.cells.len());
        for cell in &self.views.cells {
            out.string(&cell.id.to_text());
            pieces(&cell.pieces, &mut out);
        }
        out
    }

    fn portal_list(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.count(self.portals.len());
        for portal in &self.portals {
            portal.cells.iter().for_each(|cell| out.u32(cell.0));
            out.f32s(portal.plane.to_array());
            out.u8(portal_kind_code(portal.kind));
            out.option(portal.source.as_deref());
            out.count(portal.winding.len());
            portal.winding.iter().for_each(|p| out.f32s(p.to_array()));
        }
        out
    }

    fn closed_hole_list(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.count(self.closed_holes.len());
        for winding in &self.closed_holes {
            out.count(winding.len());
            winding.iter().for_each(|p| out.f32s(p.to_array()));
        }
        out
    }

    fn object_list(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.count(self.objects.len());
        for object in &self.objects {
            out.string(&object.node);
            out.u32(object.triangles);
            object.bounds.iter().for_each(|p| out.f32s(p.to_array()));
        }
        out
    }

    fn repair_list(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.count(self.repairs.len());
        for repair in &self.repairs {
            repair.cells.iter().for_each(|cell| out.u32(cell.0));
            [repair.at, repair.segment[0], repair.segment[1]].iter().for_each(|p| out.f64s(p.to_array()));
        }
        out
    }

    fn bounds_of_unseen(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let Some(Unseen { mean, cells }) = &self.unseen else { return out };
        out.f64s([*mean]);
        cells.iter().for_each(|&bound| out.f32s([bound]));
        out
    }

    fn undecided(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let Gap { closed_upper, tolerance, inside, budget, open } = self.gap.unwrap_or_default();
        [closed_upper, tolerance, inside, budget, open].into_iter().for_each(|n| out.u64(n));
        out
    }

    fn counters(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let PvsStats { rays, cubes, flow_steps, flow_over_budget, kept_unproven, left_out_unproven, contradictions } =
            self.stats;
        [rays, cubes, flow_steps, flow_over_budget, kept_unproven, left_out_unproven, contradictions]
            .into_iter()
            .for_each(|n| out.u64(n));
        out
    }
}

/// Alternating upper and lower rows, so that each lower row can refer to its upper one.
fn both(upper: &BitMatrix, lower: &BitMatrix) -> BitMatrix {
    let mut out = BitMatrix::new(2 * upper.rows(), upper.columns());
    for row in 0..upper.rows() {
        out.assign_row(2 * row, upper.row(row));
        out.assign_row(2 * row + 1, lower.row(row));
    }
    out
}

fn pieces(pieces: &[Vec<Vec4>], out: &mut Vec<u8>) {
    out.count(pieces.len());
    for piece in pieces {
        out.count(piece.len());
        piece.iter().for_each(|plane| out.f32s(plane.to_array()));
    }
}

fn directed(portals: &[DirectedPortal]) -> Vec<u8> {
    let mut out = Vec::new();
    out.count(portals.len());
    portals.iter().for_each(|portal| out.u32(portal.0));
    out
}

fn segments(segments: impl ExactSizeIterator<Item = [DVec3; 2]>) -> Vec<u8> {
    let mut out = Vec::new();
    out.count(segments.len());
    for [from, to] in segments {
        out.f64s(from.to_array());
        out.f64s(to.to_array());
    }
    out
}
