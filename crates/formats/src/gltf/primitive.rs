//! Triangles of a mesh primitive in any mode.

use super::data::{Accessor, Buffers, broken};
use super::document::Primitive;
use enfilade::scene::ImportError;
use glam::DVec3;
use std::collections::HashMap;

/// Counts of skipped data in the file.
#[derive(Default)]
pub(super) struct LeftOut {
    pub points_and_lines: usize,
    pub without_positions: usize,
    pub leftover_corners: usize,
}

/// A primitive in its mesh's own coordinates: only the vertices that its triangles use.
#[derive(Clone)]
pub(super) struct Part {
    pub positions: Vec<DVec3>,
    /// By position: its number among the vertices of the primitive.
    pub vertices: Vec<u32>,
    pub triangles: Vec<[u32; 3]>,
}

/// How corners form triangles.
#[derive(Clone, Copy)]
enum Mode {
    List,
    Strip,
    Fan,
}

impl Mode {
    /// Number of triangles of this many corners.
    fn triangles(self, corners: usize) -> usize {
        match self {
            Self::List => corners / 3,
            Self::Strip | Self::Fan => corners.saturating_sub(2),
        }
    }

    /// Corner numbers of triangle `t` (specification, 3.7.2.1).
    fn corners(self, t: usize) -> [usize; 3] {
        match self {
            Self::List => [3 * t, 3 * t + 1, 3 * t + 2],
            Self::Strip => [t, t + 1 + t % 2, t + 2 - t % 2],
            Self::Fan => [t + 1, t + 2, 0],
        }
    }
}

/// The positions of a primitive, and its indices, if it has any.
pub(super) fn vertices<'b>(
    buffers: &'b Buffers<'_>,
    primitive: &Primitive,
    position: usize,
) -> Result<(Accessor<'b>, Option<Accessor<'b>>), ImportError> {
    buffers.refuse_filters(position)?;
    let positions = buffers.accessor(position, &["VEC3"])?;
    let Some(index) = primitive.indices else { return Ok((positions, None)) };
    buffers.refuse_filters(index)?;
    let indices = buffers.accessor(index, &["SCALAR"])?;
    if !indices.holds_indices() {
        return Err(broken(format!("accessor {index}: vertex indices that are not unsigned integers")));
    }
    Ok((positions, Some(indices)))
}

/// Reads a primitive; `None` for points, lines and primitives without positions, which are counted.
pub(super) fn part(buffers: &Buffers, primitive: &Primitive, left_out: &mut LeftOut) -> Result<Option<Part>, ImportError> {
    let mode = match primitive.mode.unwrap_or(4) {
        0..=3 => {
            left_out.points_and_lines += 1;
            return Ok(None);
        }
        4 => Mode::List,
        5 => Mode::Strip,
        6 => Mode::Fan,
        other => return Err(broken(format!("primitive mode {other} is not valid in glTF"))),
    };
    let Some(position) = primitive.attributes.position else {
        left_out.without_positions += 1;
        return Ok(None);
    };
    // Some files also have plain accessors for readers without the codec.
    let claimed = buffers.claimed(position)?;
    if let (Some(draco), None) = (&primitive.extensions.draco, claimed.buffer_view) {
        if claimed.normalized {
            return Err(broken(format!("accessor {position}: normalized positions in Draco compression")));
        }
        let corners = primitive.indices.map_or(Ok(0), |indices| buffers.claimed(indices).map(|a| a.count))?;
        return Ok(Some(buffers.draco(draco, mode.triangles(corners))?.as_ref().clone()));
    }
    let (positions, indices) = vertices(buffers, primitive, position)?;
    let corners = indices.as_ref().map_or(positions.count(), |i| i.count());
    if matches!(mode, Mode::List) {
        left_out.leftover_corners += corners % 3;
    }
    let vertex = |number: usize| match &indices {
        Some(indices) => indices.index(number).unwrap_or(UNSEEN),
        None => u32::try_from(number).unwrap_or(UNSEEN),
    };
    let triangles = (0..mode.triangles(corners)).map(|t| mode.corners(t).map(vertex));
    used(&positions, corners, triangles).map(Some)
}

/// Not a vertex.
const UNSEEN: u32 = u32::MAX;

/// Triangles with the vertices that they use; `corners`: how many they have, about.
fn used(positions: &Accessor<'_>, corners: usize, triangles: impl Iterator<Item = [u32; 3]>) -> Result<Part, ImportError> {
    let mut part = Part { positions: Vec::new(), vertices: Vec::new(), triangles: Vec::new() };
    // Vertex index to index in the part. A table if most vertices are used; a map for primitives that share one large accessor,
    // so that memory does not grow with its size.
    let mut table = if positions.count() <= 4 * corners { vec![UNSEEN; positions.count()] } else { Vec::new() };
    let mut map: HashMap<u32, u32> = HashMap::new();
    for mut triangle in triangles {
        for corner in &mut triangle {
            let vertex = *corner;
            let slot = match table.get_mut(vertex as usize) {
                Some(slot) => slot,
                None => map.entry(vertex).or_insert(UNSEEN),
            };
            if *slot == UNSEEN {
                let n = positions.count();
                let p = positions.get(vertex as usize);
                let [x, y, z, _] = p.ok_or_else(|| broken(format!("vertex index {vertex} of {n} vertices")))?;
                *slot = part.positions.len() as u32;
                part.positions.push(DVec3::new(x, y, z));
                part.vertices.push(vertex);
            }
            *corner = *slot;
        }
        part.triangles.push(triangle);
    }
    Ok(part)
}
