//! Buffers and accessors. Every index, count, stride and offset is checked against the actual bytes before reading. Elements are
//! read in place, so allocations never depend on unchecked numbers. Compressed views are decoded on first use, up to a bounded
//! multiple of their bytes.

use super::document::{AccessorEntry, Document, Draco, Filter, SparsePart};
use super::primitive::Part;
use super::{draco, meshopt};
use enfilade::scene::sidecar::Sidecars;
use enfilade::scene::{ImportError, Place};
use std::cell::{Cell, OnceCell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;

/// Shorthand for an error in the document.
pub(super) fn broken(what: impl Into<String>) -> ImportError {
    ImportError::malformed(Place::File, what)
}

/// The entry `index` of a table of the document, or an error that names both.
pub(super) fn entry<'d, T>(table: &'d [T], index: usize, name: &str) -> Result<&'d T, ImportError> {
    table.get(index).ok_or_else(|| broken(format!("{name} {index} is used, there are {}", table.len())))
}

/// The buffers of a document, read on first use.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    bin: Option<&'a [u8]>,
    beside: Sidecars<'a>,
    loaded: Vec<OnceCell<Vec<u8>>>,
    /// Decoded bytes of compressed views.
    decoded: Vec<OnceCell<Vec<u8>>>,
    /// Decoded primitives, by view and id of the positions.
    primitives: RefCell<HashMap<(usize, usize), Rc<Part>>>,
    /// By buffer: number of its compressed bytes that were decoded.
    spent: Vec<Cell<usize>>,
}

impl<'a> Buffers<'a> {
    pub fn new(document: &'a Document, bin: Option<&'a [u8]>, beside: Sidecars<'a>) -> Self {
        Self {
            document,
            bin,
            beside,
            loaded: document.buffers.iter().map(|_| OnceCell::new()).collect(),
            decoded: document.buffer_views.iter().map(|_| OnceCell::new()).collect(),
            primitives: RefCell::default(),
            spent: document.buffers.iter().map(|_| Cell::new(0)).collect(),
        }
    }

    fn buffer(&self, index: usize) -> Result<&[u8], ImportError> {
        let buffer = entry(&self.document.buffers, index, "buffer")?;
        let bytes: &[u8] = match (&buffer.uri, self.bin) {
            (Some(uri), _) => {
                // Buffers of the same file share one copy.
                let first = self.document.buffers.iter().position(|b| b.uri.as_ref() == Some(uri)).unwrap_or(index);
                let cell = &self.loaded[first];
                if cell.get().is_none() {
                    let bytes = load(uri, self.beside).map_err(|e| broken(format!("buffer {index}: {e}")))?;
                    cell.get_or_init(|| bytes);
                }
                cell.get().map_or(&[], |b| b)
            }
            (None, Some(bin)) if index == 0 => bin,
            (None, _) => return Err(broken(format!("buffer {index} has neither a uri nor a BIN chunk"))),
        };
        bytes.get(..buffer.byte_length).ok_or_else(|| {
            broken(format!("buffer {index} has {} bytes, the document says {}", bytes.len(), buffer.byte_length))
        })
    }

