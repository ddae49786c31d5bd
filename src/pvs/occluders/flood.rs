//! Whether a surface hides two convex sets from each other.
//!
//! Based on: Navazo, Rossignac, Jou, Shariff, *ShieldTester: cell-to-cell visibility test for surface occluders*, 2003: if one segment
//! between two sets crosses a connected surface, and the surface's border and silhouette are outside their shaft, then every segment
//! between the sets crosses it. Deviation: edges are connected by distance and in any number, not in pairs (see [`super::mesh`]), and the
//! test of an edge is whether the surface continues on both sides of every line that meets it.
//!
//! # Why nothing visible is hidden
//!
//! Take a surface C of whole triangles, and move a segment of the shaft that meets C continuously to one that does not, within the shaft.
//! The last segment that meets C meets it at an edge, or at one of its own ends. The ends are kept away from C. At an edge, seen along it,
//! C continues in several directions. All of one end of the shaft is to the right of one of them and to the left of another. So the segment
//! passes between these two, and meets one of them wherever it moves, unless it passes the gap between edge and triangle, which no segment
//! with clearance does.

use super::mesh::{Mesh, Seam, Tri};
use super::shaft::{End, Shaft, reach};
use crate::math::geom::{Aabb, Plane, middle};
use glam::DVec3;

/// Most triangles of one surface. Larger: more surfaces close shafts; failures cost more.
const MOST: usize = 192;

/// Scratch memory of one thread.
#[derive(Default)]
pub(super) struct Flood {
    members: Vec<u32>,
    covers: Vec<Seam>,
    part: [Vec<DVec3>; 2],
}

/// Where a surface ends.
#[derive(Clone, Copy)]
pub(super) struct Failed {
    /// A point of it.
    pub at: DVec3,
    /// A unit vector perpendicular to the edge and the shaft, or the normal of a triangle that is too near to an end; otherwise zero.
    pub across: DVec3,
}

/// Two ends of a shaft, and the options of the test.
pub(super) struct Between<'a> {
    /// From a portal's window, to a target.
    pub ends: [&'a End; 2],
    /// The hull of both.
    pub shaft: &'a Shaft,
    /// The target's object, if it is only one.
    pub object: Option<u32>,
    /// Whether lines within the clearance of a surface count, too.
    pub count_grazing_lines: bool,
}

/// Lines within this share of the clearance of an edge are not guaranteed. Less than 1 because of rounding.
const NEAR: f64 = 0.95;

impl Flood {
    /// Succeeds if the surface around triangle `seed` hides one end from the other: every segment between the two meets it, or passes an
    /// edge of it within the clearance. Otherwise returns where the surface ends.
    pub fn closes(&mut self, mesh: &Mesh, between: &Between<'_>, seed: u32) -> Result<(), Failed> {
        let mut buffers = std::mem::take(&mut self.part);
        let closed = self.closes_by(mesh, between, seed, &mut buffers);
        self.part = buffers;
        closed
    }

    fn closes_by(
        &mut self,
        mesh: &Mesh,
        between: &Between<'_>,
        seed: u32,
        buffers: &mut [Vec<DVec3>; 2],
    ) -> Result<(), Failed> {
        let Between { ends: [from, to], shaft, object, count_grazing_lines } = *between;
        let axis = to.bounds.centre() - from.bounds.centre();
        self.members.clear();
        self.members.push(seed);
        let mut next = 0;
        while let Some(&tri) = self.members.get(next) {
            next += 1;
            let t = &mesh.tris[tri as usize];
            let part = shaft.clip(&t.corners, buffers);
            if part.is_empty() {
                continue;
            }
            // Near its end, a line may pass triangles within the clearance of the target.
            if !apart(from, part, mesh.gap) {
                if !count_grazing_lines && from.points.iter().all(|&p| t.is_near(p, NEAR * mesh.clearance)) {
                    return Ok(()); // all lines are within the clearance of it there
                }
                return Err(Failed { at: middle(part), across: t.plane.n });
            }
            if !apart(to, part, mesh.clearance) {
                if !count_grazing_lines
                    && object != Some(t.object)
                    && object.is_some()
                    && lands_beside(from, to, t, axis, mesh.clearance)
                {
                    return Ok(());
                }
                return Err(Failed { at: middle(part), across: t.plane.n });
            }
            let sides = [from.side(&t.plane, 2.0 * mesh.gap), to.side(&t.plane, 2.0 * mesh.gap)];
            for edge in 0..3u8 {
                let (a, b) = (t.corners[edge as usize], t.corners[(edge as usize + 1) % 3]);
                let Some(span) = shaft.clip_segment(a, b) else { continue };
                let slack = mesh.gap / a.distance(b);
                if span[1] - span[0] <= slack {
                    continue;
                }
                let goes_on = [(from, sides[0]), (to, sides[1])]
                    .into_iter()
                    .any(|(end, side)| side != 0 && self.cover(mesh, (tri, edge), (span, slack), (end, side)));
                if goes_on {
                    continue;
                }
                let (p, q) = (a.lerp(b, span[0]), a.lerp(b, span[1]));
                let across = (b - a).cross(axis).normalize_or_zero();
                let foreign = !count_grazing_lines && object != Some(t.object) && apart(to, &[p, q], 2.5 * mesh.clearance);
                if foreign && grazes(from, to, [a, b], axis, NEAR * mesh.clearance) {
                    return Ok(());
                }
                return Err(Failed { at: (p + q) * 0.5, across });
            }
            if self.members.len() > MOST {
                return Err(Failed { at: t.corners[0], across: DVec3::ZERO });
            }
        }
        Ok(())
    }

