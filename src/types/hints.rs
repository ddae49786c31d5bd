//! The author's hints about rooms, doors and storeys. Hints give names and lines; no guarantee depends on them.

use super::level::LevelPortal;
use crate::math::geom::Plane;
use glam::DVec3;
use std::fmt;

/// All hints of the author. Empty for formats without hints.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct Hints {
    /// Storeys, ascending.
    pub storeys: Vec<StoreyHint>,
    /// Rooms.
    pub rooms: Vec<RoomHint>,
    /// Doors, windows and open passages.
    pub openings: Vec<OpeningHint>,
    /// Cells in the model's format.
    pub leaves: Option<Leaves>,
    /// The leak of a map that is not closed.
    pub leak: Option<LeakHint>,
}

/// A leak of a map, in the map's own coordinates.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct LeakHint {
    /// Class of the entity at the start of the path.
    pub entity: String,
    /// Position of the entity.
    pub from: DVec3,
    /// Points of the path, each in an opening; the last one is outside.
    pub way: Vec<DVec3>,
}

impl fmt::Display for LeakHint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let point = |p: &DVec3| format!("({} {} {})", p.x.round(), p.y.round(), p.z.round());
        let Self { entity, from, way } = self;
        write!(f, "the map leaks: the path out from {entity} at {} is", point(from))?;
        way.iter().take(TOLD).try_for_each(|p| write!(f, " {}", point(p)))?;
        f.write_str(if way.len() > TOLD { " ..." } else { "" })
    }
}

/// Most points in a message.
const TOLD: usize = 12;

/// Convex cells of a format, with their portals: the leaves of a level's BSP tree. Metres, relative to the scene's origin.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct Leaves {
    /// Half-spaces of each leaf, inside below each plane; many are redundant. Leaves without any are no cells.
    pub leaves: Vec<Vec<Plane>>,
    /// Portals between leaves.
    pub portals: Vec<LevelPortal>,
    /// Convex polygons between leaves and solid space, counter-clockwise seen from the leaf, most of them behind drawn surfaces.
    pub walls: Vec<Vec<DVec3>>,
    /// Closable portals according to the author: their numbers, ascending, and the name of the shutter.
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
    /// The display name.
    pub name: String,
    /// Index into [`Hints::storeys`].
    pub storey: Option<usize>,
    /// The room's surface as triangles relative to the scene's origin, metres. It should be closed, but may not be.
    pub surface: Vec<[DVec3; 3]>,
    /// Whether the author marked it as open air (a courtyard, a terrace, a roof group).
    pub outside: bool,
    /// Whether the surface is authored; otherwise it is the box around the room's meshes.
    pub drawn: bool,
}

/// The kind of an opening.
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
    /// A boundary between two rooms without a wall.
    Virtual,
}

/// A door, a window, a passage.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct OpeningHint {
    /// GlobalId or node name.
    pub id: String,
    /// Its kind.
    pub kind: OpeningKind,
    /// Its convex outline in the middle of the wall, metres relative to the scene's origin.
    pub winding: Vec<DVec3>,
    /// Thickness of its wall, metres; 0 without a wall.
    pub thickness: f64,
    /// The rooms that it connects, as indices into [`Hints::rooms`], if the author states them.
    pub rooms: [Option<usize>; 2],
}
