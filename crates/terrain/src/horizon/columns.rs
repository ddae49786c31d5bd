//! The horizon in the pictures around the eye: for each column, a slope that lines of samples raise.

use super::holes::{BLOCK, MOST, MOST_BLOCKS, NOWHERE, has_voids, height, tops_of_holes};
use super::line::{Line, Seam};
use super::picture::{COLUMNS, FACES, Face, Footprint, Part, ROUNDING, direction, sides};
use crate::{Ground, GroundView, Patch};
use glam::DVec3;

/// The line of a row of blocks: even, and not on the tile's border, since stitching moves samples on it and odd ones beside it.
const LINE: usize = 4;

/// By picture and column.
pub(super) struct Columns {
    /// Rays below this slope have met ground. Infinite outside the view.
    slopes: Vec<f32>,
    /// Known slopes of parts of columns.
    seams: Vec<Seam>,
    /// Whether rays there may be below the ground.
    is_closed: Vec<bool>,
}

/// Result for a footprint; of several, the greatest counts.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum Found {
    /// Outside the view, or not tested.
    Beside,
    /// Nearer ground hides all of it that is in view.
    Hidden,
    /// It may show.
    Shows,
}

impl Columns {
    /// Without any horizon.
    pub(super) fn new() -> Self {
        Self {
            slopes: vec![f32::NEG_INFINITY; FACES.len() * COLUMNS],
            seams: vec![Seam::NONE; FACES.len() * COLUMNS],
            is_closed: vec![false; FACES.len() * COLUMNS],
        }
    }

    /// Begins a frame.
    pub(super) fn begin(&mut self, view: &GroundView<'_>) {
        let sides = sides(view);
        for (k, slope) in self.slopes.iter_mut().enumerate() {
            let borders = [0, 1].map(|end| direction(k / COLUMNS, k % COLUMNS + end));
            let is_beside = sides.iter().any(|side| borders.iter().all(|&border| side.dot(border) < -ROUNDING));
            *slope = if is_beside { f32::INFINITY } else { f32::NEG_INFINITY };
        }
        self.seams.fill(Seam::NONE);
        self.is_closed.fill(false);
    }

    /// Tests a tile's footprint against the horizon.
    pub(super) fn judge(&self, of: &Footprint) -> Found {
        judge(of, |part| least(&self.slopes[part.first..=part.last]))
    }

    /// The same for a piece of an object: the horizon beside it may be incomplete, so columns count only where it covers them.
    pub(super) fn judge_piece(&self, of: &Footprint) -> Found {
        judge(of, |part| {
            let begin = |column: usize| (column % COLUMNS) as f64;
            let [from, to] = part.places;
            let at = |column: usize| {
                let within = [from.max(begin(column)), to.min(begin(column) + 1.0)];
                self.slopes[column].max(self.seams[column].between(within))
            };
            // It covers the columns between its first and its last one.
            let inner = self.slopes.get(part.first + 1..part.last).map_or(f32::INFINITY, least);
            inner.min(at(part.first)).min(at(part.last))
        })
    }

    /// Marks columns behind a footprint, where rays may be below the ground.
    pub(super) fn close(&mut self, of: &Footprint, face: usize) {
        let Some(part) = of.seen_from(face) else { return };
        for column in part.first..=part.last {
            self.is_closed[column] |= self.slopes[column] < part.slope;
        }
    }

