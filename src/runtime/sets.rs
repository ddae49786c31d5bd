//! Sets independent of a camera: for lights, sounds, and loading.

use super::Culler;
use super::scratch::Scratch;
use crate::math::bits;
use crate::{CellId, ObjectId};
use glam::{Vec3, Vec4};

/// Most planes of a volume.
pub const MOST_PLANES: usize = 64;

impl Culler {
    /// The cell of a point (metres, relative to the file's origin); on a border, the one with the point deepest inside.
    pub fn cell_of(&self, p: Vec3, scratch: &mut Scratch) -> Option<CellId> {
        self.locate(p, scratch).as_slice().first().copied()
    }

    /// The cells that may be visible from a cell, including itself, ascending: its row. All cells, if the file has no rows or only sampled
    /// ones. Doors count as open.
    pub fn visible_from(&self, cell: CellId) -> impl Iterator<Item = CellId> + '_ {
        let row = self.cell_rows.as_ref().filter(|_| self.cell_rows_prune).map(|rows| rows.row(cell.index()));
        (0..self.cell_count()).filter(move |&c| row.is_none_or(|row| super::culler::bit(row, c))).map(|c| CellId(c as u32))
    }

    /// The objects of a cell's row, ascending; all objects if the file has no rows.
    pub fn objects_from(&self, cell: CellId) -> impl Iterator<Item = ObjectId> + '_ {
        let row = self.object_rows.as_ref().map(|rows| rows.row(cell.index()));
        let all = row.is_none().then(|| 0..self.object_count()).into_iter().flatten();
        row.into_iter().flat_map(bits::ones).chain(all).map(|o| ObjectId(o as u32))
    }

    /// The cells reachable from `from` through at most `hops` open portals, independent of visibility: for sounds and for loading. Ordered
    /// by the number of portals, which is part of the result; `from` itself is first.
    pub fn within_hops<'s>(&self, from: CellId, hops: u32, scratch: &'s mut Scratch) -> &'s [(CellId, u32)] {
        scratch.begin(self);
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
                let target = super::culler::target(self, portal);
                let mark = &mut scratch.cell_marks[target.index()];
                if self.is_open(portal) && *mark != scratch.frame {
                    *mark = scratch.frame;
                    scratch.hops.push((target, count + 1));
                }
            }
        }
        &scratch.hops
    }

    /// Objects whose box intersects a convex volume: `planes` are `(n, d)` with `n . p <= d` inside, metres relative to the file's origin,
    /// with normals of any length except zero. With `from`, only objects of those cells' rows: a light's frustum extended to the camera's
    /// view contains all shadow casters, and objects hidden from the lit cells cast no visible shadow. Ascending.
    ///
    /// # Panics
    ///
    /// With more than [`MOST_PLANES`] planes.
    pub fn in_volume<'s>(&self, planes: &[Vec4], from: Option<&[CellId]>, scratch: &'s mut Scratch) -> &'s [ObjectId] {
        assert!(planes.len() <= MOST_PLANES, "{} planes", planes.len());
        scratch.begin(self);
        self.join_rows(from.unwrap_or(&[]), scratch);
        for word in 0..scratch.object_row.len() {
            for bit in bits::ones(&[scratch.object_row[word]]) {
                let object = word * 64 + bit;
                let (centre, half) = self.boxes.get(object);
                if !planes.iter().any(|plane| is_outside(*plane, centre, half)) {
                    scratch.objects.push(ObjectId(object as u32));
                }
            }
        }
        &scratch.objects
    }
}

/// True if a box is certainly in front of a plane: by more than the rounding error.
fn is_outside(plane: Vec4, centre: Vec3, half: Vec3) -> bool {
    let n = plane.truncate().as_dvec3();
    let (centre, half) = (centre.as_dvec3(), half.as_dvec3());
    let size = n.abs().dot(centre.abs() + half) + f64::from(plane.w.abs());
    n.dot(centre) - n.abs().dot(half) - f64::from(plane.w) > 8.0 * f64::EPSILON * size
}
