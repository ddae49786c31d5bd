//! Planes of windings.

use super::{GivenError, Reader, around};
use crate::math::geom::{Aabb, Plane, area, middle, newell};
use glam::DVec3;

impl Reader {
    /// The plane of a winding.
    pub(super) fn winding_plane(&self, field: &str, winding: &[DVec3]) -> Result<Plane, GivenError> {
        let local = around(winding);
        if winding.len() >= 3 && area(&local) <= self.tolerance.coplanar * Aabb::of(local.iter().copied()).diagonal() {
            let what = "no area; give the corners in order around the portal";
            return Err(GivenError::at(field.to_owned(), what));
        }
        let plane = Plane::through(middle(winding), newell(&local).normalize_or(DVec3::Y));
        self.planar(field, winding, &plane, "the plane of the others")?;
        Ok(plane)
    }

    pub(super) fn planar(&self, field: &str, winding: &[DVec3], plane: &Plane, whose: &str) -> Result<(), GivenError> {
        let error = |what: String| Err(GivenError::at(field.to_owned(), what));
        if winding.len() < 3 {
            return error(format!("{} corners; give 3 at least", winding.len()));
        }
        match winding.iter().position(|&p| plane.distance(p).abs() > self.tolerance.coplanar) {
            Some(k) => {
                error(format!("corner {k} is {:.6} m off {whose}; split the portal", plane.distance(winding[k]).abs()))
            }
            None => Ok(()),
        }
    }
}
