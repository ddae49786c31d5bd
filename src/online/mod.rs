//! Online culling: what can be seen, found while the frame is drawn, where portals don't help.

pub mod bounds;
pub mod depth;
pub mod frustum;
pub mod hierarchy;
pub mod oracle;
pub mod stats;
pub mod view;

#[cfg(test)]
mod scenes;
