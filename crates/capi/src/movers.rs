//! What moves.

use crate::building::EnfBuilding;
use crate::fault::{EnfStatus, Fault, handle, needed, status};
use crate::lists::Buffer;
use crate::shapes::EnfBox;
use runtime::runtime::{Culler, MoverError, MoverId, Movers};
use std::mem::MaybeUninit;
use std::sync::Arc;

/// The movers of a world, for any number of views of its building.
pub struct EnfMovers {
    culler: Arc<Culler>,
    movers: Movers,
}

/// A mover. Slots are small numbers and used again, with another life.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct EnfMover {
    pub slot: u32,
    pub life: u32,
}

impl From<MoverId> for EnfMover {
    fn from(MoverId { slot, life }: MoverId) -> Self {
        Self { slot, life }
    }
}

impl From<EnfMover> for MoverId {
    fn from(EnfMover { slot, life }: EnfMover) -> Self {
        Self { slot, life }
    }
}

impl From<MoverError> for Fault {
    fn from(error: MoverError) -> Self {
        Self::argument(error)
    }
}

impl EnfMovers {
    /// Its movers, for what is of `culler`.
    pub(crate) fn of(&self, culler: &Arc<Culler>) -> Result<&Movers, Fault> {
        let same = Arc::ptr_eq(&self.culler, culler);
        same.then_some(&self.movers).ok_or_else(|| Fault::other_building("movers"))
    }
}

/// No movers yet. Null if the building is.
#[unsafe(no_mangle)]
pub extern "C" fn enf_movers_new(building: Option<&EnfBuilding>) -> Option<Box<EnfMovers>> {
    handle(|| {
        let culler = needed(building, "the building")?.culler.clone();
        Ok(EnfMovers { movers: Movers::new(&culler), culler })
    })
}

/// Frees movers, or nothing.
#[unsafe(no_mangle)]
pub extern "C" fn enf_movers_free(movers: Option<Box<EnfMovers>>) {
    drop(movers);
}

/// Adds a mover with a box. Allocates where there were never as many.
#[unsafe(no_mangle)]
pub extern "C" fn enf_movers_insert(
    movers: Option<&mut EnfMovers>,
    bounds: EnfBox,
    mover: Option<&mut MaybeUninit<EnfMover>>,
) -> EnfStatus {
    status(|| {
        let (movers, mover) = (needed(movers, "the movers")?, needed(mover, "the mover")?);
        mover.write(movers.movers.insert([bounds.min.into(), bounds.max.into()])?.into());
        Ok(())
    })
}

/// Moves a mover.
#[unsafe(no_mangle)]
pub extern "C" fn enf_movers_set(movers: Option<&mut EnfMovers>, mover: EnfMover, bounds: EnfBox) -> EnfStatus {
    status(|| Ok(needed(movers, "the movers")?.movers.set(mover.into(), [bounds.min.into(), bounds.max.into()])?))
}

/// Removes a mover.
#[unsafe(no_mangle)]
pub extern "C" fn enf_movers_remove(movers: Option<&mut EnfMovers>, mover: EnfMover) -> EnfStatus {
    status(|| Ok(needed(movers, "the movers")?.movers.remove(mover.into())?))
}

/// The cells that a mover's box meets; none if it is in no cell, or in too many to say.
///
/// # Safety
///
/// `buffer` has room for `capacity` cells.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_movers_cells(
    movers: Option<&EnfMovers>,
    mover: EnfMover,
    buffer: *mut u32,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let movers = needed(movers, "the movers")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill(movers.movers.cells(mover.into())?.iter().map(|cell| cell.0))
    })
}
