//! Tubes of a document: lines with a radius, and nodes with extras for a tube.

use super::super::lines::Line;
use super::data::Buffers;
use super::document::Primitive;
use super::primitive::vertices;
use enfilade::scene::{ImportError, Place, Role};
use enfilade_tubes::Shape;
use glam::{DAffine3, DVec3};
use serde::Deserialize;

/// `extras.enfilade.tube` of a node; lengths in the node's own unit.
#[derive(Deserialize, Clone)]
#[serde(deny_unknown_fields)]
pub(super) struct Tube {
    pub(super) radius: f64,
    /// Radius of the hole.
    #[serde(default)]
    pub(super) inner: f64,
    /// Whether the ends have no faces.
    #[serde(default)]
    pub(super) open: bool,
    /// Whether the last point connects to the first.
    #[serde(default)]
    pub(super) closed: bool,
    /// Whether the curve through the points is smooth.
    #[serde(default)]
    pub(super) smooth: bool,
    /// Replace the node's mesh; if empty, the lines of the mesh are used.
    #[serde(default)]
    pub(super) points: Vec<[f64; 3]>,
}

/// Greatest relative difference of scales; beyond it circles become ellipses.
const EVEN: f64 = 1e-6;

impl Tube {
    /// For lines of a node.
    pub(super) fn of_radius(radius: f64) -> Self {
        Self { radius, inner: 0.0, open: false, closed: false, smooth: false, points: Vec::new() }
    }

    /// A line of it, without name, place and points.
    pub(super) fn line(&self, shape: Shape) -> Line<'static> {
        let &Self { closed, smooth, .. } = self;
        // Tubes do not bound rooms.
        Line { name: "", place: "", role: Role::Furnishing, points: &[], closed, smooth, shape }
    }

    /// Its shape at a world scale.
    pub(super) fn shape(&self, scale: f64) -> Shape {
        Shape { radius: self.radius * scale, inner: self.inner * scale, capped: !self.open }
    }
}

/// Scale of the world transform, if it is equal in all directions.
pub(super) fn scale(world: &DAffine3) -> Option<f64> {
    let axes = [world.matrix3.x_axis, world.matrix3.y_axis, world.matrix3.z_axis];
    let scale = axes[0].length();
    let is_even = axes.iter().all(|axis| (axis.length() / scale - 1.0).abs() <= EVEN);
    let is_square = [(0, 1), (1, 2), (2, 0)].iter().all(|&(i, j)| axes[i].dot(axes[j]).abs() <= EVEN * scale * scale);
    (is_even && is_square && scale > 0.0).then_some(scale)
}

/// Modes of primitives: pairs of points, a ring, a line through all.
const PAIRS: u64 = 1;
pub(super) const LOOP: u64 = 2;
const STRIP: u64 = 3;

/// Whether a primitive has lines.
pub(super) fn is_of_lines(primitive: &Primitive) -> bool {
    matches!(primitive.mode, Some(PAIRS..=STRIP))
}

/// The lines of a primitive in its mesh's own coordinates; none for other primitives. Pairs that continue the one before form one
/// line.
pub(super) fn polylines(buffers: &Buffers<'_>, primitive: &Primitive) -> Result<Vec<Vec<DVec3>>, ImportError> {
    let Some(position) = primitive.attributes.position.filter(|_| is_of_lines(primitive)) else { return Ok(Vec::new()) };
    let (positions, indices) = vertices(buffers, primitive, position)?;
    let number = |k: usize| indices.as_ref().map_or(u32::try_from(k).ok(), |indices| indices.index(k));
    let count = indices.as_ref().map_or(positions.count(), |indices| indices.count());
    let at = |k: usize| {
        let p = number(k).and_then(|number| positions.get(number as usize));
        let [x, y, z, _] = p.ok_or_else(|| {
            ImportError::malformed(Place::File, format!("a line's vertex {k} is beyond {} vertices", positions.count()))
        })?;
        Ok(DVec3::new(x, y, z))
    };
    if primitive.mode != Some(PAIRS) {
        return Ok(vec![(0..count).map(at).collect::<Result<_, ImportError>>()?]);
    }
    let mut lines: Vec<Vec<DVec3>> = Vec::new();
    for pair in 0..count / 2 {
        let [a, b] = [at(2 * pair)?, at(2 * pair + 1)?];
        match lines.last_mut().filter(|line| line.last() == Some(&a)) {
            Some(line) => line.push(b),
            None => lines.push(vec![a, b]),
        }
    }
    Ok(lines)
}
