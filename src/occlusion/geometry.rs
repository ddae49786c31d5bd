//! The triangles that oracles draw, by object.

use crate::math::geom::Aabb;
#[cfg(feature = "bake")]
use crate::types::scene::Scene;
use glam::DVec3;
use std::ops::Range;

/// A model as oracles and hierarchies take it: triangles by object, borrowed from whoever owns them. A scene of the builder converts into it.
#[derive(Clone, PartialEq, Debug)]
pub struct Geometry<'a> {
    /// Corners, metres, finite.
    pub positions: &'a [DVec3],
    /// Indices into `positions`.
    pub triangles: &'a [[u32; 3]],
    /// Objects; object `i` has [`ObjectId(i)`](crate::ObjectId).
    pub objects: Vec<GeometryObject>,
}

/// An object of a [`Geometry`].
#[derive(Clone, PartialEq, Debug)]
pub struct GeometryObject {
    /// Its triangles, as a range of [`Geometry::triangles`].
    pub triangles: Range<u32>,
    /// Box around its triangles.
    pub bounds: Aabb,
    /// Whether it hides what is behind it.
    pub opaque: bool,
}

impl Geometry<'_> {
    /// The corners of a triangle.
    #[inline]
    pub(crate) fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }
}

#[cfg(feature = "bake")]
impl<'a> From<&'a Scene> for Geometry<'a> {
    fn from(scene: &'a Scene) -> Self {
        let object = |o: &crate::types::scene::Object| GeometryObject {
            triangles: o.triangles.clone(),
            bounds: o.bounds,
            opaque: o.opaque,
        };
        Self {
            positions: &scene.positions,
            triangles: &scene.triangles,
            objects: scene.objects.iter().map(object).collect(),
        }
    }
}
