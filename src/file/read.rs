//! Reads sections into fields. Every number is checked against the rule in the field's documentation.

use super::bytes::{Budget, Cursor};
use super::codes::{HOLE, NO_TUBES, PORTAL_KINDS, STRATEGIES, TUBE_RADIUS, UNIT, Z_UP, state_of_code};
use super::error::{Fault, FileError};
use super::format::{Container, SectionId};
use super::rows::{Guide, decode_guided, matrix_bytes};
use super::{
    Bounds, FileCell, FileObject, FilePortal, FileRelevance, FileViewCell, FileWaysIn, Gap, Import, PairCounts, PvsFile,
    ViewBounds, Views,
};
use crate::types::bounds::Unseen;
use crate::types::guarantee::Guarantee;
use crate::types::placed::PlacedBox;
use crate::types::portal::PortalState;
use crate::types::proof::{Repair, Witness};
use crate::types::stats::PvsStats;
use crate::types::strategy::Strategy;
use crate::types::view_cell_name::ViewCellName;
use crate::{BitMatrix, CellId, DirectedPortal, ObjectId};
use glam::{DVec3, Vec3, Vec4};
use std::collections::HashSet;

/// Largest error of a normal's length. Larger: planes with wrong distances pass. Smaller: rounded ones are rejected.
const NORMAL_LENGTH: f32 = 1e-3;

impl PvsFile {
    /// Reads a whole file; anything that differs from docs/format.md is rejected. Takes at most 16 MiB plus 8,192 times `bytes.len()` of
    /// memory, for any content.
    pub fn read(bytes: &[u8]) -> Result<Self, FileError> {
        let container = Container::parse(bytes)?;
        container.verify()?;
        SectionReader { container: &container }.whole(&mut Budget::new(bytes.len())).map_err(|fault| *fault)
    }

    /// Reads what [`Culler::new`](crate::runtime::Culler::new) takes, for programs that only draw, in less time and memory than
    /// [`Self::read`]. All checksums are compared, but sections of other subjects aren't decoded: reports, bounds, holes, clusters and
    /// relevance are empty, and numbers of pairs are not compared.
    pub fn read_for_frames(bytes: &[u8]) -> Result<Self, FileError> {
        let container = Container::parse(bytes)?;
        container.verify()?;
        SectionReader { container: &container }.for_frames(&mut Budget::new(bytes.len())).map_err(|fault| *fault)
    }
}

/// The content of [`SectionId::Meta`].
struct Meta {
    origin: DVec3,
    smallest_hole: f64,
    strategy: Strategy,
    import: Import,
    cells: usize,
    portals: usize,
    objects: usize,
    pairs: PairCounts,
    reason: String,
}

struct SectionReader<'c, 'a> {
    container: &'c Container<'a>,
}

