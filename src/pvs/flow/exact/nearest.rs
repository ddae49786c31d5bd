//! The point of a convex hull that is nearest to the origin.
//!
//! Based on: Wolfe, *Finding the nearest point in a polytope*, 1976. Deviation: the affine steps are solved by orthogonalization (Gram,
//! Schmidt, twice) instead of normal equations, which square the error. One routine decides both alternatives (Gordan, 1873): if the
//! nearest point is not the origin, it has a positive product with every point of the hull; if it is, its weights prove that no vector has.
//! This property, and a support of at most one more generator than dimensions, are the reasons for not using a general linear programming
//! library.

/// Most steps. Far more than necessary without rounding.
const STEPS: usize = 100;

/// A nearer point counts as the origin; generators are unit vectors.
const ORIGIN: f64 = 1e-14;

/// Relative tolerance of the nearest point's products.
const CLOSE: f64 = 1e-6;

/// A generator this near to the span of others is dependent, relative to its length.
const DEPENDENT: f64 = 1e-13;

/// The result.
pub(super) struct Nearest<I, const D: usize> {
    /// The point.
    pub point: [f64; D],
    /// Generators and their positive weights, which add up to 1.
    pub support: Vec<(I, f64)>,
    /// True if all generators have a positive product with the point.
    pub apart: bool,
}

/// `least` names the generator with the least product with a vector; generators are unit vectors.
pub(super) fn nearest<I: Copy + PartialEq, const D: usize>(
    mut least: impl FnMut(&[f64; D]) -> (I, [f64; D]),
) -> Nearest<I, D> {
    let (first, mut point) = least(&[1.0; D]);
    let mut simplex = Simplex { corners: vec![(first, 1.0, point)], columns: Vec::new() };
    let mut last = f64::INFINITY;
    let mut apart = false;
    for _ in 0..STEPS {
        let square = dot(&point, &point);
        if square <= ORIGIN * ORIGIN {
            break;
        }
        let (next, generator) = least(&point);
        let product = dot(&generator, &point);
        apart = product > 0.0;
        // In this form a NaN ends it, too.
        let goes_on = square < last && product < square * (1.0 - CLOSE);
        last = square;
        if !goes_on || simplex.corners.iter().any(|c| c.0 == next) {
            break;
        }
        let before = simplex.corners.clone();
        simplex.corners.push((next, 0.0, generator));
        if !simplex.settle() {
            simplex.corners = before;
            break;
        }
        point = simplex.foot();
        apart = false;
    }
    let weights = simplex.corners.iter().map(|&(i, w, _)| (i, w));
    Nearest { point, support: weights.filter(|s| s.1 > 0.0).collect(), apart }
}

/// The generators that support the current point.
struct Simplex<I, const D: usize> {
    /// Names, weights and the generators.
    corners: Vec<(I, f64, [f64; D])>,
    /// For the corners from the second on, if up to date.
    columns: Vec<Column<D>>,
}

/// A corner relative to the first, orthogonalized against previous ones.
struct Column<const D: usize> {
    axis: [f64; D],
    /// Components along the previous axes, and along its own.
    parts: Vec<f64>,
    /// Component along this axis of the vector from the first corner to the origin.
    along: f64,
}

impl<I, const D: usize> Simplex<I, D> {
    /// Moves to the nearest point of the affine hull, and drops corners whose weight would become negative. False if rounding leaves no
    /// corner.
    fn settle(&mut self) -> bool {
        while !self.corners.is_empty() {
            let Some(weights) = self.affine() else { return false };
            if weights.iter().all(|&w| w > 0.0) {
                self.corners.iter_mut().zip(weights).for_each(|(c, w)| c.1 = w);
                return true;
            }
            let (mut step, mut out) = (f64::INFINITY, 0);
            for (k, (c, &w)) in self.corners.iter().zip(&weights).enumerate() {
                let s = if c.1 > w { c.1 / (c.1 - w) } else { 0.0 };
                if w <= 0.0 && s < step {
                    (step, out) = (s, k);
                }
            }
            self.corners.iter_mut().zip(&weights).for_each(|(c, &w)| c.1 += step.min(1.0) * (w - c.1));
            self.corners.remove(out);
            self.columns.truncate(out.saturating_sub(1));
        }
        false
    }

