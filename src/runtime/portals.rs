//! Portal traversal, with the view narrowed at each portal.
//!
//! Based on: D. Luebke and C. Georges, *Portals and mirrors: simple, fast evaluation of potentially visible sets*, 1995: a portal opens the
//! rectangle around its winding on the screen, clipped to the rectangles of the portals before it.
//!
//! Deviations:
//!
//! * **A work list instead of recursion.** The paper's cells are convex; here they are unions of pieces (an L-shaped room, the outside
//!   around a building). Many chains lead to one portal, and recursion over chains is exponential. Here each directed portal keeps one
//!   rectangle, the union over all chains, and is visited again when that grows: `open(Q) = union over P before Q of (open(P) & own(Q))`.
//!   The rectangles only grow and their sides come from a finite set, so this ends in the least fixed point, independent of the order of
//!   work. It covers every chain: a line of sight that passes P, then Q, on a pixel in `open(P)`, has that pixel in `own(Q)`, so in
//!   `open(Q)`. Fewer portals or cells (pruned by rows) give smaller rectangles, so the modes nest: both within portals.
//! * **A portal leads one way** for one eye, which must be behind its plane. A portal Q is considered beyond P only if a corner of Q is in
//!   front of P's plane; the same holds for objects. This replaces convexity.
//! * **Windings are drawn with a thick pen.** A stored winding is within [`Culler::tolerance`] (rho) of the true opening, so
//!   each corner is projected as a ball of that radius: with `X = |x|`, `W = |w|` (norms of the camera's rows), a point within
//!   rho has clip x within `rho X` and w within `rho W`, and x/w within the quotients of those intervals. This holds at any
//!   opening angle, where a fixed margin in pixels does not. Projection is done in `f64`; the last step to `f32` is covered by
//!   [`ROUNDING`].
//! * **Near the eye** windings are clipped at `w = 2 rho W`, not at the near plane, so that the quotients exist. The clipped part can be on
//!   the screen only within [`Eye::touch`] of the eye; if a winding is that near, the portal opens everything ("the eye is in the portal").
//!   An eye within about `2 rho` of a portal's plane may be on either side: both directions are tried.

use super::camera::{Camera, Rect};
use super::culler::{Culler, directed_plane, target};
use super::doors::Doors;
use super::objects::{CollectObjects, Opened, group};
use super::scratch::{Part, PortalState, Scratch};
use crate::math::simd::vectorized;
use crate::{CellId, DirectedPortal, PortalId};
use glam::{DVec2, DVec3, Vec3};
use std::ops::Range;

/// Rectangles grow by this much (normalised device coordinates) when they are rounded to `f32`, whose steps within [-2, 2] are under
/// 2.4e-7. Larger: a portal just beside another's rectangle is entered. Smaller: a pixel on the edge is lost.
const ROUNDING: f64 = 1e-6;

/// Most visits of a directed portal; then it opens its whole outline at once, which ends its visits. Larger: pathological graphs take long.
/// Smaller: ordinary ones draw too much.
const MOST_VISITS: u32 = 32;

/// The camera in `f64`, with derived values, computed once per frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eye {
    at: DVec3,
    /// Largest changes of a point's clip x and y when the point moves by the tolerance.
    margin: DVec2,
    x: DVec3,
    y: DVec3,
    w: DVec3,
    /// Largest change of a point's clip w when the point moves by the tolerance.
    portal_margin: f64,
    /// Distance from a plane within which an eye may be on either side, metres: twice the tolerance, plus the error of the plane's normal
    /// times the eye's distance from the origin.
    either_side: f64,
    /// Distance from the eye, metres, within which a point may be on the screen with `w` below three times `portal_margin`; infinite for a
    /// camera with dependent rows.
    touch: f64,
    /// If set, only the space beyond this plane is visible: that of a mirror, for a reflected eye.
    front: Option<(Vec3, f32)>,
}

impl Eye {
    pub fn new(camera: &Camera, culler: &Culler, front: Option<(Vec3, f32)>) -> Self {
        Self::of(camera, culler, front, 0.0, &Lens::of(camera))
    }

    /// The same for a camera with a lens, whose place is known to within `off` metres.
    pub fn of(camera: &Camera, culler: &Culler, front: Option<(Vec3, f32)>, off: f64, lens: &Lens) -> Self {
        let tolerance = culler.tolerance + off;
        let (x, y, w) = (camera.x.as_dvec3(), camera.y.as_dvec3(), camera.w.as_dvec3());
        let at = camera.eye.as_dvec3();
        let (margin, portal_margin) = (lens.lengths.truncate() * tolerance, lens.lengths.z * tolerance);
        let touch = if lens.farthest.is_finite() { 3.0 * portal_margin * lens.farthest + tolerance } else { f64::INFINITY };
        let either_side = 2.0 * tolerance + 4.0 * f64::from(f32::EPSILON) * at.length();
        Self { at, margin, x, y, w, portal_margin, either_side, touch, front }
    }

