//! Files in gzip (RFC 1952): browsers read it by themselves. Their names end in `z` and not in `.gz`, which some servers take for an encoding of
//! their own.

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use std::io::{self, Read, Write};

/// Compresses. The same bytes give the same bytes.
pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    // Vectors take all that is written.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}

/// Reads a file that [`crate::pack`] compressed, up to `most` bytes.
///
/// # Errors
///
/// If it is damaged or has more.
pub fn gunzip(bytes: &[u8], most: u64) -> io::Result<Vec<u8>> {
    let mut read = Vec::new();
    GzDecoder::new(bytes).take(most + 1).read_to_end(&mut read)?;
    if read.len() as u64 > most { Err(io::Error::other(format!("more than {most} bytes"))) } else { Ok(read) }
}
