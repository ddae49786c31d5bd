//! What to load next, as one walks.

use crate::building::EnfBuilding;
use crate::doors::EnfDoors;
use crate::fault::{EnfStatus, Fault, handle, needed, status};
use crate::lists::list;
use crate::shapes::EnfCamera;
use runtime::ObjectId;
use runtime::runtime::prefetch::{ChunkId, Chunks, Prefetcher, Step};
use runtime::runtime::{Camera, Culler, Motion};
use std::mem::MaybeUninit;
use std::sync::Arc;

/// What is loaded of a building, and what to load next, for one eye.
pub struct EnfLoader {
    culler: Arc<Culler>,
    prefetcher: Prefetcher,
    motion: Motion,
    visible: Vec<ObjectId>,
}

/// What to do, one of `ENF_STEP_...`.
pub type EnfStepKind = u32;
/// Load the object, then call `enf_loader_loaded` or `enf_loader_failed`.
pub const ENF_STEP_LOAD: EnfStepKind = 0;
/// Let the object go: its bytes count as free.
pub const ENF_STEP_EVICT: EnfStepKind = 1;

/// What to do next.
#[repr(C)]
pub struct EnfStep {
    pub kind: EnfStepKind,
    pub object: u32,
    /// To load: the eye has at least so far to go before the object may be seen, metres.
    pub metres: f32,
}

impl EnfLoader {
    fn object(&self, object: u32) -> Result<ObjectId, Fault> {
        let all = self.culler.object_count();
        let there = (object as usize) < all;
        there.then_some(ObjectId(object)).ok_or_else(|| Fault::argument(format_args!("object {object} of {all}")))
    }
}

/// Nothing loaded yet. `bytes`: what each of the `objects` takes when it is loaded; `budget`: bytes for all. Null if that fails.
///
/// # Safety
///
/// `bytes` has `objects` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_loader_new(
    building: Option<&EnfBuilding>,
    bytes: *const u64,
    objects: usize,
    budget: u64,
) -> Option<Box<EnfLoader>> {
    handle(|| {
        let EnfBuilding { file, culler } = needed(building, "the building")?;
        // SAFETY: what this function asks of its caller.
        let bytes = unsafe { list(bytes, objects, "the bytes") }?;
        let all = culler.object_count();
        if objects != all {
            return Err(Fault::argument(format_args!("bytes of {objects} objects, and there are {all}")));
        }
        let prefetcher = Prefetcher::new(file, culler, Chunks::of_one(bytes.to_vec()), budget);
        Ok(EnfLoader { culler: culler.clone(), prefetcher, motion: Motion::default(), visible: Vec::with_capacity(all) })
    })
}

/// Frees a loader, or nothing.
#[unsafe(no_mangle)]
pub extern "C" fn enf_loader_free(loader: Option<Box<EnfLoader>>) {
    drop(loader);
}

/// Takes the states of the doors.
#[unsafe(no_mangle)]
pub extern "C" fn enf_loader_set_doors(loader: Option<&mut EnfLoader>, doors: Option<&EnfDoors>) -> EnfStatus {
    status(|| {
        let (loader, doors) = (needed(loader, "the loader")?, needed(doors, "the doors")?);
        loader.prefetcher.set_doors(doors.of(&loader.culler)?);
        Ok(())
    })
}

/// Begins a frame: its camera, its time in seconds from any start, and its visible objects. `missing`: how many of these are not loaded.
///
/// # Safety
///
/// `visible` has `count` objects.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_loader_frame(
    loader: Option<&mut EnfLoader>,
    camera: Option<&EnfCamera>,
    seconds: f64,
    visible: *const u32,
    count: usize,
    missing: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let loader = needed(loader, "the loader")?;
        let (camera, missing) = (Camera::from(*needed(camera, "the camera")?), needed(missing, "the number")?);
        // SAFETY: what this function asks of its caller.
        let visible = unsafe { list(visible, count, "the objects") }?;
        loader.visible.clear();
        for &object in visible {
            let object = loader.object(object)?;
            loader.visible.push(object);
        }
        loader.motion.see(&camera, seconds);
        missing.write(loader.prefetcher.frame(camera.eye, &loader.motion, &loader.visible));
        Ok(())
    })
}

/// What to do next. ENF_STATUS_NOTHING: nothing in this frame.
#[unsafe(no_mangle)]
pub extern "C" fn enf_loader_next(loader: Option<&mut EnfLoader>, step: Option<&mut MaybeUninit<EnfStep>>) -> EnfStatus {
    status(|| {
        let (loader, step) = (needed(loader, "the loader")?, needed(step, "the step")?);
        let next = loader.prefetcher.next_step().ok_or_else(|| Fault::nothing("nothing to load"))?;
        step.write(match next {
            // A chunk is an object.
            Step::Load { chunk, metres } => EnfStep { kind: ENF_STEP_LOAD, object: chunk.0, metres },
            Step::Evict(chunk) => EnfStep { kind: ENF_STEP_EVICT, object: chunk.0, metres: 0.0 },
        });
        Ok(())
    })
}

/// An object is loaded.
#[unsafe(no_mangle)]
pub extern "C" fn enf_loader_loaded(loader: Option<&mut EnfLoader>, object: u32) -> EnfStatus {
    status(|| {
        let loader = needed(loader, "the loader")?;
        let object = loader.object(object)?;
        loader.prefetcher.loaded(ChunkId(object.0));
        Ok(())
    })
}

/// An object could not be loaded; it is not asked for again.
#[unsafe(no_mangle)]
pub extern "C" fn enf_loader_failed(loader: Option<&mut EnfLoader>, object: u32) -> EnfStatus {
    status(|| {
        let loader = needed(loader, "the loader")?;
        let object = loader.object(object)?;
        loader.prefetcher.failed(ChunkId(object.0));
        Ok(())
    })
}
