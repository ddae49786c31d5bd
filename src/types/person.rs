//! Human measures: eye height, and the length of a metre in models of any unit.

/// Height of a standing person's eye above the floor, metres. A round figure for adults; all cameras of this crate use it.
pub const EYE_HEIGHT: f64 = 1.6;
/// Typical ceiling height, metres; and that of game halls, whose units are arbitrary.
pub(crate) const CEILING_HEIGHT: f64 = 2.7;
const HALL_HEIGHT: f64 = 4.5;
/// Ratios of ceiling height to the typical one that count as metres: 0.68 to 16 m, from crawl spaces to cathedrals.
pub(crate) const PLAUSIBLE: [f64; 2] = [0.25, 6.0];
/// Least size of a model in millimetres, metres: that of a room. Smaller models with high ceilings are levels in game units.
pub(crate) const LEAST_ACROSS: f64 = 5.0;

/// The length of a metre in a model with this ceiling height and size, both in its units: 1 if the height is plausible in metres; else
/// 1,000 or 0.001, for millimetres or kilometres, if that fits and the model is at least as large as a room.
pub fn metric(height: f64, across: f64) -> Option<f64> {
    let ratio = height / CEILING_HEIGHT;
    let is_room = |unit: f64| unit <= 1.0 || across >= LEAST_ACROSS * unit;
    let fits = |&unit: &f64| (PLAUSIBLE[0]..=PLAUSIBLE[1]).contains(&(ratio / unit)) && is_room(unit);
    [1.0, 1e3, 1e-3].into_iter().find(fits)
}

/// The length of a metre that gives rooms the height of game halls.
pub fn hall(height: f64) -> f64 {
    height / HALL_HEIGHT
}

/// The length of a metre in a model of this size without rooms: 1 for 3 to 400; else the value that makes it 100 m across; 1 for a point.
pub fn by_extent(across: f64) -> f64 {
    if (3.0..=400.0).contains(&across) || across <= 0.0 { 1.0 } else { across / 100.0 }
}
