//! How much of the portals of a mesh's bake is open, by the tree of the level that the mesh is the faces of.
//!
//! A level is sealed: nothing is seen through a wall of it, and a portal within the level has solid parts only where it is larger
//! than the opening that it stands for.

use crate::level_mesh::units;
use crate::random::Random;
use crate::truth::{Homes, Truth};
use crate::world::World;
use enfilade::file::PvsFile;
use enfilade::math::geom::area;
use glam::DVec3;

/// Of the random points in the model's box that only one cell holds, a cell of the level has more open ones than this share of
/// solid ones.
const OPEN_SHARE: f64 = 0.05;

/// Portals of a bake.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Openings {
    /// Cells within the level.
    pub cells: usize,
    /// Cells behind its faces. Cells that no random point is in are in neither number.
    pub cells_behind: usize,
    /// Portals between two cells within the level.
    pub portals: usize,
    /// Their area, square metres.
    pub area: f64,
    /// The part of it that is solid, as far as random points of each portal tell.
    pub solid: f64,
    /// Portals between a cell within the level and one behind its faces: nothing is seen through them.
    pub astray: usize,
}

/// Where a cell is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Within,
    Behind,
    Unknown,
}

impl Truth<'_> {
    /// Tests `places` random points of the model's box, and `count` of each portal within the level.
    pub fn openings(&self, file: &PvsFile, places: usize, count: usize, seed: u64) -> Openings {
        let mut random = Random::new(seed);
        let is_open = |world: &World, p: DVec3| world.leaves[world.leaf_at(p)].open;
        let sides = self.sides(file, places, &mut random);
        let of = |side: Side| sides.iter().filter(|&&s| s == side).count();
        let mut found = Openings { cells: of(Side::Within), cells_behind: of(Side::Behind), ..Openings::default() };
        for portal in &file.portals {
            match portal.cells.map(|cell| sides[cell.index()]) {
                [Side::Within, Side::Behind] | [Side::Behind, Side::Within] => found.astray += 1,
                [Side::Within, Side::Within] => {
                    let winding: Vec<DVec3> = portal.winding.iter().map(|p| p.as_dvec3()).collect();
                    let mut point = || units(random.point_of(&winding) + file.origin);
                    let solid = (0..count).filter(|_| !is_open(self.world, point())).count();
                    found.portals += 1;
                    found.area += area(&winding);
                    found.solid += area(&winding) * solid as f64 / count as f64;
                }
                _ => {}
            }
        }
        found
    }

    fn sides(&self, file: &PvsFile, places: usize, random: &mut Random) -> Vec<Side> {
        let (mut homes, bounds, origin) = (Homes::new(file), self.mesh.scene.bounds(), self.mesh.scene.origin);
        // By cell: points that are solid, and points that are open.
        let mut points = vec![[0u64; 2]; file.cells.len() + 1];
        for _ in 0..places {
            let p = DVec3::from_array([0, 1, 2].map(|axis| random.real(bounds.min[axis], bounds.max[axis])));
            let p = units(p + origin);
            if let [cell] = homes.cells(p)[..] {
                points[cell][usize::from(self.world.leaves[self.world.leaf_at(p)].open)] += 1;
            }
        }
        let side = |&[solid, open]: &[u64; 2]| match (solid, open) {
            (0, 0) => Side::Unknown,
            _ if open as f64 > OPEN_SHARE * solid as f64 => Side::Within,
            _ => Side::Behind,
        };
        points[..file.cells.len()].iter().map(side).collect()
    }
}
