//! Splits a mesh into clusters of triangles that are often visible together.
//!
//! Based on: Goldsmith, Salmon, *Automatic creation of object hierarchies for ray tracing*, 1987 (the probability that a random line hits a
//! box is proportional to the box's surface), and Wald, *On fast construction of SAH-based bounding volume hierarchies*, 2007 (bins instead
//! of sorting). Deviations: a leaf is a cluster, so the cost of a side is its triangle count (all are drawn if any is visible) times its
//! box's surface times a facing factor, because triangles that face one way are visible from one side of their wall only; splits by facing
//! are tried besides splits in space; each side gets at least a sixteenth, which bounds the depth and avoids tiny clusters. A mesh below
//! the limit that is scattered over the scene (levels are often exported with one group per texture) is split, too.

use crate::math::geom::Aabb;
use crate::math::parallel;
use glam::DVec3;

/// Bins along each axis for the triangles' centres.
const BINS: usize = 16;
/// Each side of a split gets at least one in this many triangles.
const LEAST_SHARE: usize = 16;
/// Cost reduction for triangles that all face one way. Of 0, 1/4, 1/2, 3/4 and 1, this value drew the fewest triangles from points and
/// small regions inside three game levels; at 1, flat clusters cost nothing and are split without end.
const ONE_WAY: f64 = 0.75;
/// A part below the limit is split while that leaves less than this fraction of its cost: a corridor cut in two gives half, so well below
/// half means that there is a gap.
const STREWN: f64 = 0.25;
/// Parts below the limit by this factor are never split.
const CRUMB: usize = 8;
/// Parts with more triangles are split on two threads.
const FORK: usize = 1 << 14;

/// Triangles as indices into positions, which may have unused entries.
#[derive(Clone, Copy)]
pub(super) struct Soup<'a> {
    pub positions: &'a [DVec3],
    pub triangles: &'a [[u32; 3]],
}

/// Lists of triangle numbers, ascending, each of at most `limit`, every triangle in exactly one; in a fixed order.
/// O(n log n) in the number of triangles.
pub(super) fn clusters(mesh: Soup<'_>, limit: u32) -> Vec<Vec<u32>> {
    split(mesh, (0..mesh.triangles.len() as u32).collect(), limit.max(1) as usize)
}

fn split(mesh: Soup<'_>, part: Vec<u32>, limit: usize) -> Vec<Vec<u32>> {
    let fits = part.len() <= limit;
    if fits && part.len() <= limit / CRUMB {
        return vec![part];
    }
    let (left, right) = match best_split(mesh, &part) {
        Some((cut, gain)) if !fits || gain < STREWN => part.iter().partition(|&&t| cut.is_left(&Triangle::of(mesh, t))),
        _ if fits => return vec![part],
        _ => halves(mesh, part),
    };
    let (mut out, rest) = if left.len() + right.len() > FORK {
        parallel::join(|| split(mesh, left, limit), || split(mesh, right, limit))
    } else {
        (split(mesh, left, limit), split(mesh, right, limit))
    };
    out.extend(rest);
    out
}

/// A triangle's data for a split.
struct Triangle {
    middle: DVec3,
    bounds: Aabb,
    /// Unit normal times twice the area.
    facing: DVec3,
    /// Its length.
    area: f64,
}

impl Triangle {
    fn of(mesh: Soup<'_>, triangle: u32) -> Self {
        let [a, b, c] = mesh.triangles[triangle as usize].map(|i| mesh.positions[i as usize]);
        let facing = (b - a).cross(c - a);
        Self { middle: (a + b + c) / 3.0, bounds: Aabb::of([a, b, c]), facing, area: facing.length() }
    }
}

/// The triangles that go left.
enum Cut {
    /// Those in this bin or before it.
    Space { axis: usize, least: f64, bins_per_metre: f64, last_left: usize },
    /// Those whose unit normal times `sign` has a component of more than half along `axis`.
    Facing { axis: usize, sign: f64 },
}

