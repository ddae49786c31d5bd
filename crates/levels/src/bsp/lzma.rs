//! Packed lumps of Source: `LZMA`, the size when unpacked, the size of the stream, five bytes of properties (lc, lp and pb in one,
//! and the dictionary's size), and a raw LZMA1 stream without an end mark. Numbers are little-endian, on consoles as well.

use lzma_rust2::{LzmaOptions, LzmaReader, LzmaWriter};
use std::io::{Read, Write};

const MAGIC: &[u8] = b"LZMA";
/// Bytes before the stream.
const HEAD: usize = 17;
/// Greatest size of an unpacked lump, in sizes of the file. Rows of mostly zeros shrink to a hundredth before, by their run lengths, so
/// packing never gains as much. More: a small hostile file fills the memory. Less: real lumps are refused.
const MOST: usize = 32;

pub(super) fn is_packed(lump: &[u8]) -> bool {
    lump.starts_with(MAGIC) && lump.len() >= HEAD
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([0, 1, 2, 3].map(|i| bytes[at + i]))
}

/// The lump when unpacked; `file` is the file's length.
pub(super) fn unpack(lump: &[u8], file: usize) -> Result<Vec<u8>, String> {
    let (size, packed) = (word(lump, 4) as usize, word(lump, 8) as usize);
    let stream = lump.get(HEAD..).and_then(|rest| rest.get(..packed));
    let stream = stream.ok_or_else(|| format!("is packed in {packed} bytes, but has {}", lump.len() - HEAD))?;
    if size > MOST.saturating_mul(file) {
        return Err(format!("would unpack to {size} bytes, {MOST} times more than the file"));
    }
    let fault = |e: std::io::Error| format!("can't be unpacked: {e}");
    let dictionary = word(lump, 13).clamp(1 << 12, (size as u32).max(1 << 12));
    let mut reader = LzmaReader::new_with_props(stream, size as u64, lump[12], dictionary, None).map_err(fault)?;
    let mut bytes = Vec::new();
    reader.by_ref().take(size as u64).read_to_end(&mut bytes).map_err(fault)?;
    if bytes.len() == size { Ok(bytes) } else { Err(format!("unpacks to {} bytes, not to {size}", bytes.len())) }
}

/// A lump, packed.
pub(super) fn pack(bytes: &[u8]) -> Vec<u8> {
    let mut options = LzmaOptions::with_preset(9);
    options.dict_size = (bytes.len() as u32).next_power_of_two().clamp(1 << 12, 1 << 24);
    let props = options.get_props();
    let packed = LzmaWriter::new_no_header(Vec::new(), &options, false).and_then(|mut writer| {
        writer.write_all(bytes)?;
        writer.finish()
    });
    // A `Vec` takes all bytes, and these options are valid.
    let stream = packed.unwrap_or_default();
    let sizes = [bytes.len(), stream.len()].map(|n| (n as u32).to_le_bytes());
    [MAGIC, sizes.as_flattened(), &[props], &options.dict_size.to_le_bytes(), &stream].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_unpacks_and_damage_is_told() {
        let bytes: Vec<u8> = (0..5000u32).map(|i| (i * i % 251) as u8).collect();
        let packed = pack(&bytes);
        assert!(is_packed(&packed));
        assert_eq!(unpack(&packed, packed.len()), Ok(bytes.clone()));
        assert!(unpack(&packed, 10).unwrap_err().contains("would unpack"));
        for cut in HEAD..packed.len() - 1 {
            assert!(unpack(&packed[..cut], packed.len()).is_err(), "{cut}");
        }
        let mut longer = packed.clone();
        longer[4..8].copy_from_slice(&6000u32.to_le_bytes());
        assert!(unpack(&longer, packed.len()).is_err());
        assert_eq!(unpack(&pack(&[]), 100), Ok(Vec::new()));
    }
}
