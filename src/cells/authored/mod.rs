//! Labels from the author's rooms: which piece lies in which room.
//!
//! In: the middles of pieces, and the author's [`Hints`]. Out: [`Claims`], the room that claims each piece; which rooms lie under the open
//! sky; and the findings of [`audit`].
//!
//! The steps: [`audit`] tells which rooms are sound; [`claims`] assigns each piece to the smallest sound room that contains its centre, and
//! each doorway to an adjacent room; [`plan`](super::plan) labels the remaining pieces. A room contains a point if a vertical ray from the
//! point crosses the room's surface an odd number of times (for polygons: Shimrat, *Algorithm 112*, 1962).
//!
//! Exported rooms are often wrong. So an authored room only names pieces; walls and doors come from the triangles.

pub(in crate::cells) mod audit;

use crate::math::geom::{Aabb, middle, newell};
use crate::math::parallel;
use crate::scene::rays::RayScene;
use crate::scene::{Hints, OpeningHint, OpeningKind, RoomHint, Scene};
use glam::DVec3;

/// A piece belongs to a doorway within this distance of it, metres.
const REVEAL: f64 = 0.02;
/// Distance from a doorway into the adjacent room, at which the room is looked up, metres.
const STEP: f64 = 0.3;
/// Vertical rays along each side of a room's box.
const LINES: usize = 12;
/// A room with less than this share covered is in the open air.
const COVERED: f64 = 0.5;

/// The authored room of each piece, an index into [`Hints::rooms`].
#[derive(Clone, PartialEq, Debug)]
pub(in crate::cells) struct Claims {
    /// The smallest room that contains the piece's centre.
    pub rooms: Vec<Option<u32>>,
    /// For pieces in a doorway and in no room: a room next to the doorway, first the one on the side of its normal. So a doorway does not
    /// join a plenum above it.
    pub doorways: Vec<Option<u32>>,
}

impl Claims {
    /// No claims.
    pub fn none(pieces: usize) -> Self {
        Self { rooms: vec![None; pieces], doorways: vec![None; pieces] }
    }
}

/// Claims of the pieces with these centres; `unsound` rooms claim nothing.
pub(in crate::cells) fn claims(points: &[DVec3], hints: &Hints, unsound: &[bool]) -> Claims {
    let boxes: Vec<Aabb> = hints.rooms.iter().map(|r| Aabb::of(r.surface.iter().flatten().copied())).collect();
    let room = |p: DVec3| {
        let inside = |i: &usize| !unsound[*i] && boxes[*i].contains(p) && holds(&hints.rooms[*i], p);
        let size = |i: &usize| boxes[*i].size().element_product();
        (0..boxes.len()).filter(inside).min_by(|a, b| size(a).total_cmp(&size(b))).map(|i| i as u32)
    };
    let passages = hints.openings.iter().filter(|o| matches!(o.kind, OpeningKind::Door | OpeningKind::Opening));
    let doorways: Vec<Doorway> = passages.filter_map(|o| Doorway::new(o, room)).collect();
    let in_doorway = |p: DVec3| doorways.iter().find(|d| d.holds(p)).map(|d| d.room);
    let rooms: Vec<Option<u32>> = parallel::map(points, |&p| room(p));
    let doorway = |i: usize| if rooms[i].is_some() { None } else { in_doorway(points[i]) };
    let doorways = parallel::map_range(0..points.len(), doorway);
    Claims { rooms, doorways }
}

/// A doorway, and the room that claims it.
struct Doorway<'h> {
    around: Aabb,
    opening: &'h OpeningHint,
    normal: DVec3,
    room: u32,
}

impl<'h> Doorway<'h> {
    /// `None` if no room is on either side.
    fn new(opening: &'h OpeningHint, room: impl Fn(DVec3) -> Option<u32>) -> Option<Self> {
        let centre = middle(&opening.winding);
        let local: Vec<DVec3> = opening.winding.iter().map(|&p| p - centre).collect();
        let normal = newell(&local).try_normalize()?;
        let reach = 0.5 * opening.thickness + REVEAL;
        let before = |way: DVec3| room(centre + way * (0.5 * opening.thickness + STEP));
        let around = Aabb::of(opening.winding.iter().copied()).inflated(reach);
        Some(Self { around, opening, normal, room: before(normal).or_else(|| before(-normal))? })
    }

