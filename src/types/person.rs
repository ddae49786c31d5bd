//! Who cameras stand for.

/// Height of a standing person's eye above the floor, metres. A round figure for adults; every camera of this crate stands so high.
pub(crate) const EYE_HEIGHT: f64 = 1.6;
