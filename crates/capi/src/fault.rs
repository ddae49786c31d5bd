//! What is wrong with a call: a status for the program, a text for its log.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What became of a call.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum EnfStatus {
    /// All went well.
    Ok = 0,
    /// A handle or a pointer that is needed is null.
    Null = 1,
    /// An argument is out of its range.
    Argument = 2,
    /// The file can't be read, or is damaged.
    File = 3,
    /// A buffer is too small: it is full, and the count is what there is.
    TooSmall = 4,
    /// Two handles are of different buildings.
    OtherBuilding = 5,
    /// There is nothing: no frame yet, no such key, no cell at a point, nothing to load.
    Nothing = 6,
    /// A fault of the library. Free what the call was given.
    Panic = 7,
}

/// A status with its text.
pub(crate) struct Fault(pub EnfStatus, pub String);

impl Fault {
    pub fn null(what: &str) -> Self {
        Self(EnfStatus::Null, format!("{what} is null"))
    }

    pub fn argument(text: impl Display) -> Self {
        Self(EnfStatus::Argument, text.to_string())
    }

    pub fn nothing(text: impl Display) -> Self {
        Self(EnfStatus::Nothing, text.to_string())
    }

    pub fn other_building(what: &str) -> Self {
        Self(EnfStatus::OtherBuilding, format!("{what} of another building"))
    }
}

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

fn keep(Fault(status, text): Fault) -> EnfStatus {
    let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    LAST.set(text);
    status
}

/// Makes a call; no panic leaves it.
pub(crate) fn status(call: impl FnOnce() -> Result<(), Fault>) -> EnfStatus {
    made(call).map_or_else(|status| status, |()| EnfStatus::Ok)
}

/// Makes a handle, or none.
pub(crate) fn handle<T>(make: impl FnOnce() -> Result<T, Fault>) -> Option<Box<T>> {
    made(make).ok().map(Box::new)
}

fn made<T>(call: impl FnOnce() -> Result<T, Fault>) -> Result<T, EnfStatus> {
    // What a panic leaves half done is freed by the caller, as the status says.
    let result = catch_unwind(AssertUnwindSafe(call));
    let panicked = |_| Err(Fault(EnfStatus::Panic, "a fault of the library; it printed more".to_owned()));
    result.unwrap_or_else(panicked).map_err(keep)
}

/// The argument that is needed.
pub(crate) fn needed<T>(argument: Option<T>, what: &str) -> Result<T, Fault> {
    argument.ok_or_else(|| Fault::null(what))
}

/// The version of the library: major, minor and patch, a byte each from the third on.
#[unsafe(no_mangle)]
pub extern "C" fn enf_version() -> u32 {
    let part = |text: &str| text.parse::<u32>().unwrap_or(0);
    let [major, minor, patch] =
        [env!("CARGO_PKG_VERSION_MAJOR"), env!("CARGO_PKG_VERSION_MINOR"), env!("CARGO_PKG_VERSION_PATCH")].map(part);
    major << 16 | minor << 8 | patch
}

/// What was wrong with the last call of this thread that failed, in a line; empty before. Valid until another one fails.
#[unsafe(no_mangle)]
pub extern "C" fn enf_last_error() -> *const c_char {
    LAST.with_borrow(|text| text.as_ptr())
}

/// A text of the caller.
///
/// # Safety
///
/// `text` is null or ends with a zero, and stays as it is.
pub(crate) unsafe fn text<'a>(text: *const c_char, what: &str) -> Result<&'a str, Fault> {
    if text.is_null() {
        return Err(Fault::null(what));
    }
    // SAFETY: not null; the rest is what this function asks of its caller.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map_err(|_| Fault::argument(format_args!("{what} is not UTF-8")))
}
