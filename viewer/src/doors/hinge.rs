//! How a leaf moves: about a hinge at a jamb, or along a line.

use super::opening::Opening;
use super::pieces::{Facet, range};
use glam::{DVec3, Vec3Swizzles};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A leaf whose facing has a larger cosine than this with its opening's stands in it, as `enfilade bake` has it. Smaller: leaves that
/// stand open count as shut.
const ALONG: f64 = 0.9;
/// A leaf in its opening covers more than this share of its own width there, and hangs no farther than this from the plane, metres.
const COVERS: f64 = 0.5;
/// See [`COVERS`].
const AWAY: f64 = 0.5;
/// A leaf's edge that is nearer to its jamb than the other edge by this, metres, is the hinge's. Smaller: rounding decides.
const NEARER: f64 = 0.01;
/// A handle is this share of the leaf's width off its middle. Smaller: panels count as handles.
const HANDLE: f64 = 0.1;
/// Leaves whose thickness is more than this share of their width don't swing. Larger: blocks of masonry do.
const THICK: f64 = 0.5;
/// So many times as wide as its opening, a leaf slides.
const WIDER: f64 = 1.5;
/// A leaf that is turned less than this from where it is shut, radians, slides there.
const TURNED: f64 = 0.35;

/// From shut to open.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Motion {
    /// About a vertical axis; radians from where the leaf was modelled, counter-clockwise seen from above.
    Swing {
        /// Any point of the axis.
        axis: DVec3,
        /// Where it is shut.
        shut: f64,
        /// Where it is open.
        open: f64,
        /// Whether it may open to either side.
        either: bool,
        /// The angle that opens it to where the opening's normal points.
        forward: f64,
    },
    /// By a vector from where it was modelled, metres.
    Slide {
        /// Where it is shut.
        shut: DVec3,
        /// Where it is open.
        open: DVec3,
    },
}

impl Motion {
    /// Where a point goes, as the leaf is open by this share.
    pub fn place(&self, p: DVec3, share: f64) -> DVec3 {
        match *self {
            Self::Slide { shut, open } => p + shut.lerp(open, share),
            Self::Swing { axis, shut, open, .. } => axis + turned(p - axis, shut + (open - shut) * share),
        }
    }

    /// Opens to the side that the normal points to, or to the other, where it can.
    pub fn open_to(&mut self, is_forward: bool) {
        if let Self::Swing { open, either: true, forward, .. } = self {
            *open = if is_forward { *forward } else { -*forward };
        }
    }
}

/// About +Y, counter-clockwise seen from above.
pub(super) fn turned(v: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = angle.sin_cos();
    DVec3::new(cos * v.x + sin * v.z, v.y, cos * v.z - sin * v.x)
}

/// A leaf as a slab.
pub struct Slab<'f> {
    /// Its triangles.
    pub facets: &'f [Facet],
    /// The direction that it faces.
    pub facing: DVec3,
}

