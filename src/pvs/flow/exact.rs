//! Stabbing lines: whether a line passes a chain of windings. The exact test, for chains that windows leave open.
//!
//! Based on: Teller, *Computing the antipenumbra of an area light source*, 1992, and Teller, Hohmeyer, *Determining the lines through four
//! lines*, 1999. A line that passes a winding has all its directed edges on one side. In Plücker coordinates, where lines are points of a
//! quadric in five dimensions, each edge gives a half-space. So the lines of a chain are the points of the quadric in an open polyhedral
//! cone.
//!
//! Deviation: it does not search for extremal lines, where edges of the polytope meet the quadric. In levels on a grid most of these lines
//! only touch edges; they form families, and signs are zero. Instead, it searches for a refutation in floating point and then checks it in
//! integers:
//!
//! 1. The cone is empty: a sum of edges' sides with non-negative weights is zero for every line (Farkas, 1902; Gordan, 1873), although each
//!    side is positive for a stabbing line.
//! 2. The cone is not empty but misses the quadric: the same with products of two sides, up to a multiple of the quadric, which is zero for
//!    every line. See `products`.
//! 3. If neither is found, the lines are divided by their side of a further line, and each part is tested. Lines that meet the further line
//!    are nowhere dense, and the stabbing lines are an open set.
//!
//! A candidate line is moved into the middle of the cone by successive linear approximations of the quadric. It counts only if the exact
//! signs of all volumes that it spans with edges are right (Shewchuk, *Adaptive precision floating-point arithmetic*, 1997).
//!
//! The result is exact for the given corners: lines pass a slit of any width; touching does not count. Reflex corners of windings are left
//! out.

mod hull;
mod nearest;
mod products;
mod weights;

use glam::DVec3;
use hull::{around, hull, normal};
use nearest::{dot, nearest, unit, without};
use products::{Corner, products};
use robust::{Coord3D, orient3d};

/// Beyond this, squares of coordinates overflow.
const FARTHEST: f64 = 1e100;

/// Least distance of the two points of a line, as a share of the scene; nearer ones give its direction too coarsely.
const SHORTEST: f64 = 1e-3;

/// A directed line, by two of its points.
pub type Edge = [DVec3; 2];

/// Most parts of the lines of a chain; with more it stays open.
const PARTS: usize = 16;

/// Linear approximations of the quadric for a candidate line.
const TURNS: usize = 12;

/// Step sizes towards the next approximation.
const SHARES: [f64; 5] = [1.0, 0.5, 0.25, 0.0625, 0.015625];

/// A term of a refutation: a sum that is zero for every line, although each term is positive for a line that passes the chain.
#[derive(Clone, PartialEq, Debug)]
pub struct Term {
    /// A positive whole number, in decimal.
    pub weight: String,
    /// One edge: a line's side of it. Two: the product of its sides of both. The side of edge (a, b) of the line through p and
    /// then q is the volume (a - p) x (b - p) . (q - p).
    pub edges: Vec<Edge>,
}

/// The result of the exact test.
#[derive(Clone, PartialEq, Debug)]
pub enum Answer {
    /// No line passes: a sum for each part of the lines.
    Refuted(Vec<Vec<Term>>),
    /// The line through these two points passes. They are in the planes of the first and the last winding, to within rounding.
    Line([DVec3; 2]),
    /// Unknown.
    Open,
}

