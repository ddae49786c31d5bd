//! Four upright pictures around the eye, and the projection of the plan to them.

use crate::{GroundView, Header, Key, Tile};
use glam::{DVec2, DVec3};

/// Columns of each of the four pictures. More: finer hilltops, and more time.
pub(super) const COLUMNS: usize = 256;
/// Allowance for rounding, as a slope (1 is 45 degrees). More: slightly hidden tiles are kept.
pub(super) const ROUNDING: f64 = 1e-6;

/// One of the pictures: the directions nearest to this half axis.
pub(super) struct Face {
    /// 0: east and west, 1: south and north.
    pub(super) axis: usize,
    pub(super) sign: f64,
}

pub(super) const FACES: [Face; 4] =
    [Face { axis: 0, sign: 1.0 }, Face { axis: 0, sign: -1.0 }, Face { axis: 1, sign: 1.0 }, Face { axis: 1, sign: -1.0 }];

/// A rectangle in the plan, metres from the eye, with the greatest height above the eye.
pub(super) struct Footprint {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
    pub(super) top: f64,
    /// By axis, the error of its low and its high side, as slopes: 0 where another footprint continues it.
    pub(super) rounding: [[f64; 2]; 2],
}

/// The part of a footprint on a picture: its greatest slope, and its columns, including the last. Columns are numbered over all
/// pictures; places are those in their picture.
pub(super) struct Part {
    pub(super) slope: f32,
    pub(super) first: usize,
    pub(super) last: usize,
    /// First and last place.
    pub(super) places: [f64; 2],
}

impl Footprint {
    /// For a tile.
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
        // On this picture, depth is at least the distance to the side.
        let nearest = nearest.max(left).max(-right).max(0.0);
        if farthest <= 0.0 || nearest > farthest {
            return None;
        }
        let whole = face * COLUMNS;
        if nearest == 0.0 {
            // It extends below the eye.
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

/// A slope plus the allowance for rounding.
fn raised(slope: f64) -> f32 {
    (slope + ROUNDING * (1.0 + slope.abs())) as f32
}

/// Place on a picture, in columns; -1 is its left border and 1 the right one.
pub(super) fn column(at: f64) -> f64 {
    (at + 1.0) * (COLUMNS as f64 / 2.0)
}

/// Direction of a column's border in the plan.
pub(super) fn direction(face: usize, border: usize) -> DVec2 {
    let Face { axis, sign } = FACES[face];
    let aside = border as f64 * (2.0 / COLUMNS as f64) - 1.0;
    if axis == 0 { DVec2::new(sign, aside) } else { DVec2::new(aside, sign) }
}

/// Normals in the plan of the sides of the view, pointing inwards. Zero if it looks steeply up or down.
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

/// Corners of the screen.
pub(super) const CORNERS: [DVec2; 4] = [DVec2::ONE, DVec2::NEG_ONE, DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)];
