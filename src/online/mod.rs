//! Online culling: what can be seen, found while the frame is drawn, where portals don't help.

pub mod bounds;
