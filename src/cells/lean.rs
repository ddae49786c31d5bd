//! Tilted models: scans, and parts of georeferenced models, are off the vertical by about a degree. They are split upright.

use super::bsp::planes::opaque_structure;
use super::{Cell, CellGraph, Piece, Portal};
use crate::math::geom::{Aabb, Plane, newell};
use crate::scene::{Hints, Object, RoomHint, Scene};
use crate::types::note::Note;
use glam::{DMat3, DQuat, DVec3};
use std::collections::HashMap;

/// Largest tilt, radians (10 degrees). Larger: ramps and roofs count as floors. Smaller: unlevelled scans stay tilted.
const MOST: f64 = 0.175;
/// Smallest tilt, radians: a centimetre in 30 m. Larger: plans of large scans have no closed cell. Smaller: rounding counts as tilt.
const LEAST: f64 = 3e-4;
/// Largest angle between normals of one floor, radians. Larger: gentle ramps belong to it. Smaller: floors of noisy scans fall apart.
const SAME: f64 = 2e-3;
/// Smallest share of the nearly horizontal area with the floor's normal; less is ground or roofs.
const FLOORS: f64 = 0.5;
/// A model with floors of this accuracy is upright, radians: 0.1 mm in a metre. Larger: tilts of a tenth of a degree stay. Smaller: models
/// rounded to a millimetre count as tilted.
const STANDS: f64 = 1e-4;
/// A wall is perpendicular to the floor within this angle, radians.
const SQUARE: f64 = 2e-3;
/// Walls perpendicular to the tilted floor must have this many times the area of vertical walls that are not. Smaller: a ramp tilts an
/// upright house.
const MORE_WALLS: f64 = 2.0;

/// The rotation that turns a model upright, about its origin.
pub(crate) struct Lean(DMat3);

impl Lean {
    /// The tilt of a scene; `None` if it is upright, within the angle of `coplanar` metres over its width, or if floors and walls disagree.
    pub fn of(scene: &Scene, coplanar: f64) -> Option<Self> {
        let normals: Vec<DVec3> = opaque_structure(scene).map(|c| newell(&c.map(|p| p - c[0]))).collect();
        let up = floor_normal(&normals)?;
        let size = scene.bounds().size();
        let angle = up.angle_between(DVec3::Y);
        if angle <= LEAST || angle * size.x.max(size.z) <= coplanar {
            return None;
        }
        // Walls along the tilt are perpendicular to both floors, and so are all walls if the tilt is small.
        let is_square = |n: &DVec3, up: DVec3| n.dot(up).abs() <= SQUARE * n.length();
        let walls = |is: DVec3, is_not: DVec3| {
            let told = normals.iter().filter(|n| is_square(n, is) && !is_square(n, is_not));
            told.map(|n| n.length()).sum::<f64>()
        };
        let [leaning, standing] = [walls(up, DVec3::Y), walls(DVec3::Y, up)];
        let agrees = leaning >= MORE_WALLS * standing && (leaning > 0.0 || angle <= SQUARE);
        agrees.then(|| Self(DMat3::from_quat(DQuat::from_rotation_arc(up, DVec3::Y))))
    }

