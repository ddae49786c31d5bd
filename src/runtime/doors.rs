//! Doors that open and shut, and windows that are seen through one way only, without a new bake.
//!
//! Rows take every door as open, so they stay right whatever is shut. What is shut here, no portal traversal goes through:
//! [`super::Mode::Portals`] and [`super::Mode::PortalsAndPvs`] see less, the other modes see as much as before.
//!
//! A leaf hangs near its portal and not in it: before the portal's plane, behind it, or across it. So what is in the doorway, within
//! [`Culler::doorway`] of the plane on the far side, is seen through a portal that is shut, the leaf among it; and to an eye that is itself
//! that near to the opening the portal counts as open, since the leaf may be behind it.
//!
//! Shut means that nothing beyond the doorway shows. A leaf with a slot under it, or ajar, is not shut: whoever says that it is gets a
//! picture without what shows through the slot.

use super::Culler;
use crate::geom::Aabb;
use crate::tolerance::DOORWAY;
use crate::{DirectedPortal, PortalId};

impl Culler {
    /// Opens or shuts a portal, both ways. Everything is open at first.
    ///
    /// # Panics
    ///
    /// Where there is no such portal.
    pub fn set_open(&mut self, portal: PortalId, open: bool) {
        (0..2).for_each(|side| self.set_see_through(portal.directed(side), open));
    }

    /// Lets a portal be seen through in one direction, or not: a mirrored window, a screen.
    ///
    /// # Panics
    ///
    /// Where there is no such portal.
    pub fn set_see_through(&mut self, portal: DirectedPortal, see_through: bool) {
        assert!(portal.portal().index() < self.portal_count(), "portal {portal:?} of {}", self.portal_count());
        let (word, bit) = (&mut self.shut[portal.0 as usize / 64], 1 << (portal.0 % 64));
        *word = if see_through { *word & !bit } else { *word | bit };
    }

    /// Shuts the portals in which the model has a solid leaf that is shut, and opens all others. Returns how many it shut. What shows beside
    /// its leaf stays open ([`crate::cells::PortalState::ajar`]).
    pub fn shut_as_found(&mut self) -> usize {
        self.shut.fill(0);
        for i in 0..self.found_shut.len() {
            self.set_open(self.found_shut[i], false);
        }
        self.found_shut.len()
    }

    /// How far from a portal's plane what stands in it may be, metres.
    pub fn doorway(&self, portal: DirectedPortal) -> f32 {
        let corners = self.portal_corners.get(portal.portal().index());
        (DOORWAY * Aabb::of(corners.iter().map(|p| p.as_dvec3())).diagonal()) as f32
    }

    /// Whether a portal is seen through in a direction.
    #[inline]
    pub fn is_open(&self, portal: DirectedPortal) -> bool {
        self.shut[portal.0 as usize / 64] >> (portal.0 % 64) & 1 == 0
    }
}
