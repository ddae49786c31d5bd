//! Integer arithmetic: exact Plücker coordinates, and their linear dependencies.
//!
//! Based on: Bareiss, *Sylvester's identity and multistep integer-preserving Gaussian elimination*, 1968. Deviation: columns are also
//! eliminated upwards (Jordan), so that the first dependent column gives its weights directly.

use super::Edge;
use glam::DVec3;
use num_bigint::{BigInt, Sign};

/// A finite number as an odd integer, or zero, times a power of two.
fn parts(x: f64) -> Option<(i64, i32)> {
    let bits = x.to_bits();
    let (exponent, fraction) = ((bits >> 52 & 0x7ff) as i32, (bits & ((1 << 52) - 1)) as i64);
    let (m, e) = if exponent == 0 { (fraction, -1074) } else { (fraction | 1 << 52, exponent - 1075) };
    let zeros = m.trailing_zeros();
    (m != 0).then(|| (if x < 0.0 { -(m >> zeros) } else { m >> zeros }, e + zeros as i32))
}

/// Plücker coordinates of edges, moment and then direction, about one common point and in one common unit, each with its divisor.
pub(super) fn rows(edges: &[Edge]) -> Vec<([BigInt; 6], BigInt)> {
    let exponents = edges.iter().flatten().flat_map(|p| p.to_array()).filter_map(|x| parts(x).map(|p| p.1));
    let least = exponents.min().unwrap_or(0);
    let integer = |x: f64| parts(x).map_or(BigInt::ZERO, |(m, e)| BigInt::from(m) << (e - least) as usize);
    let point = |p: DVec3| p.to_array().map(integer);
    let origin = edges.first().map(|e| point(e[0])).unwrap_or_default();
    let relative = |p: DVec3| {
        let p = point(p);
        std::array::from_fn::<BigInt, 3, _>(|k| &p[k] - &origin[k])
    };
    let row = |edge: &Edge| {
        let [a, b] = edge.map(relative);
        let moment = |i: usize, k: usize| &a[i] * &b[k] - &a[k] * &b[i];
        let row = [moment(1, 2), moment(2, 0), moment(0, 1), &b[0] - &a[0], &b[1] - &a[1], &b[2] - &a[2]];
        let divisor = row.iter().fold(BigInt::ZERO, |d, x| common(x.clone(), d));
        let divisor = if divisor == BigInt::ZERO { BigInt::from(1) } else { divisor };
        (row.map(|x| x / &divisor), divisor)
    };
    edges.iter().map(row).collect()
}

/// Weights over divisors, scaled to integers.
pub(super) fn whole(weights: &[BigInt], divisors: &[BigInt]) -> Vec<BigInt> {
    let multiple = divisors.iter().fold(BigInt::from(1), |m, d| &m * d / common(m.clone(), d.clone()));
    let scaled: Vec<BigInt> = weights.iter().zip(divisors).map(|(w, d)| w * (&multiple / d)).collect();
    let divisor = scaled.iter().fold(BigInt::ZERO, |d, x| common(x.clone(), d));
    if divisor == BigInt::ZERO { scaled } else { scaled.into_iter().map(|w| w / &divisor).collect() }
}

/// The greatest common divisor, not negative.
fn common(mut a: BigInt, mut b: BigInt) -> BigInt {
    while b != BigInt::ZERO {
        (a, b) = (b.clone(), a % &b);
    }
    if a.sign() == Sign::Minus { -a } else { a }
}

/// Coefficients of the 21 monomials of a product of two linear forms.
pub(super) fn product(a: &[BigInt; 6], b: &[BigInt; 6]) -> Vec<BigInt> {
    let pairs = (0..6).flat_map(|i| (i..6).map(move |k| (i, k)));
    pairs.map(|(i, k)| if i == k { &a[i] * &b[i] } else { &a[i] * &b[k] + &a[k] * &b[i] }).collect()
}

/// The coefficients of the Plücker quadric: direction times moment, which is zero for lines.
pub(super) fn quadric() -> Vec<BigInt> {
    let pairs = (0..6).flat_map(|i| (i..6).map(move |k| (i, k)));
    pairs.map(|(i, k)| BigInt::from(i32::from(k == i + 3))).collect()
}

