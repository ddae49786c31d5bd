//! The lower bound: everything here finds free lines and has `witness` make proofs of them; one line serves every cell that
//! it crosses (`lines`).
//!
//! Four ways of finding them, behind [`Strategy`]: `adaptive` visibility cubes on portals and in cells; `guided` rays at the
//! borders of what was found; and, to hold them against, `uniform` cubes and random rays. `schedule` gives the rays away,
//! and `batch` says how many at a time. Then `aimed` segments go to what the upper bound left. How much of what there is to
//! see all of them have missed, [`confidence`] bounds. `regions` does all of this for view cells.

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
