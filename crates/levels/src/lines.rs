//! Lines: the cells that a straight line passes, with a margin that makes it a proof; and random lines.
//!
//! Based on: Bittner, Mattausch, Wonka, Havran, Wimmer, *Adaptive global visibility sampling*, 2009: a line serves every pair of
//! cells that it passes. Lines start at random points of portals. Half of them aim at random points of portals that might be
//! visible from there; the others take any direction.

use super::{Level, Line};
use enfilade::BitMatrix;
use enfilade::math::bits;
use enfilade::math::geom::Plane;
use enfilade::math::parallel;
use enfilade::math::random::Prng;
use enfilade::pvs::flow::exact::{Answer, ask, passes};
use enfilade::pvs::flow::goals::{Prover, Settled};
use enfilade::pvs::flow::might_see::MightSee;
use enfilade::pvs::flow::net::Net;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A line with a smaller slope against a portal's plane runs along it.
const ALONG: f64 = 1e-9;

/// Directed portals per task.
const TASK: usize = 64;

/// Random lines between the portals of two cells. More: of the pairs that are left, fewer see each other, and all take longer.
const TRIES: u64 = 8;

/// Tasks between two updates of the known pairs.
const BATCH: usize = 16;

/// Distance of a line from the edges of windows, in multiples of the rounding of coordinates.
const MARGIN: f64 = 4.0;

/// The portals of a net, for lines.
pub(super) struct Walker<'n> {
    level: &'n Level,
    net: &'n Net,
    margin: f64,
    /// Corners are rounded to multiples of this power of two for exact tests.
    grid: f64,
    /// The plane of each directed portal; a degenerate one, which no line can pass, if it has none.
    planes: Vec<Plane>,
    /// Planes through the edges of each portal, normals pointing out of the window, and where each portal's begin.
    edges: Vec<Plane>,
    first_edge: Vec<u32>,
    /// Seed of random lines.
    seed: u64,
}

/// A line through portals of a net.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Walk {
    /// Directed portals that it crosses, in order.
    pub portals: Vec<u32>,
    /// Points in the first and the last of them.
    pub ends: [DVec3; 2],
}

impl<'n> Walker<'n> {
    /// Prepares the portals.
    pub fn new(level: &'n Level, net: &'n Net, seed: u64) -> Self {
        let (mut planes, mut edges, mut first_edge) = (Vec::new(), Vec::new(), vec![0]);
        for p in 0..net.portals() {
            let window = net.window(p);
            let plane = net.plane(p);
            planes.push(plane.unwrap_or(Plane { n: DVec3::ZERO, d: 0.0 }));
            if let Some(plane) = plane {
                let mut a = window.corner(window.len() - 1);
                for b in window.iter() {
                    // Edges as short as rounding have no direction; their neighbours close the gap.
                    edges.extend((b - a).cross(plane.n).try_normalize().map(|n| Plane::through(a, n)));
                    a = b;
                }
            }
            first_edge.push(edges.len() as u32);
        }
        let grid = 2f64.powi(net.slack.strict.log2().floor() as i32);
        Self { level, net, margin: MARGIN * net.slack.strict, grid, planes, edges, first_edge, seed }
    }

    /// Distance at which a line crosses a portal's plane in its direction.
    #[inline(always)]
    fn meets(&self, portal: usize, origin: DVec3, direction: DVec3) -> Option<f64> {
        let plane = &self.planes[portal];
        let slope = plane.n.dot(direction);
        // Not along the plane, nor against it.
        (slope > ALONG).then(|| -plane.distance(origin) / slope)
    }

    /// Whether a point of a portal's plane is in its window.
    #[inline(always)]
    fn holds(&self, portal: usize, p: DVec3) -> bool {
        let edges = &self.edges[self.first_edge[portal] as usize..self.first_edge[portal + 1] as usize];
        edges.iter().all(|e| e.distance(p) <= -self.margin)
    }

    /// Follows a line that crosses `first` at `t`: appends the portals after it. Returns where it crosses the last.
    #[inline]
    fn follow(&self, first: usize, mut t: f64, origin: DVec3, direction: DVec3, portals: &mut Vec<u32>) -> f64 {
        let mut last = first;
        // No line passes a portal twice.
        for _ in 0..self.net.portals() {
            let (mut nearest, mut next) = (f64::INFINITY, None);
            for q in self.net.out(self.net.target[last] as usize) {
                if let Some(s) = self.meets(q, origin, direction)
                    && s < nearest
                    && s >= t - self.margin
                    && q != self.net.twin[last] as usize
                    && self.holds(q, origin + direction * s)
                {
                    (nearest, next) = (s, Some(q));
                }
            }
            let Some(q) = next else { break };
            portals.push(q as u32);
            (t, last) = (nearest, q);
        }
        t
    }