/// Non-negative weights, not all zero, with which `columns` add up to zero; those of the first `free` columns may be negative. Columns
/// should be in the order of expected use. `None` if none were found.
pub(super) fn dependency(columns: &[Vec<BigInt>], free: usize) -> Option<Vec<BigInt>> {
    let (rows, n) = (columns.first()?.len(), columns.len());
    let mut matrix: Vec<Vec<BigInt>> = (0..rows).map(|r| columns.iter().map(|c| c[r].clone()).collect()).collect();
    // The column whose pivot is in each row. All pivots are `scale`.
    let mut pivots: Vec<usize> = Vec::new();
    let mut scale = BigInt::from(1);
    for c in 0..n {
        let done = pivots.len();
        let candidates = (done..rows).filter(|&r| matrix[r][c] != BigInt::ZERO);
        let Some(pivot) = candidates.min_by_key(|&r| matrix[r][c].bits()) else {
            // `scale` times this column is the sum of `matrix[r][c]` times column `pivots[r]`.
            let agrees = |r: usize| matrix[r][c] == BigInt::ZERO || matrix[r][c].sign() != scale.sign();
            if c < free || !(0..done).all(|r| pivots[r] < free || agrees(r)) {
                continue;
            }
            let mut weights = vec![BigInt::ZERO; n];
            (0..done).for_each(|r| weights[pivots[r]] = -&matrix[r][c]);
            weights[c] = scale.clone();
            if scale.sign() == Sign::Minus {
                weights.iter_mut().for_each(|w| *w = -&*w);
            }
            return Some(weights);
        };
        matrix.swap(done, pivot);
        let row = std::mem::take(&mut matrix[done]);
        for (_, other) in matrix.iter_mut().enumerate().filter(|&(r, _)| r != done) {
            let factor = std::mem::take(&mut other[c]);
            for k in c + 1..n {
                let cross = if factor == BigInt::ZERO || row[k] == BigInt::ZERO { BigInt::ZERO } else { &factor * &row[k] };
                if other[k] != BigInt::ZERO || cross != BigInt::ZERO {
                    other[k] = (&other[k] * &row[c] - cross) / &scale;
                }
            }
        }
        scale = row[c].clone();
        matrix[done] = row;
        pivots.push(c);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(of: &[&[i64]]) -> Vec<Vec<BigInt>> {
        of.iter().map(|c| c.iter().copied().map(BigInt::from).collect()).collect()
    }

    #[test]
    fn numbers_come_apart_without_rounding() {
        assert_eq!(parts(0.0), None);
        for x in [1.0, -0.1, 480.00000000000006, 5e-324, -1.7e308, f64::MIN_POSITIVE] {
            let (m, e) = parts(x).expect("not zero");
            assert!(m % 2 != 0 && m as f64 * 2f64.powi(e / 2) * 2f64.powi(e - e / 2) == x, "{x}");
        }
    }

    #[test]
    fn weights_are_found_where_there_are_some_and_only_there() {
        let sum = |c: &[&[i64]], free| dependency(&columns(c), free);
        let of = |w: &[i64]| Some(w.iter().copied().map(BigInt::from).collect::<Vec<_>>());
        assert_eq!(sum(&[&[2, 0], &[0, 3], &[-4, -3]], 0), of(&[12, 6, 6]));
        assert_eq!(sum(&[&[-2, 0], &[0, -3], &[4, 3]], 0), of(&[12, 6, 6]), "negative pivots");
        assert_eq!(sum(&[&[1, 0], &[0, 1], &[1, 1]], 0), None, "only with a negative weight");
        assert_eq!(sum(&[&[1, 0], &[0, 1], &[1, -1]], 1), of(&[-1, 1, 1]), "which the first may have");
        assert_eq!(sum(&[&[1, 0, 0], &[0, 1, 0], &[0, 0, 1]], 0), None, "independent");
        assert_eq!(sum(&[&[1, 0], &[1, 0], &[-3, 0]], 0), of(&[3, 0, 1]), "the second is not needed");
    }
}
