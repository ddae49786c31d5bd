//! Arbitrary graphs out of arbitrary bytes, for what works on ready portals.
//!
//! A byte for the number of cells, then portals: two bytes of cells, a byte of shape, and corners. Half of the shapes are rectangles in
//! a lattice, so that lines pass; others are anything: coincident, collinear and reversed corners, areas of zero, corners off their
//! plane, 1e-6 beside 1e6.

use enfilade::cells::{Cell, CellGraph, Portal, PortalKind, PortalState, validate};
use enfilade::job::Job;
use enfilade::math::geom::{Plane, middle, newell};
use enfilade::pvs::flow::flow;
use enfilade::{BitMatrix, CellId};
use enfilade_levels::{Level, LevelPortal, VisOptions, vis};
use glam::DVec3;
use testing::grid;

/// Most portals of a graph, so that one case ends soon.
const MOST: usize = 24;

/// Numbers that geometry goes wrong with.
const NASTY: [f64; 8] = [0.0, -0.0, 1e-12, 1e-6, 0.1, 1e6, 1e9, f64::EPSILON];

struct Bytes<'a>(std::slice::Iter<'a, u8>);

impl Bytes<'_> {
    fn next(&mut self) -> Option<u8> {
        self.0.next().copied()
    }

    /// A whole number of eighths, or one of [`NASTY`].
    fn number(&mut self) -> Option<f64> {
        let byte = self.next()?;
        Some(if byte < 240 { f64::from(byte) / 8.0 - 15.0 } else { NASTY[usize::from(byte % 8)] })
    }

    fn point(&mut self) -> Option<DVec3> {
        Some(DVec3::new(self.number()?, self.number()?, self.number()?))
    }

    fn winding(&mut self) -> Option<Vec<DVec3>> {
        let shape = self.next()?;
        if shape < 128 {
            let (axis, at, low, size) = (usize::from(shape % 3), self.number()?, self.point()?, self.point()?.abs());
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(a, b)| {
                let mut corner = low;
                corner[axis] = at;
                corner[u] += a * size[u];
                corner[v] += b * size[v];
                corner
            });
            return Some(corners.to_vec());
        }
        (0..3 + shape % 6).map(|_| self.point()).collect()
    }

    fn level(mut self) -> Option<Level> {
        let cells = 2 + usize::from(self.next()? % 10);
        let mut portals = Vec::new();
        while let Some(portal) = self.portal(cells).filter(|_| portals.len() < MOST) {
            portals.push(portal);
        }
        Some(Level { cells, portals, rounding: 0.0 })
    }

    fn portal(&mut self, cells: usize) -> Option<LevelPortal> {
        let (from, step) = (usize::from(self.next()?), usize::from(self.next()?));
        let from = from % cells;
        let to = (from + 1 + step % (cells - 1)) % cells;
        Some(LevelPortal { cells: [from as u32, to as u32], winding: self.winding()? })
    }
}

/// Both sides of a level; false where the bytes hold no portal.
pub fn level(bytes: &[u8]) -> bool {
    let Some(level) = Bytes(bytes.iter()).level().filter(|l| !l.portals.is_empty()) else { return false };
    let options = VisOptions { steps: 2_000, lines: 4, ..VisOptions::default() };
    let found = vis(&level, &options, None, &Job::quiet()).expect("cells in range");
    assert_eq!(found.lower.first_outside(&found.upper), None);
    for cell in 0..level.cells {
        assert!(found.lower.get(cell, cell));
        assert!((0..level.cells).all(|other| found.upper.get(cell, other) == found.upper.get(other, cell)));
    }
    assert!(found.lines.iter().flat_map(|l| l.cells).all(|c| (c as usize) < level.cells));
    true
}

/// The same portals as a graph of cells without pieces: judged, then flown through.
pub fn cells(bytes: &[u8]) -> bool {
    let Some(level) = Bytes(bytes.iter()).level().filter(|l| !l.portals.is_empty()) else { return false };
    let portal = |p: LevelPortal| {
        let at = middle(&p.winding);
        let relative: Vec<DVec3> = p.winding.iter().map(|&q| q - at).collect();
        Portal {
            cells: p.cells.map(CellId),
            plane: Plane::through(at, newell(&relative).normalize_or_zero()),
            winding: p.winding,
            kind: PortalKind::Opening,
            state: PortalState::default(),
            source: None,
        }
    };
    let graph = grid::graph(vec![Cell::default(); level.cells], level.portals.into_iter().map(portal).collect());
    drop(validate::structure(&graph, 1e-6));
    flown(&graph);
    true
}

/// The upper bound of a graph, in a few steps: neighbours see each other, and the rows have their shape.
pub fn flown(graph: &CellGraph) {
    let n = graph.cells.len();
    let none = BitMatrix::new(n, 0);
    let found = flow(&grid::input(graph, &none, &[], [&BitMatrix::new(n, n), &none], 2_000), &Job::quiet())
        .expect("nobody stops it");
    assert_eq!((found.cells_upper.rows(), found.cells_upper.columns()), (n, n));
    for cell in 0..n {
        assert!(found.cells_upper.get(cell, cell));
    }
}
