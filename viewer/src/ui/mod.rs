//! The interface: panels over the picture, by egui. Nothing here knows of a window, so pictures without one have panels, too.

pub mod escape;
pub mod find;
pub mod graphs;
pub mod hud;
pub mod keys;
pub mod legend;
pub mod marks;
pub mod matrix;
pub mod paint;
pub mod plan;
pub mod preferences;
pub mod profile;
pub mod rebind;
pub mod toolbar;
pub mod welcome;
