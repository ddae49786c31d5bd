//! Occlusion culling.

mod client_tree;
mod queries;
