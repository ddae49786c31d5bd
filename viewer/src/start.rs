//! Where a visit begins: on the floor of the closed cell that has the most in it.

use enfilade::file::PvsFile;
use enfilade::geom::{Aabb, Plane, clip};
use glam::{DVec3, Vec4};

/// No piece reaches farther than this from the origin, metres, as far as it matters where to stand.
const FARTHEST: f64 = 1e4;

/// The eye and where it looks, metres relative to the origin.
pub fn start(file: &PvsFile) -> (DVec3, DVec3) {
    let closed = (0..file.cells.len()).filter(|&c| !file.cells[c].open && !file.cells[c].pieces.is_empty());
    let home = closed.max_by_key(|&c| file.placement.ones(c).count()).or((!file.cells.is_empty()).then_some(0));
    let pieces = home.into_iter().flat_map(|c| &file.cells[c].pieces).map(|piece| corners(piece));
    let size = |corners: &[DVec3]| {
        let size = Aabb::of(corners.iter().copied()).size();
        if corners.is_empty() { 0.0 } else { size.x * size.z }
    };
    let largest = pieces.max_by(|a, b| size(a).total_cmp(&size(b))).filter(|corners| !corners.is_empty());
    let Some(corners) = largest else {
        let all = Aabb::of(file.objects.iter().flat_map(|o| o.bounds).map(|p| p.as_dvec3()));
        return (all.centre(), DVec3::NEG_Z);
    };
    let bounds = Aabb::of(corners.iter().copied());
    let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let height = crate::walker::EYE.min(0.8 * bounds.size().y);
    let along = if bounds.size().x > bounds.size().z { DVec3::X } else { DVec3::Z };
    (middle.with_y(bounds.min.y + height), along)
}

/// The corners of a convex piece: each plane's part of it.
fn corners(planes: &[Vec4]) -> Vec<DVec3> {
    let planes: Vec<Plane> = planes.iter().map(|p| Plane { n: p.truncate().as_dvec3(), d: f64::from(p.w) }).collect();
    let mut all = Vec::new();
    for (i, plane) in planes.iter().enumerate() {
        let across = plane.n.any_orthonormal_vector() * FARTHEST;
        let up = plane.n.cross(across);
        let middle = plane.n * plane.d;
        let square = vec![middle - across - up, middle + across - up, middle + across + up, middle - across + up];
        let others = planes.iter().enumerate().filter(|(other, _)| *other != i);
        all.extend(others.fold(square, |face, (_, other)| clip(&face, other, 1e-9)));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_its_corners() {
        let planes = [
            Vec4::new(1.0, 0.0, 0.0, 4.0),
            Vec4::new(-1.0, 0.0, 0.0, 0.0),
            Vec4::new(0.0, 1.0, 0.0, 3.0),
            Vec4::new(0.0, -1.0, 0.0, 0.0),
            Vec4::new(0.0, 0.0, 1.0, 2.0),
            Vec4::new(0.0, 0.0, -1.0, 0.0),
        ];
        let bounds = Aabb::of(corners(&planes));
        assert!(
            bounds.min.distance(DVec3::ZERO) < 1e-6 && bounds.max.distance(DVec3::new(4.0, 3.0, 2.0)) < 1e-6,
            "{bounds:?}"
        );
    }
}