    /// Adds triangles that continue the surface along all of `span` of an edge, on the opposite side of `end`.
    fn cover(
        &mut self,
        mesh: &Mesh,
        (tri, edge): (u32, u8),
        (span, slack): ([f64; 2], f64),
        (end, side): (&End, i32),
    ) -> bool {
        self.covers.clear();
        for seam in mesh.seams(tri).iter().filter(|s| s.edge == edge && s.span[1] >= span[0] && s.span[0] <= span[1]) {
            let ahead = if seam.ahead { 1 } else { -1 };
            if ahead * end.side(&mesh.tris[seam.tri as usize].plane, 2.0 * mesh.gap) == -side {
                self.covers.push(*seam);
            }
        }
        let mut at = span[0];
        let before = self.members.len();
        while at < span[1] - slack {
            // Members first, then the farthest-reaching seam.
            let reaches = |s: &&Seam| s.span[0] <= at + slack && s.span[1] > at + slack;
            let best = self.covers.iter().filter(reaches).max_by(|x, y| {
                let known = |s: &Seam| self.members.contains(&s.tri);
                known(x).cmp(&known(y)).then(x.span[1].total_cmp(&y.span[1])).then(y.tri.cmp(&x.tri))
            });
            let Some(best) = best.copied() else {
                self.members.truncate(before);
                return false;
            };
            if !self.members.contains(&best.tri) {
                self.members.push(best.tri);
            }
            at = best.span[1];
        }
        true
    }
}

/// True if a polygon is provably more than `margin` metres away from an end.
fn apart(end: &End, part: &[DVec3], margin: f64) -> bool {
    let off = |plane: &Plane| {
        let (low, high) = reach(part, plane);
        low > margin || high < -margin
    };
    if end.plane.as_ref().is_some_and(off) {
        return true;
    }
    let (a, b) = (end.bounds, Aabb::of(part.iter().copied()));
    (0..3).any(|k| b.min[k] > a.max[k] + margin || b.max[k] < a.min[k] - margin)
}

/// True if every segment passes a triangle within the clearance, a little before its target.
fn lands_beside(from: &End, to: &End, t: &Tri, axis: DVec3, clearance: f64) -> bool {
    let Some(target) = to.plane else { return false };
    let side = from.side(&target, 4.0 * clearance);
    let Some(direction) = axis.try_normalize() else { return false };
    let n = target.n * f64::from(-side);
    if side == 0 || n.dot(direction) <= 0.0 {
        return false;
    }
    let plane = Plane::through(to.bounds.centre() - direction * (3.0 * clearance / n.dot(direction)), n);
    crossings(from, to, &plane, |p| t.is_near(p, NEAR * clearance))
}

/// True if every segment between corners of two ends crosses `plane` from behind, at a point that satisfies `holds`.
fn crossings(from: &End, to: &End, plane: &Plane, holds: impl Fn(DVec3) -> bool) -> bool {
    from.points.iter().all(|&s| {
        let ds = plane.distance(s);
        to.points.iter().all(|&t| {
            let dt = plane.distance(t);
            ds < 0.0 && dt > 0.0 && holds(s.lerp(t, ds / (ds - dt)))
        })
    })
}

