//! Ids are `u32` newtypes, so that a cell is not mistaken for an object; absence is `Option`, never a sentinel. In memory they are their
//! number, and with the feature `bytemuck` a list of them is cast to bytes.

use std::fmt;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
        #[repr(transparent)]
        #[cfg_attr(feature = "bytemuck", derive(bytemuck::Pod, bytemuck::Zeroable))]
        #[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "bake", serde(transparent))]
        pub struct $name(pub u32);

        impl $name {
            /// The id as an index into its table.
            #[inline]
            pub const fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

id! {
    /// A cell of a [`crate::cells::CellGraph`].
    CellId
}
id! {
    /// A portal of a [`crate::cells::CellGraph`], without direction.
    PortalId
}
id! {
    /// An object of a [`crate::scene::Scene`].
    ObjectId
}
id! {
    /// A directed portal: `2 * portal + side`.
    DirectedPortal
}

impl PortalId {
    /// The directed portal that leads out of `cells[side]`.
    #[inline]
    pub const fn directed(self, side: u32) -> DirectedPortal {
        DirectedPortal(self.0 * 2 + side)
    }
}

impl DirectedPortal {
    /// The portal without its direction.
    #[inline]
    pub const fn portal(self) -> PortalId {
        PortalId(self.0 / 2)
    }

    /// 0: from `cells[0]` to `cells[1]`; 1: back.
    #[inline]
    pub const fn side(self) -> usize {
        (self.0 % 2) as usize
    }

    /// The same portal in the opposite direction.
    #[inline]
    pub const fn reversed(self) -> Self {
        Self(self.0 ^ 1)
    }
}
