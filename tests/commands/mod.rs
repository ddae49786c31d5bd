//! The command line.

mod errors;
mod files;
mod ground;
mod keys;
mod notes;
mod report;
mod vis;
mod walk;
mod why;
