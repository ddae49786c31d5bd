//! Lines of cells and portals, to look at.

use crate::building::{EnfBuilding, portal_of};
use crate::fault::{EnfStatus, Fault, needed, status};
use crate::lists::Buffer;
use crate::shapes::EnfLine;
use runtime::CellId;
use std::mem::MaybeUninit;

/// The edges of a portal.
///
/// # Safety
///
/// `buffer` has room for `capacity` lines.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_building_portal_lines(
    building: Option<&EnfBuilding>,
    portal: u32,
    buffer: *mut EnfLine,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let building = needed(building, "the building")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        let portal = portal_of(&building.culler, portal)?;
        let corners = &building.file.portals[portal.index()].winding;
        let last = corners.len().wrapping_sub(1);
        let next = |i: usize| corners[if i == last { 0 } else { i + 1 }];
        buffer.fill((0..corners.len()).map(|i| EnfLine { from: corners[i].into(), to: next(i).into() }))
    })
}

/// The edges of a cell's convex pieces, as far as the building reaches.
///
/// # Safety
///
/// `buffer` has room for `capacity` lines.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_building_cell_lines(
    building: Option<&EnfBuilding>,
    cell: u32,
    buffer: *mut EnfLine,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let building = needed(building, "the building")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        let all = building.culler.cell_count();
        if cell as usize >= all {
            return Err(Fault::argument(format_args!("cell {cell} of {all}")));
        }
        let lines = building.file.cell_lines(CellId(cell));
        buffer.fill(lines.into_iter().map(|[from, to]| EnfLine { from: from.into(), to: to.into() }))
    })
}
