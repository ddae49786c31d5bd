//! Subtracts triangles from a part of the picture. The rest is convex polygons, cut by lines.
//!
//! A point that lies on a line within rounding counts as being on neither side. So a polygon that was cut along an edge is not
//! cut again by the same edge of the neighbour, and no gap is left between them.

use super::frame::{Cell, Triangle, value};

/// A point of a beam's picture.
pub(super) type Point = [f64; 2];

/// Maximum cuts for one polygon. More: pictures of a million needles take for ever. Fewer: more triangles stay undecided.
const CUTS: usize = 20_000;

/// A rest narrower than this, in half widths of the beam, is rounding: where edges of neighbours meet at a corner, each lies on
/// the others' lines only to a multiple of 2^-53. Wider: slits are lost. Narrower: objects behind the seams of a wall stay
/// undecided.
pub(super) const SLIVER: f64 = 1e-13;

/// The rest of a polygon.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Rest {
    /// Nothing is left.
    Nothing,
    /// This point is in the rest.
    Some(Point),
    /// Too many cuts.
    Unknown,
}

/// The thing behind: an occluder must be nearer.
#[derive(Clone, Copy)]
pub(super) enum Behind<'t> {
    /// Anything at all.
    Anything,
    /// A triangle.
    Triangle(&'t Triangle),
    /// A triangle whose `1/w` is only rounding, but never exceeds this limit.
    Thin(&'t Triangle, f64),
}

/// Scratch memory for cutting.
#[derive(Default)]
pub(super) struct Cutter {
    /// The polygon being cut, its part inside the lines so far, and the part cut off.
    work: Vec<Point>,
    inside: Vec<Point>,
    next: Vec<Point>,
    values: Vec<(f64, f64)>,
    /// Polygons still to process: where their points begin in `points`, and the first triangle that may hide them.
    open: Vec<(usize, usize)>,
    points: Vec<Point>,
}

impl Cutter {
    /// The part of a cell in which a triangle shows if nothing hides it.
    pub fn picture(&mut self, cell: &Cell, triangle: &Triangle, out: &mut Vec<Point>) {
        self.inside.clear();
        self.inside.extend(cell.corners());
        for k in 0..3 {
            self.values.clear();
            let (form, slack) = (&triangle.edges[k], triangle.slack[k]);
            self.values.extend(self.inside.iter().map(|&p| (value(form, p), slack)));
            split(&self.inside, &self.values, &mut self.next, None);
            std::mem::swap(&mut self.inside, &mut self.next);
        }
        out.clear();
        if self.inside.len() > 2 {
            out.extend_from_slice(&self.inside);
        }
    }

    /// Subtracts triangles (numbers into `all`) from a polygon. Calls `on_hidden` for each occluder with the polygon that it
    /// hides, and `accept` with a point of each rest; the search ends when `accept` returns true.
    pub fn cut(
        &mut self,
        polygon: &[Point],
        all: &[Triangle],
        triangles: &[u32],
        behind: Behind<'_>,
        mut on_hidden: impl FnMut(u32, &[Point]),
        mut accept: impl FnMut(Point) -> bool,
    ) -> Rest {
        self.open.clear();
        self.points.clear();
        self.points.extend_from_slice(polygon);
        self.open.push((0, 0));
        let (mut cuts, mut left) = (0, None);
        'polygons: while let Some((start, mut next)) = self.open.pop() {
            self.work.clear();
            self.work.extend(self.points.drain(start..));
            while next < triangles.len() {
                cuts += 1;
                if cuts > CUTS {
                    return Rest::Unknown;
                }
                let number = triangles[next];
                next += 1;
                if self.hide(&all[number as usize], behind, next) {
                    on_hidden(number, &self.inside);
                    continue 'polygons;
                }
            }
            if width(&self.work) < SLIVER {
                continue;
            }
            let at = middle(&self.work);
            left = Some(at);
            if accept(at) {
                break;
            }
        }
        left.map_or(Rest::Nothing, Rest::Some)
    }

    /// Subtracts a triangle from `work`. Leaves the hidden part in `inside` and adds the rest as polygons that triangles from
    /// `next` on may hide. Returns false if the triangle hides nothing.
    fn hide(&mut self, triangle: &Triangle, behind: Behind<'_>, next: usize) -> bool {
        let edges = |k: usize, p: Point| (value(&triangle.edges[k], p), triangle.slack[k]);
        let is_apart = |k: usize| self.work.iter().all(|&p| edges(k, p).0 <= triangle.slack[k]);
        if is_apart(0) || is_apart(1) || is_apart(2) {
            return false;
        }
        // Planes order most of them, also beside a common edge, where `1/w` is equal within rounding.
        let behind = match behind {
            Behind::Triangle(other) if triangle.is_behind(other) => return false,
            Behind::Triangle(other) | Behind::Thin(other, _) if other.is_behind(triangle) => Behind::Anything,
            _ => behind,
        };
        let nearer = |p: Point| {
            let a = value(&triangle.inverse, p);
            match behind {
                Behind::Anything => (f64::INFINITY, 0.0),
                Behind::Thin(_, inverse) => (a - inverse, triangle.error_at(a)),
                Behind::Triangle(other) => {
                    let b = value(&other.inverse, p);
                    (a - b, triangle.error_at(a) + other.error_at(b))
                }
            }
        };
        let is_free = |p: &Point| {
            let (d, slack) = nearer(*p);
            d <= slack
        };
        if self.work.iter().all(is_free) {
            return false;
        }
        self.inside.clear();
        self.inside.extend_from_slice(&self.work);
        let (open, points) = (self.open.len(), self.points.len());
        for k in 0..4 {
            self.values.clear();
            if k == 3 {
                self.values.extend(self.inside.iter().map(|&p| nearer(p)));
            } else {
                self.values.extend(self.inside.iter().map(|&p| edges(k, p)));
            }
            if self.values.iter().all(|&(d, slack)| d >= -slack) {
                continue;
            }
            let start = self.points.len();
            split(&self.inside, &self.values, &mut self.next, Some(&mut self.points));
            if self.points.len() > start {
                self.open.push((start, next));
            }
            std::mem::swap(&mut self.inside, &mut self.next);
            if self.inside.len() < 3 {
                self.open.truncate(open);
                self.points.truncate(points);
                return false;
            }
        }
        true
    }
}

