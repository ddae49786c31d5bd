//! Cuts openings that the geometry reader left closed through their walls, as rectangles.
//!
//! This happens if an opening is beside its wall, or if a boolean operation fails. The file has a door there, so a viewer may
//! show the space behind it. A rectangle larger than the hole errs towards visible.

use super::geometry::{Geometry, Shape};
use enfilade::math::geom::{Aabb, Plane, clip, middle};
use glam::DVec3;
use std::collections::HashMap;

/// Corners within this distance of a side of the cut, metres, are on it.
const ON_A_SIDE: f64 = 1e-6;

/// A wall thinner than this, metres, is a sheet without reveals.
const LEAST_THICKNESS: f64 = 1e-3;

/// Faces count as sides of the wall if the cosine of their angle is above this: within 3 degrees.
const COS_PARALLEL: f64 = 0.9986;

/// A rectangle to cut through an element.
#[derive(Clone, Debug)]
pub(super) struct Cut {
    /// The element, or its parts.
    pub(super) hosts: Vec<u32>,
    /// In the middle of the wall, counter-clockwise about `normal`.
    pub(super) winding: Vec<DVec3>,
    /// Unit normal of the wall.
    pub(super) normal: DVec3,
    /// Depth of the cut on both sides of the winding, along the normal, metres.
    pub(super) reach: f64,
}

/// The shapes of cut elements, see-through ones last, by record.
pub(super) fn cut(geometry: &Geometry, cuts: &[Cut]) -> HashMap<u32, [Shape; 2]> {
    let mut shapes: HashMap<u32, [Shape; 2]> = HashMap::new();
    for cut in cuts {
        for &host in &cut.hosts {
            let Some(built) = geometry.get(host) else { continue };
            let shapes = shapes.entry(host).or_insert_with(|| [built.solid.clone(), built.clear.clone()]);
            shapes.iter_mut().for_each(|shape| cut.apply(shape));
        }
    }
    shapes
}

impl Cut {
    /// Cuts a shape open, and closes its inside with reveals.
    fn apply(&self, shape: &mut Shape) {
        let planes = self.planes();
        let whole =
            Aabb::of(self.winding.iter().flat_map(|&p| [p - self.normal * self.reach, p + self.normal * self.reach]));
        let mut kept = Shape::default();
        // Offsets of the wall's sides along the normal.
        let mut sides = [f64::INFINITY, f64::NEG_INFINITY];
        for t in shape.corners() {
            let outside = if whole.touches(&Aabb::of(t)) { outside(&t, &planes) } else { None };
            let Some(pieces) = outside else {
                kept.push(&t);
                continue;
            };
            let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
            if n.dot(self.normal).abs() > COS_PARALLEL {
                // At the centre of the cut: corners of the side may be far off, and the side may be tilted.
                let centre = middle(&self.winding);
                let at = centre.dot(self.normal) + n.dot(t[0] - centre) / n.dot(self.normal);
                sides = [sides[0].min(at), sides[1].max(at)];
            }
            pieces.iter().for_each(|piece| kept.push(piece));
        }
        if sides[1] - sides[0] > LEAST_THICKNESS {
            let bounds = Aabb::of(shape.corners().flatten());
            self.reveals(sides, bounds).iter().for_each(|reveal| kept.push(reveal));
        }
        *shape = kept;
    }

    /// The planes around the cut, facing outwards.
    fn planes(&self) -> Vec<Plane> {
        let n = self.winding.len();
        let side = |i: usize| {
            let (a, b) = (self.winding[i], self.winding[(i + 1) % n]);
            (b - a).cross(self.normal).try_normalize().map(|out| Plane::through(a, out))
        };
        let end = |normal: DVec3| Plane::through(self.winding[0] + normal * self.reach, normal);
        (0..n).filter_map(side).chain([end(self.normal), end(-self.normal)]).collect()
    }

