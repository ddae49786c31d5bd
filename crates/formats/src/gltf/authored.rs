//! Rooms, portals and roles that the author wrote into node names and extras; for the syntax see [`super`].

use super::data::broken;
use super::hull::{convex_hull, is_closed};
use super::tubes::Tube;
use enfilade::math::geom::Aabb;
use enfilade::scene::{Hints, ImportError, OpeningHint, OpeningKind, Role, RoomHint};
use enfilade::types::note::Note;
use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::value::RawValue;
use std::collections::HashMap;

/// Distance of a portal's corners from its plane, as a share of its diagonal, above which a note is printed.
const FLAT: f64 = 1e-3;
/// Distance of corners from a plane, as a share of the diagonal, up to which a mesh named as a portal is one. Larger: statues
/// count as openings and are not drawn. Smaller: openings drawn as thin boxes count as walls.
const THIN: f64 = 0.05;
/// Maximum names in a note about meshes that are no portals.
const NAMED: usize = 3;

/// The meaning of a node's name.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Named {
    /// None.
    Plain,
    /// A room of this name.
    Room(String),
    /// A group of rooms; in the open air or not.
    Group { outside: bool },
    /// The surface of the room around it.
    Bound,
    /// A portal to the room of this name; if empty, geometry decides.
    Portal(String),
}

impl Named {
    /// Reads a node name: `kitchen-room`, `outside-roomgroup`, `x-bound`, `kitchen-portal`, `kitchen*1-portal`.
    pub fn parse(name: &str) -> Self {
        // Blender adds `.001` to the names of copies.
        let digits = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let name = match digits.strip_suffix('.') {
            Some(stem) if digits.len() < name.len() => stem,
            _ => name,
        };
        // An asterisk and the text after it only make the name unique. Suffixes may be in capitals.
        let before = |suffix: &str| {
            let (stem, end) = name.split_at_checked(name.len().checked_sub(suffix.len())?)?;
            end.eq_ignore_ascii_case(suffix).then(|| stem.split('*').next().unwrap_or_default().to_owned())
        };
        if let Some(stem) = before("-room") {
            Self::Room(stem)
        } else if let Some(stem) = before("-roomgroup") {
            Self::Group { outside: stem.eq_ignore_ascii_case("outside") }
        } else if before("-bound").is_some() {
            Self::Bound
        } else if let Some(stem) = before("-portal") {
            Self::Portal(stem)
        } else {
            Self::Plain
        }
    }
}

/// `extras.enfilade` of a node.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct Extras {
    pub role: Option<RoleName>,
    pub room: Option<RoomName>,
    pub portal: Option<[String; 2]>,
    pub tube: Option<Tube>,
    /// Written by `export`.
    #[serde(rename = "object")]
    _object: Option<IgnoredAny>,
    /// Likewise.
    #[serde(rename = "cells")]
    _cells: Option<IgnoredAny>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "kebab-case")]
pub(super) enum RoleName {
    Structure,
    Furnishing,
    Door,
    Window,
    Stair,
    Helper,
    Sky,
}

#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum RoomName {
    /// True: this node is a room with the node's name; false: it is not a room, whatever its name.
    IsRoom(bool),
    /// This node is (a part of) the room of this name.
    Name(String),
}

impl From<RoleName> for Role {
    fn from(name: RoleName) -> Self {
        match name {
            RoleName::Structure => Self::Structure,
            RoleName::Furnishing => Self::Furnishing,
            RoleName::Door => Self::Door,
            RoleName::Window => Self::Window,
            RoleName::Stair => Self::Stair,
            RoleName::Helper => Self::Helper,
            RoleName::Sky => Self::Sky,
        }
    }
}

impl Extras {
    /// Reads the extras of a node; those of other tools are ignored, a spelling mistake in ours is an error.
    pub fn parse(extras: Option<&RawValue>, node: &str) -> Result<Self, ImportError> {
        /// Extras may be any JSON; only an object can hold ours.
        #[derive(Deserialize)]
        struct Any<'a> {
            #[serde(borrow)]
            enfilade: Option<&'a RawValue>,
        }
        match extras.and_then(|e| serde_json::from_str::<Any>(e.get()).ok()?.enfilade) {
            Some(ours) => serde_json::from_str(ours.get()).map_err(|e| broken(format!("node {node}: extras.enfilade: {e}"))),
            None => Ok(Self::default()),
        }
    }
}

