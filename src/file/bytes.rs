//! Little-endian numbers, strings and lists; every length is checked before allocation.

use super::error::{Fault, FileError};
use super::format::SectionId;

/// Memory limit for decoding a file: [`Budget::BASE`] bytes plus [`Budget::RATIO`] times its length.
#[derive(Debug)]
pub(super) struct Budget {
    left: u64,
}

impl Budget {
    /// Base limit for any file, bytes.
    pub const BASE: u64 = 16 << 20;
    /// Bytes of memory for each byte of the file.
    pub const RATIO: u64 = 8192;

    /// The budget of a file of `length` bytes.
    pub fn new(length: usize) -> Self {
        Self { left: (length as u64).saturating_mul(Self::RATIO).saturating_add(Self::BASE) }
    }

    /// Reserves `bytes`; call it before every allocation.
    pub fn take(&mut self, section: SectionId, bytes: u64) -> Result<(), Fault> {
        match self.left.checked_sub(bytes) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(FileError::TooLarge { section, needs: bytes, left: self.left }.into()),
        }
    }
}

/// Reads a section from front to back.
#[derive(Clone, Debug)]
pub(super) struct Cursor<'a> {
    section: SectionId,
    bytes: &'a [u8],
    at: usize,
    /// Start of the last item, for errors.
    item: usize,
}

impl<'a> Cursor<'a> {
    pub fn new(section: SectionId, bytes: &'a [u8]) -> Self {
        Self { section, bytes, at: 0, item: 0 }
    }

    /// An error at the last item.
    pub fn error(&self, what: impl Into<String>) -> Fault {
        FileError::Malformed { section: self.section, offset: self.item as u64, what: what.into() }.into()
    }

    pub fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// What is left.
    pub fn rest(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        self.at = self.bytes.len();
        rest
    }

    pub fn take(&mut self, n: usize) -> Result<&'a [u8], Fault> {
        self.item = self.at;
        if n > self.remaining() {
            return Err(self.error(format!("{n} bytes expected, {} left", self.remaining())));
        }
        let taken = &self.bytes[self.at..self.at + n];
        self.at += n;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let mut out = [0; N];
        out.copy_from_slice(self.take(N)?);
        Ok(out)
    }

    pub fn u8(&mut self) -> Result<u8, Fault> {
        Ok(self.array::<1>()?[0])
    }

    pub fn u32(&mut self) -> Result<u32, Fault> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Result<u64, Fault> {
        self.array().map(u64::from_le_bytes)
    }

    pub fn u128(&mut self) -> Result<u128, Fault> {
        self.array().map(u128::from_le_bytes)
    }

    /// Finite numbers.
    pub fn f32s<const N: usize>(&mut self) -> Result<[f32; N], Fault> {
        let mut out = [0.0; N];
        for x in &mut out {
            *x = f32::from_le_bytes(self.array()?);
            if !x.is_finite() {
                return Err(self.error("a number that is not finite"));
            }
        }
        Ok(out)
    }

    /// Finite numbers.
    pub fn f64s<const N: usize>(&mut self) -> Result<[f64; N], Fault> {
        let mut out = [0.0; N];
        for x in &mut out {
            *x = f64::from_le_bytes(self.array()?);
            if !x.is_finite() {
                return Err(self.error("a number that is not finite"));
            }
        }
        Ok(out)
    }

    /// A code from a list of `n`.
    pub fn code(&mut self, n: usize, what: &str) -> Result<usize, Fault> {
        let code = usize::from(self.u8()?);
        if code >= n {
            return Err(self.error(format!("{what} {code}; there are {n}")));
        }
        Ok(code)
    }

    /// An id below `n`.
    pub fn id(&mut self, n: usize, what: &str) -> Result<u32, Fault> {
        let id = self.u32()?;
        if id as usize >= n {
            return Err(self.error(format!("{what} {id}; there are {n}")));
        }
        Ok(id)
    }

    pub fn string(&mut self) -> Result<String, Fault> {
        let start = self.at;
        let n = self.u32()? as usize;
        let text = self.take(n)?;
        self.item = start;
        match std::str::from_utf8(text) {
            Ok(text) => Ok(text.to_owned()),
            Err(_) => Err(self.error("a string that is not UTF-8")),
        }
    }

    pub fn option(&mut self) -> Result<Option<String>, Fault> {
        match self.code(2, "a flag")? {
            0 => Ok(None),
            _ => self.string().map(Some),
        }
    }

    /// A list with its count in front; each element takes at least `least` bytes.
    pub fn list<T>(
        &mut self,
        budget: &mut Budget,
        least: usize,
        mut element: impl FnMut(&mut Self, &mut Budget) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        let n = self.u32()? as usize;
        if n > self.remaining() / least {
            return Err(self.error(format!("a list of {n}, with {} bytes left", self.remaining())));
        }
        budget.take(self.section, (n * size_of::<T>()) as u64)?;
        let mut out = Vec::with_capacity(n);
        for _ in 0..n {
            out.push(element(self, budget)?);
        }
        Ok(out)
    }

    /// LEB128 as [`Put::varint`] writes it, in its shortest form only.
    pub fn varint(&mut self) -> Result<u32, Fault> {
        let start = self.at;
        let (mut x, mut shift) = (0u64, 0);
        loop {
            let byte = self.u8()?;
            x |= u64::from(byte & 0x7f) << shift;
            shift += 7;
            if byte < 0x80 {
                self.item = start;
                if byte == 0 && shift > 7 {
                    return Err(self.error("a number not in its shortest form"));
                }
                return u32::try_from(x).map_err(|_| self.error("a number beyond 32 bits"));
            }
            if shift > 28 {
                self.item = start;
                return Err(self.error("a number beyond 32 bits"));
            }
        }
    }

    /// Fails if bytes are left.
    pub fn end(&mut self) -> Result<(), Fault> {
        self.item = self.at;
        match self.remaining() {
            0 => Ok(()),
            n => Err(self.error(format!("{n} bytes too many"))),
        }
    }
}