    /// Signed distance of the eye from a directed portal's plane, metres: negative on the source side.
    fn side(&self, culler: &Culler, portal: DirectedPortal) -> f64 {
        self.distance_from(directed_plane(culler, portal))
    }

    /// Whether a directed portal is shut, and its leaf not behind the eye.
    #[inline]
    pub fn is_shut(&self, culler: &Culler, portal: DirectedPortal, doors: &Doors) -> bool {
        !doors.is_open(portal) && !is_in_doorway(culler, self.at, portal.portal())
    }

    /// The largest rectangle that a directed portal can open.
    pub fn own_outline(&self, culler: &Culler, portal: DirectedPortal) -> Rect {
        let side = self.side(culler, portal);
        let corners = culler.portal_corners.get(portal.portal().index());
        if side > self.either_side || self.front.is_some_and(|front| !is_beyond(culler, front, corners)) {
            return Rect::EMPTY;
        }
        self.outline(corners, side)
    }

    /// The rectangle that a winding can open; `side` is the distance of its plane from the eye, metres.
    pub fn outline(&self, corners: &[Vec3], side: f64) -> Rect {
        if side.abs() <= self.touch && distance(self.at, corners) <= self.touch {
            return Rect::FULL;
        }
        self.project(corners)
    }

    /// Signed distance of the eye from a plane, metres.
    pub fn distance_from(&self, (n, d): (Vec3, f32)) -> f64 {
        n.as_dvec3().dot(self.at) - f64::from(d)
    }

    /// The rectangle around a winding grown by the tolerance, clipped to the screen.
    fn project(&self, corners: &[Vec3]) -> Rect {
        let margin = self.margin;
        let cut = 2.0 * self.portal_margin;
        let (mut min, mut max) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let mut draw = |clip: DVec3| {
            let (near, far) = (clip.z - self.portal_margin, clip.z + self.portal_margin);
            let widest = |v: f64| if v > 0.0 { v / near } else { v / far };
            let (low, high) = (clip.truncate() - margin, clip.truncate() + margin);
            max = max.max(DVec2::new(widest(high.x), widest(high.y)));
            min = min.min(-DVec2::new(widest(-low.x), widest(-low.y)));
        };
        let clip = |p: Vec3| {
            let v = p.as_dvec3() - self.at;
            DVec3::new(self.x.dot(v), self.y.dot(v), self.w.dot(v))
        };
        let mut a = corners.last().map_or(DVec3::ZERO, |&p| clip(p));
        for &corner in corners {
            let b = clip(corner);
            if (a.z < cut) != (b.z < cut) {
                let t = (cut - a.z) / (b.z - a.z);
                draw((a + (b - a) * t).with_z(cut));
            }
            if b.z >= cut {
                draw(b);
            }
            a = b;
        }
        if min.x > max.x {
            return Rect::EMPTY;
        }
        let limit = DVec2::splat(2.0);
        let rect = Rect {
            min: (min.clamp(-limit, limit) - ROUNDING).as_vec2(),
            max: (max.clamp(-limit, limit) + ROUNDING).as_vec2(),
        };
        rect.intersection(Rect::FULL)
    }
}

/// What of a camera does not depend on where it is and how it is turned.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    /// Norms of the rows.
    lengths: DVec3,
    /// The largest distance from the eye, in metres, of a point on the screen with a clip w of 1; infinite if there is none.
    farthest: f64,
}

impl Lens {
    pub fn of(camera: &Camera) -> Self {
        let back = camera.unproject();
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)];
        let distances = corners.map(|(x, y)| (back * DVec3::new(x, y, 1.0)).length());
        let farthest = distances.into_iter().fold(0.0, |a: f64, b| if b.is_finite() { a.max(b) } else { f64::INFINITY });
        let lengths = [camera.x, camera.y, camera.w].map(|row| row.as_dvec3().length());
        Self { lengths: lengths.into(), farthest }
    }
}

