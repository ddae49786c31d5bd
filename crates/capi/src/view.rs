//! Views: what a camera sees.

use crate::building::{EnfBuilding, EnfRun};
use crate::doors::EnfDoors;
use crate::fault::{EnfStatus, Fault, handle, needed, status};
use crate::lists::{Buffer, list};
use crate::movers::{EnfMover, EnfMovers};
use crate::shapes::{EnfCamera, EnfPlane, EnfRect, EnfVec3};
use runtime::CellId;
use runtime::glam::Vec4;
use runtime::runtime::{Culler, MOST_PLANES, MinPixels, Mode, View, VisibleSet};
use std::mem::MaybeUninit;
use std::sync::Arc;

/// One camera's culling. Views of one building are independent of each other.
pub struct EnfView {
    pub(crate) culler: Arc<Culler>,
    pub(crate) view: View,
    planes: Vec<Vec4>,
    from: Vec<CellId>,
}

/// What is culled by, one of `ENF_MODE_...`.
pub type EnfMode = u32;
/// Everything.
pub const ENF_MODE_NONE: EnfMode = 0;
/// Objects in the frustum.
pub const ENF_MODE_FRUSTUM: EnfMode = 1;
/// Through portals.
pub const ENF_MODE_PORTALS: EnfMode = 2;
/// The row of the eye's cell.
pub const ENF_MODE_PVS: EnfMode = 3;
/// Through portals, into cells of the row, objects of the row: the best of these.
pub const ENF_MODE_BOTH: EnfMode = 4;

/// Counters of a frame.
#[repr(C)]
pub struct EnfFrame {
    pub cells: u64,
    pub portals: u64,
    pub objects: u64,
    pub triangles: u64,
    /// Small objects that were left out.
    pub small: u64,
}

/// A portal that a frame sees through.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct EnfCrossed {
    pub portal: u32,
    /// The direction, 0 or 1.
    pub side: u32,
    /// Covers every pixel that shows something beyond.
    pub rect: EnfRect,
}

impl EnfView {
    fn last(&mut self) -> Result<VisibleSet<'_>, Fault> {
        self.view.visible().ok_or_else(|| Fault::nothing("no frame yet"))
    }

    /// Takes a volume and the cells that it is seen from.
    ///
    /// # Safety
    ///
    /// The lists have as many items as the counts say.
    unsafe fn volume(
        &mut self,
        [planes, cells]: [usize; 2],
        volume: *const EnfPlane,
        from: *const u32,
    ) -> Result<(), Fault> {
        // SAFETY: what this function asks of its caller.
        let volume = unsafe { list(volume, planes, "the planes") }?;
        // SAFETY: likewise.
        let from = unsafe { list(from, cells, "the cells") }?;
        if planes > MOST_PLANES {
            return Err(Fault::argument(format_args!("{planes} planes; at most {MOST_PLANES}")));
        }
        self.planes.clear();
        self.planes.extend(volume.iter().map(|plane| Vec4::new(plane.x, plane.y, plane.z, plane.d)));
        self.from.clear();
        for &cell in from {
            let cell = cell_of(&self.culler, cell)?;
            self.from.push(cell);
        }
        Ok(())
    }
}

fn cell_of(culler: &Culler, cell: u32) -> Result<CellId, Fault> {
    let all = culler.cell_count();
    let there = (cell as usize) < all;
    there.then_some(CellId(cell)).ok_or_else(|| Fault::argument(format_args!("cell {cell} of {all}")))
}

pub(crate) fn mode_of(mode: EnfMode) -> Result<Mode, Fault> {
    let known = Mode::WITHOUT_QUERIES.get(mode as usize).copied();
    known.ok_or_else(|| Fault::argument(format_args!("no mode has number {mode}")))
}

/// A view with all doors open. Null if the building is.
#[unsafe(no_mangle)]
pub extern "C" fn enf_view_new(building: Option<&EnfBuilding>) -> Option<Box<EnfView>> {
    handle(|| {
        let culler = needed(building, "the building")?.culler.clone();
        let (planes, from) = (Vec::with_capacity(MOST_PLANES), Vec::with_capacity(culler.cell_count()));
        Ok(EnfView { view: View::new(&culler), culler, planes, from })
    })
}

/// Frees a view, or nothing.
#[unsafe(no_mangle)]
pub extern "C" fn enf_view_free(view: Option<Box<EnfView>>) {
    drop(view);
}

/// Takes the states of the doors, for later frames.
#[unsafe(no_mangle)]
pub extern "C" fn enf_view_set_doors(view: Option<&mut EnfView>, doors: Option<&EnfDoors>) -> EnfStatus {
    status(|| {
        let (view, doors) = (needed(view, "the view")?, needed(doors, "the doors")?);
        view.view.set_doors(doors.of(&view.culler)?);
        Ok(())
    })
}

/// Leaves out what covers fewer than `pixels` in pictures of `width` by `height`; 0: nothing.
#[unsafe(no_mangle)]
pub extern "C" fn enf_view_set_min_pixels(view: Option<&mut EnfView>, pixels: u32, width: u32, height: u32) -> EnfStatus {
    status(|| {
        needed(view, "the view")?.view.set_min_pixels(MinPixels { pixels, picture: [width, height] });
        Ok(())
    })
}

