//! Kind, state and cost of a portal.

#[cfg(feature = "bake")]
use crate::PortalId;

/// The kind of a portal.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "kebab-case"))]
pub enum PortalKind {
    /// A door: closable.
    Door,
    /// A window: see-through, not passable.
    Window,
    /// An empty opening.
    Opening,
}

/// The drawing cost of the view through a portal.
#[cfg(feature = "bake")]
#[derive(Clone, Copy, PartialEq, Debug, serde::Serialize)]
pub struct PortalCost {
    /// The portal.
    pub portal: PortalId,
    /// Mean reduction of triangles per frame if it is shut.
    pub triangles: f64,
}

/// The state of a portal.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct PortalState {
    /// Whether a leaf or a pane covers it in the model. Implies `closable`.
    pub shut: bool,
    /// Whether it is see-through even if it is shut.
    pub see_through: bool,
    /// Whether something can shut it.
    pub closable: bool,
    /// Whether there is a gap although it is shut, beside its leaf or through a slot. Implies `shut`.
    pub ajar: bool,
}

impl PortalState {
    /// The default state: a door is open and solid, a window is shut and of glass, an opening is empty.
    pub fn of_kind(kind: PortalKind) -> Self {
        match kind {
            PortalKind::Door => Self { shut: false, see_through: false, closable: true, ajar: false },
            PortalKind::Window => Self { shut: true, see_through: true, closable: true, ajar: false },
            PortalKind::Opening => Self::default(),
        }
    }
}