    /// The whole line through two points that crosses `portal`, in both directions; false if it misses the portal, or a goal: the cell that
    /// it must come to beyond.
    pub fn walk(&self, portal: usize, [a, b]: [DVec3; 2], goal: Option<u32>, walk: &mut Walk) -> bool {
        let Some(direction) = (b - a).try_normalize() else { return false };
        let hit = self.meets(portal, a, direction).filter(|t| self.holds(portal, a + direction * t));
        let Some(t) = hit else { return false };
        walk.portals.clear();
        walk.portals.push(portal as u32);
        let end = self.follow(portal, t, a, direction, &mut walk.portals);
        if goal.is_some_and(|goal| !walk.portals.iter().any(|&p| self.net.target[p as usize] == goal)) {
            return false;
        }
        let after = walk.portals.len();
        let start = -self.follow(self.net.twin[portal] as usize, -t, a, -direction, &mut walk.portals);
        let before = &mut walk.portals[after..];
        before.reverse();
        before.iter_mut().for_each(|p| *p = self.net.twin[*p as usize]);
        walk.portals.rotate_left(after);
        walk.ends = [start, end].map(|t| a + direction * t + self.net.origin);
        true
    }

    /// The cells along a walk.
    pub fn cells<'w>(&self, walk: &'w Walk) -> impl Iterator<Item = u32> + Clone + use<'w, '_> {
        let first = walk.portals.first().map(|&p| self.net.source[p as usize]);
        first.into_iter().chain(walk.portals.iter().map(|&p| self.net.target[p as usize]))
    }

    /// A walk in the form that `vis` returns.
    pub fn line(&self, walk: &Walk) -> Line {
        let [first, last] = [walk.portals[0], walk.portals[walk.portals.len() - 1]].map(|p| p as usize);
        let [from, to] = walk.ends;
        Line {
            cells: [self.net.source[first], self.net.target[last]],
            from,
            to,
            portals: walk.portals.iter().map(|&p| self.net.ids[p as usize]).collect(),
        }
    }

    /// Tests exactly whether a line passes a chain.
    ///
    /// Corners are rounded first, to the tolerance of flow: otherwise a file's -320.0000000000001 beside -320 would be a slit
    /// that no real line passes. A line that is found holds for the original corners.
    pub fn ask(&self, chain: &[u32]) -> Answer {
        if chain.iter().any(|&p| self.net.plane(p as usize).is_none()) {
            return Answer::Open; // nothing is known of that portal
        }
        let windings: Vec<Vec<DVec3>> = chain.iter().map(|&p| self.level.winding(self.net.ids[p as usize])).collect();
        let rounded = |w: &Vec<DVec3>| w.iter().map(|&p| (p / self.grid).round() * self.grid).collect();
        match ask(&windings.iter().map(rounded).collect::<Vec<_>>()) {
            Answer::Line(line) if !windings.iter().all(|w| passes(&line, w)) || !self.in_order(chain, line) => Answer::Open,
            answer => answer,
        }
    }

    /// Whether a line crosses the planes of `chain` in order; several may coincide.
    fn in_order(&self, chain: &[u32], [a, b]: [DVec3; 2]) -> bool {
        let (a, Some(direction)) = (a - self.net.origin, (b - a).try_normalize()) else { return false };
        let mut last = f64::NEG_INFINITY;
        chain.iter().all(|&p| {
            let plane = &self.planes[p as usize];
            let slope = plane.n.dot(direction);
            let (t, error) = (-plane.distance(a) / slope, self.margin / slope);
            let follows = slope > 0.0 && t + error >= last;
            last = last.max(t - error);
            follows
        })
    }

    /// A random point of a portal's window, by area.
    fn point(&self, portal: usize, random: &mut Prng) -> DVec3 {
        let window = self.net.window(portal);
        let a = window.corner(0);
        let triangle = |i: usize| [window.corner(i) - a, window.corner(i + 1) - a];
        let area = |[u, v]: [DVec3; 2]| u.cross(v).length();
        let mut left = random.unit() * (1..window.len() - 1).map(|i| area(triangle(i))).sum::<f64>();
        let mut chosen = triangle(1);
        for i in 1..window.len() - 1 {
            chosen = triangle(i);
            left -= area(chosen);
            if left < 0.0 {
                break;
            }
        }
        let (mut u, mut v) = (random.unit(), random.unit());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        a + chosen[0] * u + chosen[1] * v
    }
}