impl<'a> SectionReader<'_, 'a> {
    fn whole(&self, budget: &mut Budget) -> Result<PvsFile, Fault> {
        let mut file = self.for_frames(budget)?;
        let (cells, objects) = (file.cells.len(), file.objects.len());
        [file.left_out, file.notes] = self.notes(budget)?;
        file.closed_holes = self.closed_holes(budget)?;
        file.repairs = self.repairs(cells, budget)?;
        file.stats = self.stats(budget)?;
        file.unseen = self.unseen(cells, budget)?;
        file.gap = self.gap(budget)?;
        file.bounds = self.bounds(cells, objects, budget)?;
        file.views.bounds = self.view_bounds(&file.views, objects, file.guarantee, budget)?;
        file.clusters = self.clusters(cells, budget)?;
        file.relevance = self.relevance(cells, objects, budget)?;
        file.bake = self.section(SectionId::Bake, budget, |c, _| Ok([c.u128()?, c.u128()?]))?;
        check_pairs(&file)?;
        Ok(file)
    }

    fn for_frames(&self, budget: &mut Budget) -> Result<PvsFile, Fault> {
        let meta = self.meta(budget)?;
        let (cells, objects) = (meta.cells, meta.objects);
        let mut file = PvsFile {
            model_hash: self.container.model_hash,
            origin: meta.origin,
            guarantee: self.container.guarantee,
            import: meta.import,
            strategy: meta.strategy,
            reason: meta.reason,
            smallest_hole: meta.smallest_hole,
            closed_holes: Vec::new(),
            clusters: Vec::new(),
            left_out: Vec::new(),
            notes: Vec::new(),
            cells: self.list(SectionId::Cells, cells, 10, budget, cell)?,
            portals: self.list(SectionId::Portals, meta.portals, 30, budget, |c, b| portal(c, b, cells))?,
            objects: self.list(SectionId::Objects, objects, 32, budget, |c, _| object(c))?,
            placement: BitMatrix::default(),
            placed: None,
            cell_rows: None,
            object_rows: None,
            bounds: None,
            pairs: meta.pairs,
            repairs: Vec::new(),
            stats: PvsStats::default(),
            unseen: None,
            gap: None,
            views: Views::default(),
            relevance: None,
            ways_in: None,
            bake: None,
        };
        file.placement = self.placement(cells, objects, budget)?;
        file.placed = self.placed(file.placement.count_ones(), budget)?;
        let portals: Vec<[u32; 2]> = file.portals.iter().map(|p| p.cells.map(|cell| cell.0)).collect();
        file.cell_rows = self.cell_rows(cells, &portals, budget)?;
        file.object_rows = self.object_rows(&portals, &file.placement, file.cell_rows.as_ref(), budget)?;
        self.states(&mut file.portals, budget)?;
        file.views = self.views(objects, budget)?;
        file.ways_in = self.ways_in([portals.len(), cells, objects], budget)?;
        Ok(file)
    }

    /// Reads a section to its end with `f`; `None` if the file leaves it out.
    fn section<T>(
        &self,
        id: SectionId,
        budget: &mut Budget,
        f: impl FnOnce(&mut Cursor<'_>, &mut Budget) -> Result<T, Fault>,
    ) -> Result<Option<T>, Fault> {
        let Some(bytes) = self.container.payload(id, budget)? else { return Ok(None) };
        let mut c = Cursor::new(id, &bytes);
        let value = f(&mut c, budget)?;
        c.end()?;
        Ok(Some(value))
    }

    fn meta(&self, budget: &mut Budget) -> Result<Meta, Fault> {
        let meta = self.section(SectionId::Meta, budget, |c, _| {
            let origin = DVec3::from_array(c.f64s()?);
            let [smallest_hole] = c.f64s()?;
            if smallest_hole < 0.0 {
                return Err(c.error("a negative length"));
            }
            let strategy = STRATEGIES[c.code(STRATEGIES.len(), "strategy")?].ok_or_else(|| c.error("a removed strategy"))?;
            let object_triangles = c.u32()?;
            if object_triangles == 0 {
                return Err(c.error("objects of 0 triangles"));
            }
            let flags = c.code(usize::from(UNIT | TUBE_RADIUS | NO_TUBES | Z_UP | HOLE) + 1, "flags")? as u8;
            let mut metres = |flag: u8, what: &str| match flags & flag {
                0 => Ok(None),
                _ => match c.f64s()? {
                    [metres] if metres > 0.0 => Ok(Some(metres)),
                    _ => Err(c.error(format!("{what} that is not above 0 metres"))),
                },
            };
            let (metres_per_unit, tube_radius) = (metres(UNIT, "a unit")?, metres(TUBE_RADIUS, "a radius")?);
            let smallest_hole_of_maps = metres(HOLE, "a hole")?;
            let [cells, portals, objects] = [c.u32()?, c.u32()?, c.u32()?].map(|n| n as usize);
            if let Some((_, what)) = [(cells, "cell"), (objects, "object")].into_iter().find(|(n, _)| *n == 0) {
                return Err(c.error(format!("no {what}: a file has one or more")));
            }
            let pairs = PairCounts { lower: c.u64()?, upper: c.u64()?, cell_lower: c.u64()?, cell_upper: c.u64()? };
            let most = |columns: usize| cells as u64 * columns as u64;
            for (lower, upper, most) in
                [(pairs.lower, pairs.upper, most(objects)), (pairs.cell_lower, pairs.cell_upper, most(cells))]
            {
                if lower > upper || upper > most {
                    return Err(c.error(format!("{lower} pairs in the lower set, {upper} in the upper, {most} in all")));
                }
            }
            let (tubes, z_up) = (flags & NO_TUBES == 0, flags & Z_UP != 0);
            let import =
                Import { object_triangles, metres_per_unit, z_up, tube_radius, tubes, smallest_hole: smallest_hole_of_maps };
            Ok(Meta { origin, smallest_hole, strategy, import, cells, portals, objects, pairs, reason: c.string()? })
        })?;
        meta.ok_or_else(|| missing(SectionId::Meta))
    }

    fn notes(&self, budget: &mut Budget) -> Result<[Vec<String>; 2], Fault> {
        let lines = |c: &mut Cursor<'_>, b: &mut Budget| c.list(b, 4, |c, _| c.string());
        Ok(self.section(SectionId::Notes, budget, |c, b| Ok([lines(c, b)?, lines(c, b)?]))?.unwrap_or_default())
    }

    /// A section that is one list of `n` elements; left out only if there are none.
    fn list<T>(
        &self,
        id: SectionId,
        n: usize,
        least: usize,
        budget: &mut Budget,
        element: impl FnMut(&mut Cursor<'_>, &mut Budget) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        let list = self.section(id, budget, |c, b| {
            let list = c.list(b, least, element)?;
            if list.len() != n {
                return Err(c.error(format!("a list of {}, {n} expected", list.len())));
            }
            Ok(list)
        })?;
        match list {
            None if n > 0 => Err(missing(id)),
            list => Ok(list.unwrap_or_default()),
        }
    }

    fn matrix(&self, id: SectionId, rows: usize, columns: usize, budget: &mut Budget) -> Result<Option<BitMatrix>, Fault> {
        self.guided(id, [rows, columns], &Guide::Plain, budget)
    }

    fn guided(
        &self,
        id: SectionId,
        [rows, columns]: [usize; 2],
        guide: &Guide<'_>,
        budget: &mut Budget,
    ) -> Result<Option<BitMatrix>, Fault> {
        let Some(bytes) = self.container.matrix(id)? else { return Ok(None) };
        budget.take(id, matrix_bytes(rows, columns))?;
        decode_guided(id, bytes, rows, columns, guide).map(Some)
    }

    fn placement(&self, cells: usize, objects: usize, budget: &mut Budget) -> Result<BitMatrix, Fault> {
        match self.matrix(SectionId::Placement, cells, objects, budget)? {
            Some(placement) => Ok(placement),
            None if cells == 0 || objects == 0 => Ok(BitMatrix::new(cells, objects)),
            None => Err(missing(SectionId::Placement)),
        }
    }

    /// A box for each of `n` pairs.
    fn placed(&self, n: u64, budget: &mut Budget) -> Result<Option<Vec<PlacedBox>>, Fault> {
        self.section(SectionId::Placed, budget, |c, b| {
            b.take(SectionId::Placed, n.saturating_mul(6))?;
            (0..n)
                .map(|_| {
                    let mut placed = PlacedBox::WHOLE;
                    for corner in &mut placed.0 {
                        *corner = c.u8()?;
                    }
                    placed
                        .is_sound()
                        .then_some(placed)
                        .ok_or_else(|| c.error("a box whose least corner is above its greatest"))
                })
                .collect()
        })
    }

    /// `portals`: the two cells of each.
    fn cell_rows(&self, cells: usize, portals: &[[u32; 2]], budget: &mut Budget) -> Result<Option<BitMatrix>, Fault> {
        budget.take(SectionId::CellRows, Guide::cells_bytes(cells, portals.len()))?;
        let guide = Guide::cells(cells, portals.iter().copied());
        self.guided(SectionId::CellRows, [cells; 2], &guide, budget)
    }

    fn object_rows(
        &self,
        portals: &[[u32; 2]],
        placement: &BitMatrix,
        seen: Option<&BitMatrix>,
        budget: &mut Budget,
    ) -> Result<Option<BitMatrix>, Fault> {
        let id = SectionId::ObjectRows;
        if self.container.section(id).is_none() {
            return Ok(None);
        }
        budget.take(id, Guide::objects_bytes(portals.len(), placement))?;
        let guide = Guide::objects(portals.iter().copied(), placement, seen);
        self.guided(id, [placement.rows(), placement.columns()], &guide, budget)
    }

    fn repairs(&self, cells: usize, budget: &mut Budget) -> Result<Vec<Repair>, Fault> {
        let repairs = self.section(SectionId::Repairs, budget, |c, b| {
            c.list(b, 80, |c, _| {
                let cells = [CellId(c.id(cells, "cell")?), CellId(c.id(cells, "cell")?)];
                let at = DVec3::from_array(c.f64s()?);
                Ok(Repair { cells, at, segment: [DVec3::from_array(c.f64s()?), DVec3::from_array(c.f64s()?)] })
            })
        })?;
        Ok(repairs.unwrap_or_default())
    }

    fn closed_holes(&self, budget: &mut Budget) -> Result<Vec<Vec<Vec3>>, Fault> {
        let holes = self.section(SectionId::ClosedHoles, budget, |c, b| c.list(b, 40, winding))?;
        Ok(holes.unwrap_or_default())
    }

    /// A number for each cell; empty if the file has none.
    fn clusters(&self, cells: usize, budget: &mut Budget) -> Result<Vec<u32>, Fault> {
        let clusters = self.section(SectionId::Clusters, budget, |c, b| {
            b.take(SectionId::Clusters, 4 * cells as u64)?;
            let count = |c: &mut Cursor<'_>| match c.u32()? {
                0 => Err(c.error("a cell joined from 0 cells")),
                n => Ok(n),
            };
            (0..cells).map(|_| count(c)).collect()
        })?;
        Ok(clusters.unwrap_or_default())
    }

    /// Three sections, or none.
    fn relevance(&self, cells: usize, objects: usize, budget: &mut Budget) -> Result<Option<FileRelevance>, Fault> {
        let metres = self.section(SectionId::Relevance, budget, |c, _| match c.f64s()? {
            [metres] if metres >= 0.0 => Ok(metres),
            _ => Err(c.error("a negative length")),
        })?;
        let by_cells = self.matrix(SectionId::RelevantCells, cells, cells, budget)?;
        let by_objects = self.matrix(SectionId::RelevantObjects, cells, objects, budget)?;
        match (metres, by_cells, by_objects) {
            (None, None, None) => Ok(None),
            (Some(metres), Some(cells), Some(objects)) => Ok(Some(FileRelevance { metres, cells, objects })),
            (None, ..) => Err(missing(SectionId::Relevance)),
            (_, None, _) => Err(missing(SectionId::RelevantCells)),
            (_, _, None) => Err(missing(SectionId::RelevantObjects)),
        }
    }

    /// Three sections, or none.
    fn ways_in(&self, [portals, cells, objects]: [usize; 3], budget: &mut Budget) -> Result<Option<FileWaysIn>, Fault> {
        let ways = self.section(SectionId::WaysIn, budget, |c, b| {
            let mut last = None;
            c.list(b, 4, |c, _| {
                let portal = c.id(2 * portals, "directed portal")?;
                let is_next = last.replace(portal).is_none_or(|last| last < portal);
                is_next.then_some(DirectedPortal(portal)).ok_or_else(|| c.error("portals out of order"))
            })
        })?;
        let rows = ways.as_ref().map_or(0, Vec::len);
        let by_cells = self.matrix(SectionId::WayInCells, rows, cells, budget)?;
        let by_objects = self.matrix(SectionId::WayInObjects, rows, objects, budget)?;
        match (ways, by_cells, by_objects) {
            (None, None, None) => Ok(None),
            (Some(portals), Some(cells), Some(objects)) => Ok(Some(FileWaysIn { portals, cells, objects })),
            (None, ..) => Err(missing(SectionId::WaysIn)),
            (_, None, _) => Err(missing(SectionId::WayInCells)),
            (_, _, None) => Err(missing(SectionId::WayInObjects)),
        }
    }

    fn stats(&self, budget: &mut Budget) -> Result<PvsStats, Fault> {
        let stats = self.section(SectionId::Stats, budget, |c, _| {
            let (rays, cubes, flow_steps, flow_over_budget) = (c.u64()?, c.u64()?, c.u64()?, c.u64()?);
            let (kept_unproven, left_out_unproven, contradictions) = (c.u64()?, c.u64()?, c.u64()?);
            Ok(PvsStats { rays, cubes, flow_steps, flow_over_budget, kept_unproven, left_out_unproven, contradictions })
        })?;
        Ok(stats.unwrap_or_default())
    }

    fn gap(&self, budget: &mut Budget) -> Result<Option<Gap>, Fault> {
        self.section(SectionId::Gap, budget, |c, _| {
            let (closed_upper, tolerance, inside) = (c.u64()?, c.u64()?, c.u64()?);
            let gap = Gap { closed_upper, tolerance, inside, budget: c.u64()?, open: c.u64()? };
            let more = || c.error(format!("{} undecided pairs of {closed_upper}", gap.closed()));
            (gap.closed() <= closed_upper).then_some(gap).ok_or_else(more)
        })
    }

    fn unseen(&self, cells: usize, budget: &mut Budget) -> Result<Option<Unseen>, Fault> {
        let fraction =
            |c: &Cursor<'_>, x: f64| (0.0..=1.0).contains(&x).then_some(x).ok_or_else(|| c.error("unseen, not from 0 to 1"));
        let mean = self.section(SectionId::Unseen, budget, |c, b| {
            let [mean] = c.f64s()?;
            let mean = fraction(c, mean)?;
            b.take(SectionId::Unseen, 4 * cells as u64)?;
            let one = |c: &mut Cursor<'_>| {
                let [x] = c.f32s()?;
                fraction(c, f64::from(x)).map(|_| x)
            };
            let cells = (0..cells).map(|_| one(c)).collect::<Result<Vec<f32>, Fault>>()?;
            Ok(Unseen { mean, cells })
        })?;
        Ok(mean)
    }

    /// A byte per portal; left out if all are the defaults of their kinds.
    fn states(&self, portals: &mut [FilePortal], budget: &mut Budget) -> Result<(), Fault> {
        let states = self.section(SectionId::PortalStates, budget, |c, _| {
            for portal in portals.iter_mut() {
                let code = c.u8()?;
                portal.state = state_of_code(code).ok_or_else(|| c.error(format!("portal state {code}")))?;
            }
            Ok(())
        })?;
        let usual = |p: &FilePortal| p.state == PortalState::of_kind(p.kind);
        match states {
            // The same content gives the same bytes.
            Some(()) if portals.iter().all(usual) => {
                let what = "every portal has its kind's state: omit the section".into();
                Err(malformed(SectionId::PortalStates, what))
            }
            _ => Ok(()),
        }
    }

    /// Upper and lower set of `cells` cells or view cells, with alternating rows, so that one refers to the other.
    fn sides(
        &self,
        id: SectionId,
        cells: usize,
        columns: usize,
        budget: &mut Budget,
    ) -> Result<Option<[BitMatrix; 2]>, Fault> {
        let Some(both) = self.matrix(id, 2 * cells, columns, budget)? else { return Ok(None) };
        budget.take(id, 2 * (cells * columns.div_ceil(64) * 8) as u64)?;
        let [mut upper, mut lower] = [BitMatrix::new(cells, columns), BitMatrix::new(cells, columns)];
        for cell in 0..cells {
            upper.assign_row(cell, both.row(2 * cell));
            lower.assign_row(cell, both.row(2 * cell + 1));
        }
        if let Some((cell, other)) = lower.first_outside(&upper) {
            let what = format!("pair {cell}, {other} is in the lower set and not in the upper");
            return Err(malformed(id, what));
        }
        Ok(Some([upper, lower]))
    }

    /// View cells with their rows, without bounds.
    fn views(&self, objects: usize, budget: &mut Budget) -> Result<Views, Fault> {
        let cells = self.section(SectionId::ViewCells, budget, |c, b| {
            let mut ids = HashSet::new();
            let cells = c.list(b, 8, |c, b| {
                let cell = FileViewCell { id: ViewCellName::of_text(c.string()?), pieces: pieces(c, b)? };
                match ids.insert(cell.id.clone()) {
                    true => Ok(cell),
                    false => Err(c.error(format!("duplicate view cell {}", cell.id))),
                }
            })?;
            // The same content gives the same bytes.
            if cells.is_empty() { Err(c.error("no view cells: omit the section")) } else { Ok(cells) }
        })?;
        let cells = cells.unwrap_or_default();
        if cells.is_empty() {
            let stray = [SectionId::ViewRows, SectionId::ViewBounds, SectionId::ViewWitnesses];
            return match stray.into_iter().any(|id| self.container.section(id).is_some()) {
                true => Err(missing(SectionId::ViewCells)),
                false => Ok(Views::default()),
            };
        }
        let rows = self.matrix(SectionId::ViewRows, cells.len(), objects, budget)?;
        Ok(Views { cells, rows, bounds: None })
    }

    /// Bounds of view cells, and witnesses; both present or absent, and matching the rows' numbers of pairs.
    fn view_bounds(
        &self,
        Views { cells, rows, .. }: &Views,
        objects: usize,
        guarantee: Guarantee,
        budget: &mut Budget,
    ) -> Result<Option<ViewBounds>, Fault> {
        if cells.is_empty() {
            return Ok(None);
        }
        let bounds = match self.sides(SectionId::ViewBounds, cells.len(), objects, budget)? {
            None if self.container.section(SectionId::ViewWitnesses).is_some() => {
                return Err(missing(SectionId::ViewBounds));
            }
            None => None,
            Some([upper, lower]) => {
                let witnesses = self.section(SectionId::ViewWitnesses, budget, |c, b| {
                    let witnesses =
                        c.list(b, 48, |c, _| Ok([DVec3::from_array(c.f64s()?), DVec3::from_array(c.f64s()?)]))?;
                    match (witnesses.len() as u64, lower.count_ones()) {
                        (found, expected) if found == expected => Ok(witnesses),
                        (found, expected) => Err(c.error(format!("{found} witnesses, {expected} pairs in the lower set"))),
                    }
                })?;
                let witnesses = witnesses.ok_or_else(|| missing(SectionId::ViewWitnesses))?;
                Some(ViewBounds { lower, upper, witnesses })
            }
        };
        if let Some(bounds) = &bounds {
            let shipped = if guarantee == Guarantee::Conservative { &bounds.upper } else { &bounds.lower };
            let all = cells.len() as u64 * objects as u64;
            let [found, declared] = [rows.as_ref().map_or(all, BitMatrix::count_ones), shipped.count_ones()];
            if found != declared {
                let what = format!("{found} pairs, {declared} in the bounds");
                return Err(malformed(SectionId::ViewRows, what));
            }
        }
        Ok(bounds)
    }

    /// All three sections or none.
    fn bounds(&self, cells: usize, objects: usize, budget: &mut Budget) -> Result<Option<Bounds>, Fault> {
        let by_cell = self.sides(SectionId::CellBounds, cells, cells, budget)?;
        let by_object = self.sides(SectionId::ObjectBounds, cells, objects, budget)?;
        let has_witnesses = self.container.section(SectionId::Witnesses).is_some();
        let ([cells_upper, cells_lower], [objects_upper, objects_lower]) = match (by_cell, by_object) {
            (Some(by_cell), Some(by_object)) => (by_cell, by_object),
            (None, None) if !has_witnesses => return Ok(None),
            (None, _) => return Err(missing(SectionId::CellBounds)),
            _ => return Err(missing(SectionId::ObjectBounds)),
        };
        let witnesses = self.section(SectionId::Witnesses, budget, |c, b| {
            // In the order of the lower set's pairs.
            let mut pairs =
                (0..cells).flat_map(|cell| objects_lower.ones(cell).map(move |object| [cell as u32, object as u32]));
            let witnesses = c.list(b, 48, |c, _| {
                let Some([cell, object]) = pairs.next() else {
                    return Err(c.error("a witness without a pair in the lower set"));
                };
                let (from, to) = (DVec3::from_array(c.f64s()?), DVec3::from_array(c.f64s()?));
                Ok(Witness { cell: CellId(cell), object: ObjectId(object), from, to })
            })?;
            match pairs.next() {
                Some([cell, object]) => {
                    Err(c.error(format!("no witness for cell {cell}, object {object} of the lower set")))
                }
                None => Ok(witnesses),
            }
        })?;
        let witnesses = witnesses.ok_or_else(|| missing(SectionId::Witnesses))?;
        Ok(Some(Bounds { cells_lower, cells_upper, objects_lower, objects_upper, witnesses }))
    }
}

