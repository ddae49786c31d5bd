//! Lists of the caller's: read as slices, and filled.

use crate::fault::{EnfStatus, Fault, needed};
use std::ffi::c_char;
use std::mem::MaybeUninit;

/// A list that the caller gives; it may be null where it is empty.
///
/// # Safety
///
/// `items` is null or has `count` items that stay as they are.
pub(crate) unsafe fn list<'a, T>(items: *const T, count: usize, what: &str) -> Result<&'a [T], Fault> {
    if count == 0 {
        return Ok(&[]);
    }
    if items.is_null() || !items.is_aligned() || count > isize::MAX as usize / size_of::<T>().max(1) {
        return Err(Fault::null(what));
    }
    // SAFETY: not null, aligned, and not longer than memory; the rest is what this function asks of its caller.
    Ok(unsafe { std::slice::from_raw_parts(items, count) })
}

/// A list of the caller's to be filled, and the number of items that there are.
pub(crate) struct Buffer<'a, T> {
    items: &'a mut [MaybeUninit<T>],
    count: &'a mut MaybeUninit<usize>,
}

impl<'a, T: Copy> Buffer<'a, T> {
    /// # Safety
    ///
    /// `items` is null or has room for `capacity` items, which nobody else uses.
    pub unsafe fn new(items: *mut T, capacity: usize, count: Option<&'a mut MaybeUninit<usize>>) -> Result<Self, Fault> {
        let count = needed(count, "the count")?;
        count.write(0);
        if capacity == 0 {
            return Ok(Self { items: &mut [], count });
        }
        if items.is_null() || !items.is_aligned() || capacity > isize::MAX as usize / size_of::<T>().max(1) {
            return Err(Fault::null("the buffer"));
        }
        // SAFETY: not null, aligned, not longer than memory, and perhaps without values; the rest is what this function asks of its caller.
        Ok(Self { items: unsafe { std::slice::from_raw_parts_mut(items.cast(), capacity) }, count })
    }

    /// Writes as many as there is room for.
    pub fn fill(self, from: impl ExactSizeIterator<Item = T>) -> Result<(), Fault> {
        let (room, there) = (self.items.len(), from.len());
        self.count.write(there);
        self.items.iter_mut().zip(from).for_each(|(item, value)| _ = item.write(value));
        if there > room {
            return Err(Fault(EnfStatus::TooSmall, format!("room for {room} items, and there are {there}")));
        }
        Ok(())
    }
}

impl Buffer<'_, c_char> {
    /// Writes a text and a zero, which counts.
    pub fn fill_text(self, text: &str) -> Result<(), Fault> {
        let bytes: Vec<c_char> = text.bytes().chain([0]).map(|byte| byte as c_char).collect();
        self.fill(bytes.into_iter())
    }
}
