//! Who may see whom, for servers that send what is relevant and keep back the rest.
//!
//! A server knows where a player was, not where they are: until its answer has come, they have gone on, through the next door. So the row of a
//! cell here is the union of the rows of all cells that a body may reach from anywhere in it, within so many metres. A way through a portal is at
//! least as long as the gaps between the portals on it, from the first one, and as the gap between that and the portal; distances are those of
//! boxes around portals, less the tolerance of both. What a body sees on such a way it sees from a cell on it, and what that sees is in its row.

use super::culler::{Culler, PLACED, all_ones, bit, target};
use super::doors::Doors;
use super::locate::Span;
use super::scratch::Queue;
use crate::file::PvsFile;
use crate::math::parallel;
use crate::{BitMatrix, CellId, DirectedPortal, ObjectId};
use glam::Vec3;

/// For each cell: the cells and objects that may be seen from where a body in it may soon be.
#[derive(Clone, PartialEq, Debug)]
pub struct Relevance {
    metres: f64,
    cells: BitMatrix,
    objects: BitMatrix,
}

impl Relevance {
    /// The rows of bodies that go so many metres at most (0 or more; infinite will do), through portals that are open in `doors`, worked out
    /// on all cores. [`Doors::passable`] shuts windows alone, [`Doors::as_found`] doors that are shut in the model, too. What is seen goes
    /// through any door.
    ///
    /// # Panics
    ///
    /// If the doors are of a culler with another number of portals.
    pub fn new(culler: &Culler, metres: f64, doors: &Doors) -> Self {
        doors.assert_of(culler);
        let count = culler.cell_count();
        let (mut cells, mut objects) = (BitMatrix::new(count, count), BitMatrix::new(count, culler.object_count()));
        let rows = (0..).map(CellId).zip(cells.rows_mut().into_iter().zip(objects.rows_mut()));
        let rows = rows.map(|(cell, (cells, objects))| Row { cell, cells, objects });
        parallel::deal(rows, &|| Reach::for_culler(culler), &|row, reach| {
            let reached = reach.of_cell(culler, doors, row.cell, metres);
            row.fill(culler, reached);
        });
        Self { metres, cells, objects }
    }

    /// The rows of a file, if it has any (`bake --relevance`).
    pub fn of_file(file: &PvsFile) -> Option<Self> {
        let rows = file.relevance.as_ref()?;
        Some(Self { metres: rows.metres, cells: rows.cells.clone(), objects: rows.objects.clone() })
    }

    /// How far a body goes, metres.
    pub fn metres(&self) -> f64 {
        self.metres
    }

    /// Cells x cells.
    pub fn cells(&self) -> &BitMatrix {
        &self.cells
    }

    /// Cells x objects.
    pub fn objects(&self) -> &BitMatrix {
        &self.objects
    }

    /// Whether somebody with their eyes in one box, or as far from it as bodies go, may see something of another box, by the cells that the
    /// boxes meet ([`Movers::cells`](super::Movers::cells)). None means anywhere: then they may. Never false if they do; what goes on itself
    /// has a box that is larger by its way.
    ///
    /// # Panics
    ///
    /// If there is no such cell.
    #[inline]
    pub fn may_see(&self, from: &[CellId], to: &[CellId]) -> bool {
        may_see(|from| Some(self.cells.row(from.index())), from, to)
    }

    /// Whether somebody there may see something of an object: as [`Relevance::may_see`].
    ///
    /// # Panics
    ///
    /// If there is no such cell or object.
    #[inline]
    pub fn may_see_object(&self, from: &[CellId], object: ObjectId) -> bool {
        from.is_empty() || from.iter().any(|from| self.objects.get(from.index(), object.index()))
    }
}

impl Culler {
    /// Whether something in some cells may be seen from some cells, by their rows. None means anywhere: then it may.
    ///
    /// For servers this is the way to ask: [`View::within_metres`](super::View::within_metres) gives the cells where each body may be by then, once a
    /// tick, in two or three microseconds, and a pair of bodies takes some ten nanoseconds. It keeps back more than [`Relevance::may_see`],
    /// which takes a body to start anywhere in its cell, and is for servers that know no more than the cells.
    ///
    /// # Panics
    ///
    /// If there is no such cell.
    #[inline]
    pub fn may_see(&self, from: &[CellId], to: &[CellId]) -> bool {
        may_see(|from| self.cell_row(from).filter(|_| self.cell_rows_prune), from, to)
    }
}

#[inline]
fn may_see<'r>(row: impl Fn(CellId) -> Option<&'r [u64]>, from: &[CellId], to: &[CellId]) -> bool {
    let sees = |&from: &CellId| row(from).is_none_or(|row| to.iter().any(|to| bit(row, to.index())));
    from.is_empty() || to.is_empty() || from.iter().any(sees)
}

/// A row to be filled.
struct Row<'r> {
    cell: CellId,
    cells: &'r mut [u64],
    objects: &'r mut [u64],
}

impl Row<'_> {
    /// Joins the rows of some cells.
    fn fill(self, culler: &Culler, reached: &[CellId]) {
        for &cell in reached {
            let seen = culler.cell_row(cell).filter(|_| culler.cell_rows_prune);
            join(self.cells, seen, culler.cell_count());
            join(self.objects, culler.object_row(cell), culler.object_count());
        }
    }
}