/// Ratio of the areas of a portal's hull and its mesh above which a note is printed.
const LOOSE: f64 = 1.05;

/// A room during the traversal of nodes.
struct Room {
    id: String,
    name: String,
    outside: bool,
    /// Triangles of its `-bound` meshes.
    bound: Vec<[DVec3; 3]>,
    /// Bounds of its other meshes.
    bounds: Aabb,
}

/// The rooms that a portal joins; rooms may come after portals in the file.
struct Portal {
    id: String,
    winding: Vec<DVec3>,
    inside: Option<usize>,
    names: [String; 2],
}

/// Collects rooms and portals.
#[derive(Default)]
pub(super) struct Authored {
    rooms: Vec<Room>,
    /// The first room of each name and id.
    by_name: HashMap<String, usize>,
    portals: Vec<Portal>,
    /// Nodes named as portals that are none.
    no_portals: Vec<String>,
    notes: Vec<Note>,
}

impl Authored {
    /// A new room.
    pub fn room(&mut self, id: &str, name: &str, outside: bool) -> usize {
        for key in [name, id] {
            self.by_name.entry(key.to_owned()).or_insert(self.rooms.len());
        }
        let (id, name) = (id.to_owned(), name.to_owned());
        self.rooms.push(Room { id, name, outside, bound: Vec::new(), bounds: Aabb::EMPTY });
        self.rooms.len() - 1
    }

    /// The room of this name, or a new one.
    pub fn room_named(&mut self, id: &str, name: &str, outside: bool) -> usize {
        self.by_name.get(name).copied().unwrap_or_else(|| self.room(id, name, outside))
    }

    /// Adds visible geometry of a room.
    pub fn furnish(&mut self, room: Option<usize>, positions: &[DVec3]) {
        if let Some(room) = room {
            let bounds = &mut self.rooms[room].bounds;
            *bounds = bounds.union(Aabb::of(positions.iter().copied().filter(|p| p.is_finite())));
        }
    }

    /// Adds a `-bound` mesh.
    pub fn bound(&mut self, node: &str, room: Option<usize>, triangles: impl Iterator<Item = [DVec3; 3]>) {
        match room {
            Some(room) => self.rooms[room].bound.extend(triangles),
            None => self.notes.push(Note::fault(format!("{node}: a bound outside of any room, ignored"))),
        }
    }

    /// Adds a mesh that is named as a portal and is none.
    pub fn drawn(&mut self, node: &str) {
        self.no_portals.push(node.to_owned());
    }

    /// Adds a portal's mesh. `names`: the author's names of its rooms, empty if missing; `inside`: the room around it.
    pub fn portal(&mut self, node: &str, inside: Option<usize>, names: [String; 2], triangles: &[[DVec3; 3]]) {
        match winding(triangles) {
            Some((winding, off)) => {
                if off > FLAT * Aabb::of(winding.iter().copied()).diagonal() {
                    self.notes.push(Note::taken(format!(
                        "{node}: a portal that is not flat (by {off:.3} m either way), flattened"
                    )));
                }
                let mesh: f64 = triangles.iter().map(|t| enfilade::math::geom::area(t)).sum();
                // A mesh with both sides has twice the area.
                if enfilade::math::geom::area(&winding) > LOOSE * mesh {
                    self.notes.push(Note::taken(format!("{node}: a portal that is not convex; its convex hull is used")));
                }
                if inside.is_none() && names[0].is_empty() {
                    self.notes.push(Note::taken(format!("{node}: a portal in no room; geometry decides its near side")));
                }
                self.portals.push(Portal { id: node.to_owned(), winding, inside, names });
            }
            None => self.notes.push(Note::fault(format!("{node}: a portal without area, ignored"))),
        }
    }

