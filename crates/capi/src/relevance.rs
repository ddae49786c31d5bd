//! Who may see whom.

use crate::building::EnfBuilding;
use crate::doors::EnfDoors;
use crate::fault::{EnfStatus, Fault, handle, needed, status};
use crate::lists::{Buffer, list};
use crate::shapes::EnfBox;
use crate::view::EnfView;
use runtime::CellId;
use runtime::runtime::{Doors, Relevance};
use std::mem::MaybeUninit;

/// Rows of what may be seen from where a body may soon be.
pub struct EnfRelevance {
    rows: Relevance,
}

/// Whether one of some cells may see one of others, by a row that a pair of them asks. No cells: anywhere.
///
/// # Safety
///
/// The lists have as many items as the counts say.
unsafe fn asked(
    [from, to]: [*const u32; 2],
    [from_count, to_count]: [usize; 2],
    cells: usize,
    sees: impl Fn(CellId, CellId) -> bool,
) -> Result<bool, Fault> {
    // SAFETY: what this function asks of its caller.
    let from = unsafe { list(from, from_count, "the cells") }?;
    // SAFETY: likewise.
    let to = unsafe { list(to, to_count, "the cells") }?;
    if let Some(cell) = from.iter().chain(to).find(|&&cell| cell as usize >= cells) {
        return Err(Fault::argument(format_args!("cell {cell} of {cells}")));
    }
    let any = from.iter().any(|&from| to.iter().any(|&to| sees(CellId(from), CellId(to))));
    Ok(from.is_empty() || to.is_empty() || any)
}

/// The rows of bodies that go so many metres at most through what is open in `passable`; null: all but windows. Null if that fails.
#[unsafe(no_mangle)]
pub extern "C" fn enf_relevance_new(
    building: Option<&EnfBuilding>,
    metres: f64,
    passable: Option<&EnfDoors>,
) -> Option<Box<EnfRelevance>> {
    handle(|| {
        let culler = &needed(building, "the building")?.culler;
        if metres.is_nan() || metres < 0.0 {
            return Err(Fault::argument(format_args!("no body goes {metres} metres")));
        }
        let every = Doors::passable(culler);
        let passable = passable.map_or(Ok(&every), |doors| doors.of(culler))?;
        Ok(EnfRelevance { rows: Relevance::new(culler, metres, passable) })
    })
}

/// The rows that are in the building's file. Null if there are none.
#[unsafe(no_mangle)]
pub extern "C" fn enf_relevance_of_file(building: Option<&EnfBuilding>) -> Option<Box<EnfRelevance>> {
    handle(|| {
        let rows = Relevance::of_file(&needed(building, "the building")?.file);
        Ok(EnfRelevance { rows: rows.ok_or_else(|| Fault::nothing("the file has no rows for bodies that go on"))? })
    })
}

/// Frees rows, or nothing.
#[unsafe(no_mangle)]
pub extern "C" fn enf_relevance_free(relevance: Option<Box<EnfRelevance>>) {
    drop(relevance);
}

/// Whether a body in some cells, or as far from them as bodies go, may see something in others (`enf_movers_cells`). No cells: anywhere, so it
/// may.
///
/// # Safety
///
/// The lists have as many items as the counts say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_relevance_may_see(
    relevance: Option<&EnfRelevance>,
    from: *const u32,
    from_count: usize,
    to: *const u32,
    to_count: usize,
    may: Option<&mut MaybeUninit<bool>>,
) -> EnfStatus {
    status(|| {
        let (rows, may) = (needed(relevance, "the relevance")?.rows.cells(), needed(may, "the answer")?);
        // SAFETY: what this function asks of its caller.
        may.write(unsafe { asked([from, to], [from_count, to_count], rows.rows(), |a, b| rows.get(a.index(), b.index())) }?);
        Ok(())
    })
}

/// Whether something in some cells may be seen from others now. With the cells of `enf_view_within_metres`, for servers.
///
/// # Safety
///
/// The lists have as many items as the counts say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_building_may_see(
    building: Option<&EnfBuilding>,
    from: *const u32,
    from_count: usize,
    to: *const u32,
    to_count: usize,
    may: Option<&mut MaybeUninit<bool>>,
) -> EnfStatus {
    status(|| {
        let (culler, may) = (&needed(building, "the building")?.culler, needed(may, "the answer")?);
        let cells = culler.cell_count();
        // SAFETY: what this function asks of its caller.
        may.write(unsafe { asked([from, to], [from_count, to_count], cells, |a, b| culler.may_see(&[a], &[b])) }?);
        Ok(())
    })
}

/// The cells that a body may get into from its box within so many metres, through open portals; those that the box meets come first.
///
/// # Safety
///
/// `buffer` has room for `capacity` cells.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_within_metres(
    view: Option<&mut EnfView>,
    bounds: EnfBox,
    metres: f64,
    buffer: *mut u32,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        let cells = view.view.within_metres([bounds.min.into(), bounds.max.into()], metres);
        buffer.fill(cells.iter().map(|cell| cell.0))
    })
}
