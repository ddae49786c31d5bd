//! Where to look: along the longest free line.

use crate::body::{Space, around};
use glam::DVec3;

/// Directions of lines.
const LINES: usize = 32;
/// Slopes of the lines above and below a view.
const SLANTS: [f64; 2] = [-0.2, 0.2];
/// Lines on each side of the middle of a view.
const BESIDE: usize = 2;
/// Lines of at least this share of the longest count as long; of them, the view with the most around wins. Less: views of walls. More: views
/// through a crack beside a wall.
const AS_LONG: f64 = 0.8;
/// Bonus of a view that has all furniture.
const FURNISHED: f64 = 0.25;

/// A view.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// A level unit vector.
    pub along: DVec3,
    /// How far it is clear, metres: the mean of its lines. 0 where nothing at all is met.
    pub depth: f64,
}

/// The best view from a point. A line that meets nothing shows nothing, so it doesn't count. `furniture`: where there is some.
pub fn view(space: &Space<'_>, eye: DVec3, furniture: &[DVec3]) -> View {
    let ways = around(LINES);
    let line = |way: DVec3| space.first(eye, way.normalize()).map_or(0.0, |touch| touch.t);
    let lines: Vec<f64> = ways.iter().map(|&way| line(way)).collect();
    // Through a slit, one line is long; those above and below it aren't.
    let upright = |(&way, level): (&DVec3, &f64)| {
        let slanted: f64 = SLANTS.iter().map(|&up| line(way + DVec3::Y * up)).sum();
        (level + slanted) / (1 + SLANTS.len()) as f64
    };
    let slices: Vec<f64> = ways.iter().zip(&lines).map(upright).collect();
    let longest = lines.iter().copied().fold(0.0, f64::max);
    let depth = |i: usize| {
        let beside = (0..=2 * BESIDE).map(|k| slices[(i + LINES + k - BESIDE) % LINES]);
        beside.sum::<f64>() / (2 * BESIDE + 1) as f64
    };
    let half = (std::f64::consts::TAU / LINES as f64 * (BESIDE as f64 + 0.5)).cos();
    let shown = |i: usize| {
        let is_shown = |p: &&DVec3| (**p - eye).with_y(0.0).normalize_or_zero().dot(ways[i]) >= half;
        furniture.iter().filter(is_shown).count() as f64 / furniture.len().max(1) as f64
    };
    let worth = |i: usize| depth(i) * (1.0 + FURNISHED * shown(i));
    let as_long = (0..LINES).rev().filter(|&i| lines[i] >= AS_LONG * longest);
    // Reversed, so that of equal ones the first is taken.
    let best = as_long.max_by(|&a, &b| worth(a).total_cmp(&worth(b))).unwrap_or(0);
    View { along: ways[best], depth: depth(best) }
}
