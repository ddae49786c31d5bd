//! What enums are in the file: a byte each. Codes are never used again for something else; a new variant takes the next one.

use crate::cells::{PortalKind, Strategy};
use crate::pvs::Guarantee;

/// By code.
pub(super) const GUARANTEES: [Guarantee; 2] = [Guarantee::Conservative, Guarantee::Sampled];
/// By code.
pub(super) const STRATEGIES: [Strategy; 4] = [Strategy::Authored, Strategy::Plan, Strategy::Given, Strategy::Volume];
/// By code.
pub(super) const PORTAL_KINDS: [PortalKind; 3] = [PortalKind::Door, PortalKind::Window, PortalKind::Opening];

pub(super) fn guarantee_code(guarantee: Guarantee) -> u8 {
    match guarantee {
        Guarantee::Conservative => 0,
        Guarantee::Sampled => 1,
    }
}

pub(super) fn strategy_code(strategy: Strategy) -> u8 {
    match strategy {
        Strategy::Authored => 0,
        Strategy::Plan => 1,
        Strategy::Given => 2,
        Strategy::Volume => 3,
    }
}

pub(super) fn portal_kind_code(kind: PortalKind) -> u8 {
    match kind {
        PortalKind::Door => 0,
        PortalKind::Window => 1,
        PortalKind::Opening => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_positions() {
        assert!(GUARANTEES.iter().enumerate().all(|(i, &g)| guarantee_code(g) as usize == i));
        assert!(STRATEGIES.iter().enumerate().all(|(i, &s)| strategy_code(s) as usize == i));
        assert!(PORTAL_KINDS.iter().enumerate().all(|(i, &k)| portal_kind_code(k) as usize == i));
    }
}