    /// Their document.
    pub fn document(&self) -> &'a Document {
        self.document
    }

    /// Bytes of all readable buffers.
    pub fn size(&self) -> usize {
        let size = |i| self.buffer(i).map_or(0, <[u8]>::len);
        (0..self.document.buffers.len()).map(size).fold(0, usize::saturating_add)
    }

    /// The bytes of a buffer view, decoded if compressed.
    pub fn view(&self, view: usize) -> Result<&[u8], ImportError> {
        let entry = entry(&self.document.buffer_views, view, "bufferView")?;
        let within = |buffer: usize, from: usize, len: usize| {
            let buffer = self.buffer(buffer)?;
            from.checked_add(len).and_then(|end| buffer.get(from..end)).ok_or_else(|| {
                broken(format!("bufferView {view}: {len} bytes from {from} on, in a buffer of {}", buffer.len()))
            })
        };
        let Some(compressed) = entry.compressed() else {
            return within(entry.buffer, entry.byte_offset, entry.byte_length);
        };
        let cell = &self.decoded[view];
        if cell.get().is_none() {
            let source = within(compressed.buffer, compressed.byte_offset, compressed.byte_length)?;
            self.spend(compressed.buffer, source.len())?;
            let bytes = meshopt::decode(compressed, source).map_err(|what| broken(format!("bufferView {view}: {what}")))?;
            cell.get_or_init(|| bytes);
        }
        let bytes = cell.get().map_or(&[][..], |b| b);
        if bytes.len() != entry.byte_length {
            return Err(broken(format!("bufferView {view}: {} bytes, {} when decoded", entry.byte_length, bytes.len())));
        }
        Ok(bytes)
    }

    /// Counts compressed bytes before decoding: views that repeat the same bytes are free in the file, but not in memory.
    fn spend(&self, buffer: usize, bytes: usize) -> Result<(), ImportError> {
        let spent = &self.spent[buffer];
        spent.set(spent.get().saturating_add(bytes));
        match spent.get() > self.buffer(buffer)?.len() {
            true => Err(broken(format!("compressed views of buffer {buffer} repeat its bytes"))),
            false => Ok(()),
        }
    }

    /// A primitive of at most `triangles` in Draco compression, decoded once.
    pub fn draco(&self, draco: &Draco, triangles: usize) -> Result<Rc<Part>, ImportError> {
        let view = draco.buffer_view;
        let wrong = |what: String| broken(format!("bufferView {view}: {what}"));
        let position = draco.attributes.position.ok_or_else(|| wrong("Draco compression without positions".to_owned()))?;
        if let Some(part) = self.primitives.borrow().get(&(view, position)) {
            return Ok(Rc::clone(part));
        }
        let source = self.view(view)?;
        self.spend(self.document.buffer_views[view].buffer, source.len())?;
        let part = Rc::new(draco::decode(source, position, triangles).map_err(wrong)?);
        self.primitives.borrow_mut().insert((view, position), Rc::clone(&part));
        Ok(part)
    }

    /// The entry of an accessor, unchecked.
    pub fn claimed(&self, index: usize) -> Result<&AccessorEntry, ImportError> {
        entry(&self.document.accessors, index, "accessor")
    }

    /// Fails if an accessor's bytes went through a filter for normals, quaternions or colours.
    pub fn refuse_filters(&self, index: usize) -> Result<(), ImportError> {
        let view = self.claimed(index)?.buffer_view.and_then(|view| self.document.buffer_views.get(view));
        let filter = view.and_then(|view| view.compressed()).map_or(Filter::None, |compressed| compressed.filter);
        match filter {
            Filter::None | Filter::Exponential => Ok(()),
            _ => Err(broken(format!("accessor {index}: positions and indices do not support this meshopt filter"))),
        }
    }

    /// `count` elements of `size` bytes in a buffer view, from `offset`. A stride below the element's size is an error, so
    /// `count` does not exceed the number of bytes.
    fn elements(&self, view: usize, offset: usize, count: usize, size: usize) -> Result<Elements<'_>, ImportError> {
        let entry = entry(&self.document.buffer_views, view, "bufferView")?;
        let bytes = self.view(view)?;
        let stride = entry.byte_stride.unwrap_or(size);
        if stride < size {
            return Err(broken(format!("bufferView {view}: byteStride {stride} for elements of {size} bytes")));
        }
        let length = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
        let end = length.and_then(|l| l.checked_add(offset));
        let bytes = end.and_then(|end| bytes.get(offset..end)).ok_or_else(|| {
            let have = bytes.len();
            broken(format!("bufferView {view}: {count} elements of {size} bytes from byte {offset} on, in {have} bytes"))
        })?;
        Ok(Elements { bytes, stride })
    }

    /// Accessor `index`, which must be of one of the `kinds` (`SCALAR`, `VEC2`, `VEC3`, `VEC4`).
    pub fn accessor(&self, index: usize, kinds: &[&str]) -> Result<Accessor<'_>, ImportError> {
        let entry = entry(&self.document.accessors, index, "accessor")?;
        let wrong = |what: String| broken(format!("accessor {index}: {what}"));
        if !kinds.contains(&entry.kind.as_str()) {
            return Err(wrong(format!("type {} where {} is expected", entry.kind, kinds.join(" or "))));
        }
        let width = width(&entry.kind);
        let component = Component::of(entry.component_type)
            .ok_or_else(|| wrong(format!("component type {} is not valid in glTF", entry.component_type)))?;
        let size = component.size() * width;
        let base = match entry.buffer_view {
            Some(view) => Some(self.elements(view, entry.byte_offset, entry.count, size)?),
            None => None,
        };
        let sparse = self.sparse(entry, size).map_err(|e| wrong(e.to_string()))?;
        match (&base, &entry.sparse) {
            (None, None) => return Err(wrong("no bufferView: its data is missing or compressed".into())),
            // Zeros take no bytes, so nothing else limits this count.
            (None, Some(s)) if entry.count > self.room_of(s.values.buffer_view) => {
                return Err(wrong(format!("{} elements, but {} are stored", entry.count, s.count)));
            }
            _ => {}
        }
        Ok(Accessor { base, sparse, count: entry.count, width, component, normalized: entry.normalized })
    }

    /// Bytes of the buffer behind a buffer view.
    fn room_of(&self, view: usize) -> usize {
        let view = self.document.buffer_views.get(view);
        let buffer = view.map(|v| v.compressed().map_or(v.buffer, |c| c.buffer));
        buffer.and_then(|b| self.buffer(b).ok()).map_or(0, <[u8]>::len)
    }

    fn sparse(&self, entry: &AccessorEntry, size: usize) -> Result<Option<Sparse<'_>>, ImportError> {
        let Some(sparse) = &entry.sparse else { return Ok(None) };
        let SparsePart { buffer_view, byte_offset, component_type } = sparse.indices;
        let component = component_type.and_then(Component::of).filter(|c| c.is_index());
        let component = component.ok_or_else(|| broken("sparse indices that are not unsigned integers"))?;
        let indices = self.elements(buffer_view, byte_offset, sparse.count, component.size())?;
        let values = self.elements(sparse.values.buffer_view, sparse.values.byte_offset, sparse.count, size)?;
        let sparse = Sparse { indices, component, values, count: sparse.count };
        let ascending = (1..sparse.count).all(|i| sparse.index(i - 1) < sparse.index(i));
        let inside = sparse.count.checked_sub(1).is_none_or(|last| (sparse.index(last) as usize) < entry.count);
        if ascending && inside { Ok(Some(sparse)) } else { Err(broken("sparse indices out of order or out of range")) }
    }
}

