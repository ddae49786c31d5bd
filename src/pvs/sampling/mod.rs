//! The lower bound: all methods here find free lines, and `witness` makes proofs of them; one line serves every cell that it crosses
//! (`lines`).
//!
//! Four methods, behind [`Strategy`]: `adaptive` visibility cubes on portals and in cells; `guided` rays at the borders of found objects;
//! and, for comparison, `uniform` cubes and random rays. `schedule` distributes the rays, and `batch` sets the size of batches. Then
//! `aimed` segments go to undecided pairs. [`confidence`] bounds the unseen part. `regions` does all of this for view cells.

mod adaptive;
pub(in crate::pvs) mod aimed;
mod batch;
mod cast;
pub mod confidence;
pub(in crate::pvs) mod goal;
mod guided;
pub(in crate::pvs) mod lines;
pub(in crate::pvs) mod region;
pub(in crate::pvs) mod regions;
pub(in crate::pvs) mod sampler;
mod schedule;
mod source;
mod uniform;
pub(in crate::pvs) mod witness;

pub(in crate::pvs) use schedule::{Plan, sample};
pub use schedule::{Spent, Strategy, sample_alone};
