//! Columns over the triangles of the plan, cut into pieces by sheets.

use super::arrange::Plan;
use super::bands::{Band, Cut};
use super::facets::{Facets, Matter};
use super::limits::{Count, Limits};
use super::polygon::{counter_clockwise, shared_area};
use super::to_plan;
use crate::math::parallel;
use glam::DVec2;
use std::collections::{BTreeMap, HashMap};
use std::ops::RangeInclusive;

/// A cut of one column.
#[derive(Clone, Debug)]
pub struct Slice {
    /// Its source.
    pub cut: Cut,
    /// Height above the column's three corners, metres.
    pub heights: [f64; 3],
    /// The sheet's triangles that lie over this column (indices of [`Facets::sheet_facets`]).
    pub facets: Vec<u32>,
}

/// All columns, and the numbers of their pieces.
#[derive(Debug)]
pub struct Columns {
    /// For each triangle of the plan, its cuts from bottom to top; two at least.
    pub slices: Vec<Vec<Slice>>,
    /// Columns with part of an opaque sheet that could not cut them: their open faces may really be closed.
    pub torn: Vec<bool>,
    /// Number of the lowest piece of each column; piece `k` lies between slices `k` and `k + 1`. One entry more than columns.
    pub first_piece: Vec<u32>,
}

impl Columns {
    /// Number of pieces.
    pub fn pieces(&self) -> usize {
        self.first_piece.last().map_or(0, |&n| n as usize)
    }

    /// The column of a piece and its place in it, from below.
    pub fn of_piece(&self, piece: u32) -> (usize, usize) {
        let column = self.first_piece.partition_point(|&f| f <= piece) - 1;
        (column, (piece - self.first_piece[column]) as usize)
    }

    /// Heights of a piece's floor and ceiling above its column's corners.
    pub fn heights(&self, piece: u32) -> ([f64; 3], [f64; 3]) {
        let (column, k) = self.of_piece(piece);
        (self.slices[column][k].heights, self.slices[column][k + 1].heights)
    }
}

/// Heights of storeys.
pub struct Levels<'l> {
    /// Metres, ascending.
    pub heights: &'l [f64],
    /// A level cuts where no sheet is nearer than this, metres.
    pub near: f64,
    /// Heights within this distance are equal, metres.
    pub coplanar: f64,
}

/// A sheet cuts a column if it covers this share of it. Others are dropped, which only leaves more open.
const LEAST_SHARE: f64 = 0.15;
/// A column is torn if sheets that do not cut it cover this share: all of it under a dome of fine facets, little beside the edge of a
/// stair's soffit.
const TORN_SHARE: f64 = 0.3;
/// A smaller share is rounding from a neighbour's sheet.
const ROUNDING_SHARE: f64 = 1e-3;

/// Cuts the columns of each band; `None` if there are more pieces than `limits` allow.
pub fn columns(plan: &Plan, bands: &[Band], facets: &Facets, levels: &Levels<'_>, limits: &Limits<'_>) -> Option<Columns> {
    let count = limits.count();
    let cut: Vec<(Vec<Slice>, bool)> = parallel::flat_map_range(0..bands.len(), |k| {
        let triangles = &plan.triangles[plan.bands[k].clone()];
        let corners: Vec<[DVec2; 3]> = triangles.iter().map(|t| t.map(|i| plan.points[i as usize])).collect();
        columns_of(&bands[k], &corners, facets, levels, &count)
    });
    if count.is_over() {
        return None;
    }
    let (slices, torn): (Vec<Vec<Slice>>, Vec<bool>) = cut.into_iter().unzip();
    let mut first_piece = vec![0u32];
    for s in &slices {
        first_piece.push(first_piece[first_piece.len() - 1] + s.len() as u32 - 1);
    }
    Some(Columns { slices, torn, first_piece })
}

/// The cuts of a band's columns, and whether each is torn.
fn columns_of(
    band: &Band,
    corners: &[[DVec2; 3]],
    facets: &Facets,
    &Levels { heights: levels, near, coplanar }: &Levels<'_>,
    count: &Count<'_>,
) -> Vec<(Vec<Slice>, bool)> {
    let sheets = SheetGrid::new(facets, &band.sheet_facets);
    let [bottom, top] = band.heights;
    parallel::map(corners, |q| {
        if count.is_over() {
            return (Vec::new(), false);
        }
        let wanted = shares(facets, sheets.over(q), q);
        let whole = super::polygon::area(q).max(f64::MIN_POSITIVE);
        let opaque = |list: &[u32]| list.iter().any(|&f| facets.sheet_facets[f as usize].matter == Matter::Opaque);
        let mut uncut = 0.0;
        let mut by_share: Vec<(u32, f64, Vec<u32>)> =
            wanted.into_iter().map(|(s, (a, f))| (s, a / whole, f)).filter(|w| w.1 >= ROUNDING_SHARE).collect();
        by_share.retain(|w| {
            uncut += if w.1 < LEAST_SHARE && opaque(&w.2) { w.1 } else { 0.0 };
            w.1 >= LEAST_SHARE
        });
        by_share.sort_by(|a, b| b.1.min(1.0).total_cmp(&a.1.min(1.0)).then(a.0.cmp(&b.0)));
        let rim = |cut, y| Slice { cut, heights: [y; 3], facets: Vec::new() };
        let mut stack = vec![rim(band.rims[0], bottom), rim(band.rims[1], top)];
        for (sheet, share, list) in by_share {
            let heights = q.map(|p| facets.sheets[sheet as usize].height(p));
            // A sheet on the common rim closes the face between two bands; one beyond belongs to the next band.
            let under = band.goes_on(0) && heights.iter().all(|h| *h <= bottom + coplanar);
            let above = band.goes_on(1) && heights.iter().all(|h| *h >= top - coplanar);
            if under || above {
                let (y, last) = if under { (bottom, 0) } else { (top, stack.len() - 1) };
                if heights.iter().all(|h| (h - y).abs() <= coplanar) {
                    stack[last].facets.extend(list);
                }
                continue;
            }
            let closes = opaque(&list);
            let cuts = insert(&mut stack, Slice { cut: Cut::Sheet(sheet), heights, facets: list }, coplanar);
            uncut += if closes && !cuts { share.min(1.0) } else { 0.0 };
        }
        for (i, &y) in levels.iter().enumerate().filter(|l| bottom < *l.1 && *l.1 < top) {
            let taken = |s: &Slice| matches!(s.cut, Cut::Sheet(_)) && s.heights.iter().all(|h| (h - y).abs() <= near);
            if !stack.iter().any(taken) {
                insert(&mut stack, Slice { cut: Cut::Level(i as u32), heights: [y; 3], facets: Vec::new() }, coplanar);
            }
        }
        count.add(stack.len() - 1);
        (stack, uncut >= TORN_SHARE)
    })
}

