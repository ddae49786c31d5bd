//! The states of doors.

use crate::building::{EnfBuilding, portal_of};
use crate::fault::{EnfStatus, Fault, handle, needed, status};
use runtime::DirectedPortal;
use runtime::runtime::{Culler, Doors};
use std::mem::MaybeUninit;
use std::sync::Arc;

/// Which portals of a building are shut.
pub struct EnfDoors {
    pub(crate) culler: Arc<Culler>,
    pub(crate) doors: Doors,
}

impl EnfDoors {
    /// Its states, for what is of `culler`.
    pub(crate) fn of(&self, culler: &Arc<Culler>) -> Result<&Doors, Fault> {
        let same = Arc::ptr_eq(&self.culler, culler);
        same.then_some(&self.doors).ok_or_else(|| Fault::other_building("doors"))
    }

    fn directed(&self, portal: u32, side: u32) -> Result<DirectedPortal, Fault> {
        let portal = portal_of(&self.culler, portal)?;
        if side > 1 {
            return Err(Fault::argument(format_args!("side {side} of 2")));
        }
        Ok(portal.directed(side))
    }
}

/// All portals open. Null if the building is.
#[unsafe(no_mangle)]
pub extern "C" fn enf_doors_new(building: Option<&EnfBuilding>) -> Option<Box<EnfDoors>> {
    handle(|| {
        let culler = needed(building, "the building")?.culler.clone();
        Ok(EnfDoors { doors: Doors::open(&culler), culler })
    })
}

/// Portals shut where the model has a shut leaf. Null if the building is.
#[unsafe(no_mangle)]
pub extern "C" fn enf_doors_as_found(building: Option<&EnfBuilding>) -> Option<Box<EnfDoors>> {
    handle(|| {
        let culler = needed(building, "the building")?.culler.clone();
        Ok(EnfDoors { doors: Doors::as_found(&culler), culler })
    })
}

/// Frees doors, or nothing.
#[unsafe(no_mangle)]
pub extern "C" fn enf_doors_free(doors: Option<Box<EnfDoors>>) {
    drop(doors);
}

/// Opens or shuts a portal in both directions.
#[unsafe(no_mangle)]
pub extern "C" fn enf_doors_set_open(doors: Option<&mut EnfDoors>, portal: u32, open: bool) -> EnfStatus {
    status(|| {
        let doors = needed(doors, "the doors")?;
        let portal = portal_of(&doors.culler, portal)?;
        doors.doors.set_open(portal, open);
        Ok(())
    })
}

/// Opens or shuts a portal in one direction, 0 or 1: a mirrored window, a screen.
#[unsafe(no_mangle)]
pub extern "C" fn enf_doors_set_see_through(doors: Option<&mut EnfDoors>, portal: u32, side: u32, open: bool) -> EnfStatus {
    status(|| {
        let doors = needed(doors, "the doors")?;
        let portal = doors.directed(portal, side)?;
        doors.doors.set_see_through(portal, open);
        Ok(())
    })
}

/// Whether a portal is open in a direction, 0 or 1.
#[unsafe(no_mangle)]
pub extern "C" fn enf_doors_is_open(
    doors: Option<&EnfDoors>,
    portal: u32,
    side: u32,
    open: Option<&mut MaybeUninit<bool>>,
) -> EnfStatus {
    status(|| {
        let (doors, open) = (needed(doors, "the doors")?, needed(open, "the answer")?);
        open.write(doors.doors.is_open(doors.directed(portal, side)?));
        Ok(())
    })
}
