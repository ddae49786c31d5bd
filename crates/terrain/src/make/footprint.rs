//! Removes ground under a building.

use glam::DVec2;

/// Triangles seen from above, in a raster's columns and rows.
pub struct Keeper<'a> {
    triangles: &'a [[DVec2; 3]],
}

impl<'a> Keeper<'a> {
    /// Removes samples in triangles (columns and rows, of any winding).
    pub fn new(triangles: &'a [[DVec2; 3]]) -> Self {
        Self { triangles }
    }

    /// Removes the heights of all samples in or on the triangles. `rows` begins with row `first`; `columns` samples a row.
    pub fn keep_out(&self, first: u32, columns: usize, rows: &mut [f64]) {
        let count = rows.len() / columns;
        for triangle in self.triangles {
            let [a, b, c] = triangle.map(|p| p - DVec2::new(0.0, f64::from(first)));
            let low = a.min(b).min(c).ceil().max(DVec2::ZERO);
            let high = a.max(b).max(c).floor().min(DVec2::new(columns as f64 - 1.0, count as f64 - 1.0));
            let whole = (b - a).perp_dot(c - a);
            if whole == 0.0 || !low.cmple(high).all() {
                continue;
            }
            for row in low.y as usize..=high.y as usize {
                for column in low.x as usize..=high.x as usize {
                    let p = DVec2::new(column as f64, row as f64);
                    let parts = [(b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)];
                    if parts.iter().all(|part| part * whole.signum() >= 0.0) {
                        rows[row * columns + column] = f64::NAN;
                    }
                }
            }
        }
    }
}