/// Culls a frame. `frame` takes its counters, and may be null. Ask for the lists afterwards.
#[unsafe(no_mangle)]
pub extern "C" fn enf_view_cull(
    view: Option<&mut EnfView>,
    camera: Option<&EnfCamera>,
    mode: EnfMode,
    frame: Option<&mut MaybeUninit<EnfFrame>>,
) -> EnfStatus {
    status(|| {
        let (view, camera) = (needed(view, "the view")?, needed(camera, "the camera")?);
        let stats = view.view.cull(&(*camera).into(), mode_of(mode)?).stats;
        if let Some(frame) = frame {
            let (cells, portals, objects) = (stats.cells, stats.portals, stats.objects);
            frame.write(EnfFrame { cells, portals, objects, triangles: stats.triangles, small: stats.small });
        }
        Ok(())
    })
}

/// The objects of the last frame, each once.
///
/// # Safety
///
/// `buffer` has room for `capacity` objects.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_objects(
    view: Option<&mut EnfView>,
    buffer: *mut u32,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill(view.last()?.objects.iter().map(|object| object.0))
    })
}

/// The objects of the last frame as ranges of an index buffer, ascending, neighbours joined: one draw each.
///
/// # Safety
///
/// `buffer` has room for `capacity` runs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_runs(
    view: Option<&mut EnfView>,
    buffer: *mut EnfRun,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill(view.last()?.runs().iter().map(|run| EnfRun { first: run.start, end: run.end }))
    })
}

/// The cells that the last frame reached, the eye's first.
///
/// # Safety
///
/// `buffer` has room for `capacity` cells.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_cells(
    view: Option<&mut EnfView>,
    buffer: *mut u32,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill(view.last()?.cells.iter().map(|cell| cell.0))
    })
}

/// The cells that the eye of the last frame was in: several on a border, none outside of all.
///
/// # Safety
///
/// `buffer` has room for `capacity` cells.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_homes(
    view: Option<&mut EnfView>,
    buffer: *mut u32,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill(view.last()?.homes.iter().map(|cell| cell.0))
    })
}

/// The portals that the last frame saw through, nearest first.
///
/// # Safety
///
/// `buffer` has room for `capacity` portals.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_portals(
    view: Option<&mut EnfView>,
    buffer: *mut EnfCrossed,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill(view.last()?.portals.iter().map(|crossed| EnfCrossed {
            portal: crossed.portal.portal().0,
            side: crossed.portal.side() as u32,
            rect: crossed.rect.into(),
        }))
    })
}

/// The shut doors that counted as open in the last frame, since the eye is in their doorway.
///
/// # Safety
///
/// `buffer` has room for `capacity` portals.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_near_doors(
    view: Option<&mut EnfView>,
    buffer: *mut u32,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill(view.last()?.near_doors().iter().map(|portal| portal.0))
    })
}

/// The movers that the last frame may show, each once.
///
/// # Safety
///
/// `buffer` has room for `capacity` movers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_movers(
    view: Option<&mut EnfView>,
    movers: Option<&EnfMovers>,
    buffer: *mut EnfMover,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let (view, movers) = (needed(view, "the view")?, needed(movers, "the movers")?);
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill(view.view.movers(movers.of(&view.culler)?).iter().map(|&mover| mover.into()))
    })
}

/// The objects that may be seen from a point in any direction: for engines with a frustum test of their own. `is_new` may be null; false: the
/// same as last time.
///
/// # Safety
///
/// `buffer` has room for `capacity` objects.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_around(
    view: Option<&mut EnfView>,
    eye: EnfVec3,
    is_new: Option<&mut MaybeUninit<bool>>,
    buffer: *mut u32,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        let around = view.view.around(eye.into());
        if let Some(is_new) = is_new {
            is_new.write(around.is_new);
        }
        buffer.fill(around.objects.iter().map(|object| object.0))
    })
}

/// The objects in a convex volume, with cells in `from` only those of these cells' rows: for shadows. Ascending.
///
/// # Safety
///
/// The lists have as many items as the counts say, and `buffer` has room for `capacity` objects.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_in_volume(
    view: Option<&mut EnfView>,
    planes: *const EnfPlane,
    plane_count: usize,
    from: *const u32,
    from_count: usize,
    buffer: *mut u32,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        // SAFETY: likewise.
        unsafe { view.volume([plane_count, from_count], planes, from) }?;
        buffer.fill(view.view.in_volume(&view.planes, &view.from).iter().map(|object| object.0))
    })
}

/// The movers in a convex volume, likewise.
///
/// # Safety
///
/// The lists have as many items as the counts say, and `buffer` has room for `capacity` movers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_movers_in_volume(
    view: Option<&mut EnfView>,
    movers: Option<&EnfMovers>,
    planes: *const EnfPlane,
    plane_count: usize,
    from: *const u32,
    from_count: usize,
    buffer: *mut EnfMover,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let (view, movers) = (needed(view, "the view")?, needed(movers, "the movers")?);
        let movers = movers.of(&view.culler)?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        // SAFETY: likewise.
        unsafe { view.volume([plane_count, from_count], planes, from) }?;
        buffer.fill(view.view.movers_in_volume(movers, &view.planes, &view.from).iter().map(|&mover| mover.into()))
    })
}
