//! Tests the rows of a level with random lines. It uses only the portals, and nothing of how the rows were made.
//!
//! A line goes through a random point of a random portal. It is followed both ways, cell by cell: it leaves a cell through the
//! portal that it crosses, and ends if it crosses none. Cells are convex, so the line stays inside them between portals, and
//! every two cells along it see each other: both rows must contain the other.
//!
//! A line passes a portal if it is on the inner side of every edge, at a distance of at least [`CLEARANCE`] (Plücker coordinates:
//! J. Erickson, *Plücker coordinates*, 1997; S. Teller, *Visibility computations in densely occluded polyhedral environments*,
//! 1992, for the sign). So rounding never decides a result.
//!
//! There are four kinds of lines, a quarter each: any direction, portals chosen equally; the same, chosen by area; through two
//! portals of one cell; and from a cell towards a portal at the end of its row, where a wrong row shows first.

use super::{EXAMPLES, each_once};
use enfilade::BitMatrix;
use enfilade::math::geom::{area, middle, newell};
use enfilade::math::parallel;
use enfilade::math::random::Prng;
use enfilade_levels::Level;
use glam::DVec3;
use serde::Serialize;
use std::time::Instant;

/// Distance that a line keeps from the edges of its portals, in the level's units.
pub const CLEARANCE: f64 = 1e-3;
/// Greatest step back between crossings, in the level's units. A line with a larger one found a cell that is not convex, and ends
/// there.
const BACKWARDS: f64 = 1e-6;
/// Lines of a task: fixed, so that results do not depend on the number of threads.
const CHUNK: u64 = 1 << 16;
/// Maximum portals that a line crosses in one direction: ends lines that circle in contradictory portals.
const LONGEST: usize = 4096;
/// Tries to place a line in its first portal: slivers have no room.
const TRIES: usize = 8;

/// Number of lines and seed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LineOptions {
    /// Lines.
    pub rays: u64,
    /// Seed of every random choice.
    pub seed: u64,
}

/// A line between two cells that is missing from at least one of their rows.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct MissedLine {
    /// The cells.
    pub cells: [u32; 2],
    /// The line's exit from the first cell.
    pub from: DVec3,
    /// Its entry into the second.
    pub to: DVec3,
    /// The portals in between, from first to second.
    pub portals: Vec<u32>,
}

/// Result of the test.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct LineReport {
    /// Lines followed: the number requested, unless portals have no room.
    pub rays: u64,
    /// Portals that they passed.
    pub crossings: u64,
    /// Lines that ended in a cell that is not convex.
    pub bent: u64,
    /// Lines with a pair of cells that the rows lack.
    pub missed_rays: u64,
    /// Distinct such pairs, each direction counted.
    pub missed_pairs: u64,
    /// Up to ten of them.
    pub examples: Vec<MissedLine>,
    /// Wall-clock time.
    pub seconds: f64,
    /// Whether no pair was missed.
    pub passed: bool,
}

/// Tests rows. A pass means that none of these lines found a missing pair.
///
/// # Panics
///
/// If `rows` isn't square with a row for each cell, or a portal names a cell that doesn't exist.
pub fn check_rows(level: &Level, rows: &BitMatrix, options: &LineOptions) -> LineReport {
    assert_eq!((rows.rows(), rows.columns()), (level.cells, level.cells), "a row and a column for each cell");
    let start = Instant::now();
    let walker = Walker::new(level, rows);
    let chunks = if walker.portals.is_empty() { 0 } else { options.rays.div_ceil(CHUNK) };
    let tallies = parallel::map_range(0..chunks as usize, |chunk| {
        let chunk = chunk as u64;
        let rng = &mut Prng::new(options.seed, chunk);
        let (mut tally, mut trail) = (Tally::default(), Trail::default());
        for ray in 0..CHUNK.min(options.rays - chunk * CHUNK) {
            walker.ray(ray % 4, rng, &mut trail, &mut tally);
        }
        each_once(&mut tally.pairs);
        tally
    });
    let tally = tallies.into_iter().fold(Tally::default(), Tally::add);
    LineReport {
        rays: tally.rays,
        crossings: tally.crossings,
        bent: tally.bent,
        missed_rays: tally.missed_rays,
        missed_pairs: tally.pairs.len() as u64,
        passed: tally.pairs.is_empty(),
        examples: tally.examples,
        seconds: start.elapsed().as_secs_f64(),
    }
}

#[derive(Default)]
struct Tally {
    rays: u64,
    crossings: u64,
    bent: u64,
    missed_rays: u64,
    pairs: Vec<[u32; 2]>,
    examples: Vec<MissedLine>,
}

impl Tally {
    fn add(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.crossings += other.crossings;
        self.bent += other.bent;
        self.missed_rays += other.missed_rays;
        self.pairs.extend(other.pairs);
        each_once(&mut self.pairs);
        for example in other.examples {
            self.example(example);
        }
        self
    }

