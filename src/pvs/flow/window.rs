//! Windows: what is left of a portal's winding for the lines of one chain.
//!
//! Based on: Sutherland, Hodgman, *Reentrant polygon clipping*, 1974. Deviates in two ways. The plane is moved out by
//! [`Slack::reach`] before the cut, and the cut itself then has no tolerance: keeping corners that lie within an epsilon, as
//! is usual, drops the wedge between such a corner and the place where a long edge crosses the plane. And what is left may be
//! a segment or a point: it is still a window, and only a line that is known to be none ends a chain.

use crate::geom::Plane;
use glam::DVec3;

/// How much a comparison with a plane gives way, metres.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Slack {
    /// A cut keeps what lies up to this far outside. Swallows the rounding of the cuts before it.
    pub reach: f64,
    /// A window that lies nowhere deeper than this inside is cut off: only lines that touch the plane would be left.
    pub strict: f64,
    /// The caller's tolerance: windows that have no plane, and boxes of objects, are cut off only where they lie this far
    /// outside.
    pub coplanar: f64,
}

/// Corners of a convex polygon that holds every point where a line of the chain can cross the portal. Without corners:
/// nothing is known, a line may cross anywhere.
#[derive(Clone, Default, Debug)]
pub(super) struct Window {
    /// In the portal's order. May be collinear or coincide.
    pub corners: Vec<DVec3>,
    /// Whether the corners lie in one plane that is known. Others are never clipped, only kept or cut off as a whole, because
    /// clipping the outline of a body doesn't clip the body.
    pub flat: bool,
}

impl Window {
    /// Takes over another window's corners, keeping the memory.
    pub fn assign(&mut self, corners: &[DVec3], flat: bool) {
        self.corners.clear();
        self.corners.extend_from_slice(corners);
        self.flat = flat;
    }

    /// Cuts the window down to the inside of `plane`; false where no line is left. `spare` is scratch.
    #[must_use]
    pub fn cut(&mut self, plane: &Plane, slack: &Slack, spare: &mut Vec<DVec3>) -> bool {
        if is_cut_off(&self.corners, self.flat, plane, slack) {
            return false;
        }
        let outside = |p: DVec3| plane.distance(p) - slack.reach;
        if !self.flat || !self.corners.iter().any(|&p| outside(p) > 0.0) {
            return true;
        }
        spare.clear();
        let (Some(&last), mut kept) = (self.corners.last(), false) else { return true };
        let (mut a, mut da) = (last, outside(last));
        for &b in &self.corners {
            let db = outside(b);
            if (da > 0.0) != (db > 0.0) {
                spare.push(a + (b - a) * (da / (da - db)));
            }
            if db <= 0.0 {
                spare.push(b);
                kept = true;
            }
            (a, da) = (b, db);
        }
        if kept {
            std::mem::swap(&mut self.corners, spare);
        }
        true
    }
}

/// True where no line through the hull of `corners` comes inside `plane`, touching lines aside.
#[inline]
pub(super) fn is_cut_off(corners: &[DVec3], flat: bool, plane: &Plane, slack: &Slack) -> bool {
    let limit = if flat { -slack.strict } else { slack.coplanar };
    !corners.is_empty() && corners.iter().all(|&p| plane.distance(p) >= limit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::area;

    const SLACK: Slack = Slack { reach: 1e-12, strict: 1e-10, coplanar: 1e-6 };

    fn window(points: &[(f64, f64)]) -> Window {
        Window { corners: points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect(), flat: true }
    }

    fn cut(w: &mut Window, n: DVec3, d: f64) -> bool {
        w.cut(&Plane { n, d }, &SLACK, &mut Vec::new())
    }

    #[test]
    fn a_cut_keeps_the_inside_and_no_more() {
        let mut w = window(&[(0., 0.), (2., 0.), (2., 2.), (0., 2.)]);
        assert!(cut(&mut w, DVec3::X, 0.5) && (area(&w.corners) - 1.0).abs() < 1e-9);
        assert!(cut(&mut w, DVec3::X, 7.0) && (area(&w.corners) - 1.0).abs() < 1e-9);
        assert!(!cut(&mut w, DVec3::X, 0.0), "touching is not crossing");
    }

    #[test]
    fn the_wedge_beside_a_corner_that_nearly_touches_is_kept() {
        // A corner a hair inside, its neighbour 10 cm outside and 100 m away: the crossing lies far along the edge.
        let mut w = window(&[(0., -1e-9), (100., 1e-8), (100., 1.), (0., 1.)]);
        assert!(cut(&mut w, DVec3::Y, 0.0));
        assert!(w.corners.iter().any(|p| p.x > 9.0), "{:?}", w.corners);
    }

    #[test]
    fn slivers_segments_and_points_stay_windows() {
        let mut sliver = window(&[(0., 0.), (1e-6, 0.), (1e-6, 100.), (0., 100.)]);
        assert!(cut(&mut sliver, DVec3::Y, 50.0) && cut(&mut sliver, DVec3::X, 5e-7));
        let mut segment = window(&[(0., 0.), (1., 0.), (1., 0.), (0., 0.)]);
        assert!(cut(&mut segment, DVec3::X, 0.5) && segment.corners.iter().all(|p| p.x <= 0.5 + 1e-9));
        assert!(!cut(&mut segment, DVec3::X, -0.5));
        let mut unknown = Window::default();
        assert!(cut(&mut unknown, DVec3::X, -0.5), "without corners nothing can be cut off");
    }
}
