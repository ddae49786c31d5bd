//! What the builder and the run time both name: plain data, without the code that makes it.
//!
//! In: nothing. Out: the [`scene`], what its author [said](hints), [portals](portal), what rows [promise](guarantee), how it was
//! [proven](proof), and [counters](stats). The rooms above add meaning; `scene`, `cells` and `pvs` name these as their own.

pub mod bounds;
#[cfg(feature = "bake")]
pub mod expected;
pub mod gap;
pub mod guarantee;
#[cfg(feature = "bake")]
pub mod hints;
#[cfg(feature = "bake")]
pub mod import;
#[cfg(feature = "bake")]
pub mod level;
#[cfg(feature = "bake")]
pub mod note;
#[cfg(feature = "bake")]
pub mod person;
pub mod placed;
pub mod portal;
pub mod proof;
#[cfg(feature = "bake")]
pub mod scene;
pub mod stats;
pub mod strategy;
pub mod view_cell_name;