    /// Rectangles from side to side of the wall, clipped to it, facing into the hole.
    fn reveals(&self, [low, high]: [f64; 2], bounds: Aabb) -> Vec<Vec<DVec3>> {
        let walls = [DVec3::X, DVec3::Y, DVec3::Z]
            .into_iter()
            .flat_map(|axis| [Plane::through(bounds.max, axis), Plane::through(bounds.min, -axis)]);
        let walls: Vec<Plane> = walls.collect();
        let at = |p: DVec3, offset: f64| p + self.normal * (offset - p.dot(self.normal));
        let reveal = |i: usize| {
            let (a, b) = (self.winding[i], self.winding[(i + 1) % self.winding.len()]);
            let quad = vec![at(a, low), at(a, high), at(b, high), at(b, low)];
            walls.iter().fold(quad, |quad, plane| clip(&quad, plane, ON_A_SIDE))
        };
        (0..self.winding.len()).map(reveal).collect()
    }
}

impl Shape {
    /// Adds a convex polygon.
    fn push(&mut self, polygon: &[DVec3]) {
        let start = self.positions.len() as u32;
        self.positions.extend(polygon);
        self.triangles.extend((2..polygon.len() as u32).map(|i| [start, start + i - 1, start + i]));
    }
}

/// The part of a triangle outside of a convex body, whose planes face outwards; `None` if all of it is outside.
fn outside(triangle: &[DVec3; 3], planes: &[Plane]) -> Option<Vec<Vec<DVec3>>> {
    let (mut rest, mut pieces) = (triangle.to_vec(), Vec::new());
    for plane in planes {
        if rest.iter().all(|&p| plane.distance(p) >= -ON_A_SIDE) {
            return None;
        }
        if rest.iter().any(|&p| plane.distance(p) > ON_A_SIDE) {
            pieces.push(clip(&rest, &plane.flipped(), ON_A_SIDE));
            rest = clip(&rest, plane, ON_A_SIDE);
        }
    }
    Some(pieces)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A closed box, its faces outwards.
    fn block(low: DVec3, high: DVec3) -> Shape {
        let corner = |i: usize| DVec3::new([low.x, high.x][i & 1], [low.y, high.y][i >> 1 & 1], [low.z, high.z][i >> 2]);
        let mut shape = Shape::default();
        for quad in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            shape.push(&quad.map(corner));
        }
        shape
    }

    /// Twice the area, and six times the volume.
    fn measures(shape: &Shape) -> [f64; 2] {
        let [mut area, mut volume] = [0.0; 2];
        for [a, b, c] in shape.corners() {
            area += (b - a).cross(c - a).length();
            volume += a.dot(b.cross(c));
        }
        [area, volume]
    }

    /// A door of 1 x 2 m at the foot of a wall of 4 x 3 x 0.2 m.
    fn door(reach: f64) -> Cut {
        let winding = [(1., 0.), (2., 0.), (2., 2.), (1., 2.)].map(|(x, y)| DVec3::new(x, y, 0.1)).to_vec();
        Cut { hosts: Vec::new(), winding, normal: DVec3::Z, reach }
    }

    #[test]
    fn a_door_is_cut_with_its_reveals() {
        let mut wall = block(DVec3::ZERO, DVec3::new(4., 3., 0.2));
        door(0.12).apply(&mut wall);
        // The solid loses 0.4 m³. The surface loses both sides and the foot and gains reveals; the lowest reveal is the foot.
        let [area, volume] = measures(&wall);
        assert!((volume / 6.0 - (2.4 - 0.4)).abs() < 1e-12, "{volume}");
        let surface = 2.0 * (4. * 3. + 4. * 0.2 + 3. * 0.2) - 2.0 * 2.0 + 2.0 * 2.0 * 0.2 + 0.2 + 0.2;
        assert!((area / 2.0 - surface).abs() < 1e-12, "{area} {surface}");
        // A second cut changes nothing.
        let again = wall.clone();
        door(0.12).apply(&mut wall);
        assert_eq!(measures(&wall), measures(&again));
    }

    #[test]
    fn a_sheet_has_no_reveals_and_what_is_farther_off_stays() {
        let mut sheet = Shape::default();
        sheet.push(&[(0., 0.), (4., 0.), (4., 3.), (0., 3.)].map(|(x, y)| DVec3::new(x, y, 0.1)));
        sheet.push(&[(0., 0.), (4., 0.), (4., 3.), (0., 3.)].map(|(x, y)| DVec3::new(x, y, 0.5)));
        door(0.12).apply(&mut sheet);
        assert!((measures(&sheet)[0] / 2.0 - (24.0 - 2.0)).abs() < 1e-12);
    }
}
