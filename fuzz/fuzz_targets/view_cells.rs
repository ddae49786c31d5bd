//! libFuzzer on `tests/targets`: view_cells.
#![no_main]

#[path = "../../tests/targets/mod.rs"]
mod targets;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::run("view_cells", bytes));
