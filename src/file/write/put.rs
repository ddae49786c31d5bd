//! Writes little-endian numbers, strings and lists.

/// Appends to a section.
pub(in crate::file) trait Put {
    fn u8(&mut self, x: u8);
    fn bytes(&mut self, x: &[u8]);

    fn u32(&mut self, x: u32) {
        self.bytes(&x.to_le_bytes());
    }
    fn u64(&mut self, x: u64) {
        self.bytes(&x.to_le_bytes());
    }
    fn f32s<const N: usize>(&mut self, x: [f32; N]) {
        x.iter().for_each(|x| self.bytes(&x.to_le_bytes()));
    }
    fn f64s<const N: usize>(&mut self, x: [f64; N]) {
        x.iter().for_each(|x| self.bytes(&x.to_le_bytes()));
    }
    /// The number of list elements.
    fn count(&mut self, n: usize) {
        self.u32(n as u32);
    }
    fn string(&mut self, s: &str) {
        self.count(s.len());
        self.bytes(s.as_bytes());
    }
    fn option(&mut self, s: Option<&str>) {
        self.u8(u8::from(s.is_some()));
        if let Some(s) = s {
            self.string(s);
        }
    }
    /// LEB128: seven bits a byte, low ones first, the top bit set on all but the last byte.
    fn varint(&mut self, mut x: u32) {
        while x >= 0x80 {
            self.u8(x as u8 | 0x80);
            x >>= 7;
        }
        self.u8(x as u8);
    }
}

impl Put for Vec<u8> {
    fn u8(&mut self, x: u8) {
        self.push(x);
    }
    fn bytes(&mut self, x: &[u8]) {
        self.extend_from_slice(x);
    }
}
