//! A building: a `.pvs` file, laid out for views.

use crate::fault::{EnfStatus, Fault, handle, needed, status, text};
use crate::lists::{Buffer, list};
use crate::shapes::{EnfDVec3, EnfVec3};
use runtime::file::{FileError, PvsFile};
use runtime::runtime::Culler;
use runtime::{ObjectId, PortalId};
use std::ffi::c_char;
use std::mem::MaybeUninit;
use std::path::Path;
use std::sync::Arc;

/// A building, shared by all that is made from it.
pub struct EnfBuilding {
    pub(crate) file: PvsFile,
    pub(crate) culler: Arc<Culler>,
}

/// Facts of a building.
#[repr(C)]
pub struct EnfBuildingInfo {
    /// Numbers of objects, cells and portals; their ids are below these.
    pub objects: u32,
    pub cells: u32,
    pub portals: u32,
    /// Metres by which portals, cells and rows may be off.
    pub tolerance: f64,
    /// What all positions are relative to.
    pub origin: EnfDVec3,
}

/// Indices from `first` to before `end` of an index buffer that holds the objects' triangles in the order of their ids.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct EnfRun {
    pub first: u32,
    pub end: u32,
}

impl EnfBuilding {
    fn new(read: Result<PvsFile, FileError>) -> Result<Self, Fault> {
        let file = read.map_err(|error| Fault(EnfStatus::File, error.to_string()))?;
        let culler = Culler::new(&file);
        Ok(Self { file, culler })
    }

    /// An object of this building.
    pub(crate) fn object(&self, object: u32) -> Result<ObjectId, Fault> {
        let all = self.culler.object_count();
        let there = (object as usize) < all;
        there.then_some(ObjectId(object)).ok_or_else(|| Fault::argument(format_args!("object {object} of {all}")))
    }
}

/// A portal of a culler.
pub(crate) fn portal_of(culler: &Culler, portal: u32) -> Result<PortalId, Fault> {
    let all = culler.portal_count();
    let there = (portal as usize) < all;
    there.then_some(PortalId(portal)).ok_or_else(|| Fault::argument(format_args!("portal {portal} of {all}")))
}

/// Reads a `.pvs` file. Null if that fails: `enf_last_error` says why.
///
/// # Safety
///
/// `path` is null or UTF-8 that ends with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_building_open(path: *const c_char) -> Option<Box<EnfBuilding>> {
    handle(|| {
        // SAFETY: what this function asks of its caller.
        let path = unsafe { text(path, "the path") }?;
        EnfBuilding::new(PvsFile::load(Path::new(path)))
    })
}

/// Reads the bytes of a `.pvs` file, which are not needed later. Null if that fails: `enf_last_error` says why.
///
/// # Safety
///
/// `bytes` is null or has `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_building_read(bytes: *const u8, length: usize) -> Option<Box<EnfBuilding>> {
    handle(|| {
        // SAFETY: what this function asks of its caller.
        let bytes = unsafe { list(bytes, length, "the bytes") }?;
        EnfBuilding::new(PvsFile::read(bytes))
    })
}

/// Frees a building, or nothing. What was made from it goes on.
#[unsafe(no_mangle)]
pub extern "C" fn enf_building_free(building: Option<Box<EnfBuilding>>) {
    drop(building);
}

/// Facts of a building.
#[unsafe(no_mangle)]
pub extern "C" fn enf_building_info(
    building: Option<&EnfBuilding>,
    info: Option<&mut MaybeUninit<EnfBuildingInfo>>,
) -> EnfStatus {
    status(|| {
        let EnfBuilding { file, culler } = needed(building, "the building")?;
        needed(info, "the info")?.write(EnfBuildingInfo {
            objects: culler.object_count() as u32,
            cells: culler.cell_count() as u32,
            portals: culler.portal_count() as u32,
            tolerance: culler.tolerance(),
            origin: file.origin.into(),
        });
        Ok(())
    })
}

/// The cell of a point; on a border, the one with the point deepest inside. ENF_STATUS_NOTHING if it is in none.
#[unsafe(no_mangle)]
pub extern "C" fn enf_building_cell_of(
    building: Option<&EnfBuilding>,
    point: EnfVec3,
    cell: Option<&mut MaybeUninit<u32>>,
) -> EnfStatus {
    status(|| {
        let (building, cell) = (needed(building, "the building")?, needed(cell, "the cell")?);
        let found = building.culler.cell_of(point.into()).ok_or_else(|| Fault::nothing("the point is in no cell"))?;
        cell.write(found.0);
        Ok(())
    })
}

/// The indices of an object.
#[unsafe(no_mangle)]
pub extern "C" fn enf_building_indices(
    building: Option<&EnfBuilding>,
    object: u32,
    run: Option<&mut MaybeUninit<EnfRun>>,
) -> EnfStatus {
    status(|| {
        let (building, run) = (needed(building, "the building")?, needed(run, "the run")?);
        let range = building.culler.indices(building.object(object)?);
        run.write(EnfRun { first: range.start, end: range.end });
        Ok(())
    })
}

/// The node of the model that an object is a part of, with a zero, which counts.
///
/// # Safety
///
/// `buffer` has room for `capacity` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_building_object_name(
    building: Option<&EnfBuilding>,
    object: u32,
    buffer: *mut c_char,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let building = needed(building, "the building")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill_text(&building.file.objects[building.object(object)?.index()].node)
    })
}

/// The portal with a key: the same in any bake of the model. ENF_STATUS_NOTHING if there is none.
///
/// # Safety
///
/// `key` is null or UTF-8 that ends with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_building_portal(
    building: Option<&EnfBuilding>,
    key: *const c_char,
    portal: Option<&mut MaybeUninit<u32>>,
) -> EnfStatus {
    status(|| {
        let (building, portal) = (needed(building, "the building")?, needed(portal, "the portal")?);
        // SAFETY: what this function asks of its caller.
        let key = unsafe { text(key, "the key") }?;
        let found = building.culler.portal(key).ok_or_else(|| Fault::nothing(format_args!("no portal \"{key}\"")))?;
        portal.write(found.0);
        Ok(())
    })
}

/// The key of a portal, with a zero, which counts.
///
/// # Safety
///
/// `buffer` has room for `capacity` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_building_portal_key(
    building: Option<&EnfBuilding>,
    portal: u32,
    buffer: *mut c_char,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let building = needed(building, "the building")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill_text(building.culler.portal_key(portal_of(&building.culler, portal)?))
    })
}
