//! Patches of Quake 3: grids of biquadratic Bézier surfaces, which meet in every second row and column of control points.
//!
//! Engines choose a tessellation by their settings and by distance, so no triangles are those of every frame. These ones serve to
//! find where a patch is seen from. Only a flat patch hides what is behind it: all tessellations of it are one surface.

use glam::DVec3;

/// Greatest distance of a curve in the surface's grid from its chords, in the level's units. Larger: sight of an edge may be missed.
/// Smaller: more triangles, by its square root in each direction.
const CHORD: f64 = 0.5;
/// Most chords of a curve between two rows. More: a hostile file makes as many triangles as it likes. Fewer: arches of more than
/// a thousand units have corners.
const MOST_CHORDS: usize = 32;
/// Greatest distance of control points from a flat patch's plane, and from the middles of their neighbours, in the level's units.
const FLAT: f64 = 0.01;

/// A grid of control points, row by row.
pub(super) struct Patch<'v> {
    points: &'v [DVec3],
    width: usize,
    /// Chords of each strip between every second column, and between every second row.
    chords: [Vec<usize>; 2],
}

impl<'v> Patch<'v> {
    /// Both sides have an odd number of points, 3 or more.
    pub fn new(points: &'v [DVec3], width: usize) -> Self {
        let mut patch = Self { points, width, chords: [Vec::new(), Vec::new()] };
        patch.chords = [0, 1].map(|axis| patch.bends(axis).map(chords).collect());
        patch
    }

    fn size(&self) -> [usize; 2] {
        [self.width, self.points.len() / self.width]
    }

    fn at(&self, column: usize, row: usize) -> DVec3 {
        self.points[row * self.width + column]
    }

    /// By strip along an axis (0: columns), how far its curves are from straight ones at most: the length of their second difference.
    fn bends(&self, axis: usize) -> impl Iterator<Item = f64> {
        let size = self.size();
        let point = move |along: usize, across: usize| {
            if axis == 0 { self.at(along, across) } else { self.at(across, along) }
        };
        (0..size[axis] / 2).map(move |strip| {
            let bend = |across| {
                let [a, b, c] = [0, 1, 2].map(|k| point(2 * strip + k, across));
                (a - 2.0 * b + c).length()
            };
            (0..size[1 - axis]).map(bend).fold(0.0, f64::max)
        })
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        2 * self.chords.iter().map(|chords| chords.iter().sum::<usize>()).product::<usize>()
    }

    /// Whether it is flat, with straight sides.
    pub fn is_flat(&self) -> bool {
        let [width, height] = self.size();
        let [a, b, c, d] = [(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)].map(|(i, j)| self.at(i, j));
        let Some(n) = (d - a).cross(c - b).try_normalize() else { return false };
        let is_even = [0, 1].into_iter().all(|axis| self.bends(axis).all(|bend| bend <= 2.0 * FLAT));
        is_even && self.points.iter().all(|p| n.dot(*p - a).abs() <= FLAT)
    }

    /// Points, and triangles counter-clockwise from the visible side.
    pub fn tessellated(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let [columns, rows] = [0, 1].map(|axis| places(&self.chords[axis]));
        let mut points = Vec::new();
        for &(row, v) in &rows {
            for &(column, u) in &columns {
                let along = [0, 1, 2].map(|k| bezier([0, 1, 2].map(|l| self.at(column + l, row + k)), u));
                points.push(bezier(along, v));
            }
        }
        let width = columns.len();
        let squares = (0..rows.len() - 1).flat_map(|j| (0..width - 1).map(move |i| j * width + i));
        let triangles = squares.flat_map(|at| {
            let [a, b, c, d] = [at, at + 1, at + width + 1, at + width].map(|v| v as u32);
            [[a, b, c], [a, c, d]]
        });
        (points, triangles.collect())
    }
}

/// Chords of a quadratic curve: its greatest distance from one is a quarter of its second difference, and falls by their square.
fn chords(bend: f64) -> usize {
    ((bend / (4.0 * CHORD)).sqrt().ceil() as usize).clamp(1, MOST_CHORDS)
}

/// The first control point and the parameter of each point along an axis.
fn places(chords: &[usize]) -> Vec<(usize, f64)> {
    let of_strip = |(strip, &n): (usize, &usize)| (0..n).map(move |k| (2 * strip, k as f64 / n as f64));
    let mut places: Vec<_> = chords.iter().enumerate().flat_map(of_strip).collect();
    places.push((2 * (chords.len() - 1), 1.0));
    places
}

fn bezier([a, b, c]: [DVec3; 3], t: f64) -> DVec3 {
    a * (1.0 - t) * (1.0 - t) + b * (2.0 * t * (1.0 - t)) + c * t * t
}
