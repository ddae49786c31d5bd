//! A frame.

mod frames;
mod locate;
mod mirrors;
mod movers;
mod paths;
mod prefetch;
mod relevance;
mod view;
mod world;
mod worlds;
