//! What people look at.

pub mod check;
