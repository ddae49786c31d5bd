//! Finds the eye's cells: first the piece of the last frame, then a grid of pieces, and a tree of the large ones. Of an unbounded piece the tree
//! has what is in a cube around the model; beyond the cube, all unbounded pieces are looked at.
//!
//! A point within the tolerance of several cells is in all of them. So the rows do not depend on rounding or on previous frames.

use crate::CellId;
use crate::math::box_grid::BoxGrid;
use crate::math::box_tree::BoxTree;
use crate::math::geom::{Aabb, Plane};
use crate::math::polyhedron::face;
use glam::{DVec3, Vec3, Vec4};

/// Most cells at one point; with more, the caller takes everything in the frustum.
pub(super) const MOST_HOMES: usize = 8;

/// The cells (or view cells) that contain the eye, to within the tolerance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Homes<Id = CellId> {
    cells: [Id; MOST_HOMES],
    len: usize,
    /// Whether there are more cells than fit.
    pub overflow: bool,
}

impl<Id: Copy + Default + PartialEq> Homes<Id> {
    pub fn none() -> Self {
        Self { cells: [Id::default(); MOST_HOMES], len: 0, overflow: false }
    }

    pub fn one(cell: Id) -> Self {
        Self { cells: [cell; MOST_HOMES], len: 1, overflow: false }
    }

    #[inline]
    pub fn as_slice(&self) -> &[Id] {
        &self.cells[..self.len]
    }

    fn add(&mut self, cell: Id) {
        if self.as_slice().contains(&cell) {
        } else if self.len < MOST_HOMES {
            self.cells[self.len] = cell;
            self.len += 1;
        } else {
            self.overflow = true;
        }
    }
}

/// Half a side of the cube in which unbounded pieces are in the tree, in largest distances of the model from the origin: at most 2, where
/// [`piece_bounds`] ends. Larger: nothing, for boxes of pieces that overlap less. Smaller: what moves around the building is looked for slowly.
const REACH: f64 = 1.5;

/// A box, for tests against planes.
pub(super) struct Span {
    bounds: Aabb,
    centre: DVec3,
    half: DVec3,
}

impl Span {
    pub fn new(bounds: [Vec3; 2]) -> Self {
        let [min, max] = bounds.map(|p| p.as_dvec3());
        Self { bounds: Aabb { min, max }, centre: (min + max) * 0.5, half: (max - min) * 0.5 }
    }

    /// The least and the greatest distance of the box outside a plane, metres; NaN for an infinite box.
    fn ends(&self, plane: &Vec4) -> [f64; 2] {
        let n = plane.truncate().as_dvec3();
        let (middle, reach) = (n.dot(self.centre) - f64::from(plane.w), n.abs().dot(self.half));
        [middle - reach, middle + reach]
    }
}

/// Every piece of every cell, or of every view cell.
#[derive(Clone, Debug)]
pub(super) struct Locator<Id = CellId> {
    /// Planes of all pieces, concatenated.
    planes: Vec<Vec4>,
    /// Start of each piece's planes, and the end of the last.
    starts: Vec<u32>,
    cells: Vec<Id>,
    /// Bounded pieces.
    grid: BoxGrid,
    /// Those that are too large for the grid, and what unbounded ones have in `cube`.
    tree: BoxTree,
    cube: Aabb,
    unbounded: Vec<u32>,
    /// Unbounded pieces in no tree.
    unknown: Vec<u32>,
}

