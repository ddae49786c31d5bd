//! Levels of games.

mod beside;
pub mod bsp;
mod drawn;
pub mod games;
mod kinds;
mod lines;
mod map;
mod open;
mod prt;
mod readers;
mod real;
mod scene;
mod truth;
mod vis;

/// Levels whose maps are there, too.
#[cfg(feature = "full")]
const LEVELS: [&str; 5] = ["dm4", "e1m1", "e1m3", "e2m2", "start"];
