//! Tests of bundles of planes against boxes: the inner loop of floods.
//!
//! Based on: Assarsson, Moller, *Optimized view frustum culling algorithms for bounding boxes*, 2000 (the extent of a box along a normal is
//! the dot product of its half size and the absolute normal). Deviations: planes are tested in groups of four without branches, and boxes
//! represent windows that may be flat.

use super::window::{Slack, Window};
use crate::math::geom::{Aabb, Plane};
use glam::DVec3;
use pulp::Simd;

/// Planes in one group.
pub(super) const LANES: usize = 4;

/// A group of planes: x, y and z of unit normals, then distances from the origin.
pub(super) type Lanes = [[f64; LANES]; 4];

/// A box around a window.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    middle: DVec3,
    half: DVec3,
    /// The window is cut off if its nearest point is at least this far outside of a plane, metres.
    limit: f64,
}

/// Side of a window, judged by its box.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Side {
    /// Entirely inside a plane.
    Inside,
    /// Outside, or touching.
    Outside,
    /// The box does not decide.
    Unknown,
}

impl Bounds {
    /// The box of a window's corners; without corners, all space.
    pub fn new(corners: impl Iterator<Item = DVec3>, flat: bool, slack: &Slack) -> Self {
        let bounds = Aabb::of(corners);
        let limit = if flat { -slack.strict } else { slack.coplanar };
        if bounds.is_empty() {
            return Self { middle: DVec3::ZERO, half: DVec3::INFINITY, limit };
        }
        // Grown by the rounding error.
        Self { middle: bounds.centre(), half: bounds.size() * 0.5 + 0.25 * slack.strict, limit }
    }

    /// The box, grown by a margin in metres.
    #[inline(always)]
    pub fn grown(&self, margin: f64) -> Aabb {
        Aabb { min: self.middle - self.half - margin, max: self.middle + self.half + margin }
    }

    /// Whether a box is within `margin` metres along every axis.
    #[inline(always)]
    pub fn meets(&self, middle: DVec3, half: DVec3, margin: f64) -> bool {
        (self.middle - middle).abs().cmple(self.half + half + margin).all()
    }

    /// True if it is entirely outside of another box.
    #[inline(always)]
    pub fn misses(&self, other: &Aabb) -> bool {
        (self.middle - self.half).cmpgt(other.max).any() || (self.middle + self.half).cmplt(other.min).any()
    }

    /// Its side of a plane.
    #[inline(always)]
    pub fn side(&self, plane: &Plane) -> Side {
        let (distance, reach) = (plane.distance(self.middle), plane.n.abs().dot(self.half));
        if distance + reach < 0.0 {
            Side::Inside
        } else if distance - reach >= self.limit {
            Side::Outside
        } else {
            Side::Unknown
        }
    }
}

/// Planes, as a structure of arrays.
#[derive(Default)]
pub(crate) struct Bundle {
    groups: Vec<Lanes>,
}

impl Bundle {
    /// Copies planes. The last group is padded with the last plane.
    #[inline(always)]
    pub fn assign(&mut self, planes: &[Plane]) {
        self.groups.clear();
        for planes in planes.chunks(LANES) {
            let mut group = [[0.0; LANES]; 4];
            for k in 0..LANES {
                let Plane { n, d } = planes[k.min(planes.len() - 1)];
                (group[0][k], group[1][k], group[2][k], group[3][k]) = (n.x, n.y, n.z, d);
            }
            self.groups.push(group);
        }
    }