    /// The hints, in the order of nodes. Rooms without a surface are left out with a note.
    pub fn finish(self, notes: &mut Vec<Note>) -> Hints {
        let mut hints = Hints::default();
        notes.extend(self.notes.iter().cloned());
        if !self.no_portals.is_empty() {
            let first = self.no_portals[..NAMED.min(self.no_portals.len())].join(", ");
            let count = self.no_portals.len();
            notes.push(Note::taken(format!(
                "{count} meshes are named as portals but are not flat or have a picture ({first}): they are drawn as ordinary meshes"
            )));
        }
        // New number of each room.
        let mut place = Vec::with_capacity(self.rooms.len());
        for room in &self.rooms {
            let surface = match (room.bound.is_empty(), room.bounds.is_empty()) {
                (false, _) if is_closed(&room.bound) => room.bound.clone(),
                (false, _) => match convex_hull(&room.bound) {
                    Some(hull) => {
                        notes.push(Note::taken(format!("{}: its bound is not closed; its convex hull is used", room.id)));
                        hull
                    }
                    // Flat: not a room; the audit reports it.
                    None => room.bound.clone(),
                },
                (true, false) => box_surface(room.bounds),
                (true, true) => {
                    notes.push(Note::fault(format!("{}: a room without meshes, ignored", room.id)));
                    place.push(None);
                    continue;
                }
            };
            place.push(Some(hints.rooms.len()));
            let (id, name) = (room.id.clone(), room.name.clone());
            let (drawn, outside) = (!room.bound.is_empty(), room.outside);
            hints.rooms.push(RoomHint { id, name, storey: None, surface, outside, drawn });
        }
        for portal in &self.portals {
            let mut rooms = [portal.inside, None].map(|r| r.and_then(|r| place[r]));
            for (room, name) in rooms.iter_mut().zip(&portal.names).filter(|(_, name)| !name.is_empty()) {
                *room = self.by_name.get(name).and_then(|&r| place[r]);
                if room.is_none() {
                    notes.push(Note::fault(format!("{}: leads to `{name}`: there is no such room", portal.id)));
                }
            }
            if rooms[0].is_some() && rooms[0] == rooms[1] {
                notes.push(Note::fault(format!(
                    "{}: a portal from a room into itself; its other side is left open",
                    portal.id
                )));
                rooms[1] = None;
            }
            let (id, winding) = (portal.id.clone(), portal.winding.clone());
            hints.openings.push(OpeningHint { id, kind: OpeningKind::Opening, winding, thickness: 0.0, rooms });
        }
        hints
    }
}

/// The outline of a mesh that should be a flat convex polygon: the convex hull of its corners in the plane of its largest
/// triangle, at the middle of their spread along the normal; counter-clockwise about that normal. Second: half that spread,
/// metres. `None` without area.
fn winding(triangles: &[[DVec3; 3]]) -> Option<(Vec<DVec3>, f64)> {
    let normal_of = |[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a);
    let largest = triangles.iter().map(normal_of).max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
    let n = largest.try_normalize()?;
    let (u, v) = n.any_orthonormal_pair();
    let (u, v) = if u.cross(v).dot(n) > 0.0 { (u, v) } else { (v, u) };
    let start = triangles[0][0];
    let corners = || triangles.iter().flatten().map(|&p| p - start);
    let (least, most) = corners().map(|p| p.dot(n)).fold((f64::MAX, f64::MIN), |(l, m), d| (l.min(d), m.max(d)));
    let hull = flat_hull(corners().map(|p| DVec2::new(p.dot(u), p.dot(v))).collect());
    let winding: Vec<DVec3> = hull.iter().map(|p| start + u * p.x + v * p.y + n * (0.5 * (least + most))).collect();
    (winding.len() >= 3).then_some((winding, 0.5 * (most - least)))
}

/// Whether a mesh is flat enough to mark an opening.
pub(super) fn is_thin(triangles: &[[DVec3; 3]]) -> bool {
    let diagonal = Aabb::of(triangles.iter().flatten().copied()).diagonal();
    triangles.is_empty() || winding(triangles).is_none_or(|(_, off)| off <= THIN * diagonal)
}

