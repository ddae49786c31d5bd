//! How doors swing, as plans show it: the leaf where it is open, and the arc of its edge.

use super::hinge::Motion;
use super::{Door, Doors, leaves::Leaf};
use glam::{DVec2, DVec3, Vec3Swizzles};

/// Parts that an arc is drawn in.
const PARTS: u32 = 16;

/// A leaf that swings.
#[derive(Clone, PartialEq, Debug)]
pub struct Swing {
    /// Of its door, metres relative to the origin.
    pub heights: [f64; 2],
    /// In the plan (x, z): the hinge, the free edge where it is open, and on from there to where it is shut.
    pub line: Vec<DVec2>,
}

/// The leaves of the model that swing. A leaf that the viewer made has no known hinge.
pub fn swings(doors: &Doors) -> Vec<Swing> {
    let upright = doors.doors.iter().filter(|door| door.opening.is_upright);
    upright.flat_map(|door| door.leaves.iter().filter_map(|leaf| swing(door, leaf))).collect()
}

fn swing(door: &Door, leaf: &Leaf) -> Option<Swing> {
    let Motion::Swing { axis, shut, open, .. } = leaf.motion else { return None };
    if leaf.facets.iter().all(|f| f.of.is_none()) {
        return None;
    }
    let along = door.opening.along;
    let reach = leaf.facets.iter().flat_map(|f| f.corners).map(|p| along.dot(leaf.motion.place(p, 0.0) - axis));
    let reach = reach.max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    let edge = |share: f64| (axis + super::hinge::turned(along * reach, (open - shut) * share)).xz();
    let arc = (0..=PARTS).rev().map(|part| edge(f64::from(part) / f64::from(PARTS)));
    let bounds = door.opening.bounds();
    let heights = [bounds.min, bounds.max].map(|p: DVec3| p.y);
    Some(Swing { heights, line: std::iter::once(axis.xz()).chain(arc).collect() })
}

impl Swing {
    /// Whether a storey's plan cuts its door.
    pub fn is_on(&self, storey: &enfilade_measure::pages::storeys::Storey) -> bool {
        let [low, high] = self.heights;
        (low..high).contains(&(storey.floor + storey.cut))
    }
}
