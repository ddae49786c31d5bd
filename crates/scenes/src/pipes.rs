//! Pipes: racks with elbows, risers and coils, as lines with a radius; modelled on the pipe scenes of studies on tubes.

use super::building::Building;
use super::facts::Facts;
use super::model::{Material, Model, Pipe};
use super::path::CameraPath;
use super::solid::{cuboid, turn};
use enfilade::math::random::Prng;
use enfilade::scene::Role;
use enfilade_tubes::{Counts, Shape, Tubes, usual_error};
use glam::DVec3;

/// Random stream of the kinds of bundles.
const PLACES: u64 = 1;
/// Edge of a bundle's square, metres.
const EDGE: f64 = 12.0;
/// Most sections of a coil.
const MOST_OF_COIL: usize = 20_000;
/// Points per turn of a coil.
const OF_TURN: u32 = 8;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Pipes with `sections` sections or a few more, on a square site.
pub(super) fn pipes(sections: usize, seed: u64) -> Building {
    let rng = &mut Prng::new(seed, PLACES);
    let mut bundles: Vec<Vec<Pipe>> = Vec::new();
    let mut count = 0;
    while count < sections {
        let bundle = match bundles.len() % 4 {
            0 | 2 => rack(rng),
            3 if sections - count > MOST_OF_COIL => coil(rng),
            _ => risers(rng),
        };
        count += bundle.iter().map(sections_of).sum::<usize>();
        bundles.push(bundle);
    }
    let across = (bundles.len() as f64).sqrt().ceil() as usize;
    let down = bundles.len().div_ceil(across);
    let mut model = Model::default();
    let [width, depth] = [across, down].map(|n| n as f64 * EDGE);
    model.add("ground", Role::Structure, Material::Ground, cuboid(v(0.0, -0.5, 0.0), v(width, 0.0, depth)));
    let mut pipes = 0;
    for (i, bundle) in bundles.into_iter().enumerate() {
        let at = v((i % across) as f64 * EDGE, 0.0, (i / across) as f64 * EDGE);
        for pipe in bundle {
            model.pipe(format!("pipe {pipes}"), at, Material::Metal, pipe);
            pipes += 1;
        }
    }
    // Along the first row, then up over the whole site.
    let way = [v(-6.0, 3.0, 6.0), v(width, 3.0, 6.0), v(width, 40.0, depth), v(-0.5 * width, 0.5 * width, -0.5 * depth)];
    let path = CameraPath::along(&way, way.windows(2).map(|p| p[0].distance(p[1])).sum::<f64>() / 600.0);
    let counted = vec![("sections", count), ("pipes", pipes)];
    Building { name: "pipes".into(), seed, counted, model, facts: Facts::default(), path }
}

/// Number of sections of a pipe's tube.
fn sections_of(pipe: &Pipe) -> usize {
    let mut tubes = Tubes::default();
    let shape = Shape { radius: pipe.radius, inner: 0.0, capped: true };
    let (error, mut counts) = (usual_error(pipe.radius), Counts::default());
    let made = match pipe.smooth {
        true => tubes.through(&pipe.points, false, shape, error, &mut counts),
        false => tubes.line(&pipe.points, false, shape, error, &mut counts),
    };
    made.map_or(0, |()| tubes.divided().sections.len())
}

/// Parallel pipes around two corners.
fn rack(rng: &mut Prng) -> Vec<Pipe> {
    let mut across = 0.5;
    let mut pipes = Vec::new();
    while across < 0.5 * EDGE - 1.0 {
        let radius = 0.025 * f64::from(rng.steps(1, 8, 1));
        across += radius;
        let y = 3.0 + f64::from(rng.steps(0, 2, 1));
        let turn = EDGE - 0.5 - across;
        let points = vec![v(0.0, y, across), v(turn, y, across), v(turn, y, EDGE - across), v(0.0, y, EDGE - across)];
        pipes.push(Pipe { radius, smooth: false, points });
        across += radius + 0.15;
    }
    pipes
}

/// Pipes that run along the ground and then up.
fn risers(rng: &mut Prng) -> Vec<Pipe> {
    let riser = |k: i32| {
        let radius = 0.05 * f64::from(rng.steps(1, 6, 1));
        let (z, x) = (1.0 + 1.6 * f64::from(k), 2.0 + f64::from(rng.steps(0, 7, 1)));
        let top = 6.0 + f64::from(rng.steps(0, 12, 1));
        let points = vec![v(0.0, 0.5, z), v(x, 0.5, z), v(x, top, z), v(x + 2.5, top, z)];
        Pipe { radius, smooth: false, points }
    };
    (0..7).map(riser).collect()
}

/// A coil, as in a heat exchanger.
fn coil(rng: &mut Prng) -> Vec<Pipe> {
    let (radius, turns) = (0.01 * f64::from(rng.steps(2, 5, 1)), rng.steps(20, 60, 1) as u32);
    let (bend, rise) = (0.2 * f64::from(rng.steps(3, 12, 1)), 3.0 * radius);
    let point = |k: u32| {
        let along = f64::from(k) / f64::from(OF_TURN);
        let (cos, sin) = turn(along.fract());
        v(0.5 * EDGE + bend * cos, 1.0 + rise * along, 0.5 * EDGE + bend * sin)
    };
    vec![Pipe { radius, smooth: true, points: (0..=turns * OF_TURN).map(point).collect() }]
}