impl<Id: Copy + Default + PartialEq> Locator<Id> {
    /// A locator for cells, each with its pieces as lists of planes; `extent`: largest distance of a bounded piece from the origin along
    /// any axis, metres.
    pub fn new<'c>(cells: impl IntoIterator<Item = (Id, &'c [Vec<Vec4>])>, extent: f64, tolerance: f64) -> Self {
        let (mut planes_of, mut starts, mut cells_of) = (Vec::new(), vec![0], Vec::new());
        let (mut boxes, mut bounded, mut unbounded) = (Vec::new(), Vec::new(), Vec::new());
        let (mut within, mut unknown) = (Vec::new(), Vec::new());
        let reach = (REACH * extent) as f32;
        for (cell, pieces) in cells {
            for planes in pieces {
                let piece = cells_of.len() as u32;
                cells_of.push(cell);
                planes_of.extend(planes);
                starts.push(planes_of.len() as u32);
                let whole = piece_bounds(planes, extent);
                let bounds = whole.or_else(|| piece_bounds(&cut(planes, reach), extent));
                if whole.is_none() {
                    unbounded.push(piece);
                }
                match (whole, bounds) {
                    (Some(_), _) => bounded.push(piece),
                    (None, Some(_)) => within.push(piece),
                    (None, None) => unknown.push(piece),
                }
                boxes.push(bounds.unwrap_or(Aabb::EMPTY).inflated(tolerance));
            }
        }
        let (grid, large) = BoxGrid::new(&boxes, &bounded);
        within.extend(large);
        let tree = BoxTree::new(&boxes, within);
        // What is near to a point of it is within, too.
        let inner = DVec3::splat(f64::from(reach) - 2.0 * tolerance);
        let cube = Aabb { min: -inner, max: inner };
        Self { planes: planes_of, starts, cells: cells_of, grid, tree, cube, unbounded, unknown }
    }

    /// Visits the pieces whose boxes touch a box, all that may meet it among them; some twice.
    fn near(&self, bounds: &Aabb, visit: &mut impl FnMut(u32)) {
        self.grid.in_box(bounds, visit);
        self.tree.in_box(bounds, visit);
        let is_within = self.cube.min.cmple(bounds.min).all() && bounds.max.cmple(self.cube.max).all();
        if is_within { &self.unknown } else { &self.unbounded }.iter().copied().for_each(visit);
    }

    /// The largest distance of `p` outside the piece's planes, metres; negative inside.
    fn outside(&self, piece: u32, p: DVec3) -> f64 {
        self.planes_of(piece)
            .iter()
            .map(|plane| plane.truncate().as_dvec3().dot(p) - f64::from(plane.w))
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// The cell of a piece that holds a box by more than `margin` metres.
    pub fn cell_around(&self, piece: u32, span: &Span, margin: f64) -> Option<Id> {
        let cell = *self.cells.get(piece as usize)?;
        self.planes_of(piece).iter().all(|plane| span.ends(plane)[1] < -margin).then_some(cell)
    }

    /// Visits the pieces that a box may meet, some twice, to within `margin` metres, with their cells.
    pub fn met_by(&self, span: &Span, margin: f64, visit: &mut impl FnMut(u32, Id)) {
        let mut test = |piece: u32| {
            // NaN counts as met.
            if !self.planes_of(piece).iter().any(|plane| span.ends(plane)[0] > margin) {
                visit(piece, self.cells[piece as usize]);
            }
        };
        self.near(&span.bounds.inflated(margin), &mut test);
    }

    #[inline]
    fn planes_of(&self, piece: u32) -> &[Vec4] {
        &self.planes[self.starts[piece as usize] as usize..self.starts[piece as usize + 1] as usize]
    }

    /// The cell of a piece, if there is one and it holds `p` by more than `margin` metres.
    #[inline]
    pub fn well_inside(&self, piece: u32, p: DVec3, margin: f64) -> Option<Id> {
        let cell = *self.cells.get(piece as usize)?;
        (self.outside(piece, p) < -margin).then_some(cell)
    }

    /// The cells within `tolerance` metres of `p`. The search starts at `last_piece`, which is then set to a piece that contains `p`.
    pub fn locate(&self, p: Vec3, tolerance: f64, last_piece: &mut u32) -> Homes<Id> {
        let mut homes = Homes::none();
        if !p.is_finite() {
            return homes;
        }
        let point = p.as_dvec3();
        // Pieces of cells are disjoint, so no other is near; of overlapping view cells, one is enough.
        if let Some(cell) = self.well_inside(*last_piece, point, 2.0 * tolerance) {
            return Homes::one(cell);
        }
        let mut deepest = f64::INFINITY;
        let mut visit = |piece: u32| {
            let outside = self.outside(piece, point);
            if outside <= tolerance {
                homes.add(self.cells[piece as usize]);
                if outside < deepest {
                    deepest = outside;
                    *last_piece = piece;
                    // The cell with the point deepest inside comes first.
                    let at = homes.as_slice().iter().position(|&c| c == self.cells[piece as usize]);
                    homes.cells.swap(0, at.unwrap_or(0));
                }
            }
        };
        self.near(&Aabb { min: point, max: point }, &mut visit);
        homes
    }
}

