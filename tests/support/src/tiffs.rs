//! TIFF files by hand, byte by byte, after *TIFF 6.0*.

use std::io::Write;

/// A raster and how to write it.
#[derive(Clone, Default)]
pub struct Tiff {
    /// Columns, rows.
    pub size: [usize; 2],
    /// Bytes of a sample: two for whole numbers, four for floats.
    pub samples: Vec<Vec<u8>>,
    /// 2: signed whole numbers; 3: floats.
    pub format: u16,
    /// Columns and rows of a tile; otherwise there is one strip.
    pub tile: Option<[usize; 2]>,
    /// Deflate.
    pub packed: bool,
    /// LZW.
    pub lzw: bool,
    /// 1 and 0: none; 2: differences; 3: differences of the bytes of floats.
    pub predictor: u16,
    /// BigTIFF: places of eight bytes.
    pub large: bool,
    /// The highest byte first.
    pub big: bool,
    /// More tags: number, type, values with the lowest byte first unless `big`. They replace those of the same number.
    pub tags: Vec<(u16, u16, Vec<u8>)>,
}

impl Tiff {
    /// A raster of `i16`.
    pub fn wholes(size: [usize; 2], heights: &[i16]) -> Self {
        let samples = heights.iter().map(|h| h.to_le_bytes().to_vec()).collect();
        Self { size, samples, format: 2, ..Self::default() }
    }

    /// A raster of `f32`.
    pub fn floats(size: [usize; 2], heights: &[f32]) -> Self {
        let samples = heights.iter().map(|h| h.to_le_bytes().to_vec()).collect();
        Self { size, samples, format: 3, ..Self::default() }
    }

    /// With a tag of `f64` values.
    pub fn doubles(mut self, tag: u16, values: &[f64]) -> Self {
        let bytes = values.iter().flat_map(|v| if self.big { v.to_be_bytes() } else { v.to_le_bytes() }).collect();
        self.tags.push((tag, 12, bytes));
        self
    }

    /// With a tag of `u16` values.
    pub fn shorts(mut self, tag: u16, values: &[u16]) -> Self {
        let bytes = values.iter().flat_map(|v| if self.big { v.to_be_bytes() } else { v.to_le_bytes() }).collect();
        self.tags.push((tag, 3, bytes));
        self
    }

    fn word(&self, value: usize, width: usize) -> Vec<u8> {
        let bytes = (value as u64).to_le_bytes();
        let mut bytes = bytes[..width].to_vec();
        if self.big {
            bytes.reverse();
        }
        bytes
    }

    /// Strips or tiles.
    fn chunks(&self) -> Vec<Vec<u8>> {
        let [columns, rows] = self.size;
        let [width, height] = self.tile.unwrap_or(self.size);
        let bytes = self.samples[0].len();
        let mut chunks = Vec::new();
        for (y, x) in (0..rows).step_by(height).flat_map(|y| (0..columns).step_by(width).map(move |x| (y, x))) {
            let mut chunk = Vec::new();
            for row in y..y + height {
                let mut before = 0i16;
                for column in x..x + width {
                    let inside = row < rows && column < columns;
                    let mut sample = if inside { self.samples[row * columns + column].clone() } else { vec![0; bytes] };
                    if self.predictor == 2 {
                        let value = i16::from_le_bytes([sample[0], sample[1]]);
                        sample = value.wrapping_sub(before).to_le_bytes().to_vec();
                        before = value;
                    }
                    if self.big {
                        sample.reverse();
                    }
                    chunk.extend(sample);
                }
                if self.predictor == 3 {
                    let start = chunk.len() - width * bytes;
                    self.split(&mut chunk[start..], bytes);
                }
            }
            if self.lzw {
                chunk = lzw(&chunk);
            }
            if self.packed {
                let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
                packer.write_all(&chunk).unwrap();
                chunk = packer.finish().unwrap();
            }
            chunks.push(chunk);
        }
        chunks
    }

    /// A row of floats, as *TIFF Technical Note 3* has it: the highest byte of each, then the next of each; then differences.
    fn split(&self, row: &mut [u8], bytes: usize) {
        let from = row.to_vec();
        let count = row.len() / bytes;
        for (k, place) in row.iter_mut().enumerate() {
            let byte = if self.big { k / count } else { bytes - 1 - k / count };
            *place = from[k % count * bytes + byte];
        }
        for k in (1..row.len()).rev() {
            row[k] = row[k].wrapping_sub(row[k - 1]);
        }
    }

