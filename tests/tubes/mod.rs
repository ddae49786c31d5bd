//! Tubes.

mod bake;
mod curves;
mod select;