    /// The nearest point of the affine hull. Not by the weights: the error of a sum with cancellation is small relative to the generators,
    /// but not to the result, and all generators must have equal products with the result.
    fn foot(&self) -> [f64; D] {
        let mut point = self.corners[0].2;
        for column in self.columns.iter().chain(&self.columns).chain(&self.columns) {
            let part = dot(&column.axis, &point);
            (0..D).for_each(|k| point[k] -= part * column.axis[k]);
        }
        point
    }

    /// Weights, of any sign, of the point of the affine hull that is nearest to the origin.
    fn affine(&mut self) -> Option<Vec<f64>> {
        let base = self.corners[0].2;
        for (_, _, generator) in &self.corners[self.columns.len() + 1..] {
            let mut rise: [f64; D] = std::array::from_fn(|k| generator[k] - base[k]);
            let size = dot(&rise, &rise).sqrt();
            let mut parts = vec![0.0; self.columns.len()];
            for _ in 0..2 {
                for (column, sum) in self.columns.iter().zip(&mut parts) {
                    let part = dot(&column.axis, &rise);
                    *sum += part;
                    (0..D).for_each(|k| rise[k] -= part * column.axis[k]);
                }
            }
            let height = dot(&rise, &rise).sqrt();
            if height <= DEPENDENT * size || height.is_nan() {
                return None;
            }
            let axis = rise.map(|x| x / height);
            parts.push(height);
            self.columns.push(Column { axis, parts, along: -dot(&axis, &base) });
        }
        let n = self.columns.len();
        let mut weights = vec![0.0; n + 1];
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|k| self.columns[k].parts[i] * weights[k + 1]).sum();
            weights[i + 1] = (self.columns[i].along - known) / self.columns[i].parts[i];
        }
        weights[0] = 1.0 - weights[1..].iter().sum::<f64>();
        Some(weights)
    }
}

pub(super) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// The normalized vector.
pub(super) fn unit<const D: usize>(x: &[f64; D]) -> [f64; D] {
    let length = dot(x, x).sqrt();
    x.map(|v| v / length)
}

/// A vector without its component along a unit vector.
pub(super) fn without<const D: usize>(x: &[f64; D], unit: &[f64; D]) -> [f64; D] {
    let part = dot(x, unit);
    std::array::from_fn(|k| x[k] - part * unit[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of<const D: usize>(points: &[[f64; D]]) -> Nearest<usize, D> {
        nearest(|x| {
            let by = |i: &usize, k: &usize| dot(&points[*i], x).total_cmp(&dot(&points[*k], x));
            let i = (0..points.len()).min_by(by).expect("points");
            (i, points[i])
        })
    }

    #[test]
    fn the_nearest_point_of_a_segment_and_of_a_triangle_around_the_origin() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let segment = of(&[[half, half, 0.0], [half, -half, 0.0]]);
        assert!(segment.apart && (segment.point[0] - half).abs() < 1e-12 && segment.support.len() == 2);
        let third = |k: usize| (std::f64::consts::TAU * k as f64 / 3.0).sin_cos();
        let triangle = of(&[0, 1, 2].map(|k| [third(k).0, third(k).1]));
        assert!(!triangle.apart && triangle.support.iter().all(|s| (s.1 - 1.0 / 3.0).abs() < 1e-12));
    }

    #[test]
    fn a_thin_cone_has_a_point() {
        // Two almost opposite unit vectors, and a perpendicular one.
        let narrow = of(&[[1.0, 1e-9, 0.0], [-1.0, 1e-9, 0.0], [0.0, 0.0, 1.0]]);
        assert!(narrow.apart && narrow.point[1] > 0.0);
    }
}