/// The convex hull, counter-clockwise, without corners in the middle of a side (Andrew, *Another efficient algorithm for convex
/// hulls in two dimensions*, 1979).
pub(crate) fn flat_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    // Rotation moves corners on a side by rounding errors, to either side of it.
    let extent = points.iter().fold(0.0f64, |e, p| e.max(p.abs().max_element()));
    let flat = 1e-12 * extent * extent;
    let turns_left = |a: DVec2, b: DVec2, c: DVec2| {
        let [a, b, c] = [a, b, c].map(|p| Coord { x: p.x, y: p.y });
        orient2d(a, b, c) > flat
    };
    let mut hull: Vec<DVec2> = Vec::new();
    let mut chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let start = hull.len();
        for p in points {
            while hull.len() >= start + 2 && !turns_left(hull[hull.len() - 2], hull[hull.len() - 1], p) {
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
    };
    chain(&mut points.iter().copied());
    chain(&mut points.iter().rev().copied());
    hull
}

/// A box as twelve outward-facing triangles.
fn box_surface(b: Aabb) -> Vec<[DVec3; 3]> {
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 1 { b.max[axis] } else { b.min[axis] };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).map(|t| t.map(corner)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use enfilade::math::geom::{area, newell};

    #[test]
    fn names_are_read_as_godot_reads_them() {
        let portal = |s: &str| Named::Portal(s.into());
        for (name, meaning) in [
            ("kitchen-room", Named::Room("kitchen".into())),
            ("kitchen-room.001", Named::Room("kitchen".into())),
            ("outside-roomgroup", Named::Group { outside: true }),
            ("cellar-roomgroup", Named::Group { outside: false }),
            ("anything-bound", Named::Bound),
            ("kitchen-portal", portal("kitchen")),
            ("kitchen*1-portal", portal("kitchen")),
            ("kitchen*left-portal.012", portal("kitchen")),
            ("-portal", portal("")),
            ("Kitchen-Portal", portal("Kitchen")),
            ("cellar*2-ROOM", Named::Room("cellar".into())),
            ("outside*1-roomgroup", Named::Group { outside: true }),
            ("é-room", Named::Room("é".into())),
            ("ébound", Named::Plain),
            ("bathroom", Named::Plain),
            ("portal", Named::Plain),
            ("v1.0", Named::Plain),
        ] {
            assert_eq!(Named::parse(name), meaning, "{name}");
        }
    }

    #[test]
    fn a_box_surface_is_closed_and_faces_out() {
        let surface = box_surface(Aabb { min: DVec3::ZERO, max: DVec3::new(2.0, 3.0, 4.0) });
        let volume: f64 = surface.iter().map(|[a, b, c]| a.cross(*b).dot(*c) / 6.0).sum();
        assert_eq!((surface.len(), volume), (12, 24.0));
        assert_eq!(surface.iter().map(|t| newell(t)).sum::<DVec3>(), DVec3::ZERO);
    }

    #[test]
    fn a_portals_winding_is_the_outline_of_its_mesh() {
        // A 2 x 1 rectangle, turned, cut into four triangles around its middle, with a corner in the middle of a side.
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, -0.4);
        let at = |x: f64, y: f64| turn * DVec3::new(x, y, 0.0) + DVec3::new(100.0, 5.0, -7.0);
        let rim = [at(0., 0.), at(1., 0.), at(2., 0.), at(2., 1.), at(0., 1.)];
        let fan: Vec<[DVec3; 3]> = (0..5).map(|i| [at(1.0, 0.5), rim[i], rim[(i + 1) % 5]]).collect();
        let (winding, off) = winding(&fan).unwrap();
        assert_eq!(winding.len(), 4);
        assert!(off < 1e-12 && (area(&winding) - 2.0).abs() < 1e-9);
        let relative: Vec<DVec3> = winding.iter().map(|p| *p - winding[0]).collect();
        assert!(newell(&relative).dot(turn * DVec3::Z) > 0.0);
        assert!(super::winding(&[[DVec3::ZERO, DVec3::X, DVec3::X * 2.0]]).is_none());
    }
}