    fn holds(&self, p: DVec3) -> bool {
        let winding = &self.opening.winding;
        let inward = |k: usize| {
            let (a, b) = (winding[k], winding[(k + 1) % winding.len()]);
            self.normal.cross(b - a).normalize_or_zero().dot(p - a)
        };
        self.around.contains(p)
            && self.normal.dot(p - winding[0]).abs() <= 0.5 * self.opening.thickness + REVEAL
            && (0..winding.len()).all(|k| inward(k) >= -REVEAL)
    }
}

/// For each authored room, whether less than half of it is covered, even by glass.
pub(in crate::cells) fn open_air(scene: &Scene) -> Vec<bool> {
    let rays = RayScene::new(scene);
    let far = 2.0 * scene.bounds().diagonal();
    let is_open = |room: &RoomHint| {
        let bounds = Aabb::of(room.surface.iter().flatten().copied());
        let (mut inside, mut covered) = (0usize, 0usize);
        let mut panes = Vec::new();
        for k in 0..LINES * LINES {
            let at = DVec3::new((k % LINES) as f64 + 0.4951, 0.5 * LINES as f64, (k / LINES) as f64 + 0.5073) / LINES as f64;
            let p = bounds.min + bounds.size() * at;
            if holds(room, p) {
                panes.clear();
                rays.see_through(p, DVec3::Y, far, &mut panes);
                inside += 1;
                covered += usize::from(!panes.is_empty() || rays.first_opaque(p, DVec3::Y, far).is_some());
            }
        }
        inside > 0 && (covered as f64) < COVERED * inside as f64
    };
    parallel::map(&scene.hints.rooms, |room| room.outside || is_open(room))
}

/// True if a vertical ray crosses the room's surface an odd number of times. The ray starts a tenth of a micrometre beside `p`, off axes
/// and diagonals, so that it misses edges between triangles.
fn holds(room: &RoomHint, p: DVec3) -> bool {
    let p = p + DVec3::new(1.0e-7, 0.0, 0.618e-7);
    let above = |t: &&[DVec3; 3]| {
        let side = |a: DVec3, b: DVec3| robust::orient2d(coord(a), coord(b), coord(p)) > 0.0;
        let s = [side(t[0], t[1]), side(t[1], t[2]), side(t[2], t[0])];
        let n = (t[1] - t[0]).cross(t[2] - t[0]);
        s[0] == s[1] && s[1] == s[2] && n.y != 0.0 && p.y < t[0].y - (n.x * (p.x - t[0].x) + n.z * (p.z - t[0].z)) / n.y
    };
    room.surface.iter().filter(above).count() % 2 == 1
}

fn coord(p: DVec3) -> robust::Coord<f64> {
    robust::Coord { x: p.x, y: -p.z }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_holds_its_middle_and_not_what_is_beside_above_or_below() {
        let c = |i: usize| DVec3::new((i & 1) as f64 * 4.0, (i >> 1 & 1) as f64 * 3.0, (i >> 2 & 1) as f64 * 5.0);
        let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let surface = quads.iter().flat_map(|q| [[c(q[0]), c(q[1]), c(q[2])], [c(q[0]), c(q[2]), c(q[3])]]).collect();
        let room = RoomHint { id: "r".into(), name: "r".into(), storey: None, surface, outside: false, drawn: true };
        let hints = Hints { rooms: vec![room], ..Hints::default() };
        let points = [(2.0, 1.5, 2.5), (5.0, 1.5, 2.5), (2.0, 4.0, 2.5), (2.0, -1.0, 2.5), (2.0, 1.5, 2.0)];
        let points = points.map(|(x, y, z)| DVec3::new(x, y, z));
        assert_eq!(claims(&points, &hints, &[false]).rooms, [Some(0), None, None, None, Some(0)]);
        assert_eq!(claims(&points, &hints, &[true]).rooms, [None; 5]);
    }
}
