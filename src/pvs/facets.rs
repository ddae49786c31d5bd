//! Facets and corners of convex pieces, within a box.

use crate::cells::Piece;
use crate::math::geom::{Aabb, Plane};
use crate::math::polyhedron;
use glam::DVec3;

/// Relative rounding of distances.
const ROUNDING: f64 = 1e-12;

/// The facet of a piece in its plane number `plane`, clipped to `within`: counter-clockwise seen from outside, empty if there is none.
pub(in crate::pvs) fn facet(piece: &Piece, plane: usize, within: Aabb) -> Vec<DVec3> {
    let planes: Vec<Plane> = piece.planes.iter().copied().chain(polyhedron::sides(&within)).collect();
    let near = within.centre();
    let reach = within.diagonal() + planes[plane].distance(near).abs();
    polyhedron::face(&planes, plane, near, reach, ROUNDING * reach)
}

/// The corners of a piece clipped to `within`, once per adjacent facet; none if that is empty.
pub(in crate::pvs) fn corners(piece: &Piece, within: Aabb) -> Vec<DVec3> {
    facets(piece, within).into_iter().flatten().collect()
}

/// All facets of a piece clipped to `within`: its own, and those of `within`; each once, some empty.
pub(in crate::pvs) fn facets(piece: &Piece, within: Aabb) -> Vec<Vec<DVec3>> {
    let own =
        |wall: &Plane| piece.planes.iter().any(|p| p.n == wall.n && (p.d - wall.d).abs() <= ROUNDING * (1.0 + p.d.abs()));
    let walls = polyhedron::sides(&within).filter(|wall| !own(wall));
    let cut = Piece { planes: piece.planes.iter().copied().chain(walls).collect(), bounds: piece.bounds };
    (0..cut.planes.len()).map(|i| facet(&cut, i, within)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::geom;

    fn cube() -> Piece {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter();
        let planes = axes.flat_map(|n| [Plane { n, d: 1.0 }, Plane { n: -n, d: 0.0 }]).collect();
        Piece { planes, bounds: Aabb { min: DVec3::ZERO, max: DVec3::ONE } }
    }

    #[test]
    fn facets_face_out_and_have_their_area() {
        let within = Aabb { min: DVec3::splat(-3.0), max: DVec3::splat(5.0) };
        for i in 0..6 {
            let winding = facet(&cube(), i, within);
            let area = geom::newell(&winding) * 0.5;
            assert!((area - cube().planes[i].n).length() < 1e-9, "{area}");
        }
        let half_space = Piece { planes: vec![Plane { n: DVec3::Y, d: 1.0 }], bounds: Aabb::EMPTY };
        assert!((geom::area(&facet(&half_space, 0, within)) - 64.0).abs() < 1e-9);
        let above = Aabb { min: DVec3::splat(2.0), ..within };
        assert!(facet(&half_space, 0, above).is_empty());
    }

    #[test]
    fn corners_are_those_of_the_part_within() {
        let within = Aabb { min: DVec3::splat(-3.0), max: DVec3::new(0.5, 5.0, 5.0) };
        let all = corners(&cube(), within);
        assert_eq!(all.len(), 24, "eight corners, three facets each");
        assert!((Aabb::of(all.iter().copied()).max - DVec3::new(0.5, 1.0, 1.0)).length() < 1e-9);
        assert!(corners(&cube(), Aabb { min: DVec3::splat(2.0), max: DVec3::splat(3.0) }).is_empty());
    }
}
