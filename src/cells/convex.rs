//! Convex decomposition of the inside of a closed surface.
//!
//! Based on: Thibault, Naylor, *Set operations on polyhedra using binary space partitioning trees*, 1987: space is split along the
//! surface's planes until no polygon is left inside a part, so that each part is entirely inside or outside. Deviations: crossings are
//! counted, because the winding in files is unreliable; and parts with a convex union are merged.

use crate::math::geom::{Aabb, Plane, area, clip};
use crate::math::polygon::Polygon;
use crate::math::polyhedron::{face, sides};
use glam::DVec3;

/// Most parts of one surface: real rooms take tens.
const MOST_PARTS: usize = 20_000;
/// Planes tried at each cut.
const CANDIDATES: usize = 48;
/// Cost of a split polygon, in polygons of imbalance.
const CUT_COST: usize = 8;
/// Directions of the rays that count crossings, off every axis and diagonal. The majority decides, because surfaces have cracks.
const DIRECTIONS: [DVec3; 5] = [
    DVec3::new(0.293, 0.911, 0.287),
    DVec3::new(-0.617, 0.571, 0.541),
    DVec3::new(0.773, 0.119, -0.623),
    DVec3::new(-0.211, -0.887, 0.411),
    DVec3::new(0.523, -0.439, -0.731),
];

/// A convex polyhedron by its faces: outward planes, and windings counter-clockwise seen from outside.
#[derive(Clone, PartialEq, Debug)]
pub struct Convex {
    /// Four at least.
    pub faces: Vec<(Plane, Vec<DVec3>)>,
}

impl Convex {
    /// The intersection of all half-spaces with a box; `None` if it is thinner than `eps` metres.
    pub fn inside(bounds: Aabb, planes: &[Plane], eps: f64) -> Option<Self> {
        let all: Vec<Plane> = planes.iter().copied().chain(sides(&bounds)).collect();
        Self::of_planes(&all, bounds.diagonal(), bounds.centre(), eps)
    }

    fn of_planes(planes: &[Plane], reach: f64, near: DVec3, eps: f64) -> Option<Self> {
        // Of parallel planes, only the tightest.
        let mut tight: Vec<Plane> = Vec::with_capacity(planes.len());
        for plane in planes {
            match tight.iter_mut().find(|p| p.n.dot(plane.n) > 1.0 - 1e-12) {
                Some(same) => same.d = same.d.min(plane.d),
                None => tight.push(*plane),
            }
        }
        let mut faces = Vec::with_capacity(tight.len());
        for (i, plane) in tight.iter().enumerate() {
            let winding = face(&tight, i, near, 2.0 * reach, 0.0);
            if winding.len() >= 3 && area(&winding) > eps * eps {
                faces.push((*plane, winding));
            }
        }
        let convex = Self { faces };
        (convex.faces.len() >= 4 && convex.thickness() > eps).then_some(convex)
    }

    /// Least extent along a face's normal, metres.
    fn thickness(&self) -> f64 {
        let along = |plane: &Plane| self.corners().map(|p| -plane.distance(p)).fold(0.0, f64::max);
        self.faces.iter().map(|(plane, _)| along(plane)).fold(f64::INFINITY, f64::min)
    }

    /// Corners, once for each adjacent face.
    pub fn corners(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.faces.iter().flat_map(|(_, w)| w.iter().copied())
    }

    /// The planes of the faces.
    pub fn planes(&self) -> Vec<Plane> {
        self.faces.iter().map(|f| f.0).collect()
    }

    /// Box around it.
    pub fn bounds(&self) -> Aabb {
        Aabb::of(self.corners())
    }

    /// A point well inside.
    pub fn centre(&self) -> DVec3 {
        self.corners().sum::<DVec3>() / self.corners().count().max(1) as f64
    }

    /// Cubic metres.
    pub fn volume(&self) -> f64 {
        let centre = self.centre();
        self.faces.iter().map(|(plane, w)| -plane.distance(centre) * area(w) / 3.0).sum()
    }

