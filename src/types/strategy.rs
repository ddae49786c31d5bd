//! Strategies of splits.

/// A strategy to split free space.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "kebab-case"))]
pub enum Strategy {
    /// The author's rooms and doors.
    Authored,
    /// Storeys, walls in plan, doorways.
    Plan,
    /// The user's cells and portals.
    Given,
    /// A BSP tree along the largest walls.
    Bsp,
    /// The leaves of a level's own BSP tree.
    Leaves,
}
