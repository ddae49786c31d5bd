//! The command line.

mod errors;
mod files;
mod ground;
mod keys;
mod lost;
mod notes;
mod pack;
mod report;
mod vis;
mod walk;
mod why;
