//! Tests that count memory: a program of their own, whose allocator is the counter.

#[allow(dead_code, reason = "most of it is for `suite.rs`")]
mod cli;
mod hostile;
mod no_alloc;
#[allow(dead_code, reason = "some of it is for `fuzz/`")]
mod targets;