/// Inserts a cut between its neighbours. A cut that would cross another is dropped, which only leaves more open, and the result is false.
/// Heights within the coplanar tolerance of a neighbour snap to it.
fn insert(stack: &mut Vec<Slice>, mut new: Slice, coplanar: f64) -> bool {
    for other in stack.iter() {
        for (h, o) in new.heights.iter_mut().zip(other.heights) {
            if (*h - o).abs() <= coplanar {
                *h = o;
            }
        }
    }
    let below = |a: &Slice, b: &Slice| a.heights.iter().zip(b.heights).all(|(x, y)| *x <= y);
    let at = stack.iter().take_while(|s| below(s, &new) && s.heights != new.heights).count();
    let fits = at > 0 && at < stack.len() && stack[at..].iter().all(|s| below(&new, s) && s.heights != new.heights);
    // A cut in the same place has the same effect.
    let there = stack.iter().any(|s| s.heights == new.heights);
    if fits {
        stack.insert(at, new);
    }
    fits || there
}

/// Grid index of sheet triangles over the plan.
struct SheetGrid<'s> {
    /// The triangles, and the boxes around them.
    some: &'s [u32],
    boxes: Vec<(DVec2, DVec2)>,
    /// Around all.
    bounds: (DVec2, DVec2),
    cell: f64,
    cells: HashMap<(i64, i64), Vec<u32>>,
    /// Triangles wider than 16 cells, kept outside the grid.
    large: Vec<u32>,
}

impl<'s> SheetGrid<'s> {
    fn new(facets: &Facets, some: &'s [u32]) -> Self {
        let around = |&f: &u32| reach(&facets.sheet_facets[f as usize].corners.map(to_plan));
        let boxes: Vec<(DVec2, DVec2)> = some.iter().map(around).collect();
        let n = boxes.len().max(1) as f64;
        let bounds = boxes.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        let cell = ((bounds.1 - bounds.0).max_element() / n.sqrt().max(1.0)).max(1e-9);
        let mut grid = Self { some, boxes: Vec::new(), bounds, cell, cells: HashMap::new(), large: Vec::new() };
        for (i, b) in (0..).zip(&boxes) {
            let [x, y] = grid.range(b);
            if x.end() - x.start() > 16 || y.end() - y.start() > 16 {
                grid.large.push(i);
                continue;
            }
            for place in x.flat_map(|x| y.clone().map(move |y| (x, y))) {
                grid.cells.entry(place).or_default().push(i);
            }
        }
        Self { boxes, ..grid }
    }

    fn range(&self, (low, high): &(DVec2, DVec2)) -> [RangeInclusive<i64>; 2] {
        let (a, b) = ((low / self.cell).floor(), (high / self.cell).floor());
        [a.x as i64..=b.x as i64, a.y as i64..=b.y as i64]
    }

    /// Entries whose boxes touch that of a triangle, ascending.
    fn over(&self, q: &[DVec2; 3]) -> Vec<u32> {
        let (a, b) = reach(q);
        let touches = |&i: &u32| {
            let (c, d) = self.boxes[i as usize];
            a.cmple(d).all() && c.cmple(b).all()
        };
        let [x, y] = self.range(&(a.max(self.bounds.0), b.min(self.bounds.1)));
        let places = x.flat_map(|x| y.clone().map(move |y| (x, y)));
        let near = places.filter_map(|place| self.cells.get(&place)).flatten().chain(&self.large);
        let mut out: Vec<u32> = near.copied().filter(touches).collect();
        out.sort_unstable();
        out.dedup();
        out.iter_mut().for_each(|i| *i = self.some[*i as usize]);
        out
    }
}

/// The box around a triangle.
fn reach(q: &[DVec2; 3]) -> (DVec2, DVec2) {
    (q[0].min(q[1]).min(q[2]), q[0].max(q[1]).max(q[2]))
}

/// The area of a column that each sheet lies over, square metres, and the triangles there; `over` may lie over it.
fn shares(facets: &Facets, over: impl IntoIterator<Item = u32>, q: &[DVec2; 3]) -> BTreeMap<u32, (f64, Vec<u32>)> {
    let mut wanted: BTreeMap<u32, (f64, Vec<u32>)> = BTreeMap::new();
    for f in over {
        let facet = &facets.sheet_facets[f as usize];
        let share = shared_area(counter_clockwise(facet.corners.map(to_plan)), q);
        if share > 0.0 {
            let entry = wanted.entry(facet.owner).or_default();
            entry.0 += share;
            entry.1.push(f);
        }
    }
    wanted
}