/// Tests whether a line passes convex windings, each counter-clockwise seen from the line's head. Their order does not matter.
pub fn ask(windings: &[Vec<DVec3>]) -> Answer {
    let Some(chain) = Chain::new(windings) else { return Answer::Open };
    let (mut parts, mut sums) = (vec![Vec::new()], Vec::new());
    for _ in 0..PARTS {
        let Some(part) = parts.pop() else { return Answer::Refuted(sums) };
        let edges: Vec<Edge> = chain.edges.iter().chain(&part).copied().collect();
        let rows: Vec<Row> = edges.iter().map(|&e| chain.row(e)).collect();
        let cone = nearest(|x| least(&rows, x).0);
        let sum = if cone.apart {
            let corner = Corner::new(&rows, &cone);
            if let Some(points) = chain.line(&rows, &corner, &cone.point) {
                return Answer::Line(points);
            }
            let pairs = products(&rows, &corner);
            let weights = pairs.support.iter().map(|&(pair, weight)| (pair.to_vec(), weight));
            let pairs = if pairs.apart { None } else { sum(&edges, weights.collect(), 1) };
            if pairs.is_none() {
                let [a, b] = chain.divider(&project(&cone.point), part.len());
                for side in [[a, b], [b, a]] {
                    parts.push(part.iter().copied().chain([side]).collect());
                }
                continue;
            }
            pairs
        } else {
            sum(&edges, cone.support.iter().map(|&(i, weight)| (vec![i], weight)).collect(), 0)
        };
        let Some(sum) = sum else { return Answer::Open };
        sums.push(sum);
    }
    if parts.is_empty() { Answer::Refuted(sums) } else { Answer::Open }
}

/// True if a line passes a winding: inside all edges, by exact signs.
pub fn passes(line: &Edge, winding: &[DVec3]) -> bool {
    around(winding).filter(|[a, b]| a != b).all(|e| side(&e, line) > 0.0)
}

/// Plücker coordinates: moment, direction for an edge; direction, moment for a line; their product is the side. Relative to the centre of
/// the chain, in units of its size; unit vectors.
type Row = [f64; 6];

/// The windings of a chain.
struct Chain {
    /// Edges of the windings without reflex corners.
    edges: Vec<Edge>,
    /// All edges.
    all: Vec<Edge>,
    /// A point and the normal of the first and of the last winding, and its longest edge.
    ends: [[DVec3; 3]; 2],
    centre: DVec3,
    scale: f64,
}

impl Chain {
    /// `None` if a winding is invalid.
    fn new(windings: &[Vec<DVec3>]) -> Option<Self> {
        let usable = |w: &Vec<DVec3>| w.len() >= 3 && w.iter().all(|p| p.abs().max_element() < FARTHEST);
        if !windings.iter().all(usable) {
            return None;
        }
        let bounds = crate::math::geom::Aabb::of(windings.iter().flatten().copied());
        let (centre, scale) = (bounds.centre(), 0.5 * bounds.diagonal());
        let hulls: Vec<Vec<DVec3>> = windings.iter().map(|w| hull(w)).collect();
        if hulls.iter().any(|h| h.len() < 3) {
            return None;
        }
        let edges = |w: &[Vec<DVec3>]| -> Vec<Edge> { w.iter().flat_map(|w| around(w)).filter(|e| e[0] != e[1]).collect() };
        let end = |w: &Vec<DVec3>| {
            let longest = around(w).map(|[a, b]| b - a).max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
            [w[0], normal(w), longest.unwrap_or_default()]
        };
        let ends = [end(hulls.first()?), end(hulls.last()?)];
        Some(Self { edges: edges(&hulls), all: edges(windings), ends, centre, scale })
    }

    fn row(&self, edge: Edge) -> Row {
        let [a, b] = edge.map(|p| (p - self.centre) / self.scale);
        let (moment, along) = (a.cross(b - a), b - a);
        unit(&[moment.x, moment.y, moment.z, along.x, along.y, along.z])
    }

    /// Searches for a line far inside the cone, starting near `point`; returns two points of it if it passes all windings.
    fn line(&self, rows: &[Row], corner: &Corner, point: &Row) -> Option<[DVec3; 2]> {
        // The nearest line, or the nearest in the cone's own metric: the deeper one.
        let beside = |point: &Row| {
            let lines = [project(point), project(&corner.onto_quadric(point))].map(|line| (line, least(rows, &line).1));
            if lines[1].1 > lines[0].1 { lines[1] } else { lines[0] }
        };
        let (mut best, mut depth) = beside(point);
        for _ in 0..TURNS {
            // A step in the tangent plane of the quadric, shorter if it leads too far off the quadric.
            let across = unit(&[best[3], best[4], best[5], best[0], best[1], best[2]]);
            let flat: Vec<Row> = rows.iter().map(|r| unit(&without(r, &across))).collect();
            let cone = nearest(|x| least(&flat, x).0);
            let (before, aim) = (depth, unit(&cone.point));
            let towards = |share: f64| beside(&std::array::from_fn(|k| best[k] + share * (aim[k] - best[k])));
            let deeper = SHARES.iter().map(|&share| towards(share)).find(|line| line.1 > depth);
            let Some(line) = deeper.filter(|_| cone.apart) else { break };
            (best, depth) = line;
            if before > 0.0 && depth < before * 1.1 {
                break;
            }
        }
        self.points(&best).filter(|l| depth > 0.0 && self.all.iter().all(|e| side(e, l) > 0.0))
    }

