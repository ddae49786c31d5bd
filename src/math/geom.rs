//! Planes, boxes and convex windings in `f64`, for all build-side modules.

use glam::DVec3;

/// The half-space `n . p <= d`; `n` is a unit vector that points out of it.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct Plane {
    /// Unit normal.
    pub n: DVec3,
    /// Distance of the plane from the origin along `n`, metres.
    pub d: f64,
}

impl Plane {
    /// The plane through `p` with unit normal `n`.
    #[cfg(feature = "bake")]
    #[inline]
    pub fn through(p: DVec3, n: DVec3) -> Self {
        Self { n, d: n.dot(p) }
    }

    /// Signed distance, metres: positive is outside, on the side that `n` points to.
    #[inline]
    pub fn distance(&self, p: DVec3) -> f64 {
        self.n.dot(p) - self.d
    }

    /// The plane with reversed sides.
    #[cfg(feature = "bake")]
    pub fn flipped(&self) -> Self {
        Self { n: -self.n, d: -self.d }
    }
}

/// An axis-aligned box; empty while `min > max`.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct Aabb {
    /// Least corner.
    pub min: DVec3,
    /// Greatest corner.
    pub max: DVec3,
}

impl Aabb {
    /// The empty box.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The box around points.
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| b.with(p))
    }

    /// The smallest box that also contains `p`.
    pub fn with(self, p: DVec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// The smallest box that contains both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Grown by `by` metres on every side.
    pub fn inflated(self, by: f64) -> Self {
        Self { min: self.min - by, max: self.max + by }
    }

    /// True while no point is inside.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Distance between two boxes, metres; 0 if they touch.
    #[cfg(feature = "bake")]
    pub fn gap(&self, other: &Self) -> f64 {
        (self.min - other.max).max(other.min - self.max).max(DVec3::ZERO).length()
    }

    /// True if the boxes have a common point.
    #[inline]
    pub fn touches(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// True if `p` is inside or on the boundary.
    pub fn contains(&self, p: DVec3) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }

    /// The centre.
    pub fn centre(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    /// Edge lengths, metres.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the diagonal, metres; 0 for an empty box.
    pub fn diagonal(&self) -> f64 {
        if self.is_empty() { 0.0 } else { self.size().length() }
    }
}

/// Twice the area of a planar polygon times its unit normal (Newell 1972): robust for windings with collinear points.
pub fn newell(winding: &[DVec3]) -> DVec3 {
    winding.iter().zip(winding.iter().cycle().skip(1)).map(|(&a, &b)| a.cross(b)).sum::<DVec3>()
}

/// Area of a planar polygon, square metres.
#[cfg(feature = "bake")]
pub fn area(winding: &[DVec3]) -> f64 {
    match winding.first() {
        Some(&o) => newell(&winding.iter().map(|&p| p - o).collect::<Vec<_>>()).length() * 0.5,
        None => 0.0,
    }
}

/// Width of a convex winding, metres: the least extent perpendicular to an edge.
#[cfg(feature = "bake")]
pub fn width(winding: &[DVec3]) -> f64 {
    let edges = (0..winding.len()).map(|i| (winding[i], winding[(i + 1) % winding.len()] - winding[i]));
    let reach = |(from, along): (DVec3, DVec3)| {
        let along = along.normalize_or_zero();
        winding.iter().map(|&p| (p - from).reject_from_normalized(along).length()).fold(0.0, f64::max)
    };
    edges.filter(|(_, along)| *along != DVec3::ZERO).map(reach).reduce(f64::min).unwrap_or(0.0)
}

/// The mean of the corners: a point of a convex winding. Zero without corners.
#[cfg(feature = "bake")]
pub fn middle(winding: &[DVec3]) -> DVec3 {
    winding.iter().sum::<DVec3>() / (winding.len().max(1)) as f64
}

/// Clips a convex winding to `plane`'s inside (Sutherland, Hodgman 1974); points within `eps` metres of the plane count as inside. Empty if
/// nothing is left.
pub fn clip(winding: &[DVec3], plane: &Plane, eps: f64) -> Vec<DVec3> {
    let mut out = Vec::with_capacity(winding.len() + 1);
    clip_to(winding, plane, eps, &mut out);
    out
}

/// As [`clip`], into `out`.
pub(crate) fn clip_to(winding: &[DVec3], plane: &Plane, eps: f64, out: &mut Vec<DVec3>) {
    out.clear();
    for (i, &a) in winding.iter().enumerate() {
        let b = winding[(i + 1) % winding.len()];
        let (da, db) = (plane.distance(a), plane.distance(b));
        if da <= eps {
            out.push(a);
        }
        if (da > eps && db < -eps) || (da < -eps && db > eps) {
            out.push(a + (b - a) * (da / (da - db)));
        }
    }
    if out.len() < 3 {
        out.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clip_keeps_the_inside_half_of_a_square() {
        let square = [(0., 0.), (2., 0.), (2., 2.), (0., 2.)].map(|(x, y)| DVec3::new(x, y, 5.0));
        let half = clip(&square, &Plane { n: DVec3::X, d: 0.5 }, 1e-9);
        assert!((area(&half) - 1.0).abs() < 1e-12 && (area(&square) - 4.0).abs() < 1e-12);
        assert!(clip(&square, &Plane { n: DVec3::X, d: -1.0 }, 1e-9).is_empty());
        assert_eq!(newell(&square).normalize(), DVec3::Z);
    }
}