impl Slab<'_> {
    fn along(&self) -> DVec3 {
        DVec3::Y.cross(self.facing)
    }

    fn reach(&self, axis: DVec3) -> [f64; 2] {
        range(self.facets, axis)
    }

    /// Whether it stands in its opening, as modelled.
    fn is_in(&self, opening: &Opening) -> bool {
        let middle = opening.along.dot(opening.middle);
        let [low, high] = self.reach(opening.along);
        let shared = high.min(middle + opening.half.x) - low.max(middle - opening.half.x);
        let [back, front] = self.reach(opening.n).map(|d| d - opening.n.dot(opening.middle));
        self.facing.dot(opening.n).abs() > ALONG
            && shared > COVERS * (high - low).min(2.0 * opening.half.x)
            && (0.5 * (back + front)).abs() < AWAY
    }

    /// How it moves; `None` where it isn't a leaf of the opening. `handle`: where handles are, along the opening.
    pub fn motion(&self, opening: &Opening, handle: Option<f64>) -> Option<Motion> {
        if !self.is_in(opening) {
            return self.to_shut(opening);
        }
        let ([low, high], [back, front]) = (self.reach(opening.along), self.reach(opening.n));
        let (width, thick, height) = (high - low, front - back, self.reach(DVec3::Y));
        if thick > THICK * width {
            return Some(Motion::Slide { shut: DVec3::ZERO, open: DVec3::Y * (height[1] - height[0]) });
        }
        if width > WIDER * 2.0 * opening.half.x {
            return Some(Motion::Slide { shut: DVec3::ZERO, open: opening.along * width });
        }
        let middle = opening.along.dot(opening.middle);
        let gaps = [(low - (middle - opening.half.x)).abs(), (middle + opening.half.x - high).abs()];
        let off = handle.map_or(0.0, |at| at - 0.5 * (low + high));
        // The side of the hinge: of the nearer jamb; else of where no handle is.
        let side = match gaps[1] - gaps[0] {
            nearer if nearer.abs() > NEARER => -nearer.signum(),
            _ if off.abs() > HANDLE * width => -off.signum(),
            _ => -1.0,
        };
        // Half its thickness inside the edge, so that the open leaf lies along the reveal.
        let edge = if side < 0.0 { low + 0.5 * thick } else { high - 0.5 * thick };
        let axis = opening.middle
            + opening.along * (edge - middle)
            + opening.n * (0.5 * (back + front) - opening.n.dot(opening.middle));
        let forward = quarter(-opening.along * side, opening.n);
        Some(Motion::Swing { axis, shut: 0.0, open: forward, either: true, forward })
    }

    /// Of a leaf that was modelled open.
    fn to_shut(&self, opening: &Opening) -> Option<Motion> {
        let ([low, high], [back, front]) = (self.reach(self.along()), self.reach(self.facing));
        let centre = self.facing * (0.5 * (back + front)) + DVec3::Y * opening.middle.y;
        let ends = [low, high].map(|a| centre + self.along() * a);
        let jambs = [-1.0, 1.0].map(|side| opening.jamb(side));
        let apart = |e: usize, j: usize| ends[e].xz().distance(jambs[j].xz());
        let pairs = [(0, 0), (0, 1), (1, 0), (1, 1)];
        let (e, j) = pairs.into_iter().min_by(|a, b| apart(a.0, a.1).total_cmp(&apart(b.0, b.1)))?;
        if apart(e, j) > AWAY || high - low > WIDER * 2.0 * opening.half.x {
            return None;
        }
        let polar = |v: DVec3| (-v.z).atan2(v.x);
        let angle = polar(jambs[1 - j] - jambs[j]) - polar(ends[1 - e] - ends[e]);
        let angle = (angle + PI).rem_euclid(TAU) - PI;
        if angle.abs() < TURNED || PI - angle.abs() < TURNED {
            // Beside its opening: the end away from the jamb goes to the jamb.
            let by = opening.along * opening.along.dot(jambs[j] - ends[1 - e]);
            return Some(Motion::Slide { shut: if angle.abs() < TURNED { DVec3::ZERO } else { by }, open: DVec3::ZERO });
        }
        Some(Motion::Swing { axis: ends[e], shut: angle, open: 0.0, either: false, forward: 0.0 })
    }
}

/// How a leaf moves that was made, between two places along its opening, as shares of its half width.
pub fn of_made(opening: &Opening, [from, to]: [f64; 2], slides: bool) -> Motion {
    if slides {
        return Motion::Slide { shut: DVec3::ZERO, open: opening.up * (2.0 * opening.half.y) };
    }
    // A leaf between both jambs hangs from the first.
    let side = if from > -1.0 && to >= 1.0 { 1.0 } else { -1.0 };
    let forward = quarter(-opening.along * side, opening.n);
    Motion::Swing { axis: opening.jamb(side), shut: 0.0, open: forward, either: true, forward }
}

/// How a hatch moves.
pub fn of_hatch(opening: &Opening) -> Motion {
    Motion::Slide { shut: DVec3::ZERO, open: opening.along * (2.0 * opening.half.x) }
}

/// The quarter turn that brings `free` to where `n` points.
fn quarter(free: DVec3, n: DVec3) -> f64 {
    FRAC_PI_2 * turned(free, FRAC_PI_2).dot(n).signum()
}
