//! Point location: the cell of a point, the pieces that a box or a segment meets.

use super::CellGraph;
use crate::CellId;
use crate::math::box_tree::BoxTree;
use crate::math::geom::Aabb;
use glam::DVec3;

/// A small tree over every bounded piece, and a list of the unbounded ones.
pub struct Locator<'g> {
    graph: &'g CellGraph,
    /// Cell and number within the cell of every piece, ascending.
    pieces: Vec<(CellId, u32)>,
    tree: BoxTree,
    unbounded: Vec<u32>,
    slack: f64,
}

/// The part of a segment in one piece.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stretch {
    /// Entry and exit, as fractions of the segment.
    pub span: [f64; 2],
    /// The cell.
    pub cell: CellId,
    /// The piece of the cell.
    pub piece: usize,
}

impl<'g> Locator<'g> {
    /// A point this far outside a piece, in parts of [`CellGraph::smallest_hole`], may still count as inside: planes of one wall may differ
    /// by a twelfth.
    pub const SLACK: f64 = 0.125;
    /// Builds the tree.
    pub fn new(graph: &'g CellGraph) -> Self {
        let pieces: Vec<(CellId, u32)> = (0u32..)
            .zip(&graph.cells)
            .flat_map(|(c, cell)| (0..cell.pieces.len() as u32).map(move |i| (CellId(c), i)))
            .collect();
        let boxes: Vec<Aabb> = graph.cells.iter().flat_map(|c| c.pieces.iter().map(|p| p.bounds)).collect();
        let (bounded, unbounded) = (0..boxes.len() as u32).partition(|&i| {
            let b = boxes[i as usize];
            b.min.is_finite() && b.max.is_finite()
        });
        let slack = Self::SLACK * graph.smallest_hole;
        Self { graph, pieces, tree: BoxTree::new(&boxes, bounded), unbounded, slack }
    }

    /// The cell and piece that contain `p`. A point on a boundary belongs to the first piece that it touches (least cell, then least
    /// piece). Rounding may separate two adjacent pieces; a point between them, within [`Locator::SLACK`] of one, belongs to the nearest.
    /// `None`: in no cell, or not a number.
    pub fn locate(&self, p: DVec3) -> Option<(CellId, usize)> {
        let (cell, piece) = self.pieces[self.nearest(p, self.slack)?.1 as usize];
        Some((cell, piece as usize))
    }

    /// The nearest piece within `slack` metres of `p`, and its distance; the distance is 0 if it contains `p`, and the first such piece
    /// wins.
    fn nearest(&self, p: DVec3, slack: f64) -> Option<(f64, u32)> {
        if !p.is_finite() {
            return None;
        }
        let eps = boundary(p);
        let slack = slack.max(eps);
        let mut best: Option<(f64, u32)> = None;
        let mut try_piece = |i: u32| {
            let (cell, piece) = self.pieces[i as usize];
            let planes = &self.graph.cells[cell.index()].pieces[piece as usize].planes;
            let off = planes.iter().map(|plane| plane.distance(p)).fold(0.0, f64::max);
            let off = if off <= eps { 0.0 } else { off };
            if off <= slack && best.is_none_or(|b| (off, i) < b) {
                best = Some((off, i));
            }
        };
        self.unbounded.iter().for_each(|&i| try_piece(i));
        self.tree.in_box(&Aabb { min: p, max: p }.inflated(slack), &mut try_piece);
        best
    }

    /// True if `p` is in the cell, boundary included, to within a few roundings.
    pub fn holds(&self, cell: CellId, p: DVec3) -> bool {
        self.nearest(p, 0.0).is_some_and(|(_, i)| self.pieces[i as usize].0 == cell)
            || self.graph.cells[cell.index()].pieces.iter().any(|piece| piece.contains(p, boundary(p)))
    }

    /// Visits every piece whose box meets `bounds`, in a fixed order; every unbounded piece is visited.
    pub fn pieces_in_box(&self, bounds: &Aabb, mut visit: impl FnMut(CellId, usize)) {
        let mut visit = |i: u32| {
            let (cell, piece) = self.pieces[i as usize];
            visit(cell, piece as usize);
        };
        self.unbounded.iter().for_each(|&i| visit(i));
        self.tree.in_box(bounds, &mut visit);
    }

    /// The pieces along the segment from `a` to `b`, in the order of entry. Planes are moved out by `eps` metres, so stretches of touching
    /// pieces overlap a little.
    pub fn along(&self, a: DVec3, b: DVec3, eps: f64) -> Vec<Stretch> {
        let mut out = Vec::new();
        let mut clip = |i: u32| {
            let (cell, piece) = (self.pieces[i as usize].0, self.pieces[i as usize].1 as usize);
            let (mut near, mut far) = (0.0f64, 1.0f64);
            for plane in &self.graph.cells[cell.index()].pieces[piece].planes {
                let (da, db) = (plane.distance(a) - eps, plane.distance(b) - eps);
                match (da > 0.0, db > 0.0) {
                    (true, true) => return,
                    (true, false) => near = near.max(da / (da - db)),
                    (false, true) => far = far.min(da / (da - db)),
                    (false, false) => {}
                }
            }
            if near <= far {
                out.push(Stretch { span: [near, far], cell, piece });
            }
        };
        self.unbounded.iter().for_each(|&i| clip(i));
        self.tree.on_ray(a, b - a, 1.0, eps, &mut clip);
        out.sort_by(|x, y| {
            let by_span = x.span[0].total_cmp(&y.span[0]).then(x.span[1].total_cmp(&y.span[1]));
            by_span.then((x.cell, x.piece).cmp(&(y.cell, y.piece)))
        });
        out
    }
}

