//! Finds free space inside a building that is in no cell.
//!
//! Random walks start in a closed cell or in a room of the author. They go in a random direction to the first opaque surface,
//! then in another, and so on; each straight stretch gives one random point. A walk ends when it leaves the building. The share
//! of points in no cell estimates the space that the partition missed, such as a room without a cell.

use super::cells::Cells;
use super::sample::direction;
use super::triangles::{Tracer, crosses};
use enfilade::CellId;
use enfilade::math::geom::Aabb;
use enfilade::math::parallel;
use enfilade::math::random::Prng;
use enfilade::scene::Scene;
use glam::DVec3;
use serde::Serialize;
use std::collections::BTreeMap;

/// Stretches per walk.
const BOUNCES: usize = 8;
/// Walks per task.
const CHUNK: u64 = 512;
/// Maximum listed places.
const PLACES: usize = 10;

/// Free space inside that is in no cell.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct FreeSpace {
    /// Tested points, all inside: in a closed cell or in none.
    pub points: u64,
    /// Points in no cell.
    pub outside: u64,
    /// `outside / points`; 0 without points.
    pub share: f64,
    /// Places with most of them.
    pub places: Vec<Place>,
}

/// A place in no cell.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Place {
    /// One of the points, in the model's own coordinates, metres.
    pub at: DVec3,
    /// Points in no cell within about a metre (or a hundredth of the model's diagonal, if that is more).
    pub points: u64,
    /// The cell in which the walk started; `None`: in a room of the author.
    pub from_cell: Option<CellId>,
}

/// A point in no cell, and the cell in which its walk started.
type Lost = (DVec3, Option<CellId>);

/// Tests about `points` points.
pub(super) fn walks(scene: &Scene, cells: &Cells, tracer: &Tracer, points: u64, seed: u64) -> FreeSpace {
    let rooms: Vec<Room> = scene.hints.rooms.iter().filter(|r| !r.outside).map(|r| Room::new(&r.surface)).collect();
    let closed = cells.closed();
    if closed.is_empty() && rooms.is_empty() {
        return FreeSpace::default();
    }
    let count = points.div_ceil(BOUNCES as u64);
    let walk = |rng: &mut Prng, inside: &mut u64, lost: &mut Vec<Lost>| {
        let from_room = !rooms.is_empty() && (closed.is_empty() || rng.chance(0.5));
        let start = if from_room {
            rooms[rng.below(rooms.len())].point(rng).filter(|&p| !tracer.in_solid(p)).map(|p| (p, None))
        } else {
            let cell = closed[rng.below(closed.len())];
            cells.point(cell, rng).map(|p| (p, Some(cell)))
        };
        let Some((mut p, from)) = start else { return };
        for _ in 0..BOUNCES {
            let d = direction(rng);
            let end = cells.exit(p, d);
            let length = tracer.first_opaque(p, d, end).map_or(end, |h| h.0);
            let q = p + d * (length * rng.unit());
            match cells.near(q) {
                Some(cell) if cells.is_open(cell) => return,
                Some(_) => *inside += 1,
                // Passed through a crack or along a surface.
                None if !tracer.is_clear(p, q, None) => return,
                None => {
                    *inside += 1;
                    lost.push((q, from));
                }
            }
            p += d * (length - (4.0 * cells.tolerance()).min(0.5 * length));
        }
    };
    let chunks: Vec<(u64, Vec<Lost>)> = parallel::map_range(0..count.div_ceil(CHUNK) as usize, |chunk| {
        let chunk = chunk as u64;
        let rng = &mut Prng::new(seed ^ 0x77a1_c5f0, chunk);
        let (mut inside, mut lost) = (0, Vec::new());
        for _ in 0..CHUNK.min(count - chunk * CHUNK) {
            walk(rng, &mut inside, &mut lost);
        }
        (inside, lost)
    });
    let inside = chunks.iter().map(|c| c.0).sum::<u64>();
    let lost: Vec<Lost> = chunks.into_iter().flat_map(|c| c.1).collect();
    let share = if inside > 0 { lost.len() as f64 / inside as f64 } else { 0.0 };
    FreeSpace { points: inside, outside: lost.len() as u64, share, places: places(scene, &lost) }
}

/// The grid cubes with most points.
fn places(scene: &Scene, lost: &[Lost]) -> Vec<Place> {
    let size = (0.01 * scene.bounds().diagonal()).max(f64::MIN_POSITIVE);
    let mut cubes: BTreeMap<[i64; 3], (u64, Lost)> = BTreeMap::new();
    for &(p, from) in lost {
        let cube = (p / size).floor().to_array().map(|x| x as i64);
        cubes.entry(cube).or_insert((0, (p, from))).0 += 1;
    }
    let mut places: Vec<Place> =
        (cubes.into_values()).map(|(points, (p, from_cell))| Place { at: p + scene.origin, points, from_cell }).collect();
    places.sort_by_key(|p| std::cmp::Reverse(p.points));
    places.truncate(PLACES);
    places
}

/// A room of the author.
struct Room<'r> {
    surface: &'r [[DVec3; 3]],
    bounds: Aabb,
}

impl<'r> Room<'r> {
    fn new(surface: &'r [[DVec3; 3]]) -> Self {
        Self { surface, bounds: Aabb::of(surface.iter().flatten().copied()) }
    }

    /// A random point inside, uniform; `None` if a few tries fail.
    fn point(&self, rng: &mut Prng) -> Option<DVec3> {
        (0..16).find_map(|_| {
            let size = self.bounds.size();
            let p = self.bounds.min + size * DVec3::new(rng.unit(), rng.unit(), rng.unit());
            let crossings = self.surface.iter().filter(|t| crosses(p, DVec3::Y, t)).count();
            (crossings % 2 == 1).then_some(p)
        })
    }
}