/// Elements in a buffer, `stride` bytes apart; all of them lie inside `bytes`.
struct Elements<'b> {
    bytes: &'b [u8],
    stride: usize,
}

impl Elements<'_> {
    fn at(&self, i: usize) -> &[u8] {
        &self.bytes[i * self.stride..]
    }
}

struct Sparse<'b> {
    indices: Elements<'b>,
    component: Component,
    values: Elements<'b>,
    count: usize,
}

impl Sparse<'_> {
    fn index(&self, i: usize) -> u32 {
        self.component.index(self.indices.at(i))
    }

    /// The replacement of element `i`, if there is one.
    fn find(&self, i: usize) -> Option<&[u8]> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low.midpoint(high);
            if (self.index(middle) as usize) < i {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        (low < self.count && self.index(low) as usize == i).then(|| self.values.at(low))
    }
}

/// Numbers in buffers, converted to `f64` on reading.
pub(super) struct Accessor<'b> {
    base: Option<Elements<'b>>,
    sparse: Option<Sparse<'b>>,
    count: usize,
    width: usize,
    component: Component,
    normalized: bool,
}

impl Accessor<'_> {
    /// Number of elements in the document. Their bytes exist, except for an accessor with sparse values only (the others are
    /// zero).
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether vertex indices may have this component type.
    pub fn holds_indices(&self) -> bool {
        self.component.is_index() && !self.normalized
    }

    /// Bytes of an element.
    pub fn size(&self) -> usize {
        self.width * self.component.size()
    }

    /// The bytes from element `i` on; `None` beyond the count and for a zero that is not stored.
    pub fn bytes(&self, i: usize) -> Option<&[u8]> {
        let replaced = self.sparse.as_ref().and_then(|s| s.find(i));
        replaced.or_else(|| self.base.as_ref().filter(|_| i < self.count).map(|b| b.at(i)))
    }

    /// Element `i`, padded with zeros; `None` beyond the count.
    pub fn get(&self, i: usize) -> Option<[f64; 4]> {
        let mut out = [0.0; 4];
        if i >= self.count {
            return None;
        }
        if let Some(bytes) = self.bytes(i) {
            for (k, out) in out.iter_mut().enumerate().take(self.width) {
                *out = self.component.number(&bytes[k * self.component.size()..], self.normalized);
            }
        }
        Some(out)
    }

    /// Element `i` as a matrix, column by column; `None` beyond the count.
    pub fn matrix(&self, i: usize) -> Option<[f64; 16]> {
        let bytes = self.bytes(i).filter(|_| i < self.count)?;
        Some(std::array::from_fn(|k| match k < self.width {
            true => self.component.number(&bytes[k * self.component.size()..], self.normalized),
            false => 0.0,
        }))
    }

    /// Element `i` as a vertex index; `None` beyond the count.
    pub fn index(&self, i: usize) -> Option<u32> {
        (i < self.count).then(|| self.bytes(i).map_or(0, |bytes| self.component.index(bytes)))
    }
}