    /// Keeps the first line of each pair.
    fn example(&mut self, example: MissedLine) {
        if self.examples.len() < EXAMPLES && self.examples.iter().all(|e| e.cells != example.cells) {
            self.examples.push(example);
        }
    }
}

/// A line in Plücker coordinates.
#[derive(Clone, Copy)]
struct Ray {
    origin: DVec3,
    /// Unit.
    direction: DVec3,
    /// `origin x direction`.
    moment: DVec3,
}

impl Ray {
    fn reversed(self) -> Self {
        Self { direction: -self.direction, moment: -self.moment, ..self }
    }
}

/// An edge as a line of unit direction; the portal is on its positive side.
struct Edge {
    direction: DVec3,
    moment: DVec3,
}

/// An exit of a cell.
struct Exit {
    portal: u32,
    to: u32,
    /// In `edges`.
    edges: [u32; 2],
}

/// Bounding balls of some exits of a cell, stored side by side to test several at once. Single precision: radii are enlarged by
/// [`Balls::SLACK`] of the level's extent, far more than the error.
#[derive(Clone, Copy, Default)]
struct Balls {
    x: [f32; Balls::WIDTH],
    y: [f32; Balls::WIDTH],
    z: [f32; Balls::WIDTH],
    /// Squared; 0 without an exit.
    radius2: [f32; Balls::WIDTH],
}

impl Balls {
    const WIDTH: usize = 8;
    const SLACK: f64 = 1e-5;

    fn set(&mut self, k: usize, centre: DVec3, radius: f64) {
        let c = centre.as_vec3();
        (self.x[k], self.y[k], self.z[k], self.radius2[k]) = (c.x, c.y, c.z, (radius * radius) as f32);
    }

    /// Squared distance of a line from each centre, less the squared radius; positive: it misses. `None` if it misses all.
    #[inline]
    fn beyond(&self, [dx, dy, dz, mx, my, mz]: [f32; 6]) -> Option<[f32; Self::WIDTH]> {
        let Self { x, y, z, radius2 } = self;
        // Plain loops over arrays, which the compiler vectorises.
        let beyond = std::array::from_fn(|k| {
            let x2 = (y[k] * dz - z[k] * dy - mx).powi(2);
            let y2 = (z[k] * dx - x[k] * dz - my).powi(2);
            let z2 = (x[k] * dy - y[k] * dx - mz).powi(2);
            x2 + y2 + z2 - radius2[k]
        });
        let met = beyond.iter().fold(0, |met, &b: &f32| met | u32::from(b <= 0.0));
        (met != 0).then_some(beyond)
    }
}

struct Plane {
    normal: DVec3,
    point: DVec3,
}

/// The cells and portals along a line, and distances.
#[derive(Default)]
struct Trail {
    cells: Vec<u32>,
    /// Between one cell and the next.
    portals: Vec<u32>,
    at: Vec<f64>,
}

struct Walker<'l> {
    level: &'l Level,
    rows: &'l BitMatrix,
    /// Portals large enough for a line.
    portals: Vec<u32>,
    /// Running sums of their areas.
    areas: Vec<f64>,
    planes: Vec<Plane>,
    /// By cell, from `first[cell]` to `first[cell + 1]`.
    exits: Vec<Exit>,
    first: Vec<u32>,
    /// By cell, from `first_balls[cell]` to `first_balls[cell + 1]`, in the order of exits.
    balls: Vec<Balls>,
    first_balls: Vec<u32>,
    edges: Vec<Edge>,
}

impl<'l> Walker<'l> {
    fn new(level: &'l Level, rows: &'l BitMatrix) -> Self {
        let areas: Vec<f64> = level.portals.iter().map(|p| area(&p.winding)).collect();
        let portals: Vec<u32> = (0..areas.len() as u32).filter(|&p| areas[p as usize] > CLEARANCE * CLEARANCE).collect();
        let mut sum = 0.0;
        let areas = portals.iter().map(|&p| {
            sum += areas[p as usize];
            sum
        });
        let planes = level.portals.iter().map(|p| {
            let point = middle(&p.winding);
            let around: Vec<DVec3> = p.winding.iter().map(|&q| q - point).collect();
            Plane { normal: newell(&around).normalize_or_zero(), point }
        });
        let (areas, planes): (_, Vec<Plane>) = (areas.collect(), planes.collect());
        // Exits by cell: side 0 leads from the portal's first cell, along its normal.
        let mut ways: Vec<(u32, u32, usize)> = Vec::new();
        for &p in &portals {
            let cells = level.portals[p as usize].cells;
            ways.extend((0..2).map(|side| (cells[side], p, side)));
        }
        ways.sort_unstable();
        let (mut exits, mut edges, mut first) = (Vec::new(), Vec::new(), vec![0; level.cells + 1]);
        for (cell, portal, side) in ways {
            let LevelSide { to, winding } = side_of(level, portal, side);
            let begin = edges.len() as u32;
            edges.extend(winding.iter().zip(winding.iter().cycle().skip(1)).filter_map(|(&a, &b)| {
                let direction = (b - a).try_normalize()?;
                Some(Edge { direction, moment: a.cross(direction) })
            }));
            exits.push(Exit { portal, to, edges: [begin, edges.len() as u32] });
            first[cell as usize + 1] += 1;
        }
        for cell in 0..level.cells {
            first[cell + 1] += first[cell];
        }
        let mut walker =
            Self { level, rows, portals, areas, planes, exits, first, balls: Vec::new(), first_balls: vec![0], edges };
        walker.add_balls();
        walker
    }

