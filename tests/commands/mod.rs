//! The command line.

mod errors;
mod files;
mod ground;
mod notes;
mod report;
mod vis;
mod walk;
mod why;