fn missing(section: SectionId) -> Fault {
    FileError::Missing { section }.into()
}

fn malformed(section: SectionId, what: String) -> Fault {
    FileError::Malformed { section, offset: 0, what }.into()
}

/// A plane with a unit normal.
fn plane(c: &mut Cursor<'_>) -> Result<Vec4, Fault> {
    let plane = Vec4::from_array(c.f32s()?);
    if (plane.truncate().length() - 1.0).abs() > NORMAL_LENGTH {
        return Err(c.error("a plane whose normal is not of length 1"));
    }
    Ok(plane)
}

fn cell(c: &mut Cursor<'_>, budget: &mut Budget) -> Result<FileCell, Fault> {
    Ok(FileCell { name: c.string()?, source: c.option()?, open: c.code(2, "a flag")? == 1, pieces: pieces(c, budget)? })
}

fn pieces(c: &mut Cursor<'_>, budget: &mut Budget) -> Result<Vec<Vec<Vec4>>, Fault> {
    c.list(budget, 4, |c, b| c.list(b, 16, |c, _| plane(c)))
}

fn portal(c: &mut Cursor<'_>, budget: &mut Budget, cells: usize) -> Result<FilePortal, Fault> {
    let from_to = [CellId(c.id(cells, "cell")?), CellId(c.id(cells, "cell")?)];
    if from_to[0] == from_to[1] {
        return Err(c.error(format!("a portal from cell {} to itself", from_to[0])));
    }
    let plane = plane(c)?;
    let kind = PORTAL_KINDS[c.code(PORTAL_KINDS.len(), "portal kind")?];
    let source = c.option()?;
    let winding = winding(c, budget)?;
    Ok(FilePortal { cells: from_to, plane, winding, kind, state: PortalState::of_kind(kind), source })
}

