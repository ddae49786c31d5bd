//! All tolerances of the build side: named, in metres, scaled to the model's extent.
//!
//! They nest: `coplanar + (sqrt(2) + 1/2) * seal < clearance`. So soundness is proven and not only sampled: at every closed point of a
//! portal face, an opaque triangle is within `coplanar + (sqrt(2) + 1/2) * seal`, so no segment that keeps `clearance` from every opaque
//! triangle passes. See `cells::coverage`.

/// Lengths in metres, derived from a scene's extent by [`Tolerance::for_extent`].
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct Tolerance {
    /// A triangle whose corners are this near to a plane lies in it.
    /// Larger: grazing rays pass beside walls that count as closed. Smaller: walls written in `f32` fall apart into many planes.
    pub coplanar: f64,
    /// Opaque triangles grow by this much before their union is taken, so cracks narrower than twice this are sealed.
    /// Larger: real slits vanish. Smaller: T-junctions of closed walls turn into hairline portals.
    pub seal: f64,
    /// A witness keeps this distance from every opaque triangle that it passes.
    /// Larger: narrow views stay without a witness. Smaller: a ray through the crack between two triangles proves nothing.
    pub clearance: f64,
}

impl Tolerance {
    /// Tolerances for a scene whose bounding box has this diagonal (metres, finite, above zero).
    pub fn for_extent(diagonal: f64) -> Self {
        Self { coplanar: diagonal * 2e-6, seal: diagonal * 5e-6, clearance: diagonal * 1.2e-5 }
    }

    /// The narrowest opening that is certain to stay open: narrower ones may be sealed on purpose.
    #[cfg(feature = "bake")]
    pub fn smallest_hole(&self) -> f64 {
        2.0 * self.clearance
    }
}

/// Rounding error in `f32`, including sums, at most `extent` metres from the origin, metres. Larger: the view through narrow doors grows
/// beyond them. Smaller: objects visible past a door's very edge are lost.
pub fn single_precision(extent: f64) -> f64 {
    extent * 16.0 * f64::from(f32::EPSILON)
}

/// Step of the grid that positions of a packed model lie on, a power of two, metres: no position moves more than `clearance` (metres, above
/// 0). Larger: what the rows hide could show. Smaller: more bytes, and chunks that 16 bits can't span.
#[cfg(feature = "bake")]
pub fn packed_step(clearance: f64) -> f64 {
    // Half the diagonal of a cube.
    (clearance * 2.0 / 3f64.sqrt()).log2().floor().exp2()
}

/// Largest distance of a leaf from its portal's plane, as a share of the portal's diagonal: 0.8 m for a door of 0.9 x 2.1 m. A shut leaf is
/// within half of it, or is larger than its portal. Larger: more of the room behind a shut door is drawn. Smaller: leaves are lost.
pub const DOORWAY: f64 = 0.35;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_nest_at_every_scale() {
        for diagonal in [1e-4, 1.0, 50.0, 1e6] {
            let t = Tolerance::for_extent(diagonal);
            assert!(t.coplanar + (std::f64::consts::SQRT_2 + 0.5) * t.seal < t.clearance);
            assert!(2.0 * t.seal < t.smallest_hole());
        }
    }
}
