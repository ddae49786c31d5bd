//! Opaque triangles, and the adjacency along each edge.
//!
//! Models are not manifold meshes: walls abut on walls, storeys are separate, edges of one solid lie along or inside faces of another. So
//! neighbours of an edge are found by distance: every triangle within [`Mesh::gap`] along a stretch of it. A line between the two is within
//! the clearance of them, and the guarantee does not cover it.

use crate::math::box_tree::BoxTree;
use crate::math::geom::{Aabb, Plane};
use crate::scene::Scene;
use glam::DVec3;
use std::sync::OnceLock;

/// An opaque triangle.
pub(super) struct Tri {
    /// Its corners.
    pub corners: [DVec3; 3],
    /// Its plane; seen from the tip of the normal, corners run counter-clockwise.
    pub plane: Plane,
    /// Its area, square metres.
    pub area: f64,
    /// Index into [`Scene::triangles`].
    pub id: u32,
    /// Index into [`Scene::objects`].
    pub object: u32,
}

impl Tri {
    /// True if a point is over the triangle, within `near` metres.
    pub fn is_near(&self, p: DVec3, near: f64) -> bool {
        self.plane.distance(p).abs() <= near && inside(self, p, 0.0)
    }
}

/// A stretch of a triangle's edge along which another triangle continues.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seam {
    /// The edge from corner `edge` to the next.
    pub edge: u8,
    /// The other triangle.
    pub tri: u32,
    /// Whether the other triangle extends towards its own normal x the edge's direction; otherwise the opposite.
    pub ahead: bool,
    /// The stretch, as fractions of the edge.
    pub span: [f64; 2],
}

/// An edge and a triangle are connected within this share of the clearance. Larger: an end of a shaft must be farther from planes, so more
/// of the rim of portals stays undecided. Smaller: walls that abut to within rounding fall apart.
const GAP: f64 = 0.15;

/// The opaque non-degenerate triangles of a scene, without the bounding prisms of tubes, which hide more than the tubes.
pub(super) struct Mesh {
    /// The triangles.
    pub tris: Vec<Tri>,
    /// Distance within which an edge and a triangle are connected, metres.
    pub gap: f64,
    /// The clearance that guaranteed lines keep, metres.
    pub clearance: f64,
    tree: BoxTree,
    /// Seams of each triangle, computed on first use: most never are.
    seams: Vec<OnceLock<Box<[Seam]>>>,
}

impl Mesh {
    /// The mesh of a scene; `clearance`: that of guaranteed lines, metres.
    pub fn new(scene: &Scene, clearance: f64) -> Self {
        let gap = GAP * clearance;
        let opaque = (0u32..).zip(&scene.objects).filter(|(_, o)| o.opaque && !o.is_tube());
        let opaque = opaque.flat_map(|(i, o)| o.triangles.clone().map(move |t| (i, t)));
        let tri = |(object, id): (u32, u32)| {
            let corners = scene.corners(id as usize);
            let [a, b, c] = corners;
            let n = (b - a).cross(c - a);
            let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
            // Thinner than the gap: its neighbours are connected across it.
            let thin = n.length_squared() <= longest * gap * gap;
            (!thin).then(|| Tri { corners, plane: Plane::through(a, n.normalize()), area: 0.5 * n.length(), id, object })
        };
        let tris: Vec<Tri> = opaque.filter_map(tri).collect();
        let boxes: Vec<Aabb> = tris.iter().map(|t| Aabb::of(t.corners)).collect();
        let tree = BoxTree::over(&boxes);
        let seams = tris.iter().map(|_| OnceLock::new()).collect();
        Self { tris, gap, clearance, tree, seams }
    }

    /// The neighbours along the edges of a triangle.
    pub fn seams(&self, tri: u32) -> &[Seam] {
        self.seams[tri as usize].get_or_init(|| self.find_seams(tri).into())
    }

    fn find_seams(&self, tri: u32) -> Vec<Seam> {
        let (mut out, gap) = (Vec::new(), self.gap);
        let corners = &self.tris[tri as usize].corners;
        for edge in 0..3 {
            let (a, b) = (corners[edge], corners[(edge + 1) % 3]);
            let length = a.distance(b);
            let along = (b - a) / length;
            self.tree.in_box(&Aabb::of([a, b]).inflated(gap), &mut |other| {
                if other == tri {
                    return;
                }
                let t = &self.tris[other as usize];
                let Some(span) = near(a, b, t, gap) else { return };
                if (span[1] - span[0]) * length < 2.0 * gap {
                    return;
                }
                let across = t.plane.n.cross(along);
                let middle = a.lerp(b, 0.5 * (span[0] + span[1]));
                for (ahead, sign) in [(true, 3.0 * gap), (false, -3.0 * gap)] {
                    if inside(t, middle + across * sign, 0.0) {
                        out.push(Seam { edge: edge as u8, tri: other, ahead, span });
                    }
                }
            });
        }
        out.sort_by_key(|s| (s.edge, s.tri, s.ahead));
        out
    }

