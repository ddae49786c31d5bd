//! The command line.

mod errors;
mod files;
mod ground;
mod keys;
mod lost;
mod notes;
mod report;
mod vis;
mod walk;
mod why;