impl Cut {
    fn is_left(&self, triangle: &Triangle) -> bool {
        match *self {
            Self::Space { axis, least, bins_per_metre, last_left } => {
                bin(triangle.middle[axis], least, bins_per_metre) <= last_left
            }
            Self::Facing { axis, sign } => triangle.facing[axis] * sign > 0.5 * triangle.area,
        }
    }
}

fn bin(x: f64, least: f64, bins_per_metre: f64) -> usize {
    (((x - least) * bins_per_metre) as usize).min(BINS - 1)
}

/// Totals of a set of triangles for the cost.
#[derive(Clone, Copy)]
struct Group {
    count: usize,
    bounds: Aabb,
    /// Sum of [`Triangle::facing`].
    facing: DVec3,
    /// Sum of [`Triangle::area`].
    area: f64,
}

impl Group {
    const NONE: Self = Self { count: 0, bounds: Aabb::EMPTY, facing: DVec3::ZERO, area: 0.0 };

    fn with(self, t: &Triangle) -> Self {
        Self {
            count: self.count + 1,
            bounds: self.bounds.union(t.bounds),
            facing: self.facing + t.facing,
            area: self.area + t.area,
        }
    }

    fn and(self, o: Self) -> Self {
        Self {
            count: self.count + o.count,
            bounds: self.bounds.union(o.bounds),
            facing: self.facing + o.facing,
            area: self.area + o.area,
        }
    }

    /// Number of triangles times the probability of drawing them, up to a constant factor.
    fn cost(&self) -> f64 {
        let size = self.bounds.size();
        let surface = size.x * size.y + size.y * size.z + size.z * size.x;
        let spread = 1.0 - ONE_WAY * self.facing.length() / self.area.max(f64::MIN_POSITIVE);
        self.count as f64 * surface * spread
    }
}

/// The cheapest split that leaves each side its least share, and its cost as a fraction of the unsplit cost.
fn best_split(mesh: Soup<'_>, part: &[u32]) -> Option<(Cut, f64)> {
    let middles = part.iter().fold(Aabb::EMPTY, |b, &t| b.with(Triangle::of(mesh, t).middle));
    let bins_per_metre = (BINS as f64 / middles.size()).map(|x| if x.is_finite() { x } else { 0.0 });
    let mut bins = [[Group::NONE; BINS]; 3];
    // For each axis and sign: the triangles that face that way, and the others.
    let mut ways = [[Group::NONE; 2]; 6];
    let cut_of = |way: usize| Cut::Facing { axis: way / 2, sign: if way.is_multiple_of(2) { 1.0 } else { -1.0 } };
    for &t in part {
        let triangle = Triangle::of(mesh, t);
        for (axis, bins) in bins.iter_mut().enumerate() {
            let group = &mut bins[bin(triangle.middle[axis], middles.min[axis], bins_per_metre[axis])];
            *group = group.with(&triangle);
        }
        for (way, groups) in ways.iter_mut().enumerate() {
            let group = &mut groups[usize::from(!cut_of(way).is_left(&triangle))];
            *group = group.with(&triangle);
        }
    }
    let least = (part.len() / LEAST_SHARE).max(1);
    let whole = ways[0][0].and(ways[0][1]).cost();
    let mut best: Option<(Cut, f64)> = None;
    let mut offer = |cut: Cut, left: Group, right: Group| {
        let cost = left.cost() + right.cost();
        if left.count >= least && right.count >= least && best.as_ref().is_none_or(|(_, b)| cost < *b) {
            best = Some((cut, cost));
        }
    };
    for (axis, bins) in bins.iter().enumerate() {
        let mut above = [Group::NONE; BINS + 1];
        for b in (0..BINS).rev() {
            above[b] = above[b + 1].and(bins[b]);
        }
        let mut below = Group::NONE;
        for b in 0..BINS - 1 {
            below = below.and(bins[b]);
            let cut = Cut::Space { axis, least: middles.min[axis], bins_per_metre: bins_per_metre[axis], last_left: b };
            offer(cut, below, above[b + 1]);
        }
    }
    for (way, [facing, others]) in ways.into_iter().enumerate() {
        offer(cut_of(way), facing, others);
    }
    best.map(|(cut, cost)| (cut, if whole > 0.0 { cost / whole } else { 1.0 }))
}

