//! Cells as rooms: which of them a visit had better begin in.

use crate::body::{EYE, STEP};
use enfilade::CellId;
use enfilade::file::{FilePortal, PvsFile};
use enfilade::math::geom::{Aabb, Plane, area, clip};
use enfilade::scene::{Object, Role, Scene};
use enfilade::types::portal::PortalKind;
use glam::{DVec2, DVec3, Vec4};

/// An opening this wide and this high, metres, is gone through.
const WAY_IN: [f64; 2] = [0.6, 1.8];
/// A box of stairs over so much of a room's floor makes it a staircase. More: landings are rooms. Less: living rooms with stairs are none.
const STAIRS: f64 = 0.2;
/// How far down the stairs go that lead up to a landing, metres: a storey, less what leads on from the floor below.
const FLIGHT: f64 = 2.5;
/// Pieces are cut at this many diagonals of the model.
const FARTHEST: f64 = 2.0;
/// Points within so much of a piece's sides are in it, in diagonals of the model: files are in `f32`.
const ROUNDING: f64 = 1e-7;

/// A convex piece of a cell.
pub struct Piece {
    planes: Vec<Plane>,
    /// Box around it.
    pub bounds: Aabb,
    /// Of its shadow on the plan, square metres.
    pub area: f64,
}

impl Piece {
    /// `None` where nothing is inside the planes, within `extent` metres of the origin.
    fn new(planes: &[Vec4], extent: f64) -> Option<Self> {
        let planes: Vec<Plane> = planes.iter().map(|p| Plane { n: p.truncate().as_dvec3(), d: f64::from(p.w) }).collect();
        let (mut bounds, mut shadow) = (Aabb::EMPTY, 0.0);
        for (i, plane) in planes.iter().enumerate() {
            let (across, middle) = (plane.n.any_orthonormal_vector() * extent, plane.n * plane.d);
            let up = plane.n.cross(across);
            let square = vec![middle - across - up, middle + across - up, middle + across + up, middle - across + up];
            let others = planes.iter().enumerate().filter(|(other, _)| *other != i);
            let mut face = square;
            for (_, other) in others {
                if face.is_empty() {
                    break;
                }
                face = clip(&face, other, extent * ROUNDING);
            }
            bounds = face.iter().fold(bounds, |b, p| b.with(*p));
            // Its upper and its lower side have the same shadow.
            shadow += 0.5 * area(&face) * plane.n.y.abs();
        }
        (!bounds.is_empty()).then_some(Self { planes, bounds, area: shadow })
    }

    /// The least and the greatest height in it over a point of the plan (x, z).
    pub fn heights(&self, at: DVec2) -> Option<[f64; 2]> {
        let (mut low, mut high) = (self.bounds.min.y, self.bounds.max.y);
        for plane in &self.planes {
            let rest = plane.d - plane.n.x * at.x - plane.n.z * at.y;
            if plane.n.y > 0.0 {
                high = high.min(rest / plane.n.y);
            } else if plane.n.y < 0.0 {
                low = low.max(rest / plane.n.y);
            } else if rest < 0.0 {
                return None;
            }
        }
        (low < high).then_some([low, high])
    }
}

/// A closed cell. What is listed first counts most, then what is next.
pub struct Room {
    /// The author gave it an id: it is meant to be a room.
    pub is_named: bool,
    /// Stairs take up much of it.
    is_staircase: bool,
    /// A door leads in; or else something that a person can go through.
    has_door: bool,
    has_way_in: bool,
    has_furniture: bool,
    /// Of the floor, square metres.
    pub area: f64,
    /// Which cell it is.
    pub cell: CellId,
    /// Its pieces.
    pub pieces: Vec<Piece>,
}

/// The closed cells of a file, the best room first.
pub fn rooms(file: &PvsFile, scene: &Scene) -> Vec<Room> {
    let extent = FARTHEST * scene.bounds().diagonal();
    let mut rooms: Vec<Room> = Vec::new();
    for (i, cell) in file.cells.iter().enumerate().filter(|(_, cell)| !cell.open) {
        let pieces: Vec<Piece> = cell.pieces.iter().filter_map(|planes| Piece::new(planes, extent)).collect();
        let lowest = pieces.iter().map(|piece| piece.bounds.min.y).fold(f64::INFINITY, f64::min);
        let on_floor = pieces.iter().filter(|piece| piece.bounds.min.y <= lowest + STEP);
        let area: f64 = on_floor.map(|piece| piece.area).sum();
        let bounds = pieces.iter().fold(Aabb::EMPTY, |b, piece| b.union(piece.bounds));
        let around = bounds.inflated(STEP);
        let reach = Aabb { min: around.min - DVec3::Y * FLIGHT, ..around };
        let stairs = scene.objects.iter().filter(|o| o.role == Role::Stair && o.bounds.touches(&reach));
        let stairwell = stairs.fold(Aabb::EMPTY, |b, o| b.union(o.bounds));
        let stairs = (stairwell.max.min(bounds.max) - stairwell.min.max(bounds.min)).max(DVec3::ZERO);
        // Not railings of balconies and stairs, which reach elsewhere.
        let is_furniture =
            |o: &Object| o.role == Role::Furnishing && around.contains(o.bounds.min) && around.contains(o.bounds.max);
        let mut objects = file.placement.ones(i).filter_map(|o| scene.objects.get(o));
        rooms.push(Room {
            is_named: cell.source.is_some(),
            is_staircase: stairs.x * stairs.z > STAIRS * area,
            has_door: false,
            has_way_in: false,
            has_furniture: objects.any(is_furniture),
            area,
            cell: CellId(i as u32),
            pieces,
        });
    }
    for portal in &file.portals {
        let (is_door, is_way_in) = (portal.kind == PortalKind::Door, is_way_in(portal));
        for cell in portal.cells {
            if let Ok(i) = rooms.binary_search_by_key(&cell, |room| room.cell) {
                rooms[i].has_door |= is_door;
                rooms[i].has_way_in |= is_door || is_way_in;
            }
        }
    }
    rooms.retain(|room| !room.pieces.is_empty());
    let rank = |room: &Room| [room.is_named, !room.is_staircase, room.has_door, room.has_way_in, room.has_furniture];
    rooms.sort_by(|a, b| rank(b).cmp(&rank(a)).then(b.area.total_cmp(&a.area)));
    rooms
}

/// Whether a person can go through an opening: upright, wide and high enough.
fn is_way_in(portal: &FilePortal) -> bool {
    let bounds = Aabb::of(portal.winding.iter().map(|p| p.as_dvec3()));
    let size = bounds.size();
    portal.kind == PortalKind::Opening && DVec2::new(size.x, size.z).length() >= WAY_IN[0] && size.y >= WAY_IN[1]
}

/// Whether the eye above `feet` is in one of some pieces.
pub fn holds(pieces: &[Piece], feet: DVec3) -> bool {
    let at = DVec2::new(feet.x, feet.z);
    let eye = feet.y + EYE;
    pieces.iter().filter_map(|piece| piece.heights(at)).any(|[low, high]| (low..=high).contains(&eye))
}
