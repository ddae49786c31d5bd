//! Systems of equations for points along a line, each beside the next: blocks of 2 x 2 about the diagonal, so that time is linear in their number.

use glam::{DMat2, DVec2, DVec3};

/// A symmetric system, and its solution.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocks {
    /// By point: the block on the diagonal, that beside it for the next point, and the right side.
    rows: Vec<(DMat2, DMat2, DVec2)>,
    /// The solution, by point.
    pub steps: Vec<DVec2>,
}

impl Blocks {
    pub fn clear(&mut self) {
        self.rows.clear();
    }

    pub fn push(&mut self, block: DMat2, beside: DMat2, right: DVec2) {
        self.rows.push((block, beside, right));
    }

    /// Solves it: elimination, block by block. Blocks on the diagonal are inverted in place.
    pub fn solve(&mut self) {
        let count = self.rows.len();
        self.steps.clear();
        self.steps.extend(self.rows.iter().map(|(_, _, right)| *right));
        for i in 0..count {
            let inverse = self.rows[i].0.inverse();
            if i + 1 < count {
                let beside = self.rows[i].1;
                let factor = beside.transpose() * inverse;
                self.rows[i + 1].0 -= factor * beside;
                let carried = factor * self.steps[i];
                self.steps[i + 1] -= carried;
            }
            // The inverse is needed again on the way back.
            self.rows[i].0 = inverse;
        }
        for i in (0..count).rev() {
            let next = if i + 1 < count { self.rows[i].1 * self.steps[i + 1] } else { DVec2::ZERO };
            self.steps[i] = self.rows[i].0 * (self.steps[i] - next);
        }
    }

    /// The right side times the solution, negative.
    pub fn slope(&self) -> f64 {
        self.rows.iter().zip(&self.steps).map(|((_, _, right), step)| -right.dot(*step)).sum()
    }
}

/// The second and the first derivative, negative, of a segment's length by its end's place along two axes, each zero or of length 1 and upright on
/// each other; of its direction and its length.
pub(super) fn derivatives(along: DVec3, length: f64, [x, y]: [DVec3; 2]) -> (DMat2, DVec2) {
    let flat = DVec2::new(along.dot(x), along.dot(y));
    let square = DMat2::from_diagonal(DVec2::new(x.length_squared(), y.length_squared()));
    ((square - outer(flat, flat)) * (1.0 / length), -flat)
}

/// The mixed derivative of a segment's length by its start's and its end's places.
pub(super) fn mixed(along: DVec3, length: f64, [x, y]: [DVec3; 2], end: [DVec3; 2]) -> DMat2 {
    let across = |v: DVec3| DVec2::new(x.dot(v) - along.dot(x) * along.dot(v), y.dot(v) - along.dot(y) * along.dot(v));
    DMat2::from_cols(across(end[0]), across(end[1])) * (-1.0 / length)
}

pub(super) fn outer(a: DVec2, b: DVec2) -> DMat2 {
    DMat2::from_cols(a * b.x, a * b.y)
}