    /// The parts behind and in front of a plane.
    fn cut(&self, plane: &Plane, eps: f64) -> [Option<Self>; 2] {
        let (reach, near) = (self.bounds().diagonal(), self.centre());
        [*plane, plane.flipped()].map(|side| {
            let mut planes = self.planes();
            planes.push(side);
            Self::of_planes(&planes, reach, near, eps)
        })
    }

    /// The difference to another, in convex parts; `None` if their intersection is thinner than `eps` metres.
    pub fn less(&self, other: &Self, eps: f64) -> Option<Vec<Self>> {
        let both: Vec<Plane> = self.faces.iter().chain(&other.faces).map(|f| f.0).collect();
        Self::of_planes(&both, self.bounds().diagonal(), self.centre(), eps)?;
        let (mut rest, mut out) = (self.clone(), Vec::new());
        for (plane, _) in &other.faces {
            let [behind, before] = rest.cut(plane, eps);
            out.extend(before);
            match behind {
                Some(behind) => rest = behind,
                None => break,
            }
        }
        Some(out)
    }

    /// The union with a piece across a common face, if it is convex: each lies inside all planes of the other except that of the common
    /// face.
    fn join(&self, other: &Self, eps: f64) -> Option<Self> {
        let opposite = |a: &Plane, b: &Plane| a.n.dot(b.n) < -1.0 + 1e-9 && (a.d + b.d).abs() <= eps;
        let (i, j) = (0..self.faces.len()).find_map(|i| {
            let j = other.faces.iter().position(|f| opposite(&self.faces[i].0, &f.0))?;
            Some((i, j))
        })?;
        let within = |a: &Self, skip: usize, b: &Self| {
            let mut rest = a.faces.iter().enumerate().filter(|(k, _)| *k != skip);
            rest.all(|(_, (plane, _))| b.corners().all(|p| plane.distance(p) <= eps))
        };
        if !within(self, i, other) || !within(other, j, self) {
            return None;
        }
        let mut planes: Vec<Plane> = Vec::new();
        let kept = |faces: &[(Plane, Vec<DVec3>)], skip: usize| {
            faces.iter().enumerate().filter(|(k, _)| *k != skip).map(|(_, f)| f.0).collect::<Vec<_>>()
        };
        for plane in kept(&self.faces, i).into_iter().chain(kept(&other.faces, j)) {
            if !planes.iter().any(|p| p.n.dot(plane.n) > 1.0 - 1e-9 && (p.d - plane.d).abs() <= eps) {
                planes.push(plane);
            }
        }
        let bounds = self.bounds().union(other.bounds());
        let joined = Self::of_planes(&planes, bounds.diagonal(), bounds.centre(), eps)?;
        // A shared plane is not yet a shared face.
        let whole = self.volume() + other.volume();
        ((joined.volume() - whole).abs() <= 1e-6 * whole).then_some(joined)
    }
}

/// Splits the inside of a surface; polygons within `eps` metres of a plane lie in it. Fails if that takes too many parts. Empty if nothing
/// is inside.
pub fn convex_pieces(surface: &[Polygon], eps: f64) -> Result<Vec<Convex>, String> {
    // A closed surface has at least four faces.
    if surface.len() < 4 {
        return Ok(Vec::new());
    }
    let bounds = Aabb::of(surface.iter().flat_map(|p| p.rings.iter().flatten().copied()));
    // Beyond the surface, so that no polygon lies on the box.
    let Some(whole) = Convex::inside(bounds.inflated(0.05 * bounds.diagonal() + 4.0 * eps), &[], eps) else {
        return Ok(Vec::new());
    };
    let all = surface.iter().map(|p| (p.plane, p.rings[0].clone())).collect();
    /// A part of space, with its fragments of the surface.
    type Part = (Convex, Vec<(Plane, Vec<DVec3>)>);
    let mut parts: Vec<Part> = vec![(whole, all)];
    let (mut pieces, mut count) = (Vec::new(), 1);
    while let Some((part, polygons)) = parts.pop() {
        let Some(plane) = best_plane(&polygons, eps) else {
            if is_inside(surface, part.centre()) {
                pieces.push(part);
            }
            continue;
        };
        let halves = part.cut(&plane, eps);
        let mut sides: [Vec<(Plane, Vec<DVec3>)>; 2] = Default::default();
        for (own, winding) in polygons {
            let (low, high) = range(&plane, &winding);
            if low >= -eps && high <= eps {
                continue;
            }
            for (side, half) in [plane, plane.flipped()].iter().enumerate() {
                let beyond = if side == 0 { low >= -eps } else { high <= eps };
                let rest = if beyond { Vec::new() } else { clip(&winding, half, 0.0) };
                if rest.len() >= 3 && area(&rest) > eps * eps {
                    sides[side].push((own, rest));
                }
            }
        }
        count += 1;
        if count > MOST_PARTS {
            return Err(format!("its surface is too complex: more than {MOST_PARTS} convex parts; simplify it"));
        }
        // The first half goes on top of the stack, for a fixed order of pieces.
        let [back, front] = sides;
        let [behind, before] = halves;
        parts.extend(before.map(|half| (half, front)));
        parts.extend(behind.map(|half| (half, back)));
    }
    Ok(joined(pieces, eps))
}

