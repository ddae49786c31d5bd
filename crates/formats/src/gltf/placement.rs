//! Transforms of nodes, from a matrix or from scale, rotation and translation.

use super::data::broken;
use super::document::Node;
use enfilade::scene::ImportError;
use glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};

/// Scale, then rotation, then translation.
#[derive(Clone, Copy)]
pub(super) struct Placement {
    pub scale: DVec3,
    pub rotation: DQuat,
    pub translation: DVec3,
}

impl Placement {
    /// Of a node; a matrix is decomposed.
    pub fn of(node: &Node) -> Self {
        if let Some(matrix) = &node.matrix {
            let matrix = DAffine3::from_mat4(DMat4::from_cols_array(matrix.as_ref()));
            let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
            return Self::new(scale, rotation, translation);
        }
        let rotation = node.rotation.as_deref().map_or(DQuat::IDENTITY, |&r| DQuat::from_array(r));
        let [scale, translation] = [(&node.scale, DVec3::ONE), (&node.translation, DVec3::ZERO)]
            .map(|(given, default)| given.as_deref().map_or(default, |&v| DVec3::from(v)));
        Self::new(scale, rotation, translation)
    }

    /// Normalises the rotation, which files round to `f32`.
    pub fn new(scale: DVec3, rotation: DQuat, translation: DVec3) -> Self {
        let length = rotation.length();
        let rotation = if length > 0.0 && length.is_finite() { rotation / length } else { DQuat::IDENTITY };
        Self { scale, rotation, translation }
    }

    pub fn transform(self) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }
}

/// A node's own transform.
pub(super) fn transform(node: &Node, index: usize) -> Result<DAffine3, ImportError> {
    if let Some(matrix) = &node.matrix {
        let matrix = DMat4::from_cols_array(matrix.as_ref());
        if !is_affine(matrix.row(3)) {
            return Err(broken(format!("node {index}: the last row of its matrix is not 0 0 0 1")));
        }
        return Ok(DAffine3::from_mat4(matrix));
    }
    Ok(Placement::of(node).transform())
}

/// Whether the last row of a matrix is that of an affine transform, within rounding.
fn is_affine(row: DVec4) -> bool {
    /// Larger: a perspective counts as rounding. Smaller: exporters with single precision are refused.
    const ROUNDING: f64 = 1e-4;
    (row - DVec4::W).abs().max_element() <= ROUNDING
}