fn winding(c: &mut Cursor<'_>, budget: &mut Budget) -> Result<Vec<Vec3>, Fault> {
    let winding = c.list(budget, 12, |c, _| Ok(Vec3::from_array(c.f32s()?)))?;
    if winding.len() < 3 {
        return Err(c.error(format!("a winding of {} corners", winding.len())));
    }
    Ok(winding)
}

fn object(c: &mut Cursor<'_>) -> Result<FileObject, Fault> {
    let node = c.string()?;
    let triangles = c.u32()?;
    if triangles == 0 {
        return Err(c.error("an object without triangles"));
    }
    let bounds = [Vec3::from_array(c.f32s()?), Vec3::from_array(c.f32s()?)];
    if !bounds[0].cmple(bounds[1]).all() {
        return Err(c.error("a box with its least corner above its greatest"));
    }
    Ok(FileObject { node, triangles, bounds })
}

/// Checks that rows and bounds match the numbers of pairs in [`SectionId::Meta`].
fn check_pairs(file: &PvsFile) -> Result<(), Fault> {
    let (cells, objects) = (file.cells.len() as u64, file.objects.len() as u64);
    let pairs = &file.pairs;
    let shipped = match file.guarantee {
        Guarantee::Conservative => [pairs.cell_upper, pairs.upper],
        Guarantee::Sampled => [pairs.cell_lower, pairs.lower],
    };
    let all = |all: u64, shipped: u64| if file.is_one_hall() { shipped } else { all };
    let count = |rows: &Option<BitMatrix>, all: u64| rows.as_ref().map_or(all, BitMatrix::count_ones);
    let mut found = vec![
        (SectionId::CellRows, count(&file.cell_rows, all(cells * cells, shipped[0])), shipped[0]),
        (SectionId::ObjectRows, count(&file.object_rows, all(cells * objects, shipped[1])), shipped[1]),
    ];
    if let Some(bounds) = &file.bounds {
        found.extend([
            (SectionId::CellBounds, bounds.cells_upper.count_ones(), pairs.cell_upper),
            (SectionId::CellBounds, bounds.cells_lower.count_ones(), pairs.cell_lower),
            (SectionId::ObjectBounds, bounds.objects_upper.count_ones(), pairs.upper),
            (SectionId::ObjectBounds, bounds.objects_lower.count_ones(), pairs.lower),
        ]);
    }
    if let Some(gap) = &file.gap {
        found.push((SectionId::Gap, gap.all(), pairs.upper - pairs.lower));
        found.push((SectionId::Gap, gap.closed_upper.max(pairs.upper), pairs.upper));
    }
    match found.into_iter().find(|(_, found, declared)| found != declared) {
        Some((section, found, declared)) => Err(malformed(section, format!("{found} pairs, {declared} declared"))),
        None => Ok(()),
    }
}