/// Tolerance of a point on a plane, metres: a few roundings of its coordinates.
fn boundary(p: DVec3) -> f64 {
    1e-13 * (1.0 + p.abs().max_element())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::{Cell, Piece};
    use crate::math::geom::Plane;

    fn slab(min: f64, max: f64) -> Piece {
        let planes = vec![Plane { n: DVec3::X, d: max }, Plane { n: -DVec3::X, d: -min }];
        let (lo, hi) =
            (DVec3::new(min, f64::NEG_INFINITY, f64::NEG_INFINITY), DVec3::new(max, f64::INFINITY, f64::INFINITY));
        Piece { planes, bounds: Aabb { min: lo, max: hi } }
    }

    fn cube(at: f64) -> Piece {
        let bounds = Aabb { min: DVec3::new(at, 0.0, 0.0), max: DVec3::new(at + 1.0, 1.0, 1.0) };
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let planes = axes.iter().flat_map(|&n| [Plane { n, d: n.dot(bounds.max) }, Plane { n: -n, d: -n.dot(bounds.min) }]);
        Piece { planes: planes.collect(), bounds }
    }

    fn graph(cells: Vec<Vec<Piece>>) -> CellGraph {
        let cells = cells.into_iter().map(|pieces| Cell { pieces, ..Cell::default() }).collect();
        CellGraph::given(cells, Vec::new())
    }

    #[test]
    fn a_row_of_cubes_and_an_unbounded_slab() {
        let graph = graph((0..50).map(|i| vec![cube(f64::from(i))]).chain([vec![slab(60.0, f64::INFINITY)]]).collect());
        let locator = Locator::new(&graph);
        let at = |x: f64, y: f64| locator.locate(DVec3::new(x, y, 0.5)).map(|(c, _)| c.0);
        assert_eq!(at(7.5, 0.5), Some(7));
        assert_eq!(at(7.0, 0.5), Some(6), "on a boundary: the least of the two");
        assert_eq!(at(7.5, 1.5), None);
        assert_eq!(at(1e9, -4.0), Some(50));
        let p = DVec3::new(9.0, 0.5, 0.5);
        for nowhere in [DVec3::NAN, DVec3::new(f64::INFINITY, 0.5, 0.5), DVec3::splat(f64::NEG_INFINITY)] {
            assert_eq!(locator.locate(nowhere), None);
        }
        assert!(locator.holds(CellId(8), p) && locator.holds(CellId(9), p) && !locator.holds(CellId(10), p));
    }

    #[test]
    fn a_segment_lists_the_pieces_in_order() {
        let graph = graph((0..50).map(|i| vec![cube(f64::from(49 - i))]).collect());
        let (a, b) = (DVec3::new(2.5, 0.5, 0.5), DVec3::new(6.5, 0.25, 0.75));
        let stretches = Locator::new(&graph).along(a, b, 0.0);
        assert_eq!(stretches.iter().map(|s| s.cell.0).collect::<Vec<_>>(), [47, 46, 45, 44, 43]);
        assert!((stretches[1].span[0] - 0.125).abs() < 1e-12 && (stretches[1].span[1] - 0.375).abs() < 1e-12);
    }

    #[test]
    fn the_tree_finds_what_a_loop_over_all_boxes_finds() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut point = |scale: f64| DVec3::new(random(), random(), random()) * scale;
        let boxes: Vec<Aabb> = (0..500).map(|_| point(10.0)).map(|p| Aabb { min: p, max: p }).collect();
        let boxes: Vec<Aabb> = boxes.into_iter().map(|b| Aabb { max: b.max + point(1.0), ..b }).collect();
        let tree = BoxTree::new(&boxes, (0..500).collect());
        for _ in 0..200 {
            let (p, q) = (point(10.0), point(10.0));
            let query = Aabb { min: p.min(q), max: p.max(q) };
            let mut found = Vec::new();
            tree.in_box(&query, &mut |i| found.push(i));
            found.sort_unstable();
            assert_eq!(found, (0..500).filter(|&i| boxes[i as usize].touches(&query)).collect::<Vec<_>>());
            // Along the segment: every box that contains one of its points.
            let mut found = Vec::new();
            tree.on_ray(p, q - p, 1.0, 1e-9, &mut |i| found.push(i));
            for step in 0..=100 {
                let x = p + (q - p) * (f64::from(step) / 100.0);
                assert!((0..500u32).all(|i| !boxes[i as usize].contains(x) || found.contains(&i)));
            }
        }
    }
}