/// The planes of a piece's part in the cube of `reach` metres around the origin.
fn cut(planes: &[Vec4], reach: f32) -> Vec<Vec4> {
    let sides = Vec3::AXES.into_iter().flat_map(|n| [n, -n]).map(|n| n.extend(reach));
    planes.iter().copied().chain(sides).collect()
}

/// The box around a convex piece, from its faces; `None` if a face leaves the cube of `extent` metres around the origin, or if there is no
/// face: then the box is unknown.
pub(super) fn piece_bounds(planes: &[Vec4], extent: f64) -> Option<Aabb> {
    let planes: Vec<Plane> =
        planes.iter().map(|p| Plane { n: p.truncate().as_dvec3().normalize_or_zero(), d: f64::from(p.w) }).collect();
    // Far enough that an unbounded face leaves the cube in any direction.
    let far = 16.0 * extent;
    let mut bounds = Aabb::EMPTY;
    for i in 0..planes.len() {
        planes[i].n.try_normalize()?;
        bounds = face(&planes, i, DVec3::ZERO, far, extent * 1e-9).into_iter().fold(bounds, Aabb::with);
    }
    let inside = !bounds.is_empty() && bounds.min.abs().max(bounds.max.abs()).max_element() <= 2.0 * extent;
    inside.then_some(bounds)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(min: [f32; 3], max: [f32; 3]) -> Vec<Vec4> {
        (0..3)
            .flat_map(|axis| {
                let n = Vec3::AXES[axis];
                [n.extend(max[axis]), (-n).extend(-min[axis])]
            })
            .collect()
    }

    /// A locator for cells, each with its pieces.
    fn locator(cells: &[Vec<Vec<Vec4>>], extent: f64) -> Locator {
        Locator::new((0..).map(CellId).zip(cells.iter().map(|pieces| &pieces[..])), extent, 1e-4)
    }

    #[test]
    fn bounds_follow_the_planes_and_unbounded_pieces_say_so() {
        let b = piece_bounds(&block([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]), 10.0).unwrap();
        assert!((b.min - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-6 && (b.max - DVec3::new(4.0, 5.0, 6.0)).length() < 1e-6);
        assert_eq!(piece_bounds(&block([1.0, 2.0, 3.0], [4.0, 5.0, 6.0])[..5], 10.0), None);
        assert_eq!(piece_bounds(&[Vec4::X], 10.0), None);
        assert_eq!(piece_bounds(&[], 10.0), None);
    }

    /// A row of many rooms, and the half-space beyond them: the grid agrees with the definition, in any order of queries.
    #[test]
    fn the_grid_finds_what_looking_at_every_piece_finds() {
        let mut cells: Vec<_> = (0..100).map(|i| vec![block([i as f32, 0.0, 0.0], [i as f32 + 1.0, 3.0, 4.0])]).collect();
        cells.push(vec![vec![Vec4::new(0.0, 1.0, 0.0, -0.5)]]);
        let locator = locator(&cells, 100.0);
        let mut last = 0;
        for step in 0..1000 {
            let x = (step * 379 % 1000) as f32 * 0.1 + 0.05;
            let homes = locator.locate(Vec3::new(x, 1.0, 2.0), 1e-4, &mut last);
            assert_eq!(homes.as_slice(), [CellId(x as u32)]);
        }
        assert_eq!(locator.locate(Vec3::new(5.0, -3.0, 0.0), 1e-4, &mut last).as_slice(), [CellId(100)]);
        assert_eq!(locator.locate(Vec3::new(5.0, -0.2, 0.0), 1e-4, &mut last).as_slice(), []);
        // On the wall between two: both, independent of previous queries.
        for _ in 0..2 {
            let mut both = locator.locate(Vec3::new(7.0, 1.0, 1.0), 1e-4, &mut last).as_slice().to_vec();
            both.sort();
            assert_eq!(both, [CellId(6), CellId(7)]);
        }
        assert_eq!(locator.locate(Vec3::NAN, 1e-4, &mut last).as_slice(), []);
    }

    /// Pieces of one to five planes, most of them unbounded, and boxes within the cube, across its sides, and far beyond: what holds a point of
    /// the box is met, what a plane keeps off is not, and points are where looking at every piece finds them.
    #[test]
    fn unbounded_pieces_are_found_in_the_cube_and_beyond() {
        let mut state = 7u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1u64 << 23) as f64 - 1.0
        };
        let (mut met, mut kept_off, mut beyond) = (0, 0, 0);
        for round in 0..40 {
            let mut plane = || {
                let n = DVec3::new(next(), next(), next()).normalize_or(DVec3::X);
                n.as_vec3().extend((next() * 8.0) as f32)
            };
            let cells: Vec<Vec<Vec<Vec4>>> = (0..40).map(|k| vec![(0..k % 5 + 1).map(|_| plane()).collect()]).collect();
            let locator = locator(&cells, 10.0);
            assert!(locator.unbounded.len() > 20 && locator.unknown.len() < 20, "{:?}", locator.unknown);
            let is_in = |cell: usize, p: DVec3| {
                cells[cell][0].iter().all(|plane| plane.truncate().as_dvec3().dot(p) <= f64::from(plane.w))
            };
            for _ in 0..200 {
                let middle = DVec3::new(next(), next(), next()) * [9.0, 16.0, 200.0][round % 3];
                let half = DVec3::new(next().abs(), next().abs(), next().abs())
                    * [0.1, 1.0, 20.0][(next().abs() * 3.0) as usize % 3];
                let corners = [(middle - half).as_vec3(), (middle + half).as_vec3()];
                let span = Span::new(corners);
                let mut found = Vec::new();
                locator.met_by(&span, 1e-3, &mut |piece, _| found.push(piece as usize));
                for (cell, pieces) in cells.iter().enumerate() {
                    let is_off = pieces[0].iter().any(|plane| span.ends(plane)[0] > 1e-3);
                    assert!(!(is_off && found.contains(&cell)), "round {round}: {cell} is off {corners:?}");
                    let holds_some = (0..20).any(|_| is_in(cell, middle + half * DVec3::new(next(), next(), next())));
                    assert!(!holds_some || found.contains(&cell), "round {round}: {cell} meets {corners:?}");
                    met += usize::from(holds_some);
                    kept_off += usize::from(!found.contains(&cell));
                    beyond += usize::from(holds_some && middle.abs().max_element() > 20.0);
                }
                let point = middle.as_vec3();
                let homes = locator.locate(point, 1e-4, &mut u32::MAX.clone());
                let all = (0..cells.len()).filter(|&cell| is_in(cell, point.as_dvec3()));
                let has = |cell: usize| homes.as_slice().contains(&CellId(cell as u32)) || homes.overflow;
                assert!(all.into_iter().all(has), "round {round}: {point}");
            }
        }
        assert!(met > 10_000 && kept_off > 10_000 && beyond > 1000, "{met} {kept_off} {beyond}");
    }

    #[test]
    fn more_cells_at_a_point_than_there_is_room_for_overflow() {
        let cells: Vec<_> = (0..9).map(|_| vec![block([0.0; 3], [1.0; 3])]).collect();
        let mut last = u32::MAX;
        assert!(locator(&cells, 1.0).locate(Vec3::splat(0.5), 1e-4, &mut last).overflow);
    }
}
