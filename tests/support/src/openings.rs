//! How much of the portals of a mesh's bake is open, by the tree of the level that the mesh is the faces of.
//!
//! A level is sealed: nothing is seen through a wall of it, and a portal within the level has solid parts only where it is larger
//! than the opening that it stands for.

use crate::level_mesh::units;
use crate::random::Random;
use crate::truth::{Homes, Truth};
use enfilade::file::PvsFile;
use enfilade::geom::area;

/// Portals of a bake.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Openings {
    /// Cells that hold a point of the level which no other cell is near to. The others are behind the faces.
    pub cells: usize,
    /// Portals between two of these.
    pub portals: usize,
    /// Their area, square metres.
    pub area: f64,
    /// The part of it that is solid, as far as random points of each portal tell.
    pub solid: f64,
    /// Portals between one of these and another cell: they lead through a face, or to a cell that is too thin to hold a point.
    pub astray: usize,
}

impl Truth<'_> {
    /// Tests `count` random points of each portal.
    pub fn openings(&self, file: &PvsFile, count: usize, seed: u64) -> Openings {
        let (mut random, mut homes) = (Random::new(seed), Homes::new(file));
        let mut in_level = vec![false; file.cells.len() + 1];
        for (_, p) in &self.points {
            if let [cell] = homes.cells(*p)[..] {
                in_level[cell] = true;
            }
        }
        let mut found = Openings { cells: in_level.iter().filter(|&&is| is).count(), ..Openings::default() };
        for portal in &file.portals {
            match portal.cells.iter().filter(|cell| in_level[cell.index()]).count() {
                2 => found.portals += 1,
                1 => found.astray += 1,
                _ => {}
            }
            if portal.cells.iter().all(|cell| in_level[cell.index()]) {
                let winding: Vec<_> = portal.winding.iter().map(|p| p.as_dvec3()).collect();
                let is_solid = |_: &usize| {
                    let p = random.point_of(&winding) + file.origin;
                    !self.world.leaves[self.world.leaf_at(units(p))].open
                };
                let size = area(&winding);
                found.area += size;
                found.solid += size * (0..count).filter(is_solid).count() as f64 / count as f64;
            }
        }
        found
    }
}
