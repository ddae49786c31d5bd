//! Who cameras stand for.

/// Height of a standing person's eye above the floor, metres: between the medians of men and women in the United Kingdom, 1.63 and 1.505
/// (S. Pheasant, *Bodyspace*, 1996, table 10.1).
pub(crate) const EYE_HEIGHT: f64 = 1.6;
