//! Displacements of Source: a face of four corners, as a grid whose vertices are moved.
//!
//! The grid begins at the corner nearest to the displacement's start. Its squares are split so that diagonals meet in every second
//! vertex. Beside a coarser displacement some vertices are not drawn; such a displacement is not exact.

use super::error::{BspError, entry};
use super::faces::{Faces, Shape, is_near};
use super::file::LevelFile;
use super::layout::{Displacement, Lump};
use super::record::{Records, u32};
use crate::FARTHEST;
use glam::DVec3;

/// Greatest power of a grid.
const MOST_POWER: i64 = 4;

/// A displacement, and the vertices of all.
struct Grid {
    start: DVec3,
    first: usize,
    power: i64,
    /// Whether all of its vertices are drawn.
    is_whole: bool,
}

/// The displacements of a level.
pub(super) struct Displacements {
    grids: Vec<Grid>,
    /// How vertices are moved.
    moved: Vec<DVec3>,
    /// Vertices of the displacements so far.
    taken: usize,
}

impl Displacements {
    pub fn read(file: &LevelFile, record: Displacement) -> Result<Self, BspError> {
        let [infos, vertices] = [Lump::Displacements, Lump::DisplacementVertices].map(|lump| file.lump(lump));
        let (infos, vertices) = (infos?, vertices?);
        let infos = file.records(Lump::Displacements, &infos, record.size)?;
        let vertices = file.records(Lump::DisplacementVertices, &vertices, record.vertex)?;
        let moved = (0..vertices.len()).map(|v| vertices.point(v, 0) * vertices.float(v, 12)).collect();
        let grids = (0..infos.len()).map(|i| grid(&infos, i, &record)).collect();
        Ok(Self { grids, moved, taken: 0 })
    }

    /// Makes a displacement of a face; `faces_of`: the lump of the faces.
    pub fn displace(&mut self, faces: &mut Faces, faces_of: Lump, face: usize, number: usize) -> Result<(), BspError> {
        let fault = |what: String| entry(Lump::Displacements, number, what);
        let Some(grid) = self.grids.get(number) else {
            return Err(entry(faces_of, face, format!("its displacement {number} doesn't exist")));
        };
        let &[a, b, c, d] = faces.faces[face].corners() else {
            let count = faces.faces[face].corners().len();
            return Err(entry(faces_of, face, format!("has a displacement and {count} corners, not 4")));
        };
        if !(0..=MOST_POWER).contains(&grid.power) {
            return Err(fault(format!("its power is {}, not 0 to {MOST_POWER}", grid.power)));
        }
        let side = (1 << grid.power) + 1;
        self.taken += side * side;
        let moved = grid.first.checked_add(side * side).and_then(|end| self.moved.get(grid.first..end));
        let moved = moved.filter(|_| self.taken <= self.moved.len()).ok_or_else(|| {
            fault(format!("goes beyond the {} displacement vertices; each belongs to one face", self.moved.len()))
        })?;
        // As the file has them: clockwise.
        let mut corners = [d, c, b, a].map(|v| faces.vertices[v as usize]);
        let from_start = |k: &usize| corners[*k].distance_squared(grid.start);
        let nearest = (0..4).min_by(|k, l| from_start(k).total_cmp(&from_start(l))).unwrap_or_default();
        corners.rotate_left(nearest);
        let vertices: Vec<DVec3> = flat(corners, side).zip(moved).map(|(p, moved)| p + *moved).collect();
        if !vertices.iter().all(is_near) {
            return Err(fault(format!("is not within {FARTHEST:e} of the origin")));
        }
        faces.faces[face].shape = Shape::Mesh(triangles(side, faces.vertices.len() as u32));
        faces.faces[face].is_exact = grid.is_whole;
        faces.vertices.extend(vertices);
        Ok(())
    }
}

fn grid(infos: &Records<'_>, i: usize, record: &Displacement) -> Grid {
    let power = infos.int(i, record.power);
    let count = ((1 << power.clamp(0, MOST_POWER)) + 1usize).pow(2);
    let is_drawn = |v: usize| infos.int(i, u32(record.drawn + 4 * (v / 32))) >> (v % 32) & 1 == 1;
    Grid { start: infos.point(i, 0), first: infos.index(i, record.first), power, is_whole: (0..count).all(is_drawn) }
}

/// The grid over four corners, rows from the first two to the last two.
fn flat([a, b, c, d]: [DVec3; 4], side: usize) -> impl Iterator<Item = DVec3> {
    let part = move |k: usize| k as f64 / (side - 1) as f64;
    let row = move |i: usize| (a.lerp(b, part(i)), d.lerp(c, part(i)));
    (0..side * side).map(move |v| {
        let (from, to) = row(v / side);
        from.lerp(to, part(v % side))
    })
}

/// The triangles of a grid whose first vertex is `first`, counter-clockwise.
fn triangles(side: usize, first: u32) -> Vec<[u32; 3]> {
    let squares = (0..side - 1).flat_map(|i| (0..side - 1).map(move |j| i * side + j));
    let of_square = |at: usize| {
        let [a, b, c, d] = [at, at + side, at + side + 1, at + 1].map(|v| first + v as u32);
        // A side has an odd number of vertices, so squares of one kind meet in their corners only.
        if at.is_multiple_of(2) { [[a, c, b], [a, d, c]] } else { [[a, d, b], [d, c, b]] }
    };
    squares.flat_map(of_square).collect()
}
