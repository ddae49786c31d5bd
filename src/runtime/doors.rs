//! Doors that open and shut, and one-way windows, without a new bake.
//!
//! Rows take every door as open, so they stay valid. The portal traversal does not enter shut portals: [`super::Mode::Portals`] and
//! [`super::Mode::PortalsAndPvs`] see less, the other modes stay the same.
//!
//! A leaf is near its portal and not exactly in it: in front of the portal's plane, behind it, or across it. So objects in the doorway,
//! within [`Culler::doorway`] of the plane on the far side, are visible through a shut portal, including the leaf. For an eye that near to
//! the opening the portal counts as open, because the leaf may be behind the eye.
//!
//! Shut means that nothing beyond the doorway is visible. A leaf with a slot under it, or ajar, is not shut: if it is set so, the picture
//! lacks the view through the slot.

use super::Culler;
use crate::math::geom::Aabb;
use crate::math::tolerance::DOORWAY;
use crate::{DirectedPortal, PortalId};

impl Culler {
    /// Opens or shuts a portal in both directions. Everything is open at first.
    ///
    /// # Panics
    ///
    /// If there is no such portal.
    pub fn set_open(&mut self, portal: PortalId, open: bool) {
        (0..2).for_each(|side| self.set_see_through(portal.directed(side), open));
    }

    /// Opens or shuts a portal in one direction: a mirrored window, a screen.
    ///
    /// # Panics
    ///
    /// If there is no such portal.
    pub fn set_see_through(&mut self, portal: DirectedPortal, see_through: bool) {
        assert!(portal.portal().index() < self.portal_count(), "portal {portal:?} of {}", self.portal_count());
        let (word, bit) = (&mut self.shut[portal.0 as usize / 64], 1 << (portal.0 % 64));
        *word = if see_through { *word & !bit } else { *word | bit };
    }

    /// Shuts the portals with a shut solid leaf in the model, and opens all others. Returns the number of shut ones. Portals with a gap
    /// beside the leaf stay open ([`crate::cells::PortalState::ajar`]).
    pub fn shut_as_found(&mut self) -> usize {
        self.shut.fill(0);
        for i in 0..self.found_shut.len() {
            self.set_open(self.found_shut[i], false);
        }
        self.found_shut.len()
    }

    /// Depth of a portal's doorway: largest distance of a leaf from its plane, metres.
    pub fn doorway(&self, portal: DirectedPortal) -> f32 {
        let corners = self.portal_corners.get(portal.portal().index());
        (DOORWAY * Aabb::of(corners.iter().map(|p| p.as_dvec3())).diagonal()) as f32
    }

    /// Whether a portal is open in a direction.
    #[inline]
    pub fn is_open(&self, portal: DirectedPortal) -> bool {
        self.shut[portal.0 as usize / 64] >> (portal.0 % 64) & 1 == 0
    }
}