    fn add_balls(&mut self) {
        let windings = self.level.portals.iter().flat_map(|p| &p.winding);
        let slack = Balls::SLACK * windings.map(|p| p.abs().max_element()).fold(0.0, f64::max);
        for cell in 0..self.level.cells {
            let mut all = Vec::new();
            for exits in self.exits(cell as u32).chunks(Balls::WIDTH) {
                let mut balls = Balls::default();
                for (k, exit) in exits.iter().enumerate() {
                    let centre = self.planes[exit.portal as usize].point;
                    let corners = self.level.portals[exit.portal as usize].winding.iter();
                    balls.set(k, centre, corners.map(|p| p.distance(centre)).fold(0.0, f64::max) + slack);
                }
                all.push(balls);
            }
            self.balls.extend(all);
            self.first_balls.push(self.balls.len() as u32);
        }
    }

    fn exits(&self, cell: u32) -> &[Exit] {
        &self.exits[self.first[cell as usize] as usize..self.first[cell as usize + 1] as usize]
    }

    fn passes(&self, ray: &Ray, exit: &Exit) -> bool {
        let edges = &self.edges[exit.edges[0] as usize..exit.edges[1] as usize];
        edges.iter().all(|e| e.direction.dot(ray.moment) + e.moment.dot(ray.direction) >= CLEARANCE)
    }

    /// The exit through which a line leaves.
    fn exit(&self, cell: u32, ray: &Ray, single: [f32; 6]) -> Option<&Exit> {
        let balls = self.first_balls[cell as usize] as usize..self.first_balls[cell as usize + 1] as usize;
        let exits = self.exits(cell).chunks(Balls::WIDTH);
        self.balls[balls].iter().zip(exits).find_map(|(balls, exits)| {
            let beyond = balls.beyond(single)?;
            exits.iter().zip(beyond).find(|(exit, beyond)| *beyond <= 0.0 && self.passes(ray, exit)).map(|(exit, _)| exit)
        })
    }

    /// Follows a line and compares its cells with the rows.
    fn ray(&self, kind: u64, rng: &mut Prng, trail: &mut Trail, tally: &mut Tally) {
        let found = (0..TRIES).find_map(|_| {
            let (cell, exit, ray) = self.line(kind, rng)?;
            self.passes(&ray, exit).then_some((cell, exit, ray))
        });
        let Some((cell, exit, ray)) = found else { return };
        tally.rays += 1;
        // Backwards from the first cell, reversed, then forwards through the first portal.
        trail.cells.clear();
        trail.portals.clear();
        trail.at.clear();
        let mut bent = self.follow(cell, &ray.reversed(), 0.0, trail);
        trail.cells.reverse();
        trail.portals.reverse();
        trail.at.reverse();
        trail.at.iter_mut().for_each(|t| *t = -*t);
        trail.portals.push(exit.portal);
        trail.at.push(0.0);
        bent |= self.follow(exit.to, &ray, 0.0, trail);
        tally.bent += u64::from(bent);
        tally.crossings += trail.portals.len() as u64;
        self.compare(trail, &ray, tally);
    }

    /// Adds `cell` and all cells that the line reaches from it. Returns true if it ended at a contradiction.
    fn follow(&self, mut cell: u32, ray: &Ray, mut at: f64, trail: &mut Trail) -> bool {
        trail.cells.push(cell);
        let (d, m) = (ray.direction.as_vec3(), ray.moment.as_vec3());
        let single = [d.x, d.y, d.z, m.x, m.y, m.z];
        for _ in 0..LONGEST {
            let Some(exit) = self.exit(cell, ray, single) else { return false };
            let Plane { normal, point } = &self.planes[exit.portal as usize];
            let t = normal.dot(*point - ray.origin) / normal.dot(ray.direction);
            // Also false for NaN.
            let goes_on = t >= at - BACKWARDS;
            if !goes_on {
                return true;
            }
            at = t;
            cell = exit.to;
            trail.cells.push(cell);
            trail.portals.push(exit.portal);
            trail.at.push(t);
        }
        true
    }