/// Numbers of an element: of `SCALAR`, `VEC2`, `VEC3`, `VEC4` or `MAT4`.
pub(super) fn width(kind: &str) -> usize {
    match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "MAT4" => 16,
        _ => 4,
    }
}

/// The numbers in the bytes of an element, not normalised.
pub(super) fn numbers(bytes: &[u8], component_type: u64) -> impl Iterator<Item = f64> {
    let component = Component::of(component_type).unwrap_or(Component::U8);
    bytes.chunks_exact(component.size()).map(move |b| component.number(b, false))
}

#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u64) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    fn is_index(self) -> bool {
        matches!(self, Self::U8 | Self::U16 | Self::U32)
    }

    /// The number at the start of `bytes`; integers that are `normalized` map to -1..=1 or 0..=1 (specification, 3.11).
    fn number(self, b: &[u8], normalized: bool) -> f64 {
        let (value, most) = match self {
            Self::I8 => (f64::from(b[0] as i8), 127.0),
            Self::U8 => (f64::from(b[0]), 255.0),
            Self::I16 => (f64::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
            Self::U16 => (f64::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
            Self::U32 => (f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])), f64::from(u32::MAX)),
            Self::F32 => return f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        };
        if normalized { (value / most).max(-1.0) } else { value }
    }

    /// The unsigned integer at the start of `bytes`; 0 for other types ([`Component::is_index`]).
    fn index(self, b: &[u8]) -> u32 {
        match self {
            Self::U8 => u32::from(b[0]),
            Self::U16 => u32::from(u16::from_le_bytes([b[0], b[1]])),
            Self::U32 => u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            Self::I8 | Self::I16 | Self::F32 => 0,
        }
    }
}

/// The bytes behind a uri: a `data:` uri in base64, or a file beside the model.
pub(super) fn load(uri: &str, beside: Sidecars<'_>) -> Result<Vec<u8>, String> {
    match uri.strip_prefix("data:") {
        Some(data) => match data.split_once(',') {
            Some((kind, text)) if kind.ends_with(";base64") => base64(text.as_bytes()).ok_or("broken base64 text".into()),
            _ => Err("a data: uri that is not in base64".into()),
        },
        None => beside.read(&percent_decoded(uri)),
    }
}

/// Base64 with the standard alphabet (RFC 4648, section 4), padded or not.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let end = text.len() - text.iter().rev().take(2).take_while(|&&b| b == b'=').count();
    let text = &text[..end];
    if text.len() % 4 == 1 {
        return None;
    }
    let mut out = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for four in text.chunks(4) {
        let mut bits = 0u32;
        for &b in four {
            let six = match b {
                b'A'..=b'Z' => b - b'A',
                b'a'..=b'z' => b - b'a' + 26,
                b'0'..=b'9' => b - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(six);
        }
        bits <<= 6 * (4 - four.len());
        out.extend_from_slice(&bits.to_be_bytes()[1..four.len()]);
    }
    Some(out)
}

/// Decodes `%20` and the like; other text stays as it is.
pub(super) fn percent_decoded(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let hex = (bytes[i] == b'%').then(|| bytes.get(i + 1..i + 3)).flatten();
        let byte = hex.and_then(|h| Some((h[0] as char).to_digit(16)? * 16 + (h[1] as char).to_digit(16)?));
        out.push(byte.map_or(bytes[i], |b| b as u8));
        i += if byte.is_some() { 3 } else { 1 };
    }
    String::from_utf8_lossy(&out).into_owned()
}

#[cfg(test)]
mod tests {
    use super::{base64, percent_decoded};

    /// RFC 4648, section 10.
    #[test]
    fn base64_reads_the_standards_own_examples() {
        let examples =
            [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg==", "foob"), ("Zm9vYmE=", "fooba")];
        for (text, bytes) in examples {
            assert_eq!(base64(text.as_bytes()).unwrap(), bytes.as_bytes());
            assert_eq!(base64(text.trim_end_matches('=').as_bytes()).unwrap(), bytes.as_bytes());
        }
        assert_eq!(base64(b"+/+/").unwrap(), [0xFB, 0xFF, 0xBF]);
        for bad in ["Z", "Zg=", "Z===", "Zm9 ", "Zm=v", "Zm9vY"] {
            assert_eq!(base64(bad.as_bytes()), if bad == "Zg=" { Some(b"f".to_vec()) } else { None }, "{bad}");
        }
    }

    #[test]
    fn percent_signs_are_decoded_where_they_are_codes() {
        assert_eq!(percent_decoded("my%20hall%C3%A4.bin"), "my hallä.bin");
        assert_eq!(percent_decoded("50%.bin%2"), "50%.bin%2");
    }
}
