//! A room's surface, sampled by lines: its volume, its openings, its overlaps with others.
//!
//! Lines instead of edges, because exported surfaces have T-junctions and inconsistent winding, and still enclose a volume.

use crate::math::geom::Aabb;
use crate::math::parallel;
use crate::scene::RoomHint;
use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};

/// Lines along each side of a room: 3 x 16 x 16 in all.
const LINES: usize = 16;
/// Position within a grid square, off its centre, so that lines miss edges at round coordinates.
const OFF: DVec2 = DVec2::new(0.4951, 0.5073);

/// Two crossings within this distance count as one, metres, because some exporters write two shapes of one room. Larger: thin rooms have no
/// volume. Smaller: two copies with different rounding count twice.
const TWICE: f64 = 1e-6;

/// A room's surface and its measurements by lines.
pub(super) struct Solid<'h> {
    surface: &'h [[DVec3; 3]],
    /// Box around it.
    pub bounds: Aabb,
    /// Cubic metres: the median of the measurements along the three axes.
    pub volume: f64,
    /// Share of the lines that cross it an odd number of times.
    pub open_share: f64,
}

impl<'h> Solid<'h> {
    pub fn new(room: &'h RoomHint) -> Self {
        let surface = room.surface.as_slice();
        let bounds = Aabb::of(surface.iter().flatten().copied());
        let mut solid = Self { surface, bounds, volume: 0.0, open_share: 0.0 };
        if bounds.is_empty() {
            return solid;
        }
        let (mut met, mut odd) = (0usize, 0usize);
        let mut volumes = [0, 1, 2].map(|axis| {
            let mut volume = 0.0;
            for (q, area) in squares(&bounds, axis) {
                let at = solid.crossings(axis, q);
                met += usize::from(!at.is_empty());
                odd += at.len() % 2;
                volume += area * at.chunks_exact(2).map(|s| s[1] - s[0]).sum::<f64>();
            }
            volume
        });
        volumes.sort_by(f64::total_cmp);
        solid.volume = volumes[1];
        solid.open_share = odd as f64 / met.max(1) as f64;
        solid
    }

    /// Crossings of the surface by the line along `axis` through `q` (the two other coordinates, in order), ascending.
    fn crossings(&self, axis: usize, q: DVec2) -> Vec<f64> {
        let (u, v) = others(axis);
        let flat = |p: DVec3| Coord { x: p[u], y: p[v] };
        let here = Coord { x: q.x, y: q.y };
        let mut at: Vec<f64> = (self.surface.iter())
            .filter_map(|t| {
                let side = |a: DVec3, b: DVec3| orient2d(flat(a), flat(b), here);
                let s = [side(t[1], t[2]), side(t[2], t[0]), side(t[0], t[1])];
                let inside = s.iter().all(|x| *x > 0.0) || s.iter().all(|x| *x < 0.0);
                inside.then(|| (0..3).map(|i| t[i][axis] * s[i]).sum::<f64>() / (s[0] + s[1] + s[2]))
            })
            .collect();
        at.sort_by(f64::total_cmp);
        if at.len().is_multiple_of(4) && at.chunks_exact(2).all(|pair| pair[1] - pair[0] <= TWICE) {
            at = at.into_iter().step_by(2).collect();
        }
        at
    }
}

/// The axes other than `axis`.
fn others(axis: usize) -> (usize, usize) {
    [(1, 2), (0, 2), (0, 1)][axis]
}

/// Points of a grid over a side of a box, each with its area.
fn squares(bounds: &Aabb, axis: usize) -> impl Iterator<Item = (DVec2, f64)> {
    let (u, v) = others(axis);
    let (low, size) = (DVec2::new(bounds.min[u], bounds.min[v]), DVec2::new(bounds.size()[u], bounds.size()[v]));
    let area = size.x * size.y / (LINES * LINES) as f64;
    (0..LINES * LINES).map(move |k| {
        let at = (DVec2::new((k % LINES) as f64, (k / LINES) as f64) + OFF) / LINES as f64;
        (low + size * at, area)
    })
}