/// Splits a convex polygon by a line, given the distance of each corner and its error.
fn split(polygon: &[Point], values: &[(f64, f64)], inside: &mut Vec<Point>, mut outside: Option<&mut Vec<Point>>) {
    inside.clear();
    let start = outside.as_ref().map_or(0, |o| o.len());
    let (mut any_in, mut any_out) = (false, false);
    for (i, &a) in polygon.iter().enumerate() {
        let k = if i + 1 == polygon.len() { 0 } else { i + 1 };
        let ((da, sa), (db, sb)) = (values[i], values[k]);
        let (in_a, out_a) = (da > sa, da < -sa);
        any_in |= in_a;
        any_out |= out_a;
        if !out_a {
            inside.push(a);
        }
        if !in_a && let Some(outside) = &mut outside {
            outside.push(a);
        }
        if (in_a && db < -sb) || (out_a && db > sb) {
            let (t, b) = (da / (da - db), polygon[k]);
            let p = [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
            inside.push(p);
            if let Some(outside) = &mut outside {
                outside.push(p);
            }
        }
    }
    if !any_in {
        inside.clear();
    }
    if let Some(outside) = outside
        && (!any_out || outside.len() - start < 3)
    {
        outside.truncate(start);
    }
}

/// Approximate width of a convex polygon: twice its area over its longest chord from the first corner.
fn width(polygon: &[Point]) -> f64 {
    let o = polygon[0];
    let off = |p: &Point| [p[0] - o[0], p[1] - o[1]];
    let area = |w: &[Point]| {
        let (a, b) = (off(&w[0]), off(&w[1]));
        (a[0] * b[1] - a[1] * b[0]).abs()
    };
    let twice: f64 = polygon[1..].windows(2).map(area).sum();
    let longest = polygon.iter().map(|p| off(p)[0].abs().max(off(p)[1].abs())).fold(0.0, f64::max);
    if longest > 0.0 { twice / longest } else { 0.0 }
}

/// The mean of the corners.
pub(super) fn middle(polygon: &[Point]) -> Point {
    let n = polygon.len().max(1) as f64;
    let sum = polygon.iter().fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
    [sum[0] / n, sum[1] / n]
}