    /// Raises the horizon by lines of a patch's samples, and closes it behind voids: by rows of blocks, near ones first.
    pub(super) fn raise(&mut self, ground: &Ground, patch: &Patch, eye: DVec3) {
        let header = ground.header();
        let Some(words) = ground.slot(patch.tile).map(|slot| ground.words(slot)) else {
            // It is not drawn.
            self.is_closed.fill(true);
            return;
        };
        let side = header.grid.side() as usize;
        let mut from_eye = [[0.0; MOST]; 2];
        let [from_eye_x, from_eye_z] = &mut from_eye;
        for ((to_x, to_z), k) in from_eye_x.iter_mut().zip(from_eye_z).zip(0..header.grid.side()) {
            let [x, z] = header.plan(header.grid.column(patch.key, k), header.grid.row(patch.key, k));
            (*to_x, *to_z) = (x - eye.x, z - eye.z);
        }
        let has_voids = has_voids(header, patch.key, &ground.tiles()[patch.tile as usize]);
        let tops = has_voids.then(|| tops_of_holes(header, words));
        for (face, &Face { axis, sign }) in FACES.iter().enumerate() {
            let (depths, along) = (&from_eye[axis], &from_eye[1 - axis][..side]);
            let farthest = (sign * depths[0]).max(sign * depths[side - 1]);
            // A point farther to the side than away is on another picture.
            let aside = along[0].max(-along[side - 1]).max(0.0);
            if aside >= farthest {
                continue;
            }
            let steps = if axis == 0 { [1, side] } else { [side, 1] };
            let rows = (side - 1) / BLOCK;
            for row in 0..rows {
                let row = if sign > 0.0 { row } else { rows - 1 - row };
                if let Some(tops) = &tops {
                    self.close_blocks(tops, &from_eye, side, eye.y, (face, row));
                }
                let k = row * BLOCK + LINE;
                let depth = sign * depths[k];
                if depth > aside {
                    let mut heights = [0.0; MOST];
                    for (m, to) in heights[..side].iter_mut().enumerate() {
                        *to = height(header, words, k * steps[0] + m * steps[1]).map_or(NOWHERE, |height| height - eye.y);
                    }
                    let columns = face * COLUMNS..(face + 1) * COLUMNS;
                    let line = Line { depth, along, heights: &heights[..side] };
                    line.raise(
                        &mut self.slopes[columns.clone()],
                        &mut self.seams[columns.clone()],
                        &self.is_closed[columns],
                    );
                }
            }
        }
    }

    /// Closes a picture behind the blocks with voids in a row of blocks.
    fn close_blocks(
        &mut self,
        tops: &[[f64; MOST_BLOCKS]; MOST_BLOCKS],
        from_eye: &[[f64; MOST]; 2],
        side: usize,
        eye: f64,
        (face, row): (usize, usize),
    ) {
        for column in 0..(side - 1) / BLOCK {
            let [i, j] = if FACES[face].axis == 0 { [row, column] } else { [column, row] };
            if tops[j][i] > NOWHERE {
                let at = |end: usize| [from_eye[0][(i + end) * BLOCK], from_eye[1][(j + end) * BLOCK]];
                let top = tops[j][i] - eye;
                self.close(&Footprint { low: at(0), high: at(1), top, rounding: [[ROUNDING; 2]; 2] }, face);
            }
        }
    }
}

/// Compares a footprint with the least slope of each of its parts.
fn judge(of: &Footprint, least: impl Fn(&Part) -> f32) -> Found {
    let mut found = Found::Beside;
    for part in (0..FACES.len()).filter_map(|face| of.seen_from(face)) {
        let least = least(&part);
        if part.slope > least {
            return Found::Shows;
        }
        if least < f32::INFINITY {
            found = Found::Hidden;
        }
    }
    found
}

fn least(slopes: &[f32]) -> f32 {
    slopes.iter().copied().fold(f32::INFINITY, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{SIDES, drawn};
    use std::collections::HashSet;

    /// Lines that raise the horizon are drawn, with any coarser neighbours, and triangles beside voids stay within a block.
    #[test]
    fn lines_are_edges_of_what_is_drawn_and_triangles_stay_in_their_block() {
        for side in SIDES {
            for coarser in 0..16u8 {
                let mut edges = HashSet::new();
                for (i, j) in (0..side - 1).flat_map(|j| (0..side - 1).map(move |i| (i, j))) {
                    let within = |k: u32, cell: u32| {
                        k / BLOCK as u32 * BLOCK as u32 <= cell && cell <= (k / BLOCK as u32 + 1) * BLOCK as u32
                    };
                    for [a, b, c] in drawn(i, j, side, coarser) {
                        assert!(
                            [a, b, c].iter().all(|&[x, y]| within(i, x) && within(j, y)),
                            "{coarser:04b}: cell {i}, {j}"
                        );
                        edges.extend([[a, b], [b, a], [b, c], [c, b], [c, a], [a, c]]);
                    }
                }
                for k in (LINE as u32..side - 1).step_by(BLOCK) {
                    for m in 0..side - 1 {
                        assert!(edges.contains(&[[k, m], [k, m + 1]]), "{coarser:04b}: column {k}, sample {m}");
                        assert!(edges.contains(&[[m, k], [m + 1, k]]), "{coarser:04b}: row {k}, sample {m}");
                    }
                }
            }
        }
        assert!(SIDES.iter().all(|side| ((side - 1) as usize).is_multiple_of(BLOCK) && *side as usize <= MOST));
    }
}