/// Pairs of overlapping rooms, with the shared volume in cubic metres; ascending.
pub(super) fn overlaps(solids: &[Solid<'_>]) -> Vec<(usize, usize, f64)> {
    // A sweep along x, so that only neighbours are compared.
    let mut order: Vec<usize> = (0..solids.len()).filter(|&i| solids[i].volume > 0.0).collect();
    order.sort_by(|&a, &b| solids[a].bounds.min.x.total_cmp(&solids[b].bounds.min.x).then(a.cmp(&b)));
    let pairs = order.iter().enumerate().flat_map(|(k, &i)| {
        let near = order[k + 1..].iter().take_while(move |&&j| solids[j].bounds.min.x < solids[i].bounds.max.x);
        near.map(move |&j| (i.min(j), i.max(j)))
    });
    let mut pairs: Vec<(usize, usize)> = pairs.collect();
    pairs.sort_unstable();
    let shared = |&(i, j): &(usize, usize)| {
        let (a, b) = (&solids[i], &solids[j]);
        let common = Aabb { min: a.bounds.min.max(b.bounds.min), max: a.bounds.max.min(b.bounds.max) };
        if common.is_empty() || common.size().min_element() <= 0.0 {
            return None;
        }
        let mut volume = 0.0;
        for (q, area) in squares(&common, 1) {
            let (of_a, of_b) = (a.crossings(1, q), b.crossings(1, q));
            for s in of_a.chunks_exact(2) {
                volume += of_b.chunks_exact(2).map(|t| (s[1].min(t[1]) - s[0].max(t[0])).max(0.0)).sum::<f64>() * area;
            }
        }
        (volume > 0.0).then_some((i, j, volume))
    };
    parallel::flat_map(&pairs, shared)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box with inconsistent winding.
    fn cuboid(min: [f64; 3], max: [f64; 3]) -> RoomHint {
        let c = |i: usize| DVec3::from_array(std::array::from_fn(|k| if i >> k & 1 == 0 { min[k] } else { max[k] }));
        let quads = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let surface = quads.iter().flat_map(|q| [[c(q[0]), c(q[1]), c(q[2])], [c(q[0]), c(q[2]), c(q[3])]]).collect();
        RoomHint { id: "r".into(), name: "r".into(), storey: None, surface, outside: false, drawn: true }
    }

    #[test]
    fn a_box_has_its_volume_and_no_hole() {
        let room = cuboid([1., 2., 3.], [4., 4.5, 8.]);
        let solid = Solid::new(&room);
        assert!((solid.volume - 37.5).abs() < 1e-9 && solid.open_share == 0.0, "{} {}", solid.volume, solid.open_share);
    }

    #[test]
    fn a_box_with_two_shapes_is_one() {
        let (room, mut twice) = (cuboid([1., 2., 3.], [4., 4.5, 8.]), cuboid([1., 2., 3.], [4., 4.5, 8.]));
        twice.surface.extend(room.surface.iter().map(|t| t.map(|p| p + DVec3::splat(1e-7))));
        let solid = Solid::new(&twice);
        assert!((solid.volume - 37.5).abs() < 1e-4 && solid.open_share == 0.0, "{} {}", solid.volume, solid.open_share);
        assert!((overlaps(&[solid, Solid::new(&room)])[0].2 - 37.5).abs() < 1e-4);
    }

    #[test]
    fn a_box_without_a_side_is_open() {
        for side in 0..6 {
            let mut room = cuboid([0.; 3], [4., 3., 5.]);
            room.surface.drain(2 * side..2 * side + 2);
            let share = Solid::new(&room).open_share;
            // A third of all lines crosses the missing side.
            assert!((share - 1.0 / 3.0).abs() < 1e-9, "side {side}: {share}");
        }
    }

    #[test]
    fn rooms_share_what_both_hold() {
        let rooms = [cuboid([0.; 3], [4., 3., 4.]), cuboid([3., 0., 0.], [7., 3., 4.]), cuboid([7., 0., 0.], [9., 3., 4.])];
        let solids: Vec<Solid> = rooms.iter().map(Solid::new).collect();
        let found = overlaps(&solids);
        assert_eq!(found.len(), 1);
        assert!(found[0].0 == 0 && found[0].1 == 1 && (found[0].2 - 12.0).abs() < 1e-9, "{found:?}");
    }
}
