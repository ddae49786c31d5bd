//! Cases of commands and of whole files.