/// True if every segment between two ends passes the segment `a`-`b` within `near` metres, measured in the plane through it that faces the
/// shaft. Distance from a convex set is convex, so corners suffice.
fn grazes(from: &End, to: &End, [a, b]: [DVec3; 2], axis: DVec3, near: f64) -> bool {
    let along = (b - a).normalize_or_zero();
    let Some(n) = (axis - along * along.dot(axis)).try_normalize() else { return false };
    let plane = Plane::through(a, n);
    crossings(from, to, &plane, |p| {
        let nearest = a + along * along.dot(p - a).clamp(0.0, a.distance(b));
        p.distance(nearest) <= near
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImportOptions, Mesh as Part, Role, Scene, SceneBuilder, Source};

    const MARGIN: f64 = 1e-3;

    /// Vertical rectangles over lines in plan, `[x, z]` to `[x, z]`, between two heights; each an object.
    fn walls(walls: &[([f64; 2], [f64; 2], [f64; 2])]) -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        for (i, &(a, b, [low, high])) in walls.iter().enumerate() {
            let corner = |p: [f64; 2], y| DVec3::new(p[0], y, p[1]);
            let positions = vec![corner(a, low), corner(b, low), corner(b, high), corner(a, high)];
            let triangles = vec![[0, 1, 2], [0, 2, 3]];
            builder.add(Part { node: format!("{i}"), role: Role::Unknown, opaque: true, positions, triangles }).unwrap();
        }
        builder.finish("walls").unwrap()
    }

    /// Whether some surface hides the square of edge 1 around (0, 1, 10) from the one around (0, 1, 0).
    fn hides(scene: &Scene) -> bool {
        let square = |z: f64| {
            let points = [(-0.5, 0.5), (0.5, 0.5), (0.5, 1.5), (-0.5, 1.5)].map(|(x, y)| DVec3::new(x, y, z) - scene.origin);
            End::polygon(&points, Plane::through(points[0], DVec3::Z))
        };
        let (from, to) = (square(0.0), square(10.0));
        let mesh = Mesh::new(scene, MARGIN);
        let shaft = Shaft::new(&from, &to, 0.25 * mesh.gap, Vec::new());
        let mut crossed = Vec::new();
        mesh.crossed(middle(&from.points) + 0.01, middle(&to.points) + 0.02, [8, 0], &mut crossed);
        let between = Between { ends: [&from, &to], shaft: &shaft, object: None, count_grazing_lines: false };
        crossed.iter().any(|&(_, seed)| Flood::default().closes(&mesh, &between, seed).is_ok())
    }

    const HIGH: [f64; 2] = [0.0, 2.0];

    #[test]
    fn a_wall_hides_and_half_a_wall_does_not() {
        assert!(hides(&walls(&[([-2.0, 5.0], [2.0, 5.0], HIGH)])));
        assert!(!hides(&walls(&[([-2.0, 5.0], [0.3, 5.0], HIGH)])));
        assert!(!hides(&walls(&[([-2.0, 5.0], [2.0, 5.0], [0.0, 1.2])])));
        assert!(!hides(&walls(&[([-2.0, 0.0], [2.0, 0.0], HIGH)])), "on an end, it shuts nothing");
    }

    #[test]
    fn walls_that_meet_are_one_surface_whatever_their_corners() {
        let left = ([-2.0, 5.0], [0.1, 5.0], HIGH);
        let below = ([0.1, 5.0], [2.0, 5.0], [0.0, 0.9]);
        let above = ([0.1, 5.0], [2.0, 5.0], [0.9, 2.0]);
        assert!(hides(&walls(&[left, below, above])), "three panels");
        assert!(!hides(&walls(&[left, below])));
        let overlapping = ([-0.2, 5.0], [2.0, 5.0], HIGH);
        assert!(hides(&walls(&[left, overlapping])), "an edge inside another panel");
    }

    #[test]
    fn a_crack_counts_where_it_is_wider_than_the_gap() {
        let panels = |crack: f64| walls(&[([-2.0, 5.0], [0.1, 5.0], HIGH), ([0.1 + crack, 5.0], [2.0, 5.0], HIGH)]);
        assert!(hides(&panels(0.1 * MARGIN)));
        assert!(!hides(&panels(3.0 * MARGIN)));
    }

    #[test]
    fn corners_hide_from_inside_and_end_from_outside() {
        // A corner that points away, as in a room: lines meet one wall or the other.
        assert!(hides(&walls(&[([-4.0, 1.0], [0.1, 5.0], HIGH), ([0.1, 5.0], [4.0, 1.0], HIGH)])));
        // Two walls that overlap without meeting: each has an edge in the shaft, and there is a passage between them.
        assert!(!hides(&walls(&[([-2.0, 5.0], [0.1, 5.0], HIGH), ([-0.1, 6.0], [2.0, 6.0], HIGH)])));
    }

    #[test]
    fn an_edge_that_all_lines_pass_closely_shuts() {
        let (a, b) = (DVec3::new(0.0, -9.0, 5.0), DVec3::new(0.0, 9.0, 5.0));
        let strip = |z: f64| {
            let points = [(-1e-4, 0.0), (1e-4, 0.0), (1e-4, 2.0), (-1e-4, 2.0)].map(|(x, y)| DVec3::new(x, y, z));
            End::polygon(&points, Plane::through(points[0], DVec3::Z))
        };
        let axis = DVec3::Z * 10.0;
        assert!(grazes(&strip(0.0), &strip(10.0), [a, b], axis, 2e-4));
        assert!(!grazes(&strip(0.0), &strip(10.0), [a, b], axis, 0.5e-4));
        assert!(!grazes(&strip(0.0), &strip(10.0), [a, b - DVec3::Y * 8.5], axis, 2e-4), "beyond its end");
    }
}