impl Prover for Walker<'_> {
    type Proof = Walk;

    fn prove(&self, chain: &[u32], line: [DVec3; 2], cells: &mut Vec<u32>) -> Option<Walk> {
        let mut walk = Walk { portals: Vec::new(), ends: [DVec3::ZERO; 2] };
        let goal = self.net.target[*chain.last()? as usize];
        if !self.walk(chain[0] as usize, line, Some(goal), &mut walk) {
            return None;
        }
        cells.extend(self.cells(&walk));
        Some(walk)
    }

    fn tries(&self) -> u64 {
        TRIES
    }

    fn aim(&self, from: usize, to: usize, k: u64, cells: &mut Vec<u32>) -> Option<Walk> {
        if [from, to].iter().any(|&p| self.net.plane(p).is_none()) {
            return None;
        }
        let mut random = Prng::new(self.seed ^ k, (from as u64) << 32 | to as u64);
        let ends = [self.point(from, &mut random), self.point(to, &mut random)];
        self.prove(&[from as u32, to as u32], ends, cells)
    }

    fn settle(&self, chain: &[u32], cells: &mut Vec<u32>) -> Option<Settled<Walk>> {
        Some(match self.ask(chain) {
            Answer::Refuted(_) => Settled::Refuted,
            Answer::Open => Settled::Open,
            Answer::Line(ends) => {
                let walk = Walk { portals: chain.to_vec(), ends };
                cells.extend(self.cells(&walk));
                Settled::Proven(ends, walk)
            }
        })
    }
}

/// Follows `count` random lines from each directed portal. Sets all pairs of cells along each in `lower`; returns the lines that
/// set any.
pub(super) fn random(walker: &Walker<'_>, might_see: &MightSee, count: u64, lower: &mut BitMatrix) -> Vec<Walk> {
    let net = walker.net;
    let portals: Vec<usize> = (0..net.portals()).filter(|&p| net.plane(p).is_some()).collect();
    let mut kept = Vec::new();
    for batch in portals.chunks(TASK * BATCH) {
        let known = &*lower;
        let tasks: Vec<&[usize]> = batch.chunks(TASK).collect();
        let found: Vec<Vec<Walk>> = parallel::map(&tasks, |task| {
            let mut found = Vec::new();
            let mut walk = Walk { portals: Vec::new(), ends: [DVec3::ZERO; 2] };
            for &p in *task {
                let mut random = Prng::new(walker.seed, p as u64);
                let ahead: Vec<usize> = bits::ones(might_see.row(p)).filter(|&q| net.plane(q).is_some()).collect();
                for k in 0..count {
                    let from = walker.point(p, &mut random);
                    let to = if k % 2 == 0 && !ahead.is_empty() {
                        walker.point(ahead[random.below(ahead.len())], &mut random)
                    } else {
                        let n = walker.planes[p].n;
                        let d = DVec3::from([0; 3].map(|_| random.range(-1.0, 1.0)));
                        from + if n.dot(d) < 0.0 { -d } else { d }
                    };
                    if walker.walk(p, [from, to], None, &mut walk) && shows_more(walker.cells(&walk), known) {
                        found.push(walk.clone());
                    }
                }
            }
            found
        });
        for walk in found.into_iter().flatten() {
            if keep(walker, &walk, lower) {
                kept.push(walk);
            }
        }
    }
    kept
}

/// Sets all pairs of cells along a line. Returns true if some were new.
pub(super) fn keep(walker: &Walker<'_>, walk: &Walk, lower: &mut BitMatrix) -> bool {
    let more = shows_more(walker.cells(walk), lower);
    if more {
        let cells = walker.cells(walk);
        for (a, rest) in after(cells) {
            for b in rest {
                lower.set(a as usize, b as usize);
                lower.set(b as usize, a as usize);
            }
        }
    }
    more
}

/// Whether any two of these cells are not yet known to see each other.
fn shows_more(cells: impl Iterator<Item = u32> + Clone, known: &BitMatrix) -> bool {
    after(cells).any(|(a, mut rest)| rest.any(|b| !known.get(a as usize, b as usize)))
}

/// Each item with the items after it.
fn after<I: Iterator<Item = u32> + Clone>(mut items: I) -> impl Iterator<Item = (u32, I)> {
    std::iter::from_fn(move || items.next().map(|a| (a, items.clone())))
}
