//! How cells were found.

/// How free space is split.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "kebab-case"))]
pub enum Strategy {
    /// Rooms and doors that the author named.
    Authored,
    /// Storeys, walls in plan, doorways.
    Plan,
    /// Cells and portals that the user gave.
    Given,
    /// A tree that cuts along the largest walls.
    Bsp,
    /// The leaves of a level's own tree.
    Leaves,
}
