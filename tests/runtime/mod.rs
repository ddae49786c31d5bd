//! A frame.

mod frames;
mod locate;
mod mirrors;
mod movers;
mod prefetch;
mod view;
mod worlds;
