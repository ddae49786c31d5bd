//! Products of two sides each that add up to a multiple of the Plücker quadric.
//!
//! Based on: Lasserre, *Global optimization with polynomials and the problem of moments*, 2001, whose moment matrices are here
//! replaced by plain products of linear constraints (Sherali, Adams, 1990): a form that is a sum of such products is positive in
//! the whole cone, and no semidefinite programme is needed to find one.

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

/// Products of two rows that add up to a multiple of the quadric, if some do. The rows are taken relative to six of them, in
/// which a thin cone is as wide as any.
pub(super) fn products(rows: &[Row], cone: &Nearest<usize, 6>) -> Nearest<[usize; 2], FORMS> {
    let rays = inverse(&basis(rows, cone));
    let rows: Vec<Row> = rows.iter().map(|r| unit(&rays.map(|ray| dot(r, &ray)))).collect();
    let swapped = rays.map(|r| [r[3], r[4], r[5], r[0], r[1], r[2]]);
    let axis = |i: usize| -> Row { std::array::from_fn(|k| f64::from(i == k)) };
    let mut quadric = [0.0; FORMS];
    for (i, ray) in rays.iter().enumerate() {
        for (k, other) in swapped.iter().enumerate() {
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

/// Six independent rows: those that hold the point of the cone, and others.
fn basis(rows: &[Row], cone: &Nearest<usize, 6>) -> [Row; 6] {
    let mut held = cone.support.iter().map(|s| s.0);
    let (mut axes, mut left) = (Vec::<Row>::new(), rows.to_vec());
    [(); 6].map(|()| {
        let longest = |i: &usize, k: &usize| dot(&left[*i], &left[*i]).total_cmp(&dot(&left[*k], &left[*k]));
        let i = held.next().or_else(|| (0..left.len()).max_by(longest)).unwrap_or_default();
        let axis = unit(&left[i]);
        left.iter_mut().for_each(|r| *r = without(r, &axis));
        axes.push(axis);
        rows[i]
    })
}

/// Vectors that have a product of 1 with one row each and of 0 with the others.
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
