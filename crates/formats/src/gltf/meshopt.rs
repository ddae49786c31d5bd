//! Compressed buffer views: `EXT_meshopt_compression`, and `KHR_meshopt_compression`, which adds a version of the vertex codec.
//!
//! Based on: Khronos Group, *EXT_meshopt_compression*, 2021; the codecs are the crate `meshoptimizer-rs`'s.

use super::document::Compressed;
#[cfg(feature = "meshopt")]
use super::document::Filter;
#[cfg(feature = "meshopt")]
use super::document::Mode;
#[cfg(feature = "meshopt")]
use meshoptimizer_rs::codec::{
    decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat, decode_index_buffer,
    decode_index_sequence, decode_vertex_buffer,
};
#[cfg(feature = "meshopt")]
use meshoptimizer_rs::{Error, Workspace};

/// Limit of decoded bytes, as a multiple of compressed ones. Triangles take a byte or more for 12; corners of meshes a half or
/// more for 12. More: a small file takes much memory. Less: regular grids are refused.
const MOST_RATIO: usize = 64;

/// Decodes a view. Errors are texts.
pub(super) fn decode(view: &Compressed, source: &[u8]) -> Result<Vec<u8>, String> {
    let size = view.count.checked_mul(view.byte_stride).filter(|&size| size <= MOST_RATIO.saturating_mul(source.len()));
    if size.is_none() {
        let Compressed { count, byte_stride, .. } = view;
        return Err(format!("{count} elements of {byte_stride} bytes can't be in {} compressed bytes", source.len()));
    }
    codec(view, source)
}

#[cfg(feature = "meshopt")]
fn codec(view: &Compressed, source: &[u8]) -> Result<Vec<u8>, String> {
    let Compressed { count, byte_stride: stride, mode, filter, .. } = *view;
    let workspace = &mut Workspace::default();
    let decoded = match mode {
        Mode::Attributes => decode_vertex_buffer(count, stride, source, workspace),
        Mode::Triangles => decode_index_buffer(count, stride, source, workspace),
        Mode::Indices => decode_index_sequence(count, stride, source, workspace),
    };
    let filtered = |mut bytes: Vec<u8>| -> Result<Vec<u8>, Error> {
        match filter {
            Filter::None => {}
            Filter::Exponential => decode_filter_exp(&mut bytes, count, stride, workspace)?,
            Filter::Octahedral => decode_filter_oct(&mut bytes, count, stride, workspace)?,
            Filter::Quaternion => decode_filter_quat(&mut bytes, count, stride, workspace)?,
            Filter::Color => decode_filter_color(&mut bytes, count, stride, workspace)?,
        }
        Ok(bytes)
    };
    decoded.and_then(filtered).map_err(|e| format!("meshopt compression: {e}"))
}

#[cfg(not(feature = "meshopt"))]
fn codec(view: &Compressed, _: &[u8]) -> Result<Vec<u8>, String> {
    let mode = format!("{:?}", view.mode).to_lowercase();
    Err(format!("{mode} in meshopt compression; build with `--features meshopt`, or export without it"))
}
