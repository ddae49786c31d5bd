//! One line of the audit: what is wrong, and with which of the author's ids.

use crate::scene::RoomHint;
use serde::{Deserialize, Serialize};

/// What is wrong.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FindingKind {
    /// Two rooms, or two openings, have one id.
    DuplicateId,
    /// A room encloses next to nothing.
    NoVolume,
    /// A room's surface has holes.
    NotClosed,
    /// Two rooms hold one and the same space.
    Overlap,
    /// A room holds no free space: it lies in solid matter, or other rooms took all of it.
    NoFreeSpace,
    /// No door, passage or open side leads out of a room.
    NoDoor,
    /// Sides of a room lie off the walls that bound it.
    Shifted,
    /// A door or window has no room on either side, or stands in the middle of one.
    DoorWithoutRooms,
    /// A door or window joins other rooms than its relations say.
    DoorElsewhere,
    /// The wall is closed behind a door or window.
    DoorWalledUp,
    /// A room lies under the open sky, and its author doesn't say so.
    OpenAir,
    /// Free space indoors that no room claims.
    Unclaimed,
}

/// One thing that is wrong.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Finding {
    /// What.
    pub kind: FindingKind,
    /// The author's ids (GlobalIds, node names) of what it is about; none for space that nobody named.
    pub ids: Vec<String>,
    /// One line.
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