    /// The file.
    pub fn bytes(&self) -> Vec<u8> {
        let chunks = self.chunks();
        let mut file = if self.big { b"MM".to_vec() } else { b"II".to_vec() };
        file.extend(self.word(if self.large { 43 } else { 42 }, 2));
        // BigTIFF says how wide its places are.
        let head = if self.large { [self.word(8, 2), vec![0; 10]].concat() } else { vec![0; 4] };
        file.extend(head);
        let [wide, counter] = if self.large { [8, 8] } else { [4, 2] };
        let mut places = Vec::new();
        for chunk in &chunks {
            places.push(file.len());
            file.extend(chunk);
        }
        let longs = |values: &[usize]| values.iter().flat_map(|v| self.word(*v, 4)).collect::<Vec<u8>>();
        let lengths: Vec<usize> = chunks.iter().map(Vec::len).collect();
        let short = |v: usize| (3, self.word(v, 2));
        let mut tags = std::collections::BTreeMap::from([
            (256, (4, longs(&[self.size[0]]))),
            (257, (4, longs(&[self.size[1]]))),
            (258, short(8 * self.samples[0].len())),
            (259, short(if self.lzw { 5 } else { 1 + 7 * usize::from(self.packed) })),
            (262, short(1)),
            (277, short(1)),
            (317, short(self.predictor.max(1).into())),
            (339, short(self.format.into())),
        ]);
        let [offsets, counts] = if self.tile.is_some() { [324, 325] } else { [273, 279] };
        tags.insert(offsets, (4, longs(&places)));
        tags.insert(counts, (4, longs(&lengths)));
        match self.tile {
            Some([width, height]) => tags.extend([(322, short(width)), (323, short(height))]),
            None => tags.extend([(278, (4, longs(&[self.size[1]])))]),
        }
        tags.extend(self.tags.iter().map(|(tag, kind, bytes)| (*tag, (*kind, bytes.clone()))));
        file.resize(file.len().next_multiple_of(2), 0);
        let mut directory = self.word(tags.len(), counter);
        for (tag, (kind, values)) in tags {
            let width = match kind {
                3 => 2,
                4 => 4,
                12 => 8,
                _ => 1,
            };
            directory.extend([self.word(tag.into(), 2), self.word(kind.into(), 2)].concat());
            directory.extend(self.word(values.len() / width, wide));
            if values.len() <= wide {
                directory.extend(values.iter().copied().chain([0; 8]).take(wide));
            } else {
                directory.extend(self.word(file.len(), wide));
                file.extend(values);
            }
        }
        directory.extend(vec![0; wide]);
        let at = self.word(file.len(), wide);
        let place = if self.large { 8 } else { 4 };
        file[place..place + wide].copy_from_slice(&at);
        file.extend(directory);
        file
    }
}

/// LZW after *TIFF 6.0*, section 13: codes of 9 to 12 bits, the highest bit first, which widen one code early.
fn lzw(bytes: &[u8]) -> Vec<u8> {
    const CLEAR: u32 = 256;
    const END: u32 = 257;
    let (mut out, mut held, mut bits) = (Vec::new(), 0u64, 0);
    let mut put = |code: u32, width: u32| {
        (held, bits) = (held << width | u64::from(code), bits + width);
        while bits >= 8 {
            bits -= 8;
            out.push((held >> bits) as u8);
        }
    };
    let mut known: std::collections::HashMap<(u32, u8), u32> = std::collections::HashMap::new();
    let (mut next, mut width) = (END + 1, 9);
    put(CLEAR, 9);
    let mut string: Option<u32> = None;
    for &byte in bytes {
        let Some(before) = string else {
            string = Some(byte.into());
            continue;
        };
        if let Some(&code) = known.get(&(before, byte)) {
            string = Some(code);
            continue;
        }
        put(before, width);
        known.insert((before, byte), next);
        next += 1;
        if next == 1 << width && width < 12 {
            width += 1;
        }
        if next == 4095 {
            put(CLEAR, width);
            known.clear();
            (next, width) = (END + 1, 9);
        }
        string = Some(byte.into());
    }
    if let Some(code) = string {
        put(code, width);
        next += 1;
        if next == 1 << width && width < 12 {
            width += 1;
        }
    }
    put(END, width);
    put(0, 7);
    out
}
