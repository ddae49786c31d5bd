//! Portal files (`.prt`), as level compilers write them for their vis. They are read where levels are: [`crate::quake`].

pub use crate::quake::prt::{Dialect, FLATNESS, MOST_ISOLATED, MOST_POINTS, Prt, PrtError, PrtFault, read_prt};
pub use crate::{FARTHEST, MOST_CLUSTERS};
