//! The author's rooms as labels: which piece lies in which room.
//!
//! Exporters get rooms wrong too often to take their walls for granted, so an author's room only names pieces; what closes it
//! and where its doors are is read from the triangles.

use crate::geom::Aabb;
use crate::scene::{Hints, RoomHint};
use glam::DVec3;
use rayon::prelude::*;

/// For each point, the author's room that holds it, as an index into [`Hints::rooms`]; the smallest where several do.
pub(super) fn rooms_of(points: &[DVec3], hints: &Hints) -> Vec<Option<u32>> {
    let boxes: Vec<Aabb> = hints.rooms.iter().map(|r| Aabb::of(r.surface.iter().flatten().copied())).collect();
    points
        .par_iter()
        .map(|&p| {
            let inside = |i: &usize| boxes[*i].contains(p) && holds(&hints.rooms[*i], p);
            let size = |i: &usize| boxes[*i].size().element_product();
            (0..boxes.len()).filter(inside).min_by(|a, b| size(a).total_cmp(&size(b))).map(|i| i as u32)
        })
        .collect()
}

/// True where a line straight up leaves the room's surface an odd number of times. The line starts a tenth of a micrometre beside
/// `p`, off both axes and diagonals, so that it meets no edge that two triangles share: this only names a piece.
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
        let found = rooms_of(&points.map(|(x, y, z)| DVec3::new(x, y, z)), &hints);
        assert_eq!(found, [Some(0), None, None, None, Some(0)]);
    }
}
