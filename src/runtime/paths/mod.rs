//! The shortest way through portals that stand open: for sound, characters, rescue.
//!
//! A way leaves a cell through a portal of it, at any point of the portal's polygon, and is straight in between. So its length is exact where
//! cells are convex, and a lower bound of a walk around corners in cells that are not. Of all sequences of portals and all points in them the
//! shortest way is found: best first, by a lower bound of what each sequence can become.
//!
//! Based on: P. Hart, N. Nilsson and B. Raphael, *A formal basis for the heuristic determination of minimum cost paths*, 1968, over sequences
//! of portals. A sequence is bounded by the tight line through it to the goal (`tight`), and by a table of what remains (`ahead`).
//!
//! A shortest way enters no cell twice: what is between is no shorter than the straight line. And a sequence to a portal is given up if
//! another one that is known leads to each point of the portal in no more metres. What is known of it is its length to one point, from
//! which all others are reached straight, as the portal is convex; what the first one takes at least is linear over the portal, by its
//! proof, and the former is convex. So they are compared at the corners alone.

mod ahead;
mod barrier;
mod blocks;
mod facets;
mod search;
mod table;
mod tight;

use super::culler::Culler;
use super::doors::Doors;
use crate::DirectedPortal;
use glam::Vec3;
use search::Search;
use std::sync::Arc;

/// Finds shortest ways in a culler's cells. It keeps its memory, so that a way allocates nothing where none before was harder to find.
#[derive(Clone, Debug)]
pub struct Pathfinder {
    culler: Arc<Culler>,
    search: Search,
}

/// A shortest way, kept in its [`Pathfinder`] until the next one.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Path<'p> {
    /// Its length, metres.
    pub metres: f64,
    /// No way is shorter than this, metres: less than `metres` by at most 0.1 mm and a millionth, except where cells are so many and so open that
    /// the search is cut short.
    pub at_least: f64,
    /// Where it starts, where it passes each portal, and where it ends.
    pub points: &'p [Vec3],
    /// The portals that it passes, in order.
    pub portals: &'p [DirectedPortal],
}

impl Pathfinder {
    /// Prepares for ways through portals that are open in `passable`, as all but windows are in [`Doors::passable`]. Time grows with the
    /// square of the number of portals between rooms that are no dead ends, up to some 1,000; on all cores.
    ///
    /// # Panics
    ///
    /// If the doors are of a culler with another number of portals.
    pub fn new(culler: &Arc<Culler>, passable: &Doors) -> Self {
        passable.assert_of(culler);
        Self { culler: culler.clone(), search: Search::new(culler, passable) }
    }

    /// The shortest way between two points (metres, relative to the file's origin) through passable portals that are open in `doors`, too.
    /// `None`: a point is in no cell, or there is no way.
    ///
    /// # Panics
    ///
    /// If the doors are of a culler with another number of portals.
    pub fn find(&mut self, doors: &Doors, from: Vec3, to: Vec3) -> Option<Path<'_>> {
        let homes = [from, to].map(|p| self.culler.locate(p, &mut u32::MAX.clone()));
        let [starts, ends] = [homes[0].as_slice(), homes[1].as_slice()];
        let ends_at = [from.as_dvec3(), to.as_dvec3()];
        let at_least = self.search.find(&self.culler, doors, ends_at, [starts, ends])?;
        let Search { metres, points, passed, .. } = &self.search;
        Some(Path { metres: *metres, at_least, points, portals: passed })
    }
}