    /// Insets a convex polygon by `inset` metres along each edge that is lined by triangles, or that would be without its growth of `grown`
    /// metres. Edges across which the polygon extends less than `least` metres stay.
    pub fn inset(&self, winding: &[DVec3], n: DVec3, [grown, inset]: [f64; 2], least: f64) -> Vec<DVec3> {
        let mut out = winding.to_vec();
        for (i, &a) in winding.iter().enumerate() {
            let b = winding[(i + 1) % winding.len()];
            let Some(away) = (b - a).cross(n).try_normalize() else { continue };
            if winding.iter().all(|&c| away.dot(b - c) < least) {
                continue;
            }
            let lined = [grown, 0.0].into_iter().find(|&by| self.is_lined(a - away * by, b - away * by));
            if let Some(by) = lined {
                let plane = Plane::through(a - away * (by + inset), away);
                out = crate::math::geom::clip(&out, &plane, 0.0);
            }
        }
        out
    }

    /// True if triangles are within the gap all along the segment from `a` to `b`.
    fn is_lined(&self, a: DVec3, b: DVec3) -> bool {
        let mut spans = Vec::new();
        self.tree.in_box(&Aabb::of([a, b]).inflated(self.gap), &mut |i| {
            spans.extend(near(a, b, &self.tris[i as usize], self.gap))
        });
        spans.sort_by(|x: &[f64; 2], y| x[0].total_cmp(&y[0]));
        let slack = 2.0 * self.gap / a.distance(b);
        let reached = spans.iter().fold(0.0f64, |at, s| if s[0] <= at + slack { at.max(s[1]) } else { at });
        reached >= 1.0 - slack
    }

    /// The first triangle that the segment from `a` to `b` crosses, with its place; and those to try as occluders in `out`: so many of the
    /// largest, whose edges are seldom in the shaft, then so many of the nearest to `a`.
    pub fn crossed(
        &self,
        a: DVec3,
        b: DVec3,
        [largest, nearest]: [usize; 2],
        out: &mut Vec<(f64, u32)>,
    ) -> Option<(f64, u32)> {
        out.clear();
        let length = a.distance(b);
        let direction = (b - a) / length;
        self.tree.on_ray(a, direction, length, self.gap, &mut |i| {
            let t = &self.tris[i as usize];
            let (da, db) = (t.plane.distance(a), t.plane.distance(b));
            if (da > 0.0) != (db > 0.0) {
                let s = da / (da - db);
                if inside(t, a.lerp(b, s), 0.0) {
                    out.push((s, i));
                }
            }
        });
        let nearer = |x: &(f64, u32), y: &(f64, u32)| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1));
        let first = out.iter().copied().min_by(nearer);
        let area = |&(_, tri): &(f64, u32)| self.tris[tri as usize].area;
        out.sort_by(|x, y| area(y).total_cmp(&area(x)).then(nearer(x, y)));
        if out.len() > largest {
            out[largest..].sort_by(nearer);
        }
        out.truncate(largest + nearest);
        first
    }
}

/// True if a point of a triangle's plane is in the triangle grown by `by` metres.
fn inside(t: &Tri, p: DVec3, by: f64) -> bool {
    (0..3).all(|k| outward(t, k).is_none_or(|e| e.distance(p) <= by))
}

/// The plane through an edge perpendicular to the triangle, normal outward.
fn outward(t: &Tri, edge: usize) -> Option<Plane> {
    let (a, b) = (t.corners[edge], t.corners[(edge + 1) % 3]);
    Some(Plane::through(a, (b - a).cross(t.plane.n).try_normalize()?))
}

/// The stretch of the segment from `a` to `b` within `gap` of a triangle.
fn near(a: DVec3, b: DVec3, t: &Tri, gap: f64) -> Option<[f64; 2]> {
    let mut span = [0.0f64, 1.0];
    let faces = [t.plane, t.plane.flipped()].into_iter().chain((0..3).filter_map(|k| outward(t, k)));
    for plane in faces {
        keep_inside(plane.distance(a) - gap, plane.distance(b) - gap, &mut span);
    }
    let bounds = Aabb::of(t.corners).inflated(gap);
    for axis in 0..3 {
        keep_inside(a[axis] - bounds.max[axis], b[axis] - bounds.max[axis], &mut span);
        keep_inside(bounds.min[axis] - a[axis], bounds.min[axis] - b[axis], &mut span);
    }
    (span[0] < span[1]).then_some(span)
}

/// Clips a stretch of a segment to where a linear distance, `da` at its start and `db` at its end, is not above 0.
pub(super) fn keep_inside(da: f64, db: f64, span: &mut [f64; 2]) {
    match (da > 0.0, db > 0.0) {
        (true, true) => span[1] = span[0] - 1.0,
        (true, false) => span[0] = span[0].max(da / (da - db)),
        (false, true) => span[1] = span[1].min(da / (da - db)),
        (false, false) => {}
    }
}
