//! The shortest way through doors.

use crate::building::EnfBuilding;
use crate::doors::EnfDoors;
use crate::fault::{EnfStatus, Fault, handle, needed, status};
use crate::lists::Buffer;
use crate::shapes::EnfVec3;
use runtime::runtime::{Culler, Doors, Pathfinder};
use std::mem::MaybeUninit;
use std::sync::Arc;

/// Finds shortest ways in a building.
pub struct EnfPaths {
    culler: Arc<Culler>,
    paths: Pathfinder,
    open: Doors,
}

/// A way.
#[repr(C)]
pub struct EnfPath {
    /// Its length, metres.
    pub metres: f64,
    /// No way is shorter than this, metres: less than `metres` where the search is cut short.
    pub at_least: f64,
}

/// Prepares for ways through what is open in `passable`; null: all but windows. That takes a while in a large building. Null if it fails.
#[unsafe(no_mangle)]
pub extern "C" fn enf_paths_new(building: Option<&EnfBuilding>, passable: Option<&EnfDoors>) -> Option<Box<EnfPaths>> {
    handle(|| {
        let culler = needed(building, "the building")?.culler.clone();
        let every = Doors::passable(&culler);
        let passable = passable.map_or(Ok(&every), |doors| doors.of(&culler))?;
        let (paths, open) = (Pathfinder::new(&culler, passable), Doors::open(&culler));
        Ok(EnfPaths { paths, open, culler })
    })
}

/// Frees what finds ways, or nothing.
#[unsafe(no_mangle)]
pub extern "C" fn enf_paths_free(paths: Option<Box<EnfPaths>>) {
    drop(paths);
}

/// The shortest way between two points through portals that are open in `doors`, too; null: all are. The buffer takes where it starts, where it
/// passes each portal, and where it ends. ENF_STATUS_NOTHING: a point is in no cell, or there is no way.
///
/// # Safety
///
/// `buffer` has room for `capacity` points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_paths_find(
    paths: Option<&mut EnfPaths>,
    doors: Option<&EnfDoors>,
    from: EnfVec3,
    to: EnfVec3,
    path: Option<&mut MaybeUninit<EnfPath>>,
    buffer: *mut EnfVec3,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let (all, path) = (needed(paths, "the paths")?, needed(path, "the path")?);
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        let doors = doors.map_or(Ok(&all.open), |doors| doors.of(&all.culler))?;
        let found = all.paths.find(doors, from.into(), to.into()).ok_or_else(|| Fault::nothing("there is no way"))?;
        path.write(EnfPath { metres: found.metres, at_least: found.at_least });
        buffer.fill(found.points.iter().map(|&p| p.into()))
    })
}
