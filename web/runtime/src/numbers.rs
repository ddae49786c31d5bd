//! Numbers in memory that both sides know.

use glam::{DVec3, Vec3};
use std::cell::{Cell, RefCell};
use std::fmt::Display;
use wasm_bindgen::prelude::*;

/// Room for a matrix, a point and a time.
const ROOM: usize = 32;

thread_local! {
    static NUMBERS: [Cell<f64>; ROOM] = const { [const { Cell::new(0.0) }; ROOM] };
    static LIST: [Cell<usize>; 2] = const { [const { Cell::new(0) }; 2] };
    static FAULT: RefCell<String> = const { RefCell::new(String::new()) };
}

/// What the last call that failed says.
#[wasm_bindgen]
pub fn fault() -> String {
    FAULT.take()
}

/// Whether a call has worked; what it says if not is kept. A `Result` would allocate in each call of the caller's.
pub fn worked<E: Display>(result: Result<(), E>) -> bool {
    result.map_err(|error| FAULT.replace(error.to_string())).is_ok()
}

/// Where the numbers are.
#[wasm_bindgen]
pub fn numbers() -> usize {
    NUMBERS.with(|numbers| numbers.as_ptr() as usize)
}

/// Where the last list is told: its place, and its length.
#[wasm_bindgen]
pub fn list() -> usize {
    LIST.with(|list| list.as_ptr() as usize)
}

/// A number that the caller has written.
pub fn number(at: usize) -> f64 {
    NUMBERS.with(|numbers| numbers[at].get())
}

/// A point that the caller has written, relative to an origin.
pub fn point(at: usize, origin: DVec3) -> Vec3 {
    (DVec3::new(number(at), number(at + 1), number(at + 2)) - origin).as_vec3()
}

/// Gives numbers to the caller, from the first on.
pub fn give<const N: usize>(given: [f64; N]) {
    NUMBERS.with(|numbers| numbers.iter().zip(given).for_each(|(number, given)| number.set(given)));
}

/// Gives a list to the caller.
pub fn give_list<T>(items: &[T]) {
    LIST.with(|[place, length]| {
        place.set(items.as_ptr() as usize);
        length.set(items.len());
    });
}
