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
use crate::math::bits::ones;
use crate::math::geom::Aabb;
use crate::math::tolerance::DOORWAY;
use crate::{DirectedPortal, PortalId};

/// Which portals of a culler are shut. A value of its own: each view has one, and a world keeps as many as it has states. A copy takes a bit
/// a direction of a portal.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Doors {
    portals: usize,
    /// Directed portals that are shut, as bits.
    pub(super) shut: Vec<u64>,
}

impl Doors {
    /// All portals open.
    pub fn open(culler: &Culler) -> Self {
        let portals = culler.portal_count();
        Self { portals, shut: vec![0; (2 * portals).div_ceil(64)] }
    }

    /// Portals with a shut solid leaf in the model are shut, all others open. Portals with a gap beside the leaf are open
    /// ([`crate::file::PortalState::ajar`]).
    pub fn as_found(culler: &Culler) -> Self {
        let mut doors = Self::open(culler);
        culler.found_shut.iter().for_each(|&portal| doors.set_open(portal, false));
        doors
    }

    /// What a body passes: all portals are open but windows, which are shut.
    pub fn passable(culler: &Culler) -> Self {
        let mut doors = Self::open(culler);
        culler.windows.iter().for_each(|&portal| doors.set_open(portal, false));
        doors
    }

    /// Opens or shuts a portal in both directions.
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
        assert!(portal.portal().index() < self.portals, "portal {portal:?} of {}", self.portals);
        let (word, bit) = (&mut self.shut[portal.0 as usize / 64], 1 << (portal.0 % 64));
        *word = if see_through { *word & !bit } else { *word | bit };
    }

    /// Whether a portal is open in a direction.
    ///
    /// # Panics
    ///
    /// If there is no such portal.
    #[inline]
    pub fn is_open(&self, portal: DirectedPortal) -> bool {
        self.shut[portal.0 as usize / 64] >> (portal.0 % 64) & 1 == 0
    }

    /// The portals that are shut in some direction, ascending.
    pub fn shut(&self) -> impl Iterator<Item = PortalId> + '_ {
        let mut last = None;
        ones(&self.shut).map(|directed| PortalId(directed as u32 / 2)).filter(move |&p| last.replace(p) != Some(p))
    }

    /// Takes the states of others of the same culler; allocates nothing.
    ///
    /// # Panics
    ///
    /// If the number of portals differs.
    pub(super) fn assign(&mut self, other: &Self) {
        assert_eq!(self.portals, other.portals, "doors of another culler");
        self.shut.copy_from_slice(&other.shut);
    }

    /// Checks that they may be of a culler.
    ///
    /// # Panics
    ///
    /// If its number of portals differs.
    pub(super) fn assert_of(&self, culler: &Culler) {
        assert_eq!(self.portals, culler.portal_count(), "doors of another culler");
    }
}

impl Culler {
    /// Depth of a portal's doorway: largest distance of a leaf from its plane, metres.
    pub fn doorway(&self, portal: DirectedPortal) -> f32 {
        let corners = self.portal_corners.get(portal.portal().index());
        (DOORWAY * Aabb::of(corners.iter().map(|p| p.as_dvec3())).diagonal()) as f32
    }
}
