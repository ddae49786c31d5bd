//! Clearance: how wide the space is around a point, as twice the way to the nearest wall that stands at its height.

use crate::cells::complex::assemble::Complex;
use crate::cells::complex::faces::Surface;
use crate::cells::plan::options::PlanOptions;
use crate::cells::plan::space::Input;
use crate::geom::Aabb;
use crate::parallel;
use glam::{DVec2, DVec3};

/// How far it is to the nearest wall.
pub(in crate::cells) struct Clearance<'c> {
    options: &'c PlanOptions,
    walls: Vec<Standing>,
    /// Walls by place in plan and by height, so that a tower's other storeys aren't looked at: those of cell `i` of the grid are
    /// `of_cell[first[i]..first[i + 1]]`.
    of_cell: Vec<u32>,
    first: Vec<u32>,
    low: [i64; 3],
    size: [i64; 3],
    cell: f64,
}

/// A closed face on a wall.
struct Standing {
    ends: (DVec2, DVec2),
    heights: (f64, f64),
}

impl<'c> Clearance<'c> {
    /// Enters the closed faces on walls.
    pub(in crate::cells) fn new(input: &Input<'c>) -> Self {
        let (Complex { faces, facets, .. }, options) = (input.complex, input.options);
        let (none, size) = (Vec::new(), [0; 3]);
        let across = Aabb::of(facets.wall_facets.iter().flat_map(|f| f.corners)).size().max(DVec3::ZERO);
        let cell = input.human.metre.max((across.x * across.z / options.most_grid_cells).sqrt());
        let mut all = Self { options, walls: Vec::new(), of_cell: none.clone(), first: none, low: size, size, cell };
        let mut places: Vec<([i64; 3], u32)> = Vec::new();
        for f in *faces {
            let Surface::Wall(w) = f.surface else {
                continue;
            };
            if f.open_area > options.open_face * f.area {
                continue;
            }
            let wall = &facets.walls[w as usize];
            let (lo, hi) = extent(&f.polygon);
            let ends = (wall.at(lo.x), wall.at(hi.x));
            let steps = (ends.0.distance(ends.1) / (options.wall_step * all.cell)).ceil().max(1.0) as usize;
            let mut cells: Vec<(i64, i64)> =
                (0..=steps).map(|s| all.cell_of(ends.0.lerp(ends.1, s as f64 / steps as f64))).collect();
            cells.dedup();
            for (x, y) in cells {
                places.extend(all.bins(lo.y, hi.y).map(|h| ([h, x, y], all.walls.len() as u32)));
            }
            all.walls.push(Standing { ends, heights: (lo.y, hi.y) });
        }
        all.sort(places);
        all
    }

    /// Lays out the grid: which walls are in which of its cells.
    fn sort(&mut self, mut places: Vec<([i64; 3], u32)>) {
        if places.is_empty() {
            return;
        }
        self.low = std::array::from_fn(|k| places.iter().map(|p| p.0[k]).min().unwrap_or_default());
        self.size = std::array::from_fn(|k| places.iter().map(|p| p.0[k] - self.low[k] + 1).max().unwrap_or_default());
        places.sort_unstable();
        self.first = vec![0; (self.size[0] * self.size[1] * self.size[2]) as usize + 1];
        for (place, wall) in places {
            if let Some(i) = self.index(place) {
                self.first[i + 1] += 1;
                self.of_cell.push(wall);
            }
        }
        for i in 1..self.first.len() {
            self.first[i] += self.first[i - 1];
        }
    }

    /// The number of a cell of the grid, in the order of its place.
    fn index(&self, place: [i64; 3]) -> Option<usize> {
        let at: [i64; 3] = std::array::from_fn(|k| place[k] - self.low[k]);
        let inside = (0..3).all(|k| (0..self.size[k]).contains(&at[k]));
        inside.then(|| ((at[0] * self.size[1] + at[1]) * self.size[2] + at[2]) as usize)
    }

    /// The walls of a cell of the grid.
    fn walls_at(&self, place: [i64; 3]) -> &[u32] {
        self.index(place).map_or(&[], |i| &self.of_cell[self.first[i] as usize..self.first[i + 1] as usize])
    }

    fn cell_of(&self, q: DVec2) -> (i64, i64) {
        let c = (q / self.cell).floor();
        (c.x as i64, c.y as i64)
    }

    /// The parts of the grid between two heights.
    fn bins(&self, low: f64, high: f64) -> std::ops::RangeInclusive<i64> {
        let bin = |y: f64| (y / (self.options.bin_height * self.cell)).floor() as i64;
        bin(low)..=bin(high)
    }

    /// Metres from a point of the plan to the nearest wall that stands between two heights.
    pub(in crate::cells) fn at(&self, q: DVec2, low: f64, high: f64) -> f64 {
        let (cx, cy) = self.cell_of(q);
        let far = self.options.clearance_reach as i64;
        // A wall entered `ring` cells away is nearer by a cell at most, and by a step along it.
        let nearer = 1.0 + self.options.wall_step;
        let mut best = far as f64 * self.cell;
        for ring in 0..=far {
            if (ring as f64 - nearer) * self.cell > best {
                break;
            }
            for x in cx - ring..=cx + ring {
                let step = if (x - cx).abs() == ring { 1 } else { (2 * ring).max(1) };
                let mut y = cy - ring;
                while y <= cy + ring {
                    for &w in self.bins(low, high).flat_map(|h| self.walls_at([h, x, y])) {
                        let w = &self.walls[w as usize];
                        if w.heights.0 < high && low < w.heights.1 {
                            let (a, d) = (w.ends.0, w.ends.1 - w.ends.0);
                            let t = ((q - a).dot(d) / d.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                            best = best.min(q.distance(a + d * t));
                        }
                    }
                    y += step;
                }
            }
        }
        best
    }
}

/// A range of heights without its ends: walls that only graze a height don't narrow what is there.
pub(in crate::cells) fn without_ends(low: f64, high: f64, options: &PlanOptions) -> (f64, f64) {
    let grazed = options.grazed;
    (low + grazed * (high - low), low + (1.0 - grazed) * (high - low))
}

/// The box around a polygon.
pub(in crate::cells) fn extent(polygon: &[DVec2]) -> (DVec2, DVec2) {
    polygon.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |a, p| (a.0.min(*p), a.1.max(*p)))
}

/// For each piece, how wide the space around its middle is, metres: twice the way to the nearest wall that stands at its height,
/// at most some times its own height.
pub(in crate::cells) fn widths(input: &Input<'_>, clearance: &Clearance<'_>) -> Vec<f64> {
    let (Complex { plan, columns, .. }, options) = (input.complex, input.options);
    parallel::map_range(0..columns.pieces(), |p| {
        let (column, _) = columns.of_piece(p as u32);
        let q = plan.triangles[column].map(|i| plan.points[i as usize]);
        // The middle of an edge that no wall is on may be the middle of the room, as in one of two triangles.
        let edges = (0..3).filter(|&e| !plan.constrained[column][e]).map(|e| (q[e] + q[(e + 1) % 3]) * 0.5);
        let (floor, ceiling) = columns.heights(p as u32);
        let (low, high) = (floor.iter().sum::<f64>() / 3.0, ceiling.iter().sum::<f64>() / 3.0);
        let (a, b) = without_ends(low, high, options);
        let clear = edges.chain([(q[0] + q[1] + q[2]) / 3.0]).map(|p| clearance.at(p, a, b)).fold(0.0, f64::max);
        (2.0 * clear).min(options.widest_for_height * (high - low))
    })
}
