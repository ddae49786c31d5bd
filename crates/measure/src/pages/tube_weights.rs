//! Coverage error of thin tubes that are drawn a pixel wide and blended.
//!
//! Based on: Persson, *Phone-wire AA*, 2012: a wire is drawn at least a pixel wide and blended by its coverage. Deviation: rings
//! have corners, so the width of their outline counts.

use super::tube_errors::TubeView;
use enfilade_tubes::{Band, Tubes};
use glam::DVec3;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Greatest factor by which thin tubes are widened: the viewer's usual one.
const MOST: f64 = 1e3;

/// A ring as drawn: its centre relative to the scene's origin, half the width of its outline, and the values that pixels
/// interpolate: half of the true width and of the outline's width in the shader; metres.
struct Drawn {
    middle: DVec3,
    half_width: f64,
    covers: [f64; 2],
}

/// Pixels per metre at a place.
fn pixels(view: &TubeView, place: DVec3) -> f64 {
    let [_, y, w] = view.rows;
    let focal = y.length() / w.length() * view.size[1] / 2.0;
    focal / ((place - view.eye).dot(w) / w.length()).max(view.near)
}

/// A ring, widened as in the viewer's `tubes.wgsl`.
fn drawn(tubes: &Tubes, view: &TubeView, band: &Band, end: usize) -> Drawn {
    let (place, axes, radius) = band.ring(tubes, end);
    let (middle, [x, y], radius) =
        (tubes.tubes[band.tube() as usize].origin + place.as_dvec3(), axes.map(|axis| axis.as_dvec3()), f64::from(radius));
    let sides = band.sides()[end];
    let aside = x.cross(y).cross(view.eye - middle).normalize_or(x);
    let outline = |k: u32| {
        let (sin, cos) = (TAU * f64::from(k) / f64::from(sides)).sin_cos();
        aside.dot(cos * x + sin * y).abs()
    };
    // The shader uses eight corners for finer rings.
    let (a, b) = (aside.dot(x).abs(), aside.dot(y).abs());
    let wide = if sides > 4 { a.max(b).max((a + b) * FRAC_1_SQRT_2) } else { a.max(b) };
    let least = 0.5 / pixels(view, middle);
    let drawn = (least / wide).clamp(radius, radius * MOST);
    let half_width = drawn * (0..sides).map(outline).fold(0.0, f64::max);
    Drawn { middle, half_width, covers: [radius, drawn * wide] }
}

/// Drawn over true coverage of a tube, less 1, at a place of its curve with a radius, by the band there. `None` if the tube is
/// not thinner than a pixel.
pub(super) fn weight_error(tubes: &Tubes, view: &TubeView, band: &Band, (place, radius): (DVec3, f64)) -> Option<f64> {
    let half_width = radius * pixels(view, place);
    if half_width >= 0.5 {
        return None;
    }
    let [a, b] = [0, 1].map(|end| drawn(tubes, view, band, end));
    let chord = b.middle - a.middle;
    let share = ((place - a.middle).dot(chord) / chord.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    let between = |a: f64, b: f64| a + (b - a) * share;
    let drawn_pixels = between(a.half_width, b.half_width) * pixels(view, a.middle.lerp(b.middle, share));
    let [covered, outline] = [0, 1].map(|k| between(a.covers[k], b.covers[k]));
    Some((covered / outline).min(1.0) * drawn_pixels / half_width - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use enfilade_tubes::{Counts, Runs, SIDES, Selection, Shape, View, Wall};

    /// A straight pipe across the view has its exact coverage; a pipe of 1 mm covers a quarter of a pixel of 4 mm.
    #[test]
    fn straight_pipes_weigh_what_they_are() {
        let mut tubes = Tubes::default();
        let shape = Shape { radius: 5e-4, inner: 0.0, capped: true };
        let points = [DVec3::new(-1.0, 0.0, -1.0), DVec3::new(1.0, 0.0, -1.0)];
        tubes.line(&points, false, shape, 1e-6, &mut Counts::default()).unwrap();
        let view = TubeView { eye: DVec3::ZERO, rows: [DVec3::X, DVec3::Y, -DVec3::Z], near: 0.1, size: [500.0, 500.0] };
        let runs = Runs::new(&tubes, std::iter::once(0..1));
        let mut selection = Selection::default();
        let chooses = View::new(view.eye, view.rows, view.near, view.size, 0.5);
        selection.select(&tubes, &runs, &chooses, std::iter::once((0, 0..1)));
        let bands = (0..SIDES.len()).flat_map(|k| selection.bands(k)).filter(|band| band.wall() == Wall::Outer);
        let mut count = 0;
        for band in bands {
            let (ring, middle) = (drawn(&tubes, &view, band, 0), DVec3::new(0.0, 0.0, -1.0));
            assert!((ring.half_width - 2e-3).abs() < 1e-5, "{} m", ring.half_width);
            let weight = ring.covers[0] / ring.covers[1];
            assert!((weight - 0.25).abs() < 1e-3, "{weight}");
            let error = weight_error(&tubes, &view, band, (middle, 5e-4)).unwrap();
            assert!(error.abs() < 2e-3, "{error}");
            assert_eq!(weight_error(&tubes, &view, band, (middle, 2e-3)), None);
            count += 1;
        }
        assert_eq!(count, 1);
    }
}
