//! Who cameras stand for, and what their metre is in models of any unit.

/// Height of a standing person's eye above the floor, metres. A round figure for adults; every camera of this crate stands so high.
pub const EYE_HEIGHT: f64 = 1.6;
/// How high rooms are, metres; and the halls of games, whose units are their own.
pub(crate) const CEILING_HEIGHT: f64 = 2.7;
const HALL_HEIGHT: f64 = 4.5;
/// Rooms from 0.68 to 16 m high are taken to be in metres: crawl spaces and cathedrals are.
pub(crate) const PLAUSIBLE: [f64; 2] = [0.25, 6.0];
/// A model in millimetres is at least so many metres across: a room is. Smaller things with high ceilings are levels in units of a game.
pub(crate) const LEAST_ACROSS: f64 = 5.0;

/// What a metre is in a model whose rooms are so high, and which is so far across, both in its units: 1 where rooms are as high as people
/// build them in metres; else 1,000 or 0.001, for millimetres or kilometres, where that fits and leaves the model as large as a room.
pub fn metric(height: f64, across: f64) -> Option<f64> {
    let ratio = height / CEILING_HEIGHT;
    let is_room = |unit: f64| unit <= 1.0 || across >= LEAST_ACROSS * unit;
    let fits = |&unit: &f64| (PLAUSIBLE[0]..=PLAUSIBLE[1]).contains(&(ratio / unit)) && is_room(unit);
    [1.0, 1e3, 1e-3].into_iter().find(fits)
}

/// What makes rooms that are so high as high as the halls of games.
pub fn hall(height: f64) -> f64 {
    height / HALL_HEIGHT
}

/// What a metre is in a model that is so far across and has no rooms: 1 for 3 to 400, else what makes it 100 m; 1 where it is a point.
pub fn by_extent(across: f64) -> f64 {
    if (3.0..=400.0).contains(&across) || across <= 0.0 { 1.0 } else { across / 100.0 }
}