fn join(out: &mut [u64], row: Option<&[u64]>, columns: usize) {
    match row {
        Some(row) => out.iter_mut().zip(row).for_each(|(out, row)| *out |= row),
        None => out.iter_mut().enumerate().for_each(|(word, out)| *out = all_ones(columns, word)),
    }
}

/// Cells within a distance: shortest ways from portal to portal, corrected until none gets shorter (R. Bellman, *On a routing problem*, 1958).
#[derive(Clone, Debug)]
pub(super) struct Reach {
    /// By portal: the box around it.
    boxes: Vec<[Vec3; 2]>,
    /// By directed portal: the shortest known way to it, metres.
    known: Vec<f64>,
    touched: Vec<DirectedPortal>,
    queue: Queue,
    is_queued: Vec<bool>,
    is_reached: Vec<u64>,
    reached: Vec<CellId>,
}

/// Where ways start, and how far they go.
#[derive(Clone, Copy)]
struct Start<'d> {
    doors: &'d Doors,
    bounds: [Vec3; 2],
    metres: f64,
}

impl Reach {
    pub fn for_culler(culler: &Culler) -> Self {
        let around = |portal: usize| {
            let corners = culler.portal_corners.get(portal).iter();
            corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)])
        };
        let directed = 2 * culler.portal_count();
        Self {
            boxes: (0..culler.portal_count()).map(around).collect(),
            known: vec![f64::INFINITY; directed],
            touched: Vec::with_capacity(directed),
            queue: Queue::of(directed),
            is_queued: vec![false; directed],
            is_reached: vec![0; culler.cell_count().div_ceil(64)],
            reached: Vec::with_capacity(culler.cell_count()),
        }
    }

    /// The cells that a body may get into from anywhere in a cell.
    fn of_cell(&mut self, culler: &Culler, doors: &Doors, cell: CellId, metres: f64) -> &[CellId] {
        self.begin();
        self.enter(cell);
        for &portal in culler.cell_portals.get(cell.index()) {
            if self.reached.len() == culler.cell_count() {
                break;
            }
            // Without an end, all beyond a cell is reached with it.
            if metres.is_finite() || !bit(&self.is_reached, target(culler, portal).index()) {
                let start = Start { doors, bounds: self.boxes[portal.portal().index()], metres };
                self.offer(culler, portal, 0.0, start);
                self.go_on(culler, start);
            }
        }
        &self.reached
    }

    /// The cells that a body may get into from anywhere in a box. None: it is in no cell.
    pub fn of_box(&mut self, culler: &Culler, doors: &Doors, bounds: [Vec3; 2], metres: f64) -> &[CellId] {
        self.begin();
        culler.locator.met_by(&Span::new(bounds), PLACED * culler.tolerance, &mut |_, cell| self.enter(cell));
        let start = Start { doors, bounds, metres };
        for i in 0..self.reached.len() {
            for &portal in culler.cell_portals.get(self.reached[i].index()) {
                self.offer(culler, portal, 0.0, start);
            }
        }
        self.go_on(culler, start);
        &self.reached
    }

    fn begin(&mut self) {
        self.reached.drain(..).for_each(|cell| self.is_reached[cell.index() / 64] = 0);
    }

    fn go_on(&mut self, culler: &Culler, start: Start<'_>) {
        while let Some(portal) = self.queue.pop() {
            self.is_queued[portal.0 as usize] = false;
            let (cell, length) = (target(culler, portal), self.known[portal.0 as usize]);
            self.enter(cell);
            for &next in culler.cell_portals.get(cell.index()) {
                let [here, there] = [portal, next].map(|portal| self.boxes[portal.portal().index()]);
                self.offer(culler, next, length + gap(culler, here, there), start);
            }
        }
        self.touched.drain(..).for_each(|portal| self.known[portal.0 as usize] = f64::INFINITY);
    }

    fn enter(&mut self, cell: CellId) {
        if !bit(&self.is_reached, cell.index()) {
            self.is_reached[cell.index() / 64] |= 1 << (cell.index() % 64);
            self.reached.push(cell);
        }
    }

    /// There is a way to a portal that is no shorter than `length` metres.
    fn offer(&mut self, culler: &Culler, portal: DirectedPortal, length: f64, start: Start<'_>) {
        let index = portal.0 as usize;
        if !start.doors.is_open(portal) || length > start.metres || length >= self.known[index] {
            return;
        }
        // Without an end, lengths don't matter.
        let is_near = start.metres.is_finite();
        let length = if is_near { length.max(gap(culler, start.bounds, self.boxes[portal.portal().index()])) } else { 0.0 };
        if length <= start.metres && length < self.known[index] {
            if self.known[index].is_infinite() {
                self.touched.push(portal);
            }
            self.known[index] = length;
            if !std::mem::replace(&mut self.is_queued[index], true) {
                self.queue.push(portal);
            }
        }
    }
}

/// What a body takes at least from a box to another, metres.
fn gap(culler: &Culler, a: [Vec3; 2], b: [Vec3; 2]) -> f64 {
    let gap = (a[0] - b[1]).max(b[0] - a[1]).max(Vec3::ZERO).as_dvec3().length();
    (gap - 2.0 * culler.tolerance).max(0.0)
}