    /// Two points of a line.
    fn points(&self, line: &Row) -> Option<[DVec3; 2]> {
        let [u, m] = halves(line);
        let along = u.normalize();
        let foot = self.centre + u.cross(m) * (self.scale / u.length_squared());
        let hit = |[p, n, _]: [DVec3; 3]| foot + along * (n.dot(p - foot) / n.dot(along));
        let [a, mut b] = self.ends.map(hit);
        if a.distance(b) < SHORTEST * self.scale {
            b = a + along * self.scale;
        }
        (a.is_finite() && b.is_finite()).then_some([a, b])
    }

    /// A dividing line: in the plane of an end, through its intersection with `line`. A different one at each depth.
    fn divider(&self, line: &Row, depth: usize) -> Edge {
        let [p, n, longest] = self.ends[depth % 2];
        let [u, m] = halves(line);
        let foot = self.centre + u.cross(m) * (self.scale / u.length_squared());
        let t = n.dot(p - foot) / n.dot(u);
        let hit = foot + u * t;
        let at = if hit.distance(self.centre) < 2.0 * self.scale { hit } else { p };
        let along = if depth & 2 == 0 { n.cross(longest) } else { longest };
        // Any line serves: short numbers make exact arithmetic faster.
        let grid = 2f64.powi(self.scale.log2() as i32 - 20);
        let short = |p: DVec3| (p / grid).round() * grid;
        [short(at), short(at + along.normalize_or(DVec3::X) * self.scale)]
    }
}

/// The exact sign of a line's side of an edge; positive on the inside.
fn side(edge: &Edge, line: &Edge) -> f64 {
    let coord = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    orient3d(coord(edge[0]), coord(edge[1]), coord(line[1]), coord(line[0]))
}

/// The row with the least product with a vector, and the product.
fn least(rows: &[Row], x: &Row) -> ((usize, Row), f64) {
    let (mut found, mut depth) = (0, f64::INFINITY);
    for (i, row) in rows.iter().enumerate() {
        let product = dot(row, x);
        if product < depth {
            (found, depth) = (i, product);
        }
    }
    ((found, rows[found]), depth)
}

fn halves(x: &Row) -> [DVec3; 2] {
    [DVec3::new(x[0], x[1], x[2]), DVec3::new(x[3], x[4], x[5])]
}

/// The nearest line: on the quadric, the sum and the difference of direction and moment have equal lengths.
fn project(x: &Row) -> Row {
    let [u, m] = halves(x);
    let (sum, difference) = ((u + m).normalize_or(DVec3::X), (u - m).normalize_or(DVec3::X));
    let (u, m) = (sum + difference, sum - difference);
    unit(&[u.x, u.y, u.z, m.x, m.y, m.z])
}

