//! The format of results on disk.
//!
//! A file has a head: magic, and the digests of all inputs of the work. Then follow blocks, appended as results arrive: length (`u32`),
//! checksum (XXH3), and results with their keys, in postcard's encoding, compressed with zstd. All numbers are little-endian. An incomplete
//! block, as a killed run may leave, ends the file; later results are computed again.

use super::digest::Digest;
use serde::{Deserialize, Serialize};
use std::io::{self, Read};
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: &[u8; 8] = b"EnfWork\n";
/// Bytes of the head.
pub(super) const HEAD: usize = MAGIC.len() + Digest::BYTES;
/// Largest decompressed size of a block, bytes.
const MOST: u64 = 1 << 32;

/// Number of the map, and of its item.
pub(super) type Key = (u32, u32);

/// Some results.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct Block(pub Vec<(Key, Vec<u8>)>);

/// The beginning of a file.
pub(super) enum Head {
    /// A complete head.
    Whole(Digest),
    /// An incomplete head.
    Cut,
    /// Something else.
    Strange,
}

pub(super) fn head(digest: &Digest) -> Vec<u8> {
    [MAGIC.as_slice(), &digest.to_bytes()].concat()
}

/// Reads up to [`HEAD`] bytes.
pub(super) fn read_head(input: &mut impl Read) -> io::Result<Head> {
    let mut bytes = Vec::new();
    input.take(HEAD as u64).read_to_end(&mut bytes)?;
    if !bytes.starts_with(&MAGIC[..bytes.len().min(MAGIC.len())]) {
        return Ok(Head::Strange);
    }
    let digest = bytes.get(MAGIC.len()..).and_then(|rest| rest.try_into().ok());
    Ok(digest.map_or(Head::Cut, |digest| Head::Whole(Digest::from_bytes(digest))))
}

pub(super) fn packed(block: &Block) -> io::Result<Vec<u8>> {
    let payload = zstd::encode_all(postcard::to_allocvec(block).map_err(io::Error::other)?.as_slice(), 1)?;
    let length = u32::try_from(payload.len()).map_err(io::Error::other)?;
    Ok([length.to_le_bytes().as_slice(), &xxh3_64(&payload).to_le_bytes(), &payload].concat())
}

/// The next block and its size in the file, which has `left` more bytes; `None` at the end, and for an incomplete block.
pub(super) fn read_block(input: &mut impl Read, left: u64) -> io::Result<Option<(Block, u64)>> {
    let mut head = [0; 12];
    if left < head.len() as u64 {
        return Ok(None);
    }
    input.read_exact(&mut head)?;
    let (length, sum) = head.split_at(4);
    let length = u64::from(u32::from_le_bytes(length.try_into().unwrap_or_default()));
    if length > left - head.len() as u64 {
        return Ok(None);
    }
    let mut payload = Vec::new();
    input.take(length).read_to_end(&mut payload)?;
    if xxh3_64(&payload).to_le_bytes() != sum {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    let unpacked = zstd::Decoder::new(payload.as_slice()).and_then(|decoder| decoder.take(MOST).read_to_end(&mut bytes));
    let block = unpacked.ok().and_then(|_| postcard::from_bytes(&bytes).ok());
    Ok(block.map(|block| (block, head.len() as u64 + length)))
}
