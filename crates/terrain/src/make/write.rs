//! The header and the table as bytes.

use crate::format::{ENTRY, HEADER, Header, MAGIC, Tile, VERSION};
use xxhash_rust::xxh3::xxh3_64;

impl Header {
    /// The header's bytes. `table` is the table's checksum.
    pub(super) fn write(&self, table: u64) -> [u8; HEADER] {
        let mut out = Vec::with_capacity(HEADER);
        let [columns, rows] = self.grid.size();
        out.extend(MAGIC);
        for number in [VERSION, self.width.bytes() as u32, columns, rows, self.grid.side(), u32::from(self.is_divided())] {
            out.extend(number.to_le_bytes());
        }
        out.extend(self.place(self.grid.tiles()).to_le_bytes());
        for number in self.spacing.into_iter().chain(self.origin).chain([self.step]) {
            out.extend(number.to_le_bytes());
        }
        out.extend(self.voids.to_le_bytes());
        out.extend(table.to_le_bytes());
        out.extend(xxh3_64(&out).to_le_bytes());
        out.try_into().unwrap_or([0; HEADER])
    }

    /// Whether the file has levels above the raster's own.
    fn is_divided(&self) -> bool {
        self.grid.top() > 0
    }
}

impl Tile {
    /// An entry of the table.
    pub(super) fn write(&self) -> [u8; ENTRY] {
        let mut out = [0; ENTRY];
        for (k, number) in [self.low, self.high, self.error, self.rim].into_iter().enumerate() {
            out[4 * k..4 * k + 4].copy_from_slice(&number.to_le_bytes());
        }
        out[16..20].copy_from_slice(&self.samples.to_le_bytes());
        out[24..].copy_from_slice(&self.checksum.to_le_bytes());
        out
    }
}