fn range(plane: &Plane, winding: &[DVec3]) -> (f64, f64) {
    let distances = winding.iter().map(|&p| plane.distance(p));
    distances.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), d| (l.min(d), h.max(d)))
}

/// The best splitting plane: few cut polygons, and balanced sides.
fn best_plane(polygons: &[(Plane, Vec<DVec3>)], eps: f64) -> Option<Plane> {
    let step = polygons.len().div_ceil(CANDIDATES).max(1);
    let cost = |plane: &Plane| {
        let (mut cut, mut behind, mut before) = (0usize, 0usize, 0usize);
        for (_, winding) in polygons {
            let (low, high) = range(plane, winding);
            match (low < -eps, high > eps) {
                (true, true) => cut += 1,
                (true, false) => behind += 1,
                (false, true) => before += 1,
                (false, false) => {}
            }
        }
        CUT_COST * cut + behind.abs_diff(before)
    };
    polygons.iter().step_by(step).map(|(plane, _)| *plane).min_by_key(cost)
}

/// Whether a point is inside a surface: an odd number of crossings, by the majority of some directions.
pub(crate) fn is_inside(surface: &[Polygon], p: DVec3) -> bool {
    let odd = |direction: DVec3| {
        let crossed = |polygon: &&Polygon| {
            let slope = polygon.plane.n.dot(direction);
            let t = -polygon.plane.distance(p) / slope;
            slope != 0.0 && t > 0.0 && polygon.holds(p + direction * t)
        };
        surface.iter().filter(crossed).count() % 2 == 1
    };
    2 * DIRECTIONS.iter().filter(|&&d| odd(d)).count() > DIRECTIONS.len()
}

