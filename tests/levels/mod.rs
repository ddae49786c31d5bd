//! Levels of games.

mod bsp;
mod lines;
mod map;
mod prt;
mod scene;
mod truth;
mod vis;
