//! The path as a polyline, and the frames along it.

use glam::{DVec2, DVec3};

/// A path shorter than this, metres, has no direction.
const LEAST_STEP: f64 = 1e-3;

/// Points nearer than this, metres, coincide.
const SAME_PLACE: f64 = 1e-6;

/// Maximum frames of a tour; a file with more cells has some of them left out, evenly.
const MOST_FRAMES: usize = 240;
/// Maximum views from the only places of a path.
const LOOKS: usize = 96;
/// Least distance between frames, metres.
const STEP: f64 = 0.25;

/// A polyline in separate legs.
#[derive(Default)]
pub struct Way {
    pub legs: Vec<Vec<DVec3>>,
    /// Points that must have a frame: leg and index.
    kept: Vec<(usize, usize)>,
}

impl Way {
    /// Begins a leg.
    pub fn jump(&mut self, p: DVec3) {
        self.legs.push(Vec::new());
        self.keep(p);
    }

    /// The end so far.
    pub fn last(&self) -> Option<DVec3> {
        self.legs.last()?.last().copied()
    }

    /// Goes on along points.
    pub fn points(&mut self, points: &[DVec3]) {
        let leg = self.legs.last_mut().expect("a way starts with a jump");
        for &p in points {
            if leg.last().is_none_or(|&last| last.distance(p) > SAME_PLACE) {
                leg.push(p);
            }
        }
    }

    /// Goes on to a point that must have a frame.
    pub fn keep(&mut self, p: DVec3) {
        self.points(&[p]);
        let leg = self.legs.len() - 1;
        self.kept.push((leg, self.legs[leg].len() - 1));
    }

    /// Drops the way back from the last cell of each leg.
    pub fn end_in_last_cells(&mut self) {
        for (leg, points) in self.legs.iter_mut().enumerate() {
            let last = self.kept.iter().filter(|k| k.0 == leg).map(|k| k.1).max().unwrap_or(0);
            points.truncate(last + 1);
        }
    }

    /// Eyes and directions of length 1.
    pub fn frames(mut self) -> Vec<(DVec3, DVec3)> {
        self.end_in_last_cells();
        let along: Vec<Vec<f64>> = self.legs.iter().map(|leg| lengths(leg)).collect();
        let total: f64 = along.iter().filter_map(|a| a.last()).sum();
        let every = self.kept.len().div_ceil(MOST_FRAMES).max(1);
        let kept: Vec<(usize, usize)> = self.kept.iter().copied().step_by(every).collect();
        let spare = (MOST_FRAMES - kept.len()) as f64;
        let step = if spare >= 1.0 { (total / spare).max(STEP) } else { f64::INFINITY };
        let stands = along.iter().all(|along| along.len() == 1);
        let mut frames = Vec::new();
        for (i, leg) in self.legs.iter().enumerate() {
            let stops: Vec<f64> = kept.iter().filter(|k| k.0 == i).map(|k| along[i][k.1]).collect();
            let end = along[i].last().copied().unwrap_or(0.0);
            if end == 0.0 {
                // One point: look around, starting in different directions, so that every fourth frame still covers all of them.
                let around = if stands { LOOKS / self.legs.len() } else { 0 }.max(stops.len());
                let first = crate::walkthrough::golden_turn(i);
                frames.extend((0..around).map(|turn| {
                    let (sin, cos) = ((turn as f64 / around as f64 + first) * std::f64::consts::TAU).sin_cos();
                    (leg[0], DVec3::new(cos, 0.0, sin))
                }));
                continue;
            }
            // Evenly between stops.
            for (s, &from) in stops.iter().enumerate() {
                let to = stops.get(s + 1).copied().unwrap_or(end);
                let between = ((to - from) / step).floor() as usize;
                frames.extend((0..=between).map(|k| {
                    let s = from + (to - from) * k as f64 / (between + 1) as f64;
                    (at(leg, &along[i], s), direction(leg, &along[i], s))
                }));
            }
        }
        frames
    }
}

/// Distance of each point along a leg, metres.
pub fn lengths(leg: &[DVec3]) -> Vec<f64> {
    let mut sum = 0.0;
    let steps = leg.windows(2).map(|w| w[0].distance(w[1]));
    std::iter::once(0.0)
        .chain(steps.map(|d| {
            sum += d;
            sum
        }))
        .collect()
}

/// The point of a leg at a distance.
pub fn at(leg: &[DVec3], along: &[f64], s: f64) -> DVec3 {
    let i = along.partition_point(|&l| l <= s).clamp(1, leg.len() - 1);
    let t = ((s - along[i - 1]) / (along[i] - along[i - 1])).clamp(0.0, 1.0);
    leg[i - 1].lerp(leg[i], t)
}

/// Looks a little ahead, so that turns begin before corners, and not far up or down.
pub fn direction(leg: &[DVec3], along: &[f64], s: f64) -> DVec3 {
    let end = along.last().copied().unwrap_or(0.0);
    let ahead = [0.5, 1.0, 2.0, 3.0].map(|d| at(leg, along, (s + d).min(end))).iter().sum::<DVec3>() / 4.0;
    let mut v = ahead - at(leg, along, s);
    if v.length() < LEAST_STEP {
        // At the end: the direction of arrival.
        v = at(leg, along, end) - at(leg, along, (end - 1.0).max(0.0));
    }
    let flat = DVec2::new(v.x, v.z).length();
    v.y = v.y.clamp(-0.5 * flat - 1e-3, 0.5 * flat + 1e-3);
    v.normalize_or(DVec3::X)
}
