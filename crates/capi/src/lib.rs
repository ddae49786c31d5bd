//! The run time of Enfilade for C: `include/enfilade.h` is made from this crate, and is the reference of what each function does.
//!
//! Handles are boxes whose pointers C holds. A building is shared by what is made from it, so handles are freed in any order. Arguments that
//! are null, of another building or out of range are errors with a text; no panic leaves a function. Frames allocate nothing after
//! the first of each kind; names, lines, new handles and ways that are harder than any before do.
//!
//! # What a caller must keep
//!
//! * A handle comes from its constructor and is not freed yet; one thread at a time changes it. Buildings may be read by any number.
//! * A buffer has as many items as the call says, and no one else writes it meanwhile.
//! * A text ends with a zero.

pub mod building;
pub mod doors;
pub mod fault;
pub mod lines;
pub mod lists;
pub mod loader;
pub mod mirrors;
pub mod movers;
pub mod paths;
pub mod relevance;
pub mod shapes;
pub mod view;
pub mod world;