/// Exact weights for products of `degree + 1` edges' sides each, which approximately add up to zero.
fn sum(edges: &[Edge], mut support: Vec<(Vec<usize>, f64)>, degree: usize) -> Option<Vec<Term>> {
    support.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut used: Vec<usize> = support.iter().flat_map(|s| s.0.iter().copied()).collect();
    used.sort_unstable();
    used.dedup();
    let used_edges: Vec<Edge> = used.iter().map(|&i| edges[i]).collect();
    let rows = weights::rows(&used_edges);
    let row = |i: usize| &rows[used.partition_point(|&u| u < i)];
    let mut columns = Vec::new();
    if degree == 1 {
        columns.push(weights::quadric());
    }
    columns.extend(support.iter().map(|(of, _)| match of[..] {
        [i, k] => weights::product(&row(i).0, &row(k).0),
        _ => row(of[0]).0.to_vec(),
    }));
    let found = weights::dependency(&columns, degree)?;
    let divisors: Vec<_> = support.iter().map(|(of, _)| of.iter().map(|&i| row(i).1.clone()).product()).collect();
    let whole = weights::whole(&found[degree..], &divisors);
    let term = |(weight, (of, _)): (&_, &(Vec<usize>, f64))| Term {
        weight: ToString::to_string(weight),
        edges: of.iter().map(|&i| edges[i]).collect(),
    };
    let terms = whole.iter().zip(&support).map(term);
    Some(terms.filter(|t| t.weight != "0").collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_bigint::BigInt;

    /// Door in the plane at `x`.
    fn door(x: f64, [y0, y1]: [f64; 2], [z0, z1]: [f64; 2]) -> Vec<DVec3> {
        [(y0, z0), (y1, z0), (y1, z1), (y0, z1)].map(|(y, z)| DVec3::new(x, y, z)).to_vec()
    }

    struct Random(u64);

    impl Random {
        fn next(&mut self) -> u64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            self.0 >> 33
        }

        fn below(&mut self, n: u64) -> i64 {
            (self.next() % n) as i64
        }
    }

    /// Runs the test and checks its proof; whether a line passes, or `None` if that stays open.
    fn passes_all(windings: &[Vec<DVec3>]) -> Option<bool> {
        match ask(windings) {
            Answer::Line(line) => {
                assert!(windings.iter().all(|w| passes(&line, w)));
                Some(true)
            }
            Answer::Refuted(sums) => {
                check(windings, &sums);
                Some(false)
            }
            Answer::Open => None,
        }
    }

    /// Coordinates in units of 2^-60, without rounding.
    fn whole(p: DVec3) -> [BigInt; 3] {
        p.to_array().map(|x| {
            let scaled = x * 2f64.powi(60);
            assert!(scaled == scaled.trunc() && scaled.abs() < 1e38, "{x}");
            BigInt::from(scaled as i128)
        })
    }

    /// Checks that each sum is zero for random lines through integer points, and that its edges are those of the windings or dividers that
    /// cover all lines.
    fn check(windings: &[Vec<DVec3>], sums: &[Vec<Term>]) {
        let own: Vec<Edge> = windings.iter().flat_map(|w| around(&hull(w)).collect::<Vec<_>>()).collect();
        let mut random = Random(7);
        let mut dividers: Vec<Vec<Edge>> = Vec::new();
        for sum in sums {
            assert!(!sum.is_empty() && sum.iter().all(|t| !t.weight.starts_with('-') && t.weight != "0"));
            for _ in 0..30 {
                let mut point = || [0; 3].map(|_: i32| BigInt::from(random.below(1 << 30) - (1 << 29)) << 40usize);
                let (p, q) = (point(), point());
                let side = |[a, b]: &Edge| {
                    let from = |c: &[BigInt; 3]| std::array::from_fn::<BigInt, 3, _>(|k| &c[k] - &p[k]);
                    let (a, b, q) = (from(&whole(*a)), from(&whole(*b)), from(&q));
                    (0..3)
                        .map(|k| &q[k] * (&a[(k + 1) % 3] * &b[(k + 2) % 3] - &a[(k + 2) % 3] * &b[(k + 1) % 3]))
                        .sum::<BigInt>()
                };
                let value =
                    |t: &Term| t.weight.parse::<BigInt>().expect("a number") * t.edges.iter().map(side).product::<BigInt>();
                assert_eq!(sum.iter().map(value).sum::<BigInt>(), BigInt::ZERO);
            }
            let edges = sum.iter().flat_map(|t| t.edges.iter().copied());
            dividers.push(edges.filter(|e| !own.contains(e)).collect());
        }
        // Every choice of sides of the dividers must match some part.
        let mut all: Vec<Edge> = dividers
            .iter()
            .flatten()
            .map(|&[a, b]| if dividers.iter().flatten().any(|e| *e == [b, a]) { [a, b] } else { panic!("one side only") })
            .collect();
        all.sort_by(|a, b| format!("{a:?}").cmp(&format!("{b:?}")));
        all.dedup();
        let lines: Vec<Edge> = all.iter().filter(|[a, b]| format!("{a:?}") < format!("{b:?}")).copied().collect();
        assert!(lines.len() < 12);
        for choice in 0..1u32 << lines.len() {
            let chosen = |e: &Edge| {
                lines.iter().enumerate().any(|(i, &[a, b])| *e == if choice >> i & 1 == 0 { [a, b] } else { [b, a] })
            };
            assert!(dividers.iter().any(|d| d.iter().all(chosen)), "a part is missing");
        }
    }

    #[test]
    fn rows_of_doors_to_the_last_bit() {
        // A line passes a sequence of open intervals if every three have a common line (Helly); three have one if the middle interval meets
        // the span of the outer two.
        let stabs = |doors: &[(i64, [i64; 2])]| {
            let n = doors.len();
            (0..n).all(|i| {
                (i + 1..n).all(|j| {
                    (j + 1..n).all(|k| {
                        let ((x, a), (y, b), (z, c)) = (doors[i], doors[j], doors[k]);
                        let at = |e: usize| i128::from(z - y) * i128::from(a[e]) + i128::from(y - x) * i128::from(c[e]);
                        let b = b.map(|b| i128::from(b) * i128::from(z - x));
                        at(0).max(b[0]) < at(1).min(b[1])
                    })
                })
            })
        };
        let mut random = Random(3);
        let mut told = [0; 3];
        for round in 0..600 {
            let unit = [2f64.powi(-30), 2f64.powi(-36), 2f64.powi(-40)][round % 3];
            let n = 3 + random.below(4);
            let mut x = 0;
            // Edges lie within a few units of a line, on either side.
            let (rise, fall) = (random.below(1000) - 500, random.below(1000) - 500);
            let doors: Vec<(i64, [[i64; 2]; 2])> = (0..n)
                .map(|_| {
                    x += 1 + random.below(5);
                    let mut side = |slope: i64| {
                        let at = slope * x * 1_000_000 + random.below(5) - 2;
                        if random.below(2) == 0 { [at, at + 4_000_000_000] } else { [at - 4_000_000_000, at] }
                    };
                    (x, [side(rise), side(fall)])
                })
                .collect();
            let truth = (0..2).all(|axis| stabs(&doors.iter().map(|&(x, d)| (x, d[axis])).collect::<Vec<_>>()));
            let windings: Vec<Vec<DVec3>> = doors
                .iter()
                .map(|&(x, [y, z])| door(x as f64, y.map(|v| v as f64 * unit), z.map(|v| v as f64 * unit)))
                .collect();
            match passes_all(&windings) {
                None => told[2] += 1,
                Some(answer) => {
                    assert_eq!(answer, truth, "{doors:?}");
                    told[usize::from(answer)] += 1;
                }
            }
        }
        assert!(told[0] > 100 && told[1] > 20 && told[2] < 20, "hidden, seen, open: {told:?}");
    }

    #[test]
    fn three_skew_slits_and_a_fourth() {
        // Slits of half width w along the lines (a, t, a t) for a = 1, 2, 3, all on the saddle z = x y; for w = 0, the lines that meet all
        // three are (t, b, b t). One of them meets a fourth along (t, -t, c) if c = -b b. Otherwise the three leave 7 w beside the saddle
        // at x = 0, and the fourth w; and somewhat more a little before that.
        let w = 1.0 / 1024.0;
        let slit = |a: f64| [(-1.0, -w), (3.0, -w), (3.0, w), (-1.0, w)].map(|(t, d)| DVec3::new(a, t, a * t + d)).to_vec();
        let fourth = |c: f64| [(4.0, -w), (-1.0, -w), (-1.0, w), (4.0, w)].map(|(y, d)| DVec3::new(-y, y, c + d)).to_vec();
        let chain = |c: f64| {
            let mut first = fourth(c);
            first.reverse();
            [first, slit(1.0), slit(2.0), slit(3.0)]
        };
        assert_eq!(passes_all(&chain(0.0)[1..]), Some(true), "three have always a line");
        for b in [0.5, 1.0, 2.0, 2.9] {
            assert_eq!(passes_all(&chain(-b * b)), Some(true), "{b}");
        }
        assert_eq!(passes_all(&chain(8.0 * w)), Some(true));
        for c in [8.02 * w, 10.0 * w, 0.25, 1.0, -11.0] {
            assert_eq!(passes_all(&chain(c)), Some(false), "{c}");
        }
        let Answer::Refuted(sums) = ask(&chain(10.0 * w)) else { panic!("not refuted") };
        assert!(sums.iter().flatten().any(|t| t.edges.len() == 2), "the cone is not empty, only the quadric misses it");
    }

    #[test]
    fn touching_is_not_passing() {
        let open = [door(0.0, [0.0, 1.0], [0.0, 1.0]), door(1.0, [1.0, 2.0], [0.0, 1.0]), door(2.0, [2.0, 3.0], [0.0, 1.0])];
        assert_eq!(passes_all(&open), Some(true));
        let mut touching = open.clone();
        touching[1] = door(1.0, [2.0, 3.0], [0.0, 1.0]);
        touching[2] = door(2.0, [2.0, 3.0], [0.0, 1.0]);
        touching[0] = door(0.0, [1.0, 2.0], [0.0, 1.0]);
        assert_eq!(passes_all(&touching), Some(true), "from below 2 to beyond it");
        touching[2] = door(2.0, [1.0, 2.0], [0.0, 1.0]);
        assert_eq!(passes_all(&touching), Some(false));
        // Two windows of one wall, and two with a common edge across a corner.
        let back = |mut w: Vec<DVec3>| {
            w.reverse();
            w
        };
        assert_eq!(passes_all(&[back(open[0].clone()), door(0.0, [1.0, 2.0], [0.0, 1.0])]), Some(false));
        let corner =
            vec![DVec3::new(0.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 1.0), DVec3::new(1.0, 1.0, 1.0), DVec3::new(1.0, 1.0, 0.0)];
        assert_eq!(passes_all(&[door(0.0, [0.0, 1.0], [0.0, 1.0]), corner.clone()]), Some(true));
        assert_eq!(passes_all(&[door(0.0, [0.0, 1.0], [0.0, 1.0]), back(corner)]), Some(false));
    }

    #[test]
    fn slits_of_a_billionth_and_a_million_away() {
        for (far, width) in [(0.0, 1e-6), (0.0, 1e-9), (1e6, 1e-6), (1e6, 2e-9)] {
            let width = width as f32 as f64;
            let width = (width * 2f64.powi(50)).round() / 2f64.powi(50);
            let chain = |bend: f64| {
                [
                    door(far, [far, far + width], [far, far + 8.0]),
                    door(far + 1.0, [far, far + 8.0], [far + 3.0, far + 3.0 + width]),
                    door(far + 2.0, [far + bend, far + bend + width], [far, far + 8.0]),
                    door(far + 3.0, [far, far + 8.0], [far + 5.0, far + 5.0 + width]),
                    door(far + 4.0, [far + 2.0 * bend + 1.5 * width, far + 2.0 * bend + 2.5 * width], [far, far + 8.0]),
                ]
            };
            assert_eq!(passes_all(&chain(1.0)), Some(true), "{far} {width}");
            // Two widths off: the second slit would have to be wider.
            let mut bent = chain(1.0);
            bent[4].iter_mut().for_each(|p| p.y += width);
            assert_eq!(passes_all(&bent), Some(false), "{far} {width}");
        }
    }

    #[test]
    fn windings_that_are_none_tell_nothing() {
        let good = door(0.0, [0.0, 1.0], [0.0, 1.0]);
        for odd in
            [vec![], vec![DVec3::ZERO; 4], vec![DVec3::NAN; 3], vec![DVec3::X, DVec3::Y], vec![DVec3::splat(1e300); 4]]
        {
            assert_eq!(ask(&[good.clone(), odd]), Answer::Open);
        }
        assert_eq!(ask(&[]), Answer::Open);
        // A reflex corner, and a duplicate one.
        let mut dented = good.clone();
        dented.insert(1, DVec3::new(0.0, 0.5, 0.25));
        dented.push(dented[4]);
        assert_eq!(hull(&dented), good);
    }
}