    /// The model upright.
    pub fn levelled(&self, scene: &Scene) -> Scene {
        let turn = |p: &DVec3| self.0 * *p;
        let around = |b: Aabb| {
            let corner =
                |i: usize| DVec3::new([b.min.x, b.max.x][i & 1], [b.min.y, b.max.y][i >> 1 & 1], [b.min.z, b.max.z][i >> 2]);
            Aabb::of((0..8).map(|i| self.0 * corner(i)))
        };
        let positions: Vec<DVec3> = scene.positions.iter().map(turn).collect();
        let object = |o: &Object| {
            let corners = scene.triangles[o.triangles.start as usize..o.triangles.end as usize].iter().flatten();
            let bounds = Aabb::of(corners.map(|&i| positions[i as usize]));
            Object { bounds, reach: o.reach.map(around), ..o.clone() }
        };
        let hints = &scene.hints;
        let room = |room: &RoomHint| {
            let surface = room.surface.iter().map(|t| t.each_ref().map(turn)).collect();
            RoomHint { surface, ..room.clone() }
        };
        let mut openings = hints.openings.clone();
        openings.iter_mut().flat_map(|o| &mut o.winding).for_each(|p| *p = turn(p));
        let objects = scene.objects.iter().map(object).collect();
        let rooms = hints.rooms.iter().map(room).collect();
        let hints = Hints { rooms, openings, ..hints.clone() };
        Scene { positions, objects, hints, ..scene.clone() }
    }

    /// A graph of the upright model, turned back into the tilted one. `eps`: see [`Piece::new`].
    pub fn back(&self, graph: CellGraph, eps: f64) -> CellGraph {
        let back = self.0.transpose();
        let degrees = self.0.y_axis.angle_between(DVec3::Y).to_degrees();
        // A rotation about the origin keeps distances from it.
        let plane = |plane: &Plane| Plane { n: back * plane.n, d: plane.d };
        let winding = |points: &[DVec3]| points.iter().map(|p| back * *p).collect::<Vec<_>>();
        let piece = |piece: &Piece| Piece::new(piece.planes.iter().map(plane).collect(), eps);
        let cell = |cell: Cell| Cell { pieces: cell.pieces.iter().filter_map(piece).collect(), ..cell };
        let portal = |portal: Portal| Portal { plane: plane(&portal.plane), winding: winding(&portal.winding), ..portal };
        let note =
            Note::taken(format!("the model is tilted by {degrees:.2} degrees; its rooms were found in an upright copy"));
        CellGraph {
            cells: graph.cells.into_iter().map(cell).collect(),
            portals: graph.portals.into_iter().map(portal).collect(),
            closed_holes: graph.closed_holes.iter().map(|hole| winding(hole)).collect(),
            notes: graph.notes.into_iter().chain([note]).collect(),
            ..graph
        }
    }
}

/// The upward normal of most of the nearly horizontal area; `None` if it has too small a share, or if much of the area is exactly
/// horizontal.
fn floor_normal(normals: &[DVec3]) -> Option<DVec3> {
    let level: Vec<(DVec3, f64)> = normals
        .iter()
        .map(|n| (n.normalize_or_zero() * if n.y < 0.0 { -1.0 } else { 1.0 }, n.length()))
        .filter(|(n, _)| n.y >= MOST.cos())
        .collect();
    let all: f64 = level.iter().map(|(_, area)| area).sum();
    let flat: f64 = level.iter().filter(|(n, _)| n.distance(DVec3::Y) <= STANDS).map(|(_, area)| area).sum();
    if flat >= FLOORS * all {
        return None;
    }
    let mut bins: HashMap<[i64; 2], f64> = HashMap::new();
    let bin = |n: DVec3| [n.x, n.z].map(|x| (x / SAME).round() as i64);
    for (n, area) in &level {
        *bins.entry(bin(*n)).or_default() += area;
    }
    let heaviest = bins.iter().max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(a.0)))?.0.map(|i| i as f64 * SAME);
    let mut up = DVec3::new(heaviest[0], (1.0 - heaviest[0].powi(2) - heaviest[1].powi(2)).sqrt(), heaviest[1]);
    let mut share = 0.0;
    // The mean of the normals near the heaviest, and of those near that mean.
    for _ in 0..2 {
        let near = level.iter().filter(|(n, _)| n.distance(up) <= SAME);
        let (sum, area) = near.fold((DVec3::ZERO, 0.0), |(sum, area), (n, a)| (sum + *n * *a, area + a));
        (up, share) = (sum.try_normalize()?, area / all);
    }
    (share >= FLOORS).then_some(up)
}
