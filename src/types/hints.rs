//! What a model's author said about rooms, doors and storeys. Hints name things and draw lines; no guarantee rests on them.

use super::level::LevelPortal;
use crate::geom::Plane;
use glam::DVec3;
use std::fmt;

/// Everything that the author said. Empty for formats that say nothing.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct Hints {
    /// Storeys, ascending.
    pub storeys: Vec<StoreyHint>,
    /// Rooms.
    pub rooms: Vec<RoomHint>,
    /// Doors, windows and open passages.
    pub openings: Vec<OpeningHint>,
    /// Cells that the format brings.
    pub leaves: Option<Leaves>,
    /// The way out of a map that is not closed.
    pub leak: Option<LeakHint>,
}

/// Where a map leaks, in the map's own coordinates.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct LeakHint {
    /// The class of the entity that the way begins at.
    pub entity: String,
    /// Where it is.
    pub from: DVec3,
    /// Points of the way, each in an opening; the last one is outside.
    pub way: Vec<DVec3>,
}

impl fmt::Display for LeakHint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let point = |p: &DVec3| format!("({} {} {})", p.x.round(), p.y.round(), p.z.round());
        let Self { entity, from, way } = self;
        write!(f, "the map leaks: the way out from {entity} at {} is", point(from))?;
        way.iter().take(TOLD).try_for_each(|p| write!(f, " {}", point(p)))?;
        f.write_str(if way.len() > TOLD { " ..." } else { "" })
    }
}

/// Points of a way that are told.
const TOLD: usize = 12;

/// Convex cells that a format brings, with their portals: the leaves of a level's tree. Metres, relative to the scene's origin.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct Leaves {
    /// Half-spaces of each leaf, inside below each plane; many bound nothing. Leaves without any are no cells.
    pub leaves: Vec<Vec<Plane>>,
    /// Portals between leaves.
    pub portals: Vec<LevelPortal>,
    /// Where leaves end at what is solid: convex polygons, most of them behind what is drawn.
    pub walls: Vec<Vec<DVec3>>,
    /// Portals that the author says can be shut: their numbers, ascending, and the name of what shuts them.
    pub shutters: Vec<(u32, String)>,
}

/// A storey.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct StoreyHint {
    /// Its name.
    pub name: String,
    /// Height of its floor, metres, relative to the scene's origin.
    pub elevation: f64,
}

/// A room as its author drew it (IfcSpace; a glTF `-room` node's bound).
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct RoomHint {
    /// GlobalId or node name.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// Index into [`Hints::storeys`].
    pub storey: Option<usize>,
    /// The room's surface as triangles relative to the scene's origin, metres. Meant to be closed; may not be.
    pub surface: Vec<[DVec3; 3]>,
    /// The author marked it as open air (a courtyard, a terrace, a roof group).
    pub outside: bool,
    /// Somebody drew the surface; else it is the box around the room's meshes.
    pub drawn: bool,
}

/// What an opening is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "kebab-case"))]
pub enum OpeningKind {
    /// Closed by a leaf that can open.
    Door,
    /// Closed by glass.
    Window,
    /// A hole in a wall.
    Opening,
    /// Where two rooms meet without a wall.
    Virtual,
}

/// A door, a window, a passage.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct OpeningHint {
    /// GlobalId or node name.
    pub id: String,
    /// What it is.
    pub kind: OpeningKind,
    /// Its outline, convex, in the middle of the wall, metres relative to the scene's origin.
    pub winding: Vec<DVec3>,
    /// Thickness of the wall that it goes through, metres; 0 where there is none.
    pub thickness: f64,
    /// The rooms that it joins, as indices into [`Hints::rooms`], where the author said so.
    pub rooms: [Option<usize>; 2],
}
