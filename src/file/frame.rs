//! One zstd frame, decompressed in memory (Collet, Kucherawy, *Zstandard compression and the application/zstd media type*, RFC 8878, 2021).

use ruzstd::decoding::FrameDecoder;

/// First bytes of a frame.
const MAGIC: [u8; 4] = 0xfd2f_b528u32.to_le_bytes();
/// Largest window of a frame that is longer than its window, bytes: that of levels up to 15. A decoder takes this much memory. Larger: a
/// frame of a few bytes takes more. Smaller: long sections cannot be read.
const WINDOW: u64 = 8 << 20;

/// Decompresses a frame to exactly `length` bytes. Takes that much memory, plus at most [`WINDOW`].
pub(super) fn decompress(frame: &[u8], length: usize) -> Result<Vec<u8>, String> {
    if !has_small_window(frame) {
        return Err("can't be decompressed: not a zstd frame, or its window is too large".into());
    }
    let mut bytes = vec![0; length];
    match FrameDecoder::new().decode_all(frame, &mut bytes) {
        Ok(n) if n == length => Ok(bytes),
        Ok(n) => Err(format!("{n} bytes decompressed, {length} declared")),
        // A decoder has many texts, and none has a remedy.
        Err(_) => Err(format!("can't be decompressed to {length} bytes")),
    }
}

/// Whether a frame's header declares a window of at most [`WINDOW`]: the descriptor, then the window or the content's size.
fn has_small_window(frame: &[u8]) -> bool {
    let Some((&descriptor, rest)) = frame.strip_prefix(&MAGIC).and_then(|rest| rest.split_first()) else { return false };
    let is_single_segment = descriptor >> 5 & 1 == 1;
    let dictionary = descriptor & 3;
    let window = if is_single_segment {
        let bytes = [1, 2, 4, 8][usize::from(descriptor >> 6)];
        let size = rest.get(..bytes).map(|size| size.iter().rev().fold(0, |value, &b| value << 8 | u64::from(b)));
        size.map(|size| if bytes == 2 { size + 256 } else { size })
    } else {
        let window = rest.first().map(|&w| (u32::from(w >> 3) + 10, u64::from(w & 7)));
        window.map(|(log, eighths)| (1u64 << log) + (1u64 << log) / 8 * eighths)
    };
    dictionary == 0 && window.is_some_and(|window| window <= WINDOW)
}