/// The fallback if no split gives each side its share: halves by the median of centres along the longest axis.
fn halves(mesh: Soup<'_>, part: Vec<u32>) -> (Vec<u32>, Vec<u32>) {
    let middle = |t: u32| Triangle::of(mesh, t).middle;
    let size = Aabb::of(part.iter().map(|&t| middle(t))).size();
    let axis = if size.x >= size.max_element() {
        0
    } else if size.z >= size.y {
        2
    } else {
        1
    };
    let mut order: Vec<(f64, u32)> = part.iter().map(|&t| (middle(t)[axis], t)).collect();
    let by_place = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    let half = order.len() / 2;
    let (_, pivot, _) = order.select_nth_unstable_by(half, by_place);
    let pivot = *pivot;
    part.into_iter().partition(|&t| by_place(&(middle(t)[axis], t), &pivot).is_lt())
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Mesh(Vec<DVec3>, Vec<[u32; 3]>);

    fn mesh(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> Mesh {
        let positions: Vec<DVec3> = triangles.into_iter().flatten().collect();
        let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        Mesh(positions, triangles)
    }

    fn clusters(mesh: &Mesh, limit: u32) -> Vec<Vec<u32>> {
        super::clusters(Soup { positions: &mesh.0, triangles: &mesh.1 }, limit)
    }

    /// A grid of `n * n` squares of 1 m in the plane through `at` along `u` and `v`.
    fn grid(at: DVec3, u: DVec3, v: DVec3, n: usize) -> impl Iterator<Item = [DVec3; 3]> {
        (0..n * n).flat_map(move |i| {
            let p = at + u * (i % n) as f64 + v * (i / n) as f64;
            [[p, p + u, p + u + v], [p, p + u + v, p + v]]
        })
    }

    fn check_partition(parts: &[Vec<u32>], n: usize, limit: usize) {
        assert!(parts.iter().all(|p| !p.is_empty() && p.len() <= limit && p.is_sorted()));
        let mut all: Vec<u32> = parts.concat();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..n as u32));
    }

    #[test]
    fn every_triangle_is_in_exactly_one_cluster_of_at_most_the_limit() {
        let m = mesh(grid(DVec3::ZERO, DVec3::X, DVec3::Z, 40));
        for limit in [1, 2, 7, 256, 100_000] {
            check_partition(&clusters(&m, limit), 3200, limit as usize);
        }
        // Identical triangles.
        let heap = mesh(std::iter::repeat_n([DVec3::ZERO, DVec3::X, DVec3::Y], 1000));
        check_partition(&clusters(&heap, 10), 1000, 10);
    }

    #[test]
    fn the_two_faces_of_a_wall_fall_into_different_clusters() {
        let front = grid(DVec3::ZERO, DVec3::X, DVec3::Y, 8);
        let back = grid(DVec3::new(8.0, 0.0, -0.2), -DVec3::X, DVec3::Y, 8);
        let mut parts = clusters(&mesh(front.chain(back)), 128);
        parts.sort();
        assert_eq!(parts, [(0..128).collect::<Vec<u32>>(), (128..256).collect()]);
    }

    #[test]
    fn a_strewn_mesh_is_split_below_the_limit_and_a_compact_one_is_not() {
        let far = DVec3::new(100.0, 0.0, 30.0);
        let strewn = mesh(grid(DVec3::ZERO, DVec3::X, DVec3::Z, 4).chain(grid(far, DVec3::X, DVec3::Z, 4)));
        assert_eq!(clusters(&strewn, 256), [(0..32).collect::<Vec<u32>>(), (32..64).collect()]);
        assert_eq!(clusters(&mesh(grid(DVec3::ZERO, DVec3::X, DVec3::Z, 8)), 256).len(), 1);
    }
}