/// Merges pieces while any two have a convex union.
pub fn joined(mut pieces: Vec<Convex>, eps: f64) -> Vec<Convex> {
    let mut i = 0;
    while i < pieces.len() {
        let bounds = pieces[i].bounds().inflated(eps);
        let found = (i + 1..pieces.len()).find_map(|j| {
            let near = bounds.touches(&pieces[j].bounds());
            near.then(|| pieces[i].join(&pieces[j], eps)).flatten().map(|whole| (j, whole))
        });
        match found {
            Some((j, whole)) => {
                pieces.remove(j);
                pieces[i] = whole;
                // Pieces that did not fit before may fit now.
                i = 0;
            }
            None => i += 1,
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room of 3 m over a ring in plan, with every second wall reversed.
    fn prism(ring: &[(f64, f64)]) -> Vec<Polygon> {
        let at = |y: f64| ring.iter().map(|&(x, z)| DVec3::new(x, y, z)).collect::<Vec<_>>();
        let (low, high) = (at(0.0), at(3.0));
        let n = ring.len();
        let mut rings: Vec<Vec<DVec3>> =
            (0..n).map(|i| vec![low[i], low[(i + 1) % n], high[(i + 1) % n], high[i]]).collect();
        rings.iter_mut().step_by(2).for_each(|r| r.reverse());
        rings.extend([low, high]);
        rings.into_iter().map(|r| Polygon::new(vec![r]).unwrap()).collect()
    }

    fn volume(pieces: &[Convex]) -> f64 {
        pieces.iter().map(Convex::volume).sum()
    }

    #[test]
    fn a_convex_room_is_one_piece_whichever_way_its_walls_face() {
        let pieces = convex_pieces(&prism(&[(0., 0.), (4., 0.), (5., 2.), (4., 5.), (0., 5.)]), 1e-6).unwrap();
        assert_eq!((pieces.len(), pieces[0].faces.len()), (1, 7));
        // The shoelace formula gives 22.5 square metres.
        assert!((volume(&pieces) - 67.5).abs() < 1e-6, "{}", volume(&pieces));
    }

    #[test]
    fn what_two_boxes_share_is_taken_from_one() {
        let block = |min: f64, max: f64| Aabb { min: DVec3::splat(min), max: DVec3::splat(max) };
        let whole = |bounds| Convex::inside(bounds, &[], 1e-6).unwrap();
        let (large, corner, inner) = (whole(block(0., 4.)), whole(block(3., 5.)), whole(block(1., 2.)));
        for (other, shared) in [(&corner, 1.0), (&inner, 1.0)] {
            let rest = large.less(other, 1e-6).unwrap();
            assert!((volume(&rest) - (64.0 - shared)).abs() < 1e-9, "{}", volume(&rest));
            assert!(rest.iter().all(|part| part.less(other, 1e-6).is_none()), "nothing is shared any more");
        }
        assert_eq!(inner.less(&large, 1e-6), Some(Vec::new()));
        assert_eq!(large.less(&whole(block(4., 6.)), 1e-6), None, "a corner is nothing");
    }

    #[test]
    fn an_l_is_two_pieces_and_a_ring_around_a_shaft_four() {
        let l = convex_pieces(&prism(&[(0., 0.), (4., 0.), (4., 2.), (2., 2.), (2., 4.), (0., 4.)]), 1e-6).unwrap();
        assert_eq!(l.len(), 2);
        assert!((volume(&l) - 36.0).abs() < 1e-6);
        // 5 x 5 m around a shaft of 1 x 1 m, which is a hole in floor and ceiling.
        let mut ring = prism(&[(0., 0.), (5., 0.), (5., 5.), (0., 5.)]);
        let shaft = prism(&[(2., 2.), (3., 2.), (3., 3.), (2., 3.)]);
        for k in [0, 1] {
            let hole = shaft[4 + k].rings[0].clone();
            ring[4 + k].rings.push(hole);
        }
        ring.extend(shaft[..4].iter().cloned());
        let pieces = convex_pieces(&ring, 1e-6).unwrap();
        assert_eq!(pieces.len(), 4);
        assert!((volume(&pieces) - 72.0).abs() < 1e-6);
        assert!(!is_inside(&ring, DVec3::new(2.5, 1.5, 2.5)) && is_inside(&ring, DVec3::new(1.0, 1.5, 2.5)));
    }

    #[test]
    fn a_gabled_loft_is_one_piece_and_a_flat_sheet_none() {
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let rings = [
            vec![at(0., 0., 0.), at(4., 0., 0.), at(4., 0., 6.), at(0., 0., 6.)],
            vec![at(0., 0., 0.), at(2., 2., 0.), at(2., 2., 6.), at(0., 0., 6.)],
            vec![at(4., 0., 0.), at(2., 2., 0.), at(2., 2., 6.), at(4., 0., 6.)],
            vec![at(0., 0., 0.), at(4., 0., 0.), at(2., 2., 0.)],
            vec![at(0., 0., 6.), at(4., 0., 6.), at(2., 2., 6.)],
        ];
        let loft: Vec<Polygon> = rings.into_iter().map(|r| Polygon::new(vec![r]).unwrap()).collect();
        let pieces = convex_pieces(&loft, 1e-6).unwrap();
        assert_eq!(pieces.len(), 1);
        assert!((volume(&pieces) - 24.0).abs() < 1e-6);
        assert_eq!(convex_pieces(&loft[..1], 1e-6).unwrap(), []);
        assert_eq!(convex_pieces(&[], 1e-6).unwrap(), []);
    }
}
