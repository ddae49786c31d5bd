//! Four upright pictures around the eye, and where something in the plan is on them.

use crate::{GroundView, Header, Key, Tile};
use glam::{DVec2, DVec3};

/// Columns of a picture, of which four are around the eye. More: finer tops of hills, and more time.
pub(super) const COLUMNS: usize = 256;
/// Of slopes (1 is 45 degrees), what roundings may amount to. More: tiles are kept that hardly are hidden.
pub(super) const ROUNDING: f64 = 1e-6;

/// One of the pictures around the eye: what is nearer to this half axis than to the others.
pub(super) struct Face {
    /// 0: east and west, 1: south and north.
    pub(super) axis: usize,
    pub(super) sign: f64,
}

pub(super) const FACES: [Face; 4] =
    [Face { axis: 0, sign: 1.0 }, Face { axis: 0, sign: -1.0 }, Face { axis: 1, sign: 1.0 }, Face { axis: 1, sign: -1.0 }];

/// A rectangle in the plan, metres from the eye, and how high what is there reaches above the eye.
pub(super) struct Footprint {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
    pub(super) top: f64,
    /// By axis, how far its low and its high side may be off, as slopes: 0 where it goes on in another footprint.
    pub(super) rounding: [[f64; 2]; 2],
}

/// What of a footprint is on a picture: the greatest slope at which something can be, and columns, the last included. Columns of all pictures
/// are counted on, and places in them are those of their picture.
pub(super) struct Part {
    pub(super) slope: f32,
    pub(super) first: usize,
    pub(super) last: usize,
    /// From place to place.
    pub(super) places: [f64; 2],
}

impl Footprint {
    /// Of a tile.
    pub(super) fn new(header: &Header, key: Key, tile: &Tile, eye: DVec3) -> Self {
        let at = |k: u32| {
            let [x, z] = header.plan(header.grid.column(key, k), header.grid.row(key, k));
            [x - eye.x, z - eye.z]
        };
        let top = f64::from(tile.high) - eye.y;
        Self { low: at(0), high: at(header.grid.side() - 1), top, rounding: [[ROUNDING; 2]; 2] }
    }

    pub(super) fn seen_from(&self, face: usize) -> Option<Part> {
        let Face { axis, sign } = FACES[face];
        let [from, to] = [self.low[axis] * sign, self.high[axis] * sign];
        let (nearest, farthest) = (from.min(to), from.max(to));
        let [left, right] = [self.low[1 - axis], self.high[1 - axis]];
        // On this picture, depth is not less than what is to the side.
        let nearest = nearest.max(left).max(-right).max(0.0);
        if farthest <= 0.0 || nearest > farthest {
            return None;
        }
        let whole = face * COLUMNS;
        if nearest == 0.0 {
            // It reaches under the eye.
            let slope = if self.top > 0.0 { f64::INFINITY } else { self.top / farthest };
            return Some(Part {
                slope: raised(slope),
                first: whole,
                last: whole + COLUMNS - 1,
                places: [0.0, COLUMNS as f64],
            });
        }
        let low = left / if left < 0.0 { nearest } else { farthest };
        let high = right / if right < 0.0 { farthest } else { nearest };
        let [low_rounding, high_rounding] = self.rounding[1 - axis];
        let places = [column(low - low_rounding), column(high + high_rounding)];
        let [first, last] = places.map(|place| whole + (place.max(0.0) as usize).min(COLUMNS - 1));
        Some(Part { slope: raised(self.top / if self.top > 0.0 { nearest } else { farthest }), first, last, places })
    }
}

/// A slope with what roundings may add.
fn raised(slope: f64) -> f32 {
    (slope + ROUNDING * (1.0 + slope.abs())) as f32
}

/// Where something is on a picture, in columns; -1 is its left border and 1 the right one.
pub(super) fn column(at: f64) -> f64 {
    (at + 1.0) * (COLUMNS as f64 / 2.0)
}

/// The border of a column, in the plan.
pub(super) fn direction(face: usize, border: usize) -> DVec2 {
    let Face { axis, sign } = FACES[face];
    let aside = border as f64 * (2.0 / COLUMNS as f64) - 1.0;
    if axis == 0 { DVec2::new(sign, aside) } else { DVec2::new(aside, sign) }
}

/// Normals in the plan of what the view holds: all of it is on the side that they point to. None where it looks steeply up or down.
pub(super) fn sides(view: &GroundView<'_>) -> [DVec2; 2] {
    let corners = CORNERS.map(|at| view.camera.unproject() * at.extend(1.0)).map(|ray| DVec2::new(ray.x, ray.z));
    let ahead = DVec2::new(f64::from(view.camera.w.x), f64::from(view.camera.w.z));
    if corners.iter().any(|corner| ahead.dot(*corner) <= 0.0) {
        return [DVec2::ZERO; 2];
    }
    [1.0, -1.0].map(|sign| {
        let normals = corners.map(|corner| sign * corner.perp().normalize());
        let is_side = |normal: &&DVec2| corners.iter().all(|&corner| normal.dot(corner) >= -ROUNDING * corner.length());
        normals.iter().find(is_side).copied().unwrap_or(DVec2::ZERO)
    })
}

/// Of the screen.
pub(super) const CORNERS: [DVec2; 4] = [DVec2::ONE, DVec2::NEG_ONE, DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)];
