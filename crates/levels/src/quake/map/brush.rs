//! Brushes: convex polyhedra given by planes, with a face for each.

use crate::FARTHEST;
use crate::bsp::portals::square;
use enfilade::math::geom::{Aabb, Plane, area, clip};
use glam::DVec3;
use quake_map::{Alignment, Surface};

/// Points within this distance of a plane lie in it, in the map's units. Larger: separate faces are merged. Smaller: corners that
/// editors round to three decimals miss their planes.
pub(super) const ON: f64 = 1e-3;

/// Coincident planes with normals this near to each other are one. Larger: inclined planes are merged. Smaller: a plane that a
/// file repeats with other points is two.
const SAME: f64 = 1e-9;

/// One side of a brush.
pub(super) struct Side {
    /// Normal out of the brush.
    pub plane: Plane,
    /// The texture's name in lower case.
    pub texture: String,
    /// Its texture alignment.
    pub alignment: Alignment,
    /// Counter-clockwise from outside; empty if the plane does not bound the brush.
    pub face: Vec<DVec3>,
}

/// A convex polyhedron.
pub(super) struct Brush {
    pub sides: Vec<Side>,
    pub bounds: Aabb,
    /// Quake 2 flags of all sides.
    pub contents: u32,
}

/// The planes of a brush, each given by three points, clockwise from outside. Errors name the side.
pub(super) fn planes(surfaces: &[Surface]) -> Result<Vec<Plane>, String> {
    let plane = |(i, surface): (usize, &Surface)| {
        let [a, b, c] = surface.half_space.map(DVec3::from);
        if ![a, b, c].iter().all(|p| p.abs().cmple(DVec3::splat(FARTHEST)).all()) {
            return Err(format!("side {}: a number that is not within {FARTHEST:e} of the origin", i + 1));
        }
        let normal = (a - b).cross(c - b).try_normalize();
        normal.map(|n| Plane::through(b, n)).ok_or_else(|| format!("side {}: its three points define no plane", i + 1))
    };
    surfaces.iter().enumerate().map(plane).collect()
}

impl Brush {
    /// `within` holds the whole map. `None` if the planes leave no volume, or do not close it.
    pub fn new(surfaces: &[Surface], planes: &[Plane], within: &Aabb) -> Option<Self> {
        let mut sides: Vec<Side> = Vec::new();
        for (i, (surface, plane)) in surfaces.iter().zip(planes).enumerate() {
            // Of repeated planes, the first one counts.
            let is_twice = |other: &Plane| other.n.distance(plane.n) < SAME && (other.d - plane.d).abs() < ON;
            let doubled = planes[..i].iter().any(is_twice);
            let others = planes.iter().enumerate().filter(|&(j, other)| j != i && !is_twice(other));
            let face = others.fold(square(plane, within), |face, (_, other)| clip(&face, other, ON * 0.1));
            let is_face = !doubled && area(&face) > ON;
            let texture = surface.texture.to_string_lossy().to_lowercase();
            // Quake 2 has textures in folders.
            let texture = texture.rsplit('/').next().unwrap_or_default().to_owned();
            let face = if is_face { face } else { Vec::new() };
            sides.push(Side { plane: *plane, texture, alignment: surface.alignment, face });
        }
        let bounds = Aabb::of(sides.iter().flat_map(|side| side.face.iter().copied()));
        let is_closed = within.contains(bounds.min) && within.contains(bounds.max);
        let is_solid = sides.iter().filter(|side| !side.face.is_empty()).count() > 3 && bounds.size().min_element() > ON;
        sides.retain(|side| !side.face.is_empty());
        let contents = surfaces.iter().fold(0, |all, side| all | side.q2ext.content_flags as u32);
        (is_closed && is_solid).then_some(Self { sides, bounds, contents })
    }

    /// Whether a point is inside or in a face, as between two brushes.
    pub fn holds(&self, p: DVec3) -> bool {
        self.bounds.inflated(ON).contains(p) && self.sides.iter().all(|side| side.plane.distance(p) <= ON)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    fn side([a, b, c]: [[f64; 3]; 3]) -> Surface {
        let alignment = quake_map::Alignment { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], axes: None };
        Surface {
            half_space: [a, b, c],
            texture: c"Brick".into(),
            alignment,
            q2ext: quake_map::Quake2SurfaceExtension::default(),
        }
    }

    /// The sides of a box as a map writes them.
    fn sides(min: [f64; 3], max: [f64; 3]) -> Vec<Surface> {
        let axes = (0..3).flat_map(|axis| [(axis, false), (axis, true)]);
        let points = |(axis, above): (usize, bool)| {
            let at = |u: f64, v: f64| {
                let mut p = [0.0; 3];
                p[axis] = if above { max[axis] } else { min[axis] };
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (u, v);
                p
            };
            // Clockwise from outside.
            if above {
                [at(0.0, 1.0), at(0.0, 0.0), at(1.0, 0.0)].map(|p| p)
            } else {
                [at(1.0, 0.0), at(0.0, 0.0), at(0.0, 1.0)]
            }
        };
        axes.map(points).map(|[a, b, c]| side([c, b, a])).collect()
    }

    pub fn block(min: [f64; 3], max: [f64; 3]) -> Brush {
        let sides = sides(min, max);
        Brush::new(&sides, &planes(&sides).unwrap(), &Aabb { min: DVec3::splat(-100.0), max: DVec3::splat(100.0) }).unwrap()
    }

    #[test]
    fn a_box_has_six_faces_that_look_out_of_it() {
        let brush = block([1.0, 2.0, 3.0], [5.0, 7.0, 9.0]);
        assert_eq!(
            (brush.sides.len(), brush.bounds.min, brush.bounds.max),
            (6, DVec3::new(1., 2., 3.), DVec3::new(5., 7., 9.))
        );
        for side in &brush.sides {
            let normal = enfilade::math::geom::newell(&side.face).normalize();
            assert!(normal.distance(side.plane.n) < 1e-12 && side.plane.distance(DVec3::new(3., 4., 5.)) < 0.0);
            assert_eq!(side.texture, "brick");
        }
        assert!(brush.holds(DVec3::new(4.9, 6.9, 8.9)) && !brush.holds(DVec3::new(5.1, 6.9, 8.9)));
    }

    #[test]
    fn brushes_without_a_volume_are_none_and_doubled_planes_count_once() {
        let within = Aabb { min: DVec3::splat(-100.0), max: DVec3::splat(100.0) };
        let brush = |sides: &[Surface]| Brush::new(sides, &planes(sides).unwrap(), &within);
        let mut doubled = sides([0.0; 3], [4.0; 3]);
        doubled.push(doubled[2].clone());
        assert_eq!(brush(&doubled).unwrap().sides.len(), 6);
        // Flat; inside out; open on one side.
        assert!(brush(&sides([0.0; 3], [4.0, 4.0, 0.0])).is_none());
        assert!(brush(&sides([4.0; 3], [0.0; 3])).is_none());
        assert!(brush(&sides([0.0; 3], [4.0; 3])[..5]).is_none());
        let line = side([[0.0; 3], [1.0; 3], [2.0; 3]]);
        assert_eq!(planes(&[line]).unwrap_err(), "side 1: its three points define no plane");
        let far = side([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2e7, 0.0]]);
        assert_eq!(planes(&[far]).unwrap_err(), "side 1: a number that is not within 1e7 of the origin");
    }
}
