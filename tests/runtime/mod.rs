//! A frame.

mod frames;
mod locate;
mod mirrors;
mod prefetch;
mod worlds;
