//! Compressed primitives: `KHR_draco_mesh_compression`.
//!
//! Based on: Khronos Group, *KHR_draco_mesh_compression*, 2018; Google, *Draco Bitstream Specification* 2.2; the decoder is the crate
//! `draco-core`'s.

use super::primitive::Part;
#[cfg(feature = "draco")]
use draco_core::{DecodeLimits, DecoderBuffer, ErrorKind, Mesh, MeshDecoder, PointIndex};
#[cfg(feature = "draco")]
use glam::DVec3;

/// Limit of decoded triangles, as a multiple of compressed bytes. Flat grids of Google's encoder have 11. More: a small file
/// takes much memory. Less: such grids are refused.
const MOST_TRIANGLES: usize = 64;
/// Limit of bytes per vertex: positions have 12, common vertices at most some 120.
#[cfg(feature = "draco")]
const MOST_VERTEX_BYTES: usize = 256;

/// Decodes a primitive of at most `triangles`; `position` is the id of its attribute. Errors are texts.
pub(super) fn decode(source: &[u8], position: usize, triangles: usize) -> Result<Part, String> {
    if triangles > MOST_TRIANGLES.saturating_mul(source.len()) {
        return Err(format!("{triangles} triangles can't be in {} compressed bytes", source.len()));
    }
    codec(source, position, triangles)
}

/// The bytes of attributes of such a primitive, vertex by vertex, in the numbering of [`decode`], and the bytes per vertex.
#[cfg(feature = "draco")]
pub(super) fn attributes(source: &[u8], ids: &[usize], triangles: usize) -> Result<Vec<(Vec<u8>, usize)>, String> {
    let mesh = mesh(source, triangles)?;
    let bytes = |&id: &usize| {
        let attribute = u32::try_from(id).ok().and_then(|id| mesh.attribute_by_unique_id(id));
        let attribute = attribute.ok_or_else(|| format!("Draco compression: no attribute {id}"))?;
        let size = attribute.data_type().byte_length() * usize::from(attribute.num_components());
        let (data, stride) = (attribute.buffer().data(), attribute.byte_stride() as usize);
        let mut out = Vec::with_capacity(size * mesh.num_points());
        for vertex in 0..mesh.num_points() as u32 {
            let at = (attribute.mapped_index(PointIndex(vertex)).0 as usize).saturating_mul(stride);
            let value = at.checked_add(size).and_then(|end| data.get(at..end));
            out.extend(value.ok_or_else(|| format!("Draco compression: attribute {id} ends before vertex {vertex}"))?);
        }
        Ok((out, size))
    };
    ids.iter().map(bytes).collect()
}

/// Fails: no decoder is built in.
#[cfg(not(feature = "draco"))]
pub(super) fn attributes(source: &[u8], _: &[usize], triangles: usize) -> Result<Vec<(Vec<u8>, usize)>, String> {
    codec(source, 0, triangles).map(|_| Vec::new())
}

#[cfg(feature = "draco")]
fn mesh(source: &[u8], triangles: usize) -> Result<Mesh, String> {
    let most_bytes = (triangles as u64).saturating_mul(3 * MOST_VERTEX_BYTES as u64);
    let limits = DecodeLimits::default().with_max_faces(triangles as u64).with_max_decoded_bytes(most_bytes);
    let mut mesh = Mesh::new();
    MeshDecoder::new().decode(&mut DecoderBuffer::new(source).with_limits(limits), &mut mesh).map_err(|e| {
        match e.kind() {
            ErrorKind::LimitExceeded => {
                format!("Draco compression: it holds more than the {triangles} triangles of its accessor")
            }
            _ => format!("Draco compression: {e}"),
        }
    })?;
    mesh.remove_points_unused_by_faces();
    Ok(mesh)
}

#[cfg(feature = "draco")]
fn codec(source: &[u8], position: usize, triangles: usize) -> Result<Part, String> {
    let mesh = mesh(source, triangles)?;
    let attribute = u32::try_from(position).ok().and_then(|id| mesh.attribute_by_unique_id(id));
    let attribute = attribute.filter(|a| a.num_components() == 3);
    let attribute = attribute.ok_or_else(|| format!("Draco compression: attribute {position} is not a position"))?;
    let corners = attribute.read_f32s(mesh.num_points(), 3);
    Ok(Part {
        vertices: (0..mesh.num_points() as u32).collect(),
        positions: corners.as_chunks().0.iter().map(|&[x, y, z]| DVec3::new(x.into(), y.into(), z.into())).collect(),
        triangles: mesh.faces().iter().map(|face| face.map(|corner| corner.0)).collect(),
    })
}

#[cfg(not(feature = "draco"))]
fn codec(_: &[u8], _: usize, _: usize) -> Result<Part, String> {
    Err("a mesh in Draco compression; build with `--features draco`, or export without it".to_owned())
}