    fn compare(&self, trail: &Trail, ray: &Ray, tally: &mut Tally) {
        let mut missed = false;
        for (i, &a) in trail.cells.iter().enumerate() {
            for (j, &b) in trail.cells.iter().enumerate().skip(i + 1) {
                if self.rows.get(a as usize, b as usize) && self.rows.get(b as usize, a as usize) {
                    continue;
                }
                missed = true;
                let ways = [[a, b], [b, a]].into_iter().filter(|[x, y]| !self.rows.get(*x as usize, *y as usize));
                tally.pairs.extend(ways);
                let point = |t: f64| ray.origin + ray.direction * t;
                let (from, to) = (point(trail.at[i]), point(trail.at[j - 1]));
                tally.example(MissedLine { cells: [a, b], from, to, portals: trail.portals[i..j].to_vec() });
            }
        }
        tally.missed_rays += u64::from(missed);
        // Limits memory if rows lack nearly everything.
        if tally.pairs.len() > 1 << 20 {
            each_once(&mut tally.pairs);
        }
    }

    /// A cell, an exit of it, and a line that may pass the exit.
    fn line(&self, kind: u64, rng: &mut Prng) -> Option<(u32, &Exit, Ray)> {
        let portal = match kind {
            1 => {
                let at = rng.unit() * self.areas.last()?;
                self.portals[self.areas.partition_point(|&a| a <= at).min(self.portals.len() - 1)]
            }
            _ => self.portals[rng.below(self.portals.len())],
        };
        let side = rng.below(2);
        let cells = self.level.portals[portal as usize].cells;
        let (cell, to) = (cells[side], cells[1 - side]);
        let exit = self.exits(cell).iter().find(|e| e.portal == portal)?;
        let origin = self.point_of(portal, rng);
        let through = match kind {
            2 => Some(to),
            3 => self.edge_of_row(to, rng),
            _ => None,
        };
        let target = through.and_then(|cell| {
            let exits = self.exits(cell);
            // For a cell at the edge of a row: prefer exits at the end of the row.
            let last = (0..3)
                .map(|_| exits.get(rng.below(exits.len())))
                .find(|e| kind == 2 || e.is_some_and(|e| !self.rows.get(to as usize, e.to as usize)));
            last.flatten().map(|e| self.point_of(e.portal, rng))
        });
        let direction = match target {
            Some(target) => (target - origin).try_normalize()?,
            None => {
                let d = sphere(rng);
                d * self.planes[portal as usize].normal.dot(d).signum() * if side == 0 { 1.0 } else { -1.0 }
            }
        };
        Some((cell, exit, Ray { origin, direction, moment: origin.cross(direction) }))
    }

    /// A cell of a row with a neighbour outside the row, if a few tries find one.
    fn edge_of_row(&self, cell: u32, rng: &mut Prng) -> Option<u32> {
        let row = self.rows.row(cell as usize);
        (0..TRIES).find_map(|_| {
            // A random word, then a random bit of it.
            let begin = rng.below(row.len());
            let word = (0..row.len()).map(|k| (begin + k) % row.len()).find(|&w| row[w] != 0)?;
            let turn = rng.below(64) as u32;
            let bit = (row[word].rotate_right(turn).trailing_zeros() + turn) % 64;
            let other = (word * 64) as u32 + bit;
            let ends = |e: &Exit| !self.rows.get(cell as usize, e.to as usize);
            self.exits(other).iter().any(ends).then_some(other)
        })
    }

    /// A random point of a portal: uniform in one of its fan's triangles.
    fn point_of(&self, portal: u32, rng: &mut Prng) -> DVec3 {
        let winding = &self.level.portals[portal as usize].winding;
        let k = 2 + rng.below(winding.len() - 2);
        let (mut u, mut v) = (rng.unit(), rng.unit());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        winding[0] + (winding[k - 1] - winding[0]) * u + (winding[k] - winding[0]) * v
    }
}

/// A portal from one of its cells: the winding is counter-clockwise as seen from beyond it.
struct LevelSide {
    to: u32,
    winding: Vec<DVec3>,
}

fn side_of(level: &Level, portal: u32, side: usize) -> LevelSide {
    let portal = &level.portals[portal as usize];
    let mut winding = portal.winding.clone();
    if side == 1 {
        winding.reverse();
    }
    LevelSide { to: portal.cells[1 - side], winding }
}

/// A random direction, uniform over the sphere, by rejection.
fn sphere(rng: &mut Prng) -> DVec3 {
    loop {
        let p = DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
        if (1e-6..=1.0).contains(&p.length_squared()) {
            return p.normalize();
        }
    }
}
