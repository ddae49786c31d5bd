//! A barrier method for lines through portals: slower than pulling one point at a time, and it never gets stuck.
//!
//! Newton's method on `sum sqrt(|p[i + 1] - p[i]|^2 + m^2) - m sum log s`, with `s` the distances of the points from their portals' edges, while
//! `m` falls. The Hessian has blocks of 2 x 2 about its diagonal, so that a step takes time linear in the number of portals.

use super::blocks::{Blocks, derivatives, mixed, outer};
use super::facets::Facets;
use super::tight::{Line, Proof, prove};
use glam::{DMat2, DVec2, DVec3};

/// Factor by which the barrier falls from stage to stage. Larger: more stages. Smaller: more steps in each.
const FALL: f64 = 0.2;
/// Steps of a stage. More: closer to the middle line. Fewer: proofs that are weaker.
const STEPS: usize = 8;
/// The last barrier, for each edge of a portal on the line, metres. Larger: longer lines are told. Smaller: steps lost in rounding.
const LAST: f64 = 1e-7;
/// Share of the way to an edge that a step goes at most.
const SHORT: f64 = 0.9;

/// Its memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Barrier {
    /// By portal: its middle and two axes of its plane.
    frames: Vec<[DVec3; 3]>,
    /// By portal: the point in its frame.
    at: Vec<DVec2>,
    blocks: Blocks,
    directions: Vec<DVec3>,
}

impl Barrier {
    /// Pulls a line tight, and tells what any line through its portals is at least.
    pub fn pull(&mut self, facets: &Facets, line: &mut Line) -> Proof {
        let ends = [line.points[0], line.points[line.points.len() - 1]];
        self.start(facets, &line.portals);
        let edges: usize = line.portals.iter().map(|&portal| facets.edges(portal as usize).len()).sum();
        let mut barrier = 0.1 * line.metres().max(LAST);
        loop {
            for _ in 0..STEPS {
                self.step(facets, &line.portals, ends, barrier);
            }
            if barrier * edges as f64 <= LAST * 10.0 || barrier <= LAST * 1e-3 {
                break;
            }
            barrier *= FALL;
        }
        for i in 0..line.portals.len() {
            line.points[i + 1] = self.point(i, self.at[i]);
        }
        self.directions.clear();
        let direction = |pair: &[DVec3]| (pair[1] - pair[0]) / smooth(pair[1] - pair[0], barrier);
        self.directions.extend(line.points.windows(2).map(direction));
        prove(facets, &line.portals, ends, &self.directions)
    }

    fn start(&mut self, facets: &Facets, portals: &[u32]) {
        let frame = |&portal: &u32| {
            let edges = facets.edges(portal as usize);
            let middle = edges.iter().map(|edge| edge.start).sum::<DVec3>() / edges.len() as f64;
            [middle, edges[0].along, edges[0].inwards]
        };
        self.frames.clear();
        self.frames.extend(portals.iter().map(frame));
        self.at.clear();
        self.at.resize(portals.len(), DVec2::ZERO);
    }

    fn point(&self, i: usize, at: DVec2) -> DVec3 {
        let [middle, x, y] = self.frames[i];
        middle + x * at.x + y * at.y
    }

    /// A step of Newton's method.
    fn step(&mut self, facets: &Facets, portals: &[u32], ends: [DVec3; 2], barrier: f64) {
        self.linearize(facets, portals, ends, barrier);
        self.blocks.solve();
        let slope = self.blocks.slope();
        let mut share = self.room(facets, portals);
        let now = self.value(facets, portals, ends, barrier, 0.0);
        for _ in 0..40 {
            if self.value(facets, portals, ends, barrier, share) <= now + 1e-4 * share * slope {
                for (at, step) in self.at.iter_mut().zip(&self.blocks.steps) {
                    *at += *step * share;
                }
                return;
            }
            share *= 0.5;
        }
    }

    /// Fills in the Hessian and the gradient.
    fn linearize(&mut self, facets: &Facets, portals: &[u32], [start, end]: [DVec3; 2], barrier: f64) {
        let mut blocks = std::mem::take(&mut self.blocks);
        blocks.clear();
        let count = portals.len();
        let place = |i: usize| self.point(i, self.at[i]);
        for (i, &portal) in portals.iter().enumerate() {
            let here = place(i);
            let before = if i == 0 { start } else { place(i - 1) };
            let after = if i + 1 == count { end } else { place(i + 1) };
            let [_, x, y] = self.frames[i];
            let (mut hessian, mut down) = (DMat2::ZERO, DVec2::ZERO);
            for other in [before, after] {
                let length = smooth(here - other, barrier);
                let (second, first) = derivatives((here - other) / length, length, [x, y]);
                hessian += second;
                down += first;
            }
            for edge in facets.edges(portal as usize) {
                let n = DVec2::new(edge.inwards.dot(x), edge.inwards.dot(y));
                let inside = edge.inwards.dot(here - edge.start);
                hessian += outer(n, n) * (barrier / (inside * inside));
                down += n * (barrier / inside);
            }
            let length = smooth(after - here, barrier);
            let next = self.frames.get(i + 1).map(|&[_, next_x, next_y]| [next_x, next_y]);
            let beside = next.map_or(DMat2::ZERO, |next| mixed((after - here) / length, length, [x, y], next));
            blocks.push(hessian, beside, down);
        }
        self.blocks = blocks;
    }

    /// The largest share of the steps, 1 at most, that stays inside of all edges.
    fn room(&self, facets: &Facets, portals: &[u32]) -> f64 {
        let mut share = 1.0f64;
        for (i, &portal) in portals.iter().enumerate() {
            let [_, x, y] = self.frames[i];
            let (here, step) = (self.point(i, self.at[i]), x * self.blocks.steps[i].x + y * self.blocks.steps[i].y);
            for edge in facets.edges(portal as usize) {
                let (inside, nears) = (edge.inwards.dot(here - edge.start), -edge.inwards.dot(step));
                if nears * share > SHORT * inside {
                    share = SHORT * inside / nears;
                }
            }
        }
        share
    }

    /// What is minimized, after a share of the steps.
    fn value(&self, facets: &Facets, portals: &[u32], [start, end]: [DVec3; 2], barrier: f64, share: f64) -> f64 {
        let (mut sum, mut before) = (0.0, start);
        for (i, &portal) in portals.iter().enumerate() {
            let here = self.point(i, self.at[i] + self.blocks.steps[i] * share);
            sum += smooth(here - before, barrier);
            for edge in facets.edges(portal as usize) {
                sum -= barrier * edge.inwards.dot(here - edge.start).max(f64::MIN_POSITIVE).ln();
            }
            before = here;
        }
        sum + smooth(end - before, barrier)
    }
}

fn smooth(v: DVec3, by: f64) -> f64 {
    (v.length_squared() + by * by).sqrt()
}
