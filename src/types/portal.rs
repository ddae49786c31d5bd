//! What a portal is, what stands in it, and what it costs.

use crate::PortalId;

/// What a portal is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "kebab-case"))]
pub enum PortalKind {
    /// A door: closable.
    Door,
    /// A window: see-through, not passable.
    Window,
    /// Nothing in it.
    Opening,
}

/// What is drawn for what shows through a portal.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct PortalCost {
    /// Which.
    pub portal: PortalId,
    /// Triangles that a frame draws less in the mean where it is shut.
    pub triangles: f64,
}

/// What stands in a portal.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct PortalState {
    /// A leaf or a pane covers it, as the model stands. Nothing is shut that isn't closable.
    pub shut: bool,
    /// One sees through it even where it is shut.
    pub see_through: bool,
    /// Something hangs in it that can shut it.
    pub closable: bool,
    /// It is shut and something shows all the same, beside its leaf or through a slot. Only what is shut is ajar.
    pub ajar: bool,
}

impl PortalState {
    /// What is assumed where nothing more is known: a door stands open and is solid, a window is shut and of glass, an opening
    /// has nothing in it.
    pub fn of_kind(kind: PortalKind) -> Self {
        match kind {
            PortalKind::Door => Self { shut: false, see_through: false, closable: true, ajar: false },
            PortalKind::Window => Self { shut: true, see_through: true, closable: true, ajar: false },
            PortalKind::Opening => Self::default(),
        }
    }
}
