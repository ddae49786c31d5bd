//! One finding of the audit: the fault, and the author's ids.

use crate::scene::RoomHint;
use serde::{Deserialize, Serialize};

/// The kind of a fault.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FindingKind {
    /// Two rooms, or two openings, have one id.
    DuplicateId,
    /// A room has almost no volume.
    NoVolume,
    /// A room's surface has holes.
    NotClosed,
    /// Two rooms overlap.
    Overlap,
    /// A room has no free space: it is solid, or other rooms cover it.
    NoFreeSpace,
    /// No door, passage or open side leads out of a room.
    NoDoor,
    /// Sides of a room do not lie on its walls.
    Shifted,
    /// A door or window has no room on either side, or stands in the middle of one.
    DoorWithoutRooms,
    /// A door or window connects rooms other than those in its relations.
    DoorElsewhere,
    /// The wall is closed behind a door or window.
    DoorWalledUp,
    /// A room is in the open air, but is not marked so.
    OpenAir,
    /// Indoor free space without a room.
    Unclaimed,
}

/// One fault.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Finding {
    /// Its kind.
    pub kind: FindingKind,
    /// The author's ids (GlobalIds, node names) of the objects concerned; empty for unnamed space.
    pub ids: Vec<String>,
    /// One line of text.
    pub text: String,
}

/// Id and name.
pub(super) fn called(room: &RoomHint) -> String {
    if room.name.is_empty() || room.name == room.id {
        format!("room {}", room.id)
    } else {
        format!("room {} ({})", room.id, room.name)
    }
}
