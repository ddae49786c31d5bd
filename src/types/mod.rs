//! Types common to the builder and the run time: plain data, without the code that makes it.
//!
//! In: nothing. Out: the [`scene`], its author's [hints], [portals](portal), the [guarantee] of rows, [proofs](proof),
//! and [counters](stats). `scene`, `cells` and `pvs` re-export these types.

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
