//! Refutation by products of two sides that add up to a multiple of the Plücker quadric.
//!
//! Based on: Lasserre, *Global optimization with polynomials and the problem of moments*, 2001, with products of linear constraints
//! (Sherali, Adams, 1990) instead of moment matrices: a sum of such products is positive in the whole cone, and no semidefinite program is
//! necessary.

use super::Row;
use super::nearest::{Nearest, dot, nearest, unit, without};

/// Monomials of two coordinates.
const FORMS: usize = 21;

type Form = [f64; FORMS];

/// The product of two linear forms, so that the product of two of these is that of the matrices.
fn form(a: &Row, b: &Row) -> Form {
    let mut form = [0.0; FORMS];
    let pairs = (0..6).flat_map(|i| (i..6).map(move |k| (i, k)));
    for (f, (i, k)) in form.iter_mut().zip(pairs) {
        *f = if i == k { a[i] * b[i] } else { (a[i] * b[k] + a[k] * b[i]) * std::f64::consts::FRAC_1_SQRT_2 };
    }
    form
}

/// Products of two rows that add up to a multiple of the quadric, if there are any.
pub(super) fn products(rows: &[Row], corner: &Corner) -> Nearest<[usize; 2], FORMS> {
    let rays = corner.rays;
    let rows: Vec<Row> = rows.iter().map(|r| unit(&rays.map(|ray| dot(r, &ray)))).collect();
    let slopes = rays.map(|r| swapped(&r));
    let axis = |i: usize| -> Row { std::array::from_fn(|k| f64::from(i == k)) };
    let mut quadric = [0.0; FORMS];
    for (i, ray) in rays.iter().enumerate() {
        for (k, other) in slopes.iter().enumerate() {
            let part = form(&axis(i), &axis(k));
            (0..FORMS).for_each(|f| quadric[f] += part[f] * dot(ray, other));
        }
    }
    let quadric = unit(&quadric);
    let generator = |[i, k]: [usize; 2]| unit(&without(&form(&rows[i], &rows[k]), &quadric));
    nearest(|x: &Form| {
        let mut matrix = [[0.0; 6]; 6];
        let pairs = (0..6).flat_map(|i| (i..6).map(move |k| (i, k)));
        for ((i, k), &f) in pairs.zip(x) {
            let f = if i == k { f } else { f * std::f64::consts::FRAC_1_SQRT_2 };
            (matrix[i][k], matrix[k][i]) = (f, f);
        }
        let mut found = ([0, 0], f64::INFINITY);
        for (i, row) in rows.iter().enumerate() {
            let turned = matrix.map(|m| dot(&m, row));
            for (k, other) in rows.iter().enumerate().skip(i) {
                let product = dot(&turned, other);
                if product < found.1 {
                    found = ([i, k], product);
                }
            }
        }
        (found.0, generator(found.0))
    })
}

/// Six independent rows, first those that support the point of the cone: in this basis a thin cone is wide.
pub(super) struct Corner {
    rows: [Row; 6],
    /// The dual basis: each vector has a product of 1 with one row and 0 with the others.
    rays: [Row; 6],
    /// Rows that are not the cone's, because it is unconstrained in that direction.
    free: [bool; 6],
}

impl Corner {
    /// Chooses the rows for a cone.
    pub fn new(rows: &[Row], cone: &Nearest<usize, 6>) -> Self {
        let axis = |i: usize| -> Row { std::array::from_fn(|k| f64::from(i == k)) };
        let all: Vec<Row> = rows.iter().copied().chain((0..6).map(axis)).collect();
        let mut left = all.clone();
        let mut axes: Vec<Row> = Vec::new();
        let mut held = cone.support.iter().map(|s| s.0);
        let chosen: [usize; 6] = std::array::from_fn(|_| {
            let length = |i: &usize| dot(&left[*i], &left[*i]);
            let longest = |of: std::ops::Range<usize>| of.max_by(|i, k| length(i).total_cmp(&length(k))).unwrap_or_default();
            let next = held.next().unwrap_or_else(|| longest(0..rows.len()));
            let i = if length(&next) > FLAT * FLAT { next } else { longest(rows.len()..all.len()) };
            // Orthogonalized again: the rest of a nearly dependent row has the others' rounding error.
            let axis = unit(&axes.iter().fold(unit(&left[i]), |rest, axis| without(&rest, axis)));
            axes.push(axis);
            left.iter_mut().for_each(|r| *r = without(r, &axis));
            i
        });
        let rows_chosen = chosen.map(|i| all[i]);
        Self { rows: rows_chosen, rays: inverse(&rows_chosen), free: chosen.map(|i| i >= rows.len()) }
    }

    /// Moves a point of the cone onto the quadric, by steps scaled by its depth inside each row.
    pub fn onto_quadric(&self, point: &Row) -> Row {
        let mut x = unit(point);
        for _ in 0..NEWTON {
            let slope = swapped(&x);
            let mut step = [0.0; 6];
            for ((row, ray), free) in self.rows.iter().zip(&self.rays).zip(self.free) {
                let depth = if free { 1.0 } else { dot(row, &x) };
                let part = depth * depth * dot(ray, &slope);
                (0..6).for_each(|k| step[k] += part * ray[k]);
            }
            let t = -0.5 * dot(&x, &slope) / dot(&step, &slope);
            if !t.is_finite() {
                break;
            }
            x = unit(&std::array::from_fn(|k| x[k] + t * step[k]));
        }
        x
    }
}

/// Rows this near to the span of others are dependent.
const FLAT: f64 = 1e-12;

/// Newton steps onto the quadric.
const NEWTON: usize = 4;

/// Half of the quadric's gradient at a point.
fn swapped(x: &Row) -> Row {
    [x[3], x[4], x[5], x[0], x[1], x[2]]
}

/// The inverse: each vector has a product of 1 with one row and 0 with the others.
fn inverse(rows: &[Row; 6]) -> [Row; 6] {
    let mut matrix: [[f64; 12]; 6] =
        std::array::from_fn(|i| std::array::from_fn(|k| if k < 6 { rows[i][k] } else { f64::from(k - 6 == i) }));
    for c in 0..6 {
        let pivot = (c..6).max_by(|&i, &k| matrix[i][c].abs().total_cmp(&matrix[k][c].abs())).unwrap_or(c);
        matrix.swap(c, pivot);
        let row = matrix[c].map(|x| x / matrix[c][c]);
        matrix[c] = row;
        for other in (0..6).filter(|&r| r != c) {
            let factor = matrix[other][c];
            (0..12).for_each(|k| matrix[other][k] -= factor * row[k]);
        }
    }
    std::array::from_fn(|k| std::array::from_fn(|i| matrix[i][6 + k]))
}
