//! Online culling: what can be seen, found while the frame is drawn, where portals don't help.

pub mod bounds;
pub mod chc;
pub mod chc_plus;
pub mod depth;
pub mod frustum;
pub mod hierarchy;
pub mod levels;
pub mod oracle;
pub mod stats;
pub mod view;

mod walk;

#[cfg(test)]
mod scenes;
#[cfg(test)]
mod tests;
