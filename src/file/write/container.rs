//! Writes the container: a header, a section table, the sections.

use super::put::Put;
use crate::file::codes::guarantee_code;
use crate::file::format::{CHECKSUM_AT, ENTRY, HEADER, MAGIC, REQUIRED, SectionId, VERSION, ZSTD, header_checksum};
use crate::types::guarantee::Guarantee;
use xxhash_rust::xxh3::xxh3_64;

/// Compression level. On the rows of grids of up to 576 rooms, level 19 took several times as long and saved less than 1 %.
const ZSTD_LEVEL: i32 = 15;

/// `bytes` as one zstd frame if that is shorter.
pub(in crate::file) fn compressed(bytes: &[u8]) -> Option<Vec<u8>> {
    // Compression in memory should not fail; if it does, the bytes are stored uncompressed.
    zstd::bulk::compress(bytes, ZSTD_LEVEL).ok().filter(|z| z.len() < bytes.len())
}

/// Assembles a file. `sections` ascend.
pub(in crate::file) fn assemble(model_hash: u128, guarantee: Guarantee, sections: &[(SectionId, Vec<u8>)]) -> Vec<u8> {
    let stored: Vec<Option<Vec<u8>>> =
        sections.iter().map(|(id, bytes)| if id.is_matrix() { None } else { compressed(bytes) }).collect();
    let bodies = || sections.iter().zip(&stored).map(|((_, bytes), zstd)| zstd.as_ref().unwrap_or(bytes));
    let table_end = HEADER + sections.len() * ENTRY;
    let length = table_end + bodies().map(Vec::len).sum::<usize>();

    let mut out = Vec::with_capacity(length);
    out.bytes(&MAGIC);
    out.u32(VERSION);
    out.count(sections.len());
    out.u64(length as u64);
    out.bytes(&model_hash.to_le_bytes());
    out.u8(guarantee_code(guarantee));
    out.resize(HEADER, 0);
    for (((id, bytes), zstd), body) in sections.iter().zip(&stored).zip(bodies()) {
        out.u32(id.number());
        out.u32(if id.is_required() { REQUIRED } else { 0 } | if zstd.is_some() { ZSTD } else { 0 });
        out.u64(body.len() as u64);
        out.u64(bytes.len() as u64);
        out.u64(xxh3_64(body));
    }
    let checksum = header_checksum(&out, table_end);
    out[CHECKSUM_AT..HEADER].copy_from_slice(&checksum.to_le_bytes());
    bodies().for_each(|body| out.bytes(body));
    out
}
