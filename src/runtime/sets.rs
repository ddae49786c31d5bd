//! Sets independent of a camera: for lights, sounds, and loading.

use super::culler::{Culler, bit, target};
use super::movers::{Collected, Movers};
use super::scratch::Scratch;
use crate::math::bits;
use crate::{CellId, ObjectId};
use glam::{Vec3, Vec4};

/// Most planes of a volume.
pub const MOST_PLANES: usize = 64;

impl Culler {
    /// The cells that may be visible from a cell, including itself, ascending: its row. All cells, if the file has no rows or only sampled
    /// ones. Doors count as open.
    pub fn visible_from(&self, cell: CellId) -> impl Iterator<Item = CellId> + '_ {
        let row = self.cell_row(cell).filter(|_| self.cell_rows_prune);
        (0..self.cell_count()).filter(move |&c| row.is_none_or(|row| bit(row, c))).map(|c| CellId(c as u32))
    }

    /// The objects of a cell's row, ascending; all objects if the file has no rows.
    pub fn objects_from(&self, cell: CellId) -> impl Iterator<Item = ObjectId> + '_ {
        let row = self.object_row(cell);
        let all = row.is_none().then(|| 0..self.object_count()).into_iter().flatten();
        row.into_iter().flat_map(bits::ones).chain(all).map(|o| ObjectId(o as u32))
    }

    /// Fills [`Scratch::hops`] with the cells reachable from `from` through at most `hops` open portals.
    pub(super) fn hop(&self, from: CellId, hops: u32, scratch: &mut Scratch) {
        scratch.begin();
        scratch.hops.clear();
        scratch.cell_marks[from.index()] = scratch.frame;
        scratch.hops.push((from, 0));
        let mut next = 0;
        while let Some(&(cell, count)) = scratch.hops.get(next) {
            next += 1;
            if count == hops {
                break;
            }
            for &portal in self.cell_portals.get(cell.index()) {
                let target = target(self, portal);
                let mark = &mut scratch.cell_marks[target.index()];
                if scratch.doors.is_open(portal) && *mark != scratch.frame {
                    *mark = scratch.frame;
                    scratch.hops.push((target, count + 1));
                }
            }
        }
    }

    /// Fills a scratch with the objects of some cells' rows whose box meets a convex volume.
    pub(super) fn take_volume(&self, planes: &[Vec4], from: &[CellId], scratch: &mut Scratch) {
        assert!(planes.len() <= MOST_PLANES, "{} planes", planes.len());
        scratch.begin();
        self.join_rows(from, scratch);
        for word in 0..scratch.object_row.len() {
            for bit in bits::ones(&[scratch.object_row[word]]) {
                let object = word * 64 + bit;
                let (centre, half) = self.boxes.get(object);
                if !planes.iter().any(|plane| is_outside(*plane, centre, half)) {
                    scratch.objects.push(ObjectId(object as u32));
                }
            }
        }
    }
}

impl Culler {
    /// Collects the movers in cells of some cells' rows whose box meets a convex volume.
    pub(super) fn collect_volume(
        &self,
        planes: &[Vec4],
        from: &[CellId],
        scratch: &mut Scratch,
        movers: &Movers,
        out: &mut Collected,
    ) {
        assert!(planes.len() <= MOST_PLANES, "{} planes", planes.len());
        self.join_rows(from, scratch);
        out.ids.clear();
        let is_lit = |cell: CellId| self.may_enter(cell, scratch);
        out.add_in_volume(movers, self, is_lit, |centre, half| planes.iter().any(|p| is_outside(*p, centre, half)));
    }
}

/// True if a box is certainly in front of a plane: by more than the rounding error.
fn is_outside(plane: Vec4, centre: Vec3, half: Vec3) -> bool {
    let n = plane.truncate().as_dvec3();
    let (centre, half) = (centre.as_dvec3(), half.as_dvec3());
    let size = n.abs().dot(centre.abs() + half) + f64::from(plane.w.abs());
    n.dot(centre) - n.abs().dot(half) - f64::from(plane.w) > 8.0 * f64::EPSILON * size
}
