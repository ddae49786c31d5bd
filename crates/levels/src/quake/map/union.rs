//! The surface of overlapping brushes: faces without the parts that other brushes cover.
//!
//! Based on: Laidlaw, Trumbore, Hughes, *Constructive solid geometry for polyhedral objects*, 1986, for convex solids only: a
//! face is cut by the planes of each other brush, and the part inside all of them is dropped.

use super::brush::{Brush, ON};
use enfilade::math::geom::{Plane, area, clip};
use enfilade::math::parallel;
use glam::DVec3;

/// Maximum parts of a face. More: a hostile file of overlapping brushes takes hours. Fewer: a floor under a forest of pillars is
/// refused.
const MOST_PARTS: usize = 1 << 12;

/// A part of a face.
#[derive(Clone)]
pub(super) struct Part {
    pub plane: Plane,
    /// Brush and side.
    pub side: [usize; 2],
    pub winding: Vec<DVec3>,
}

/// The parts of faces on the surface of the brushes' union. Of coincident faces, that of the later brush remains.
///
/// # Errors
///
/// A face with too many parts.
pub(super) fn surface(brushes: &[Brush]) -> Result<Vec<Part>, String> {
    let indices: Vec<usize> = (0..brushes.len()).collect();
    let of_brush = parallel::map(&indices, |&i| {
        let brush = &brushes[i];
        let reach = brush.bounds.inflated(ON);
        let others = brushes.iter().enumerate().filter(|(j, other)| *j != i && other.bounds.touches(&reach));
        let others: Vec<(usize, &Brush)> = others.collect();
        let mut parts = Vec::new();
        for (s, side) in brush.sides.iter().enumerate() {
            let mut left = vec![side.face.clone()];
            for &(j, other) in &others {
                left = left.into_iter().flat_map(|winding| outside(winding, &side.plane, other, j > i)).collect();
                if left.len() > MOST_PARTS {
                    return Err(format!("has a face that other brushes cut into more than {MOST_PARTS} parts"));
                }
            }
            parts.extend(left.into_iter().map(|winding| Part { plane: side.plane, side: [i, s], winding }));
        }
        Ok(parts)
    });
    Ok(of_brush.into_iter().collect::<Result<Vec<_>, _>>()?.concat())
}

/// The parts of a winding in `plane` outside `brush`. Coplanar faces of the brush with the same normal cover it if the brush
/// `is_later`, and those with the opposite normal always.
fn outside(winding: Vec<DVec3>, plane: &Plane, brush: &Brush, is_later: bool) -> Vec<Vec<DVec3>> {
    let (mut found, mut rest) = (Vec::new(), winding.clone());
    for side in &brush.sides {
        let (least, most) = reach(&rest, &side.plane);
        let is_in_plane = least >= -ON && most <= ON;
        if is_in_plane && side.plane.n.dot(plane.n) > 0.0 && !is_later || !is_in_plane && least >= -ON {
            // Whole: discards cuts that were not needed.
            return vec![winding];
        }
        if !is_in_plane && most > ON {
            found.push(clip(&rest, &side.plane.flipped(), 0.0));
            rest = clip(&rest, &side.plane, 0.0);
        }
    }
    found.retain(|part| area(part) > ON);
    found
}

/// Range of a winding's distances from a plane.
pub(super) fn reach(winding: &[DVec3], plane: &Plane) -> (f64, f64) {
    winding.iter().map(|&p| plane.distance(p)).fold((f64::MAX, f64::MIN), |(a, b), d| (a.min(d), b.max(d)))
}

#[cfg(test)]
mod tests {
    use super::super::brush::tests::block;
    use super::*;

    fn areas(brushes: &[Brush]) -> Vec<f64> {
        let mut areas = vec![0.0; brushes.len()];
        surface(brushes).unwrap().iter().for_each(|part| areas[part.side[0]] += area(&part.winding));
        areas.into_iter().map(|area| (area * 1e6).round() / 1e6).collect()
    }

    #[test]
    fn the_surface_of_a_union_is_that_of_its_parts_less_what_they_cover() {
        let cube = |at: f64| block([at, 0.0, 0.0], [at + 8.0, 8.0, 8.0]);
        // Apart; side by side; half in each other, where four faces lie in one place and the later shows; twice the same.
        assert_eq!(areas(&[cube(0.0), cube(9.0)]), [384.0, 384.0]);
        assert_eq!(areas(&[cube(0.0), cube(8.0)]), [320.0, 320.0]);
        assert_eq!(areas(&[cube(0.0), cube(4.0)]), [64.0 + 4.0 * 32.0, 320.0]);
        assert_eq!(areas(&[cube(0.0), cube(0.0)]), [0.0, 384.0]);
        // One within the other, and a pillar that stands on a slab.
        assert_eq!(areas(&[block([2.0; 3], [4.0; 3]), block([0.0; 3], [8.0; 3])]), [0.0, 384.0]);
        let slab = block([0.0, 0.0, -2.0], [8.0, 8.0, 0.0]);
        let pillar = block([2.0, 2.0, 0.0], [4.0, 4.0, 8.0]);
        assert_eq!(areas(&[slab, pillar]), [2.0 * 64.0 + 4.0 * 16.0 - 4.0, 4.0 * 16.0 + 4.0]);
    }
}
