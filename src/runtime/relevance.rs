//! Who may see whom, for servers that send what is relevant and keep back the rest.
//!
//! A server knows where a player was, not where they are: until its answer has come, they have gone on, through the next door. So the row of a
//! cell here is the union of the rows of all cells that a body may reach from anywhere in it, within so many metres. A way into a cell is at
//! least as long as the gaps between the portals on it, from the first one; distances are those of boxes around portals, less the
//! tolerance of both. What a body sees on such a way it sees from a cell on it, and what that sees is in its row.

use super::culler::{Culler, PLACED, all_ones, bit, target};
use super::doors::Doors;
use super::locate::Span;
use crate::file::PvsFile;
use crate::{BitMatrix, CellId, DirectedPortal, ObjectId, PortalId};
use glam::Vec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

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
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(count.max(1));
        let mut parts: Vec<Vec<Row<'_>>> = (0..threads).map(|_| Vec::new()).collect();
        let rows = cells.rows_mut().into_iter().zip(objects.rows_mut());
        for (cell, (cells, objects)) in rows.enumerate() {
            parts[cell % threads].push(Row { cell: CellId(cell as u32), cells, objects });
        }
        std::thread::scope(|scope| {
            for part in parts {
                scope.spawn(move || {
                    let mut reach = Reach::for_culler(culler);
                    for row in part {
                        let reached = reach.of_cell(culler, doors, row.cell, metres);
                        row.fill(culler, reached);
                    }
                });
            }
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
    /// Whether something in some cells may be seen from some cells, by their rows. None means anywhere: then it may. For servers that know how
    /// far bodies go, [`View::within_metres`](super::View::within_metres) gives the cells where each may be by then: tighter than
    /// [`Relevance::may_see`], which takes a body to start anywhere in its cell, and some microseconds for each body.
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

fn around(culler: &Culler, portal: PortalId) -> [Vec3; 2] {
    let corners = culler.portal_corners.get(portal.index()).iter();
    corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)])
}

/// Cells within a distance, by E. W. Dijkstra's shortest paths (1959) from portal to portal.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    /// By directed portal: the shortest known way to it, metres.
    known: Vec<f64>,
    touched: Vec<DirectedPortal>,
    is_reached: Vec<u64>,
    reached: Vec<CellId>,
    /// Bits of a length, which sort like it, and a directed portal.
    queue: BinaryHeap<Reverse<(u64, DirectedPortal)>>,
}

impl Reach {
    pub fn for_culler(culler: &Culler) -> Self {
        Self {
            known: vec![f64::INFINITY; 2 * culler.portal_count()],
            touched: Vec::new(),
            is_reached: vec![0; culler.cell_count().div_ceil(64)],
            reached: Vec::with_capacity(culler.cell_count()),
            queue: BinaryHeap::new(),
        }
    }

    /// The cells that a body may get into from anywhere in a cell.
    fn of_cell(&mut self, culler: &Culler, doors: &Doors, cell: CellId, metres: f64) -> &[CellId] {
        self.begin();
        self.enter(cell);
        for &portal in culler.cell_portals.get(cell.index()) {
            self.offer(doors, portal, 0.0, metres);
        }
        self.go_on(culler, doors, metres)
    }

    /// The cells that a body may get into from anywhere in a box. None: it is in no cell.
    pub fn of_box(&mut self, culler: &Culler, doors: &Doors, bounds: [Vec3; 2], metres: f64) -> &[CellId] {
        self.begin();
        culler.locator.met_by(&Span::new(bounds), PLACED * culler.tolerance, &mut |_, cell| self.enter(cell));
        for i in 0..self.reached.len() {
            for &portal in culler.cell_portals.get(self.reached[i].index()) {
                self.offer(doors, portal, gap(culler, bounds, portal), metres);
            }
        }
        self.go_on(culler, doors, metres)
    }

    fn begin(&mut self) {
        self.touched.drain(..).for_each(|portal| self.known[portal.0 as usize] = f64::INFINITY);
        self.reached.drain(..).for_each(|cell| self.is_reached[cell.index() / 64] = 0);
        self.queue.clear();
    }

    fn go_on(&mut self, culler: &Culler, doors: &Doors, metres: f64) -> &[CellId] {
        while let Some(Reverse((bits, portal))) = self.queue.pop() {
            let length = f64::from_bits(bits);
            if length <= self.known[portal.0 as usize] {
                let (cell, bounds) = (target(culler, portal), around(culler, portal.portal()));
                self.enter(cell);
                for &next in culler.cell_portals.get(cell.index()) {
                    self.offer(doors, next, length + gap(culler, bounds, next), metres);
                }
            }
        }
        &self.reached
    }

    fn enter(&mut self, cell: CellId) {
        if !bit(&self.is_reached, cell.index()) {
            self.is_reached[cell.index() / 64] |= 1 << (cell.index() % 64);
            self.reached.push(cell);
        }
    }

    fn offer(&mut self, doors: &Doors, portal: DirectedPortal, length: f64, metres: f64) {
        let known = &mut self.known[portal.0 as usize];
        if doors.is_open(portal) && length <= metres && length < *known {
            *known = length;
            self.touched.push(portal);
            self.queue.push(Reverse((length.to_bits(), portal)));
        }
    }
}

/// What a body takes at least from a box to a portal, metres.
fn gap(culler: &Culler, a: [Vec3; 2], portal: DirectedPortal) -> f64 {
    let b = around(culler, portal.portal());
    let gap = (a[0] - b[1]).max(b[0] - a[1]).max(Vec3::ZERO).as_dvec3().length();
    (gap - 2.0 * culler.tolerance).max(0.0)
}