/// Distance of a point from a convex winding, metres.
pub(super) fn distance(at: DVec3, corners: &[Vec3]) -> f64 {
    let corner = |i: usize| corners[i % corners.len()].as_dvec3() - at;
    let n = (1..corners.len().saturating_sub(1))
        .map(|i| (corner(i) - corner(0)).cross(corner(i + 1) - corner(0)))
        .sum::<DVec3>()
        .normalize_or_zero();
    let (mut inside, mut nearest) = (true, f64::INFINITY);
    for i in 0..corners.len() {
        let (a, edge) = (corner(i), corner(i + 1) - corner(i));
        inside &= n.cross(edge).dot(a) <= 0.0;
        let t = (-a.dot(edge) / edge.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        nearest = nearest.min((a + edge * t).length());
    }
    if inside && !corners.is_empty() { n.dot(corner(0)).abs() } else { nearest }
}

/// Whether an eye is in a portal's doorway, on either side: then the leaf may be behind the eye.
pub(super) fn is_in_doorway(culler: &Culler, at: DVec3, portal: PortalId) -> bool {
    let (depth, plane) = (f64::from(culler.doorway(portal.directed(0))), culler.portal_planes[portal.index()]);
    let side = plane.truncate().as_dvec3().dot(at) - f64::from(plane.w);
    side.abs() <= depth && distance(at, culler.portal_corners.get(portal.index())) <= depth
}

/// Fills the scratch with the cells, portals and objects that the camera sees from `homes`, the eye's cells, on `open`.
pub(super) fn traverse(culler: &Culler, camera: &Camera, eye: &Eye, homes: &[CellId], open: &Rect, scratch: &mut Scratch) {
    start(culler, eye, homes, open, scratch);
    spread(culler, eye, scratch);
    let seen = Opened { culler, camera, front: eye.front, open, off: 0.0 };
    collect(CollectObjects { seen, homes, beside: None, scratch });
}

/// Offers the portals out of cells that are visible on `open`, with nothing between them and the eye.
pub(super) fn start(culler: &Culler, eye: &Eye, homes: &[CellId], open: &Rect, scratch: &mut Scratch) {
    for &home in homes {
        scratch.reach(home);
        offer(culler, eye, home, None, open, scratch);
    }
}

/// Goes from portal to portal, until no rectangle grows.
pub(super) fn spread(culler: &Culler, eye: &Eye, scratch: &mut Scratch) {
    while let Some(portal) = scratch.queue.pop() {
        let state = &mut scratch.portal_states[portal.0 as usize];
        state.queued = false;
        state.visits += 1;
        if state.visits == MOST_VISITS {
            state.open = state.own;
            scratch.stats.capped += 1;
        }
        let open = state.open;
        offer(culler, eye, target(culler, portal), Some(portal), &open, scratch);
    }
}

/// Sets the final rectangles, and adds the objects.
pub(super) fn collect(mut objects: CollectObjects<'_>) {
    let CollectObjects { seen: Opened { culler, .. }, ref mut scratch, .. } = objects;
    for i in 0..scratch.crossed.len() {
        let portal = scratch.crossed[i].portal;
        let state = scratch.portal_states[portal.0 as usize];
        scratch.crossed[i].rect = state.open;
        if state.goes_on() {
            scratch.reach(target(culler, portal));
        }
    }
    group(culler, scratch);
    scratch.stats.cells = scratch.cells.len() as u64;
    scratch.stats.portals = scratch.crossed.len() as u64;
    vectorized(objects);
}

/// A cell is visible on `open`, through portal `through` (or from the eye): queues its portals whose rectangles grow by that.
fn offer(culler: &Culler, eye: &Eye, cell: CellId, through: Option<DirectedPortal>, open: &Rect, scratch: &mut Scratch) {
    let Range { start, mut end } = ways_out(culler, eye, cell, scratch);
    let mut at = start;
    while at < end {
        let next = scratch.ways[at];
        let state = &mut scratch.portal_states[next.0 as usize];
        let opened = open.intersection(state.own);
        // A straight line passes a portal at most once.
        let passes = |through: DirectedPortal| {
            next.portal() != through.portal()
                && is_beyond(culler, directed_plane(culler, through), culler.portal_corners.get(next.portal().index()))
        };
        if opened.is_empty() || state.open.covers(&opened) || !through.is_none_or(passes) {
            at += 1;
            continue;
        }
        scratch.open(next, opened);
        let state = &scratch.portal_states[next.0 as usize];
        if state.open.covers(&state.own) {
            // It is entirely open: no further visits.
            end -= 1;
            scratch.ways.swap(at, end);
        } else {
            at += 1;
        }
    }
    scratch.cell_ways[cell.index()].end = end as u32;
}

/// The portals of a cell that the eye might see through at all, without those entirely open already, as a range of [`Scratch::ways`].
/// Computed once per frame, because most portals of a large cell (the outside) face away from the eye or are off the screen.
fn ways_out(culler: &Culler, eye: &Eye, cell: CellId, scratch: &mut Scratch) -> Range<usize> {
    let Part { frame, start, end } = scratch.cell_ways[cell.index()];
    if frame == scratch.frame {
        return start as usize..end as usize;
    }
    let start = scratch.ways.len();
    for &portal in culler.cell_portals.get(cell.index()) {
        if culler.may_enter(target(culler, portal), scratch) && !scratch.is_joined(portal.reversed()) {
            let own = eye.own_outline(culler, portal);
            if !own.is_empty() {
                let shut = eye.is_shut(culler, portal, &scratch.doors);
                let joined = scratch.is_joined(portal);
                scratch.portal_states[portal.0 as usize] = PortalState { own, shut, joined, ..PortalState::UNSEEN };
                scratch.ways.push(portal);
            }
        }
    }
    let end = scratch.ways.len();
    scratch.cell_ways[cell.index()] = Part { frame: scratch.frame, start: start as u32, end: end as u32 };
    start..end
}

/// True if one of `corners` is in front of a plane, within the tolerance.
#[inline]
pub(super) fn is_beyond(culler: &Culler, (n, d): (Vec3, f32), corners: &[Vec3]) -> bool {
    let (n, d) = (n.as_dvec3(), f64::from(d));
    corners.iter().any(|p| n.dot(p.as_dvec3()) - d >= -2.0 * culler.tolerance)
}
