//! What the viewer does, a module a subject; the window and the counter of allocations have processes of their own.

#[allow(dead_code, reason = "the window's test uses the rest")]
mod common;

mod cli;
mod doors;
mod finding;
mod frames;
mod going;
mod ground;
mod habits;
mod hinges;
mod hiz;
mod insight;
mod looks;
mod opening;
mod panels;
mod section;
mod start;
mod tubes;
