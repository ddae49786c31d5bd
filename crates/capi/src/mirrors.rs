//! Mirrors, and what is to be drawn in them.

use crate::fault::{EnfStatus, Fault, handle, needed, status};
use crate::lists::list;
use crate::movers::{EnfMover, EnfMovers};
use crate::shapes::{EnfCamera, EnfRect, EnfVec3};
use crate::view::EnfView;
use runtime::CellId;
use runtime::glam::Vec3;
use runtime::runtime::{Mirror, Rect};
use std::mem::MaybeUninit;

/// Mirrors, numbered in the order in which they were added.
pub struct EnfMirrors {
    pub(crate) mirrors: Vec<Mirror>,
}

/// No mirror: what the eye sees directly.
pub const ENF_NONE: u32 = u32::MAX;

/// What a mirror shows.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct EnfReflection {
    /// The mirror's number.
    pub mirror: u32,
    /// The reflection in which it is seen; ENF_NONE: directly.
    pub parent: u32,
    /// Number of mirrors on the way.
    pub depth: u32,
    /// The reflected camera. Draw what is in front of the mirror's plane, with reversed winding.
    pub camera: EnfCamera,
    /// The part of the screen.
    pub rect: EnfRect,
    /// Its objects: from `first_object` on, `objects` of them. Its movers likewise.
    pub first_object: u32,
    pub objects: u32,
    pub first_mover: u32,
    pub movers: u32,
}

/// The caller's buffers for reflections, with room for so many each, and then what there is.
#[repr(C)]
pub struct EnfReflections {
    pub reflections: *mut EnfReflection,
    pub reflection_capacity: usize,
    pub reflection_count: usize,
    /// Objects of all reflections.
    pub objects: *mut u32,
    pub object_capacity: usize,
    pub object_count: usize,
    /// Movers of all reflections.
    pub movers: *mut EnfMover,
    pub mover_capacity: usize,
    pub mover_count: usize,
}

impl From<Rect> for EnfRect {
    fn from(Rect { min, max }: Rect) -> Self {
        Self { min_x: min.x, min_y: min.y, max_x: max.x, max_y: max.y }
    }
}

/// No mirrors yet.
#[unsafe(no_mangle)]
pub extern "C" fn enf_mirrors_new() -> Option<Box<EnfMirrors>> {
    handle(|| Ok(EnfMirrors { mirrors: Vec::new() }))
}

/// Frees mirrors, or nothing.
#[unsafe(no_mangle)]
pub extern "C" fn enf_mirrors_free(mirrors: Option<Box<EnfMirrors>>) {
    drop(mirrors);
}

/// Adds a mirror in a cell: a convex polygon of `count` corners, counter-clockwise seen from the room.
///
/// # Safety
///
/// `corners` has `count` points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_mirrors_add(
    mirrors: Option<&mut EnfMirrors>,
    cell: u32,
    corners: *const EnfVec3,
    count: usize,
) -> EnfStatus {
    status(|| {
        let mirrors = needed(mirrors, "the mirrors")?;
        // SAFETY: what this function asks of its caller.
        let corners = unsafe { list(corners, count, "the corners") }?;
        let corners: Vec<Vec3> = corners.iter().map(|&p| p.into()).collect();
        let mirror = Mirror::new(CellId(cell), &corners);
        mirrors.mirrors.push(mirror.ok_or_else(|| Fault::argument("the mirror has no area, or a corner is not finite"))?);
        Ok(())
    })
}

/// A list that is filled part by part.
struct Parts<'a, T> {
    buffer: &'a mut [MaybeUninit<T>],
    count: usize,
}

impl<'a, T> Parts<'a, T> {
    /// # Safety
    ///
    /// `items` is null or has room for `capacity` items, which nobody else uses.
    unsafe fn new(items: *mut T, capacity: usize) -> Self {
        let most = isize::MAX as usize / size_of::<T>();
        let is_there = !items.is_null() && items.is_aligned() && capacity > 0 && capacity <= most;
        // SAFETY: not null, aligned, not longer than memory, and perhaps without values; the rest is what this function asks of its caller.
        let buffer = if is_there { unsafe { std::slice::from_raw_parts_mut(items.cast(), capacity) } } else { &mut [] };
        Self { buffer, count: 0 }
    }

    /// Adds items as far as there is room; where they begin, and their number.
    fn add(&mut self, items: impl ExactSizeIterator<Item = T>) -> [u32; 2] {
        let (first, number) = (self.count, items.len());
        let room = self.buffer.get_mut(first..).unwrap_or_default();
        room.iter_mut().zip(items).for_each(|(slot, item)| _ = slot.write(item));
        self.count += number;
        [first as u32, number as u32]
    }

    fn is_too_small(&self) -> bool {
        self.count > self.buffer.len()
    }
}

/// The mirrors that the view's last frame shows, and what to draw in them, up to `depth` reflections: those that the eye sees directly come
/// first. `movers` may be null. With ENF_STATUS_TOO_SMALL, the counts say what is needed.
///
/// # Safety
///
/// The buffers of `into` have the room that it says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_view_mirrors(
    view: Option<&mut EnfView>,
    mirrors: Option<&EnfMirrors>,
    depth: u32,
    movers: Option<&EnfMovers>,
    into: Option<&mut EnfReflections>,
) -> EnfStatus {
    status(|| {
        let (view, mirrors) = (needed(view, "the view")?, &needed(mirrors, "the mirrors")?.mirrors);
        let into = needed(into, "the list")?;
        let movers = movers.map(|movers| movers.of(&view.culler)).transpose()?;
        let cells = view.culler.cell_count();
        if let Some(mirror) = mirrors.iter().find(|mirror| mirror.cell().index() >= cells) {
            return Err(Fault::argument(format_args!("a mirror is in cell {} of {cells}", mirror.cell().0)));
        }
        // SAFETY: what this function asks of its caller.
        let mut all = unsafe { Parts::new(into.reflections, into.reflection_capacity) };
        // SAFETY: likewise.
        let mut objects = unsafe { Parts::new(into.objects, into.object_capacity) };
        // SAFETY: likewise.
        let mut moving = unsafe { Parts::new(into.movers, into.mover_capacity) };
        for seen in view.view.mirrors(mirrors, depth, movers) {
            let [first_object, of_objects] = objects.add(seen.objects.iter().map(|object| object.0));
            let [first_mover, of_movers] = moving.add(seen.movers.iter().map(|&mover| mover.into()));
            all.add(std::iter::once(EnfReflection {
                mirror: seen.mirror as u32,
                parent: seen.parent.map_or(ENF_NONE, |parent| parent as u32),
                depth: seen.depth,
                camera: seen.camera.into(),
                rect: seen.rect.into(),
                first_object,
                objects: of_objects,
                first_mover,
                movers: of_movers,
            }));
        }
        (into.reflection_count, into.object_count, into.mover_count) = (all.count, objects.count, moving.count);
        if all.is_too_small() || objects.is_too_small() || moving.is_too_small() {
            let text = format!("{} reflections, {} objects, {} movers", all.count, objects.count, moving.count);
            return Err(Fault(EnfStatus::TooSmall, text));
        }
        Ok(())
    })
}