    /// Clips a window, whose box is `bounds`, to the inside of every plane; false if no line is left.
    #[inline(always)]
    pub fn cut(&self, window: &mut Window, bounds: &Bounds, slack: &Slack, spare: &mut Window) -> bool {
        let Bounds { middle: m, half: h, limit } = bounds;
        for [x, y, z, d] in &self.groups {
            let (mut outside, mut across) = ([false; LANES], [false; LANES]);
            for k in 0..LANES {
                let distance = x[k] * m.x + y[k] * m.y + z[k] * m.z - d[k];
                let reach = x[k].abs() * h.x + y[k].abs() * h.y + z[k].abs() * h.z;
                outside[k] = distance - reach >= *limit;
                across[k] = distance + reach >= 0.0 || reach.is_nan();
            }
            if outside[0] | outside[1] | outside[2] | outside[3] {
                return false;
            }
            for k in 0..LANES {
                if across[k] && !window.cut(&Plane { n: DVec3::new(x[k], y[k], z[k]), d: d[k] }, slack, spare) {
                    return false;
                }
            }
        }
        true
    }

    /// True if a window is entirely outside some plane.
    #[inline(always)]
    pub fn cuts_off<S: Simd>(&self, simd: S, bounds: &Bounds, window: &Window) -> bool {
        are_cut_off(simd, &self.groups, bounds, window)
    }
}

/// True if a window is entirely outside some plane. Corners are tested only if the centre of its box is outside some plane: the centre of an
/// axis-parallel rectangle is a point of it, and that of others is near.
#[inline(always)]
pub(super) fn are_cut_off<S: Simd>(simd: S, groups: &[Lanes], bounds: &Bounds, window: &Window) -> bool {
    let Bounds { middle: m, half: h, limit } = bounds;
    let mut unsure = false;
    for [x, y, z, d] in groups {
        let (mut outside, mut over) = ([false; LANES], [false; LANES]);
        for k in 0..LANES {
            let distance = x[k] * m.x + y[k] * m.y + z[k] * m.z - d[k];
            let reach = x[k].abs() * h.x + y[k].abs() * h.y + z[k].abs() * h.z;
            outside[k] = distance - reach >= *limit;
            over[k] = distance >= *limit;
        }
        if outside[0] | outside[1] | outside[2] | outside[3] {
            return true;
        }
        unsure |= over[0] | over[1] | over[2] | over[3];
    }
    if unsure && !window.is_empty() {
        for group in groups {
            if window.is_beyond(simd, group, *limit) {
                return true;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLACK: Slack = Slack { reach: 1e-12, strict: 1e-10, coplanar: 1e-6 };

    #[test]
    fn a_box_is_cut_off_where_all_its_corners_are() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 2.0, 0.0), DVec3::Y * 2.0];
        let bounds = Bounds::new(corners.into_iter(), true, &SLACK);
        let window = Window::new(&corners, DVec3::Z, true);
        for (k, n) in [DVec3::X, -DVec3::X, DVec3::ONE.normalize(), DVec3::new(3.0, -4.0, 0.0) / 5.0].into_iter().enumerate()
        {
            let low = corners.iter().map(|p| n.dot(*p)).fold(f64::INFINITY, f64::min);
            let high = corners.iter().map(|p| n.dot(*p)).fold(f64::NEG_INFINITY, f64::max);
            for (d, side) in
                [(low - 1e-6, Side::Outside), (low, Side::Outside), (low + 1e-6, Side::Unknown), (high + 1e-6, Side::Inside)]
            {
                let plane = Plane { n, d };
                assert_eq!(bounds.side(&plane), side, "{k} {d}");
                let far = Plane { n: DVec3::Z, d: 9.0 };
                let mut bundle = Bundle::default();
                for planes in [vec![plane], vec![far; 5], [vec![far; 5], vec![plane]].concat()] {
                    bundle.assign(&planes);
                    assert_eq!(
                        bundle.cuts_off(pulp::Scalar::new(), &bounds, &window),
                        side == Side::Outside && planes.contains(&plane)
                    );
                }
            }
        }
    }

    #[test]
    fn nothing_is_known_of_a_window_without_corners() {
        let bounds = Bounds::new([].into_iter(), false, &SLACK);
        let window = Window::default();
        let plane = Plane { n: DVec3::X, d: -1e9 };
        let mut bundle = Bundle::default();
        bundle.assign(&[plane]);
        assert!(!bundle.cuts_off(pulp::Scalar::new(), &bounds, &window) && bounds.side(&plane) == Side::Unknown);
    }
}
