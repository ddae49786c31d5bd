//! Merges the leaves of a region into few convex pieces.
//!
//! Based on: Hertel, Mehlhorn, *Fast triangulation of the plane with respect to simple polygons*, 1983, a dimension up: two pieces merge
//! across their common face, the largest faces first, if the result is convex: if each lies within all planes of the other except the
//! common one. Then every point within both sets of planes without that one is in one of the two.

use super::adjacency::Contact;
use super::tree::{Bsp, Poly};
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::{Piece, polyhedron};
use crate::job::{Job, Stopped};
use crate::math::geom::{Aabb, Plane};
use glam::DVec3;

/// A piece while it grows.
struct Growing {
    /// Planes with outward normals.
    planes: Vec<Plane>,
    corners: Vec<DVec3>,
}

impl Growing {
    fn new(poly: &Poly, eps: f64) -> Self {
        let planes = poly.faces.iter().map(|f| if f.front { f.plane.flipped() } else { f.plane }).collect();
        let mut corners: Vec<DVec3> = Vec::new();
        for &p in poly.faces.iter().flat_map(|f| &f.points) {
            if corners.iter().all(|c| c.distance(p) > eps) {
                corners.push(p);
            }
        }
        Self { planes, corners }
    }

    /// True if all of `other` is inside every plane except `common` (in either orientation).
    fn holds(&self, other: &Self, common: &Plane, eps: f64) -> bool {
        let is_common = |p: &Plane| same(p, common) || same(&p.flipped(), common);
        self.planes.iter().filter(|p| !is_common(p)).all(|p| other.corners.iter().all(|&c| p.distance(c) <= eps))
    }

    fn join(&mut self, other: Self, common: &Plane, eps: f64) {
        self.planes.extend(other.planes);
        self.planes.retain(|p| !same(p, common) && !same(&p.flipped(), common));
        for c in other.corners {
            if self.corners.iter().all(|d| d.distance(c) > eps) {
                self.corners.push(c);
            }
        }
        // Keeps planes with three non-collinear corners, or without which the piece would be larger.
        let on = |p: &Plane, c: &DVec3| p.distance(*c).abs() <= 2.0 * eps;
        let spans = |p: &Plane| {
            let mut on = self.corners.iter().filter(|c| on(p, c));
            let Some(&first) = on.next() else { return false };
            let mut line: Option<DVec3> = None;
            on.any(|&c| match line {
                None => {
                    line = Some((c - first).normalize_or_zero());
                    false
                }
                Some(line) => line.cross(c - first).length() > 4.0 * eps,
            })
        };
        let mut kept: Vec<Plane> = Vec::new();
        for p in &self.planes {
            if !kept.iter().any(|k| same(k, p)) {
                kept.push(*p);
            }
        }
        let bounds = Aabb::of(self.corners.iter().copied());
        let around = bounds.inflated(bounds.diagonal());
        for p in kept.clone().into_iter().filter(|p| !spans(p)) {
            let others: Vec<Plane> = kept.iter().filter(|k| !same(k, &p)).copied().collect();
            if polyhedron::faces(&others, &around).iter().flatten().all(|&c| p.distance(c) <= eps) {
                kept = others;
            }
        }
        self.planes = kept;
        let planes = &self.planes;
        self.corners.retain(|c| planes.iter().filter(|p| on(p, c)).count() >= 2);
    }
}

fn same(a: &Plane, b: &Plane) -> bool {
    a.n == b.n && a.d == b.d
}

/// Convex pieces of each region; `eps`: largest overlap of pieces, metres.
pub fn pieces(
    bsp: &Bsp,
    contacts: &[Contact],
    labels: &[Option<u32>],
    regions: usize,
    eps: f64,
    work: &Job<'_>,
) -> Result<Vec<Vec<Piece>>, Stopped> {
    let mut growing: Vec<Option<Growing>> =
        bsp.leaves.iter().zip(labels).map(|(leaf, l)| l.map(|_| Growing::new(&leaf.poly, eps))).collect();
    let mut set = DisjointSets::new(growing.len());
    let inner = |c: &&Contact| {
        let [a, b] = c.leaves.map(|l| labels[l as usize]);
        a.is_some() && a == b
    };
    let mut order: Vec<&Contact> = contacts.iter().filter(inner).collect();
    order.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.leaves.cmp(&b.leaves)));
    loop {
        let before = order.len();
        let mut left = Vec::new();
        for c in order {
            work.go_on()?;
            let (a, b) = (set.find(c.leaves[0]), set.find(c.leaves[1]));
            if a == b {
                continue;
            }
            let (a, b) = (a.min(b), a.max(b));
            let common = &bsp.nodes[c.node as usize].plane;
            let fits = match (&growing[a as usize], &growing[b as usize]) {
                (Some(p), Some(q)) => p.holds(q, common, eps) && q.holds(p, common, eps),
                _ => false,
            };
            if !fits {
                left.push(c);
                continue;
            }
            set.join(a, b);
            if let (Some(p), Some(q)) = (growing[a as usize].take(), growing[b as usize].take()) {
                let mut joined = p;
                joined.join(q, common, eps);
                growing[a as usize] = Some(joined);
            }
        }
        if left.len() == before || left.is_empty() {
            break;
        }
        order = left;
    }
    let mut out: Vec<Vec<Piece>> = vec![Vec::new(); regions];
    for (leaf, g) in growing.into_iter().enumerate() {
        if let (Some(g), Some(label)) = (g, labels[leaf]) {
            let bounds = Aabb::of(g.corners.iter().copied());
            out[label as usize].push(Piece { planes: g.planes, bounds });
        }
    }
    Ok(out)
}
