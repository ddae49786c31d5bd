//! Clearance: the width of the space around a point, twice the distance to the nearest wall at its height.

use crate::cells::complex::assemble::Complex;
use crate::cells::complex::faces::{Face, Surface};
use crate::cells::plan::options::PlanOptions;
use crate::cells::plan::space::Input;
use crate::math::box_tree::BoxTree;
use crate::math::geom::Aabb;
use crate::math::parallel;
use glam::DVec2;

/// Distance queries to the nearest wall.
pub(in crate::cells) struct Clearance {
    walls: Vec<Standing>,
    /// Boxes of the walls, with heights as the third coordinate.
    tree: BoxTree,
    /// Largest distance that counts, metres.
    reach: f64,
}

/// A closed face on a wall.
struct Standing {
    ends: (DVec2, DVec2),
    heights: (f64, f64),
}

impl Clearance {
    /// Collects the closed faces on walls.
    pub(in crate::cells) fn new(input: &Input<'_>) -> Self {
        let (Complex { faces, facets, .. }, options) = (input.complex, input.options);
        let standing = |f: &Face| {
            let Surface::Wall(w) = f.surface else { return None };
            let (wall, (lo, hi)) = (&facets.walls[w as usize], extent(&f.polygon));
            let is_closed = f.open_area <= options.most * f.area;
            is_closed.then(|| Standing { ends: (wall.at(lo.x), wall.at(hi.x)), heights: (lo.y, hi.y) })
        };
        let walls: Vec<Standing> = faces.iter().filter_map(standing).collect();
        let around = |&Standing { ends: (a, b), heights }: &Standing| Aabb {
            min: a.min(b).extend(heights.0),
            max: a.max(b).extend(heights.1),
        };
        let boxes: Vec<Aabb> = walls.iter().map(around).collect();
        let tree = BoxTree::over(&boxes);
        Self { walls, tree, reach: input.human.metres(options.clearance_reach) }
    }

    /// Distance from a point of the plan to the nearest wall between two heights, metres.
    pub(in crate::cells) fn at(&self, q: DVec2, low: f64, high: f64) -> f64 {
        let to_box = |b: &Aabb| {
            let is_beside = b.min.z < high && low < b.max.z;
            if is_beside { q.distance(q.clamp(b.min.truncate(), b.max.truncate())) } else { f64::INFINITY }
        };
        let to_wall = |w: u32| {
            let w = &self.walls[w as usize];
            if w.heights.0 >= high || low >= w.heights.1 {
                return f64::INFINITY;
            }
            let (a, d) = (w.ends.0, w.ends.1 - w.ends.0);
            let t = ((q - a).dot(d) / d.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            q.distance(a + d * t)
        };
        self.tree.least(self.reach, &to_box, &to_wall)
    }
}

/// A range of heights without its ends: walls that only reach into the ends do not narrow the space.
pub(in crate::cells) fn without_ends(low: f64, high: f64, options: &PlanOptions) -> (f64, f64) {
    let grazed = options.grazed;
    (low + grazed * (high - low), low + (1.0 - grazed) * (high - low))
}

/// The box around a polygon.
pub(in crate::cells) fn extent(polygon: &[DVec2]) -> (DVec2, DVec2) {
    polygon.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |a, p| (a.0.min(*p), a.1.max(*p)))
}

/// For each piece, the width of the space around its centre, metres: twice the distance to the nearest wall at its height, at most a
/// multiple of its own height.
pub(in crate::cells) fn widths(input: &Input<'_>, clearance: &Clearance) -> Vec<f64> {
    let (Complex { plan, columns, .. }, options) = (input.complex, input.options);
    parallel::map_range(0..columns.pieces(), |p| {
        let (column, _) = columns.of_piece(p as u32);
        let q = plan.triangles[column].map(|i| plan.points[i as usize]);
        // The middle of an edge without a wall may be the middle of the room, as in a room of two triangles.
        let edges = (0..3).filter(|&e| !plan.constrained[column][e]).map(|e| (q[e] + q[(e + 1) % 3]) * 0.5);
        let (floor, ceiling) = columns.heights(p as u32);
        let (low, high) = (floor.iter().sum::<f64>() / 3.0, ceiling.iter().sum::<f64>() / 3.0);
        let (a, b) = without_ends(low, high, options);
        let clear = edges.chain([(q[0] + q[1] + q[2]) / 3.0]).map(|p| clearance.at(p, a, b)).fold(0.0, f64::max);
        (2.0 * clear).min(options.widest_for_height * (high - low))
    })
}
