//! How much more or less of a thin tube is drawn than there is, where it is drawn a pixel wide by its weight.
//!
//! Based on: Persson, *Phone-wire AA*, 2012: a wire is drawn no thinner than a pixel, by what it covers of it. What differs: rings have
//! corners, so the width that counts is that of their outline.

use super::tube_errors::TubeView;
use enfilade_tubes::{Band, Tubes};
use glam::DVec3;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// How much wider than they are thin tubes may be: the viewer's usual factor.
const MOST: f64 = 1e3;

/// A ring as it is drawn: its middle relative to the scene's origin, half of its outline's width, and what pixels interpolate: half of
/// the width that there is, and of what the shader takes for its outline; metres.
struct Drawn {
    middle: DVec3,
    half_width: f64,
    covers: [f64; 2],
}

/// Pixels of a metre, at the distance of a place.
fn pixels(view: &TubeView, place: DVec3) -> f64 {
    let [_, y, w] = view.rows;
    let focal = y.length() / w.length() * view.size[1] / 2.0;
    focal / ((place - view.eye).dot(w) / w.length()).max(view.near)
}

/// A ring as the viewer's `tubes.wgsl` widens it.
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
    // The shader takes the outline of eight corners where a ring has more.
    let (a, b) = (aside.dot(x).abs(), aside.dot(y).abs());
    let wide = if sides > 4 { a.max(b).max((a + b) * FRAC_1_SQRT_2) } else { a.max(b) };
    let least = 0.5 / pixels(view, middle);
    let drawn = (least / wide).clamp(radius, radius * MOST);
    let half_width = drawn * (0..sides).map(outline).fold(0.0, f64::max);
    Drawn { middle, half_width, covers: [radius, drawn * wide] }
}

/// What is drawn of a tube, over what there is, less 1: at a place of its curve, where it has a radius, by a band beside that place. `None`
/// where it isn't thinner than a pixel.
pub(super) fn weight_error(tubes: &Tubes, view: &TubeView, band: &Band, (place, radius): (DVec3, f64)) -> Option<f64> {
    let half_width = radius * pixels(view, place);
    if half_width >= 0.5 {
        return None;
    }
    let [a, b] = [0, 1].map(|end| drawn(tubes, view, band, end));
    let chord = b.middle - a.middle;
    let share = ((place - a.middle).dot(chord) / chord.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    let between = |a: f64, b: f64| a + (b - a) * share;
    let there = between(a.half_width, b.half_width) * pixels(view, a.middle.lerp(b.middle, share));
    let [there_is, outline] = [0, 1].map(|k| between(a.covers[k], b.covers[k]));
    Some((there_is / outline).min(1.0) * there / half_width - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use enfilade_tubes::{Counts, Runs, SIDES, Selection, Shape, View, Wall};

    /// Of a straight pipe, across the view, all is drawn; a pixel of 4 mm has a pipe of 1 mm a quarter.
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
