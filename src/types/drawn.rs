//! What files draw and miss in views.

use serde::Serialize;

/// What a mode draws and misses.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct Drawn {
    /// Mean of the triangles kept.
    pub triangles_mean: f64,
    /// Pixels that show something that the set leaves out; sum over views.
    pub missed_pixels: u64,
    /// Pixels that do so through a crack between triangles only; sum over views.
    pub crack_pixels: u64,
}

/// What one file draws and misses.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct DrawnOfFile {
    /// By rows.
    pub pvs: Drawn,
    /// By portals and rows.
    pub both: Drawn,
}

/// What several files of one model draw and miss in the same views.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Compared {
    /// Views.
    pub views: usize,
    /// Mean of the triangles of objects that really show: what a perfect culler would keep.
    pub exact_triangles_mean: f64,
    /// Of each file.
    pub files: Vec<DrawnOfFile>,
}
