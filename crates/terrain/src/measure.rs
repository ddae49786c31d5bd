//! Measures the error and the cost of selections: flights over a ground, with samples compared to their drawn positions.

use super::grid::Key;
use super::select::{GroundScratch, GroundView, Limit, Patch};
use super::{Ground, drawn};
use enfilade::math::random::Prng;
use enfilade::runtime::{Camera, Rect};
use glam::{DVec2, DVec3};
use std::time::Instant;

/// Results of a limit over some views.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Measured {
    /// The limit.
    pub limit: Limit,
    /// Mean triangles per frame.
    pub triangles: f64,
    /// Mean seconds of a selection.
    pub seconds: f64,
    /// Greatest error that selections promised, pixels.
    pub told: f64,
    /// Error of the worst sample, pixels.
    pub greatest: f64,
    /// Mean error of samples, pixels.
    pub mean: f64,
    /// Number of tested samples, all on the screen.
    pub samples: u64,
}

/// Samples per frame.
const SAMPLES: usize = 2000;

/// Cameras over a ground with all tiles in memory: `frames` of them, `above` metres over it, from one side to the other, turning.
/// Low flights look nearly level. Metres from the ground's origin; 60 degrees high, 16 to 9.
pub fn flight(ground: &Ground, above: f64, frames: usize) -> Vec<Camera> {
    let header = ground.header();
    let [columns, rows] = header.grid.size();
    let [low, high] = [header.plan(0, 0), header.plan(columns - 1, rows - 1)].map(DVec2::from);
    let down = if above > LOW { DOWN } else { NEARLY_LEVEL };
    let of = |k: usize| {
        let t = (k as f64 + 0.5) / frames as f64;
        let at = low + (high - low) * (0.1 + 0.8 * DVec2::new(t, 0.5 + 0.4 * (SWAYS * t).sin()));
        let eye = DVec3::new(at.x, ground.height_at(at.x, at.y).unwrap_or(0.0) + above, at.y);
        let angle = TURNS * t;
        Camera::look_at(eye, eye + DVec3::new(angle.cos(), -down, angle.sin()), 60f64.to_radians(), 16.0 / 9.0)
    };
    (0..frames).map(of).collect()
}

/// Sway and turn of a flight, radians.
const SWAYS: f64 = 7.0;
const TURNS: f64 = 11.0;
/// Above this height, metres, it looks down more; metres down per metre ahead.
const LOW: f64 = 10.0;
const DOWN: f64 = 0.25;
const NEARLY_LEVEL: f64 = 0.05;

/// Selects with a limit from each camera, on a screen of `size` pixels, and measures random samples (by seed).
pub fn measure(ground: &Ground, cameras: &[Camera], size: [u32; 2], limit: Limit, seed: u64) -> Measured {
    let (mut scratch, mut random) = (GroundScratch::default(), Prng::new(seed, 0));
    let mut found = Measured { limit, triangles: 0.0, seconds: 0.0, told: 0.0, greatest: 0.0, mean: 0.0, samples: 0 };
    for &camera in cameras {
        let view = GroundView { camera, size, windows: &[Rect::FULL] };
        let start = Instant::now();
        ground.select(&view, limit, &mut scratch);
        found.seconds += start.elapsed().as_secs_f64() / cameras.len() as f64;
        found.triangles += scratch.triangles() as f64 / cameras.len() as f64;
        found.told = found.told.max(f64::from(scratch.worst()));
        for _ in 0..SAMPLES {
            let Some(pixels) = error(ground, &view, scratch.patches(), &mut random) else { continue };
            found.greatest = found.greatest.max(pixels);
            found.mean += pixels;
            found.samples += 1;
        }
    }
    found.mean /= (found.samples as f64).max(1.0);
    found
}

/// Pixels between a random sample and its drawn position; `None` off the screen, or for a void.
fn error(ground: &Ground, view: &GroundView<'_>, patches: &[Patch], random: &mut Prng) -> Option<f64> {
    let (header, grid) = (ground.header(), &ground.header().grid);
    let patch = patches.get(random.below(patches.len().max(1)))?;
    let last = grid.side() - 1;
    let within = |[from, to]: [u32; 2], random: &mut Prng| from + random.below((to - from) as usize + 1) as u32;
    let column = within([0, last].map(|i| grid.column(patch.key, i)), random);
    let row = within([0, last].map(|j| grid.row(patch.key, j)), random);
    let [x, z] = header.plan(column, row);
    let [place, shown] = [sample(ground, column, row)?, drawn_at(ground, patch, column, row)?].map(|h| DVec3::new(x, h, z));
    let half = DVec2::new(f64::from(view.size[0]), f64::from(view.size[1])) / 2.0;
    let [ex, ey, ew] = [view.camera.x, view.camera.y, view.camera.w].map(|row| row.as_dvec3());
    let at = |p: DVec3| {
        let p = p - view.camera.eye.as_dvec3();
        (ew.dot(p) > 0.0).then(|| DVec2::new(ex.dot(p), ey.dot(p)) / ew.dot(p))
    };
    let place = at(place).filter(|p| p.abs().cmple(DVec2::ONE).all())?;
    Some(((at(shown)? - place) * half).length())
}

/// The height of the raster's sample, from the finest tile.
fn sample(ground: &Ground, column: u32, row: u32) -> Option<f64> {
    let grid = &ground.header().grid;
    let cells = grid.side() - 1;
    let [columns, rows] = grid.size();
    // The last sample belongs to the last cell.
    let [c, r] = [column.min(columns - 2), row.min(rows - 2)];
    let key = Key { level: 0, x: c / cells, y: r / cells };
    let height = ground.sample(grid.tile(key)?, [column - key.x * cells, row - key.y * cells])?;
    Some(f64::from(height))
}

/// The height of a patch at one of the raster's samples.
fn drawn_at(ground: &Ground, patch: &Patch, column: u32, row: u32) -> Option<f64> {
    let grid = &ground.header().grid;
    let last = grid.side() - 1;
    let cell = |first: u32, at: u32| ((at - first) >> patch.key.level).min(last - 1);
    let (i, j) = (cell(grid.column(patch.key, 0), column), cell(grid.row(patch.key, 0), row));
    // Beside a coarser neighbour, triangles extend into the cells before and after.
    let around = |k: u32| k.saturating_sub(1)..=(k + 1).min(last - 1);
    let cells = around(j).flat_map(|j| around(i).map(move |i| (i, j)));
    let p = DVec2::new(f64::from(column), f64::from(row));
    for triangle in cells.flat_map(|(i, j)| drawn(i, j, grid.side(), patch.coarser)) {
        let at = triangle.map(|[i, j]| DVec2::new(f64::from(grid.column(patch.key, i)), f64::from(grid.row(patch.key, j))));
        let [a, b, c] = at;
        let whole = (b - a).perp_dot(c - a);
        let parts = [(b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)];
        if whole != 0.0 && parts.iter().all(|part| part * whole.signum() >= 0.0) {
            let heights = triangle.map(|sample| ground.sample(patch.tile, sample));
            if let [Some(a), Some(b), Some(c)] = heights {
                return Some([a, b, c].iter().zip(parts).map(|(&h, part)| f64::from(h) * part / whole).sum());
            }
        }
    }
    None
}
