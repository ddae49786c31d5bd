//! Codes of enums in the file, a byte each. Codes are never reused; a new variant takes the next one.

use crate::types::guarantee::Guarantee;
use crate::types::portal::{PortalKind, PortalState};
use crate::types::strategy::Strategy;

/// By code.
pub(super) const GUARANTEES: [Guarantee; 2] = [Guarantee::Conservative, Guarantee::Sampled];
/// By code.
pub(super) const STRATEGIES: [Option<Strategy>; 6] = [
    Some(Strategy::Authored),
    Some(Strategy::Plan),
    Some(Strategy::Given),
    // Voxels, removed before the first release.
    None,
    Some(Strategy::Bsp),
    Some(Strategy::Leaves),
];
/// By code.
pub(super) const PORTAL_KINDS: [PortalKind; 3] = [PortalKind::Door, PortalKind::Window, PortalKind::Opening];

#[cfg(feature = "bake")]
pub(super) fn guarantee_code(guarantee: Guarantee) -> u8 {
    match guarantee {
        Guarantee::Conservative => 0,
        Guarantee::Sampled => 1,
    }
}

#[cfg(feature = "bake")]
pub(super) fn strategy_code(strategy: Strategy) -> u8 {
    match strategy {
        Strategy::Authored => 0,
        Strategy::Plan => 1,
        Strategy::Given => 2,
        Strategy::Bsp => 4,
        Strategy::Leaves => 5,
    }
}

#[cfg(feature = "bake")]
pub(super) fn portal_kind_code(kind: PortalKind) -> u8 {
    match kind {
        PortalKind::Door => 0,
        PortalKind::Window => 1,
        PortalKind::Opening => 2,
    }
}

/// A bit each.
#[cfg(feature = "bake")]
pub(super) fn state_code(state: PortalState) -> u8 {
    u8::from(state.shut) | u8::from(state.see_through) << 1 | u8::from(state.closable) << 2 | u8::from(state.ajar) << 3
}

/// `None` for an unknown bit, for shut without closable, and for ajar without shut.
pub(super) fn state_of_code(code: u8) -> Option<PortalState> {
    let bit = |k: u8| code >> k & 1 == 1;
    let state = PortalState { shut: bit(0), see_through: bit(1), closable: bit(2), ajar: bit(3) };
    (code < 16 && (state.closable || !state.shut) && (state.shut || !state.ajar)).then_some(state)
}

/// Flags of import options: which values follow ([`HOLE`] last), pipes as meshes, and +Z up.
pub(super) const UNIT: u8 = 1;
pub(super) const TUBE_RADIUS: u8 = 2;
pub(super) const NO_TUBES: u8 = 4;
pub(super) const Z_UP: u8 = 8;
pub(super) const HOLE: u8 = 16;

#[cfg(all(test, feature = "bake"))]
mod tests {
    use super::*;

    #[test]
    fn codes_are_positions() {
        assert!(GUARANTEES.iter().enumerate().all(|(i, &g)| guarantee_code(g) as usize == i));
        assert!(STRATEGIES.iter().enumerate().all(|(i, &s)| s.is_none_or(|s| strategy_code(s) as usize == i)));
        let states: Vec<_> = (0..=255).filter_map(state_of_code).map(state_code).collect();
        assert_eq!(states, [0, 2, 4, 5, 6, 7, 13, 15], "shut requires a leaf, ajar requires shut, at most 15");
        assert!(PORTAL_KINDS.iter().enumerate().all(|(i, &k)| portal_kind_code(k) as usize == i));
    }
}
