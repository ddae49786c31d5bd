//! Distances of points and segments from triangles.

use super::Sheared;
use glam::DVec3;

/// True if the closed segment from `a` to `b` has a point within `distance` metres of the triangle.
pub(super) fn comes_within(a: DVec3, b: DVec3, corners: &[DVec3; 3], distance: f64) -> bool {
    let [p, q, r] = *corners;
    let normal = (q - p).cross(r - p);
    let (da, db, limit) = (normal.dot(a - p), normal.dot(b - p), normal.length() * distance);
    if (da > limit && db > limit) || (da < -limit && db < -limit) {
        return false;
    }
    let squared = distance * distance;
    if da * db <= 0.0 && Sheared::new(a, b - a).hit(corners).is_some_and(|t| (0.0..=1.0).contains(&t)) {
        return true;
    }
    (a - closest_on_triangle(a, corners)).length_squared() <= squared
        || (b - closest_on_triangle(b, corners)).length_squared() <= squared
        || [(p, q), (q, r), (r, p)].iter().any(|&(e, f)| segments_squared(a, b, e, f) <= squared)
}

/// The point of a triangle nearest to `p` (Ericson 2005, 5.1.5).
pub fn closest_on_triangle(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    a + ab * (vb * scale) + ac * (vc * scale)
}

/// Squared distance of the segments `p`-`q` and `r`-`s` (Ericson 2005, 5.1.9).
fn segments_squared(p: DVec3, q: DVec3, r: DVec3, s: DVec3) -> f64 {
    let (d1, d2, w) = (q - p, s - r, p - r);
    let (a, e, f) = (d1.length_squared(), d2.length_squared(), d2.dot(w));
    let (b, c) = (d1.dot(d2), d1.dot(w));
    let denominator = a * e - b * b;
    let mut x = if denominator > 0.0 { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.0 };
    let mut y = if e > 0.0 { (b * x + f) / e } else { 0.0 };
    if !(0.0..=1.0).contains(&y) {
        y = y.clamp(0.0, 1.0);
        x = if a > 0.0 { ((b * y - c) / a).clamp(0.0, 1.0) } else { 0.0 };
    }
    (p + d1 * x - r - d2 * y).length_squared()
}
