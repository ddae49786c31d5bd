//! Numbers in the records of a lump.

/// How a number is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    I16,
    U16,
    I32,
    U32,
}

/// A number of a record: where, and how it is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Field {
    pub at: usize,
    pub kind: Kind,
}

impl Field {
    /// Bytes of the number.
    pub fn size(self) -> usize {
        if matches!(self.kind, Kind::I16 | Kind::U16) { 2 } else { 4 }
    }
}

/// Bytes of three floats.
pub(crate) const POINT: usize = 12;

pub(crate) const fn i16(at: usize) -> Field {
    Field { at, kind: Kind::I16 }
}

pub(crate) const fn u16(at: usize) -> Field {
    Field { at, kind: Kind::U16 }
}

pub(crate) const fn i32(at: usize) -> Field {
    Field { at, kind: Kind::I32 }
}

pub(crate) const fn u32(at: usize) -> Field {
    Field { at, kind: Kind::U32 }
}

/// The bytes of a lump as records of one size.
pub(crate) struct Records<'b> {
    bytes: &'b [u8],
    size: usize,
    big_endian: bool,
}

impl<'b> Records<'b> {
    /// Whole records only: `bytes` has a multiple of `size`.
    pub fn new(bytes: &'b [u8], size: usize, big_endian: bool) -> Self {
        Self { bytes, size, big_endian }
    }

    pub fn len(&self) -> usize {
        self.bytes.len() / self.size
    }

    /// The bytes of a record.
    pub fn record(&self, record: usize) -> &'b [u8] {
        &self.bytes[record * self.size..(record + 1) * self.size]
    }

    /// A whole number of a record.
    pub fn int(&self, record: usize, field: Field) -> i64 {
        let at = record * self.size + field.at;
        let [a, b, c, d] = match field.kind {
            Kind::I16 | Kind::U16 => {
                let [a, b] = self.ordered([self.bytes[at], self.bytes[at + 1]]);
                [a, b, 0, 0]
            }
            _ => self.ordered([self.bytes[at], self.bytes[at + 1], self.bytes[at + 2], self.bytes[at + 3]]),
        };
        match field.kind {
            Kind::I16 => i16::from_le_bytes([a, b]).into(),
            Kind::U16 => u16::from_le_bytes([a, b]).into(),
            Kind::I32 => i32::from_le_bytes([a, b, c, d]).into(),
            Kind::U32 => u32::from_le_bytes([a, b, c, d]).into(),
        }
    }

    /// A whole number that is no less than 0, as an index; `usize::MAX` for negative ones, which no list has.
    pub fn index(&self, record: usize, field: Field) -> usize {
        usize::try_from(self.int(record, field)).unwrap_or(usize::MAX)
    }

    /// Three floats in a row.
    pub fn point(&self, record: usize, at: usize) -> glam::DVec3 {
        glam::DVec3::new(self.float(record, at), self.float(record, at + 4), self.float(record, at + 8))
    }

    /// A float.
    pub fn float(&self, record: usize, at: usize) -> f64 {
        let from = record * self.size + at;
        f64::from(f32::from_le_bytes(self.ordered([0, 1, 2, 3].map(|i| self.bytes[from + i]))))
    }

    /// The lowest byte first.
    fn ordered<const N: usize>(&self, mut bytes: [u8; N]) -> [u8; N] {
        if self.big_endian {
            bytes.reverse();
        }
        bytes
    }
}
