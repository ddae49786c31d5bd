//! The triangles that split space, and their planes.

use crate::cells::disjoint_sets::DisjointSets;
use crate::math::geom::{Aabb, Plane, area, newell};
use crate::scene::{Role, Scene};
use glam::{DVec2, DVec3};
use std::collections::{BTreeMap, HashMap};

/// A triangle is vertical if its normal's cosine with the vertical is below this (84 degrees).
const UPRIGHT: f64 = 0.1;

/// Polygons within this share of the coplanar tolerance of a splitting plane are not split. Where surfaces meet at a shallow angle, that
/// leaves a slit, which the seal closes down to half a degree. Smaller: rounding makes cuts.
pub const TOUCH: f64 = 0.02;

/// Triangles and their planes.
pub struct Shell {
    /// Planes, ordered by their largest triangle.
    pub planes: Vec<Plane>,
    /// Triangles, each with the index of its plane, to within [`TOUCH`] of the coplanar tolerance.
    pub triangles: Vec<([DVec3; 3], u32)>,
    /// Number of triangles left out because of the tree's size.
    pub left_out: usize,
}

impl Shell {
    /// Removes the triangles of half of the planes: those with the least area.
    pub fn keep_larger_half(&mut self) {
        let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
        self.triangles.iter().for_each(|(t, plane)| *areas.entry(*plane).or_default() += area(t));
        let mut order: Vec<(f64, u32)> = areas.into_iter().map(|(plane, area)| (area, plane)).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut kept: Vec<u32> = order[..order.len() / 2].iter().map(|&(_, plane)| plane).collect();
        kept.sort_unstable();
        let before = self.triangles.len();
        self.triangles.retain(|(_, plane)| kept.binary_search(plane).is_ok());
        self.left_out += before - self.triangles.len();
    }
}

/// A corner, quantized to a fraction of the tolerance.
pub fn key(p: DVec3, coplanar: f64) -> [i64; 3] {
    (p / (0.25 * coplanar)).round().to_array().map(|x| x as i64)
}

/// Connected components of triangles over shared corners, ascending.
pub fn parts(triangles: &[[DVec3; 3]], coplanar: f64) -> Vec<Vec<u32>> {
    let mut first: HashMap<[i64; 3], u32> = HashMap::new();
    let mut set = DisjointSets::new(triangles.len());
    for (i, t) in triangles.iter().enumerate() {
        for &p in t {
            let other = *first.entry(key(p, coplanar)).or_insert(i as u32);
            set.join(other, i as u32);
        }
    }
    let mut out: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for i in 0..triangles.len() as u32 {
        out.entry(set.find(i)).or_default().push(i);
    }
    out.into_values().collect()
}

/// Size of each triangle's surface: the diagonal of the box around its connected component, metres; `coplanar` in metres.
pub fn extents(triangles: &[[DVec3; 3]], coplanar: f64) -> Vec<f64> {
    let mut out = vec![0.0; triangles.len()];
    for part in parts(triangles, coplanar) {
        let extent = Aabb::of(part.iter().flat_map(|&i| triangles[i as usize])).diagonal();
        part.iter().for_each(|&i| out[i as usize] = extent);
    }
    out
}

/// Groups triangles into planes, larger triangles first, so that the largest member defines the plane.
pub fn planes(mut triangles: Vec<[DVec3; 3]>, coplanar: f64) -> Shell {
    let size = |t: &[DVec3; 3]| newell(&t.map(|p| p - t[0])).length_squared();
    triangles.retain(|t| size(t) > 0.0);
    triangles.sort_by(|a, b| size(b).total_cmp(&size(a)));
    let bounds = Aabb::of(triangles.iter().flatten().copied());
    let (centre, step) = (bounds.centre(), (bounds.diagonal() / 512.0).max(8.0 * coplanar));
    /// Buckets of normals are about 2 degrees wide.
    const NORMALS: f64 = 32.0;
    let mut out = Shell { planes: Vec::new(), triangles: Vec::with_capacity(triangles.len()), left_out: 0 };
    let mut buckets: HashMap<[i64; 4], Vec<u32>> = HashMap::new();
    for t in triangles {
        let n = newell(&t.map(|p| p - t[0])).normalize();
        let at = |n: DVec3| [n.x * NORMALS, n.y * NORMALS, n.z * NORMALS, n.dot(t[0] - centre) / step];
        let fits = |&i: &u32| t.iter().all(|&p| out.planes[i as usize].distance(p).abs() <= coplanar);
        let mut found: Option<u32> = None;
        for n in [n, -n] {
            // Adjacent buckets within a little noise.
            let range = at(n).map(|x| ((x - 0.2).floor() as i64, (x + 0.2).floor() as i64));
            for a in range[0].0..=range[0].1 {
                for b in range[1].0..=range[1].1 {
                    for c in range[2].0..=range[2].1 {
                        for d in range[3].0..=range[3].1 {
                            let of_bucket = buckets.get(&[a, b, c, d]).into_iter().flatten().copied();
                            found = of_bucket.filter(|i| fits(i)).chain(found).min();
                        }
                    }
                }
            }
        }
        let plane = found.unwrap_or_else(|| {
            let id = out.planes.len() as u32;
            out.planes.push(Plane::through((t[0] + t[1] + t[2]) / 3.0, n));
            buckets.entry(at(n).map(|x| x.floor() as i64)).or_default().push(id);
            id
        });
        out.triangles.push((t, plane));
    }
    out
}

/// Triangles that may split space: opaque, and of role structure or unknown.
pub fn opaque_structure(scene: &Scene) -> impl Iterator<Item = [DVec3; 3]> {
    let objects = scene.objects.iter().filter(|o| o.opaque && matches!(o.role, Role::Structure | Role::Unknown));
    objects.flat_map(|o| o.triangles.clone()).map(|t| scene.corners(t as usize))
}

/// The main direction in plan (x and z): most wall area is parallel or perpendicular to it.
pub fn main_axis(triangles: &[[DVec3; 3]]) -> DVec2 {
    const STEPS: usize = 360;
    let mut votes = vec![(0.0f64, DVec2::ZERO); STEPS];
    for t in triangles {
        let n = newell(&t.map(|p| p - t[0]));
        let flat = DVec2::new(n.x, n.z);
        if n.y.abs() < UPRIGHT * n.length() && n.length() > 0.0 {
            // Four times the angle is equal for all four perpendicular directions.
            let four = |z: DVec2| {
                let two = z.rotate(z);
                two.rotate(two)
            };
            let q = four(flat.normalize());
            let step = ((q.y.atan2(q.x) / std::f64::consts::TAU).rem_euclid(1.0) * STEPS as f64) as usize % STEPS;
            votes[step].0 += n.length();
            votes[step].1 += q * n.length();
        }
    }
    let window = |i: usize| [i + STEPS - 1, i, i + 1].map(|k| votes[k % STEPS]);
    let weight = |i: usize| window(i).iter().map(|v| v.0).sum::<f64>();
    let best = (0..STEPS).max_by(|&a, &b| weight(a).total_cmp(&weight(b)).then(b.cmp(&a))).unwrap_or(0);
    let sum: DVec2 = window(best).iter().map(|v| v.1).sum();
    if sum == DVec2::ZERO { DVec2::X } else { DVec2::from_angle(sum.to_angle() / 4.0) }
}
