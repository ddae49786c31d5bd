//! `.ground` files by hand, and taken apart: by docs/format.md alone, without the project's own reader and writer.

use xxhash_rust::xxh3::xxh3_64;

/// Bytes of the header and of an entry of the table.
pub const HEADER: usize = 112;
pub const ENTRY: usize = 32;

/// A file in parts. Lengths and checksums are put right when it is written.
#[derive(Clone, PartialEq, Debug)]
pub struct GroundFile {
    pub head: Vec<u8>,
    pub table: Vec<Vec<u8>>,
    pub tiles: Vec<Vec<u8>>,
}

/// Tiles across and down by level, the coarsest first.
fn levels([columns, rows]: [u32; 2], side: u32, divided: bool) -> Vec<[u32; 2]> {
    let mut levels = vec![[columns, rows].map(|n| (n - 1).div_ceil(side - 1))];
    while divided && levels[0] != [1, 1] {
        levels.insert(0, levels[0].map(|n| n.div_ceil(2)));
    }
    levels
}

/// By tile: its level, its place, and whether there is a coarser one.
fn tiles(size: [u32; 2], side: u32, divided: bool) -> Vec<(u32, [u32; 2], bool)> {
    let levels = levels(size, side, divided);
    let top = levels.len() as u32 - 1;
    let of = |k: usize, [across, down]: [u32; 2]| {
        let level = top - k as u32;
        (0..down).flat_map(move |y| (0..across).map(move |x| (level, [x, y], level < top)))
    };
    levels.iter().enumerate().flat_map(|(k, &size)| of(k, size)).collect()
}

/// Samples that a tile stores, to the east and to the south, in their order.
fn samples(side: u32, has_coarser: bool) -> Vec<[u32; 2]> {
    let all = (0..side).flat_map(|j| (0..side).map(move |i| [i, j]));
    all.filter(|[i, j]| !has_coarser || i % 2 == 1 || j % 2 == 1).collect()
}

impl GroundFile {
    /// Numbers by column and row, two bytes each, a metre a step; samples 10 m apart. 0xffff: no height.
    pub fn by_hand(size: [u32; 2], side: u32, divided: bool, number: impl Fn(u32, u32) -> u16) -> Self {
        let mut head = b"\x89GRN\r\n\x1a\n".to_vec();
        for field in [1, 2, size[0], size[1], side, u32::from(divided)] {
            head.extend(field.to_le_bytes());
        }
        head.extend([0; 8]);
        let middle = size.map(|n| 5.0 * f64::from(n - 1));
        for field in [10.0, 10.0, middle[0], -middle[1], 0.0, 1.0f64] {
            head.extend(field.to_le_bytes());
        }
        let voids = (0..size[1]).flat_map(|r| (0..size[0]).map(move |c| (c, r))).filter(|&(c, r)| number(c, r) == 0xffff);
        head.extend((voids.count() as u64).to_le_bytes());
        head.extend([0; 16]);
        let mut file = Self { head, table: vec![], tiles: vec![] };
        for (level, place, has_coarser) in tiles(size, side, divided) {
            let at = |k: usize, i: u32| (((place[k] * (side - 1)) + i) << level).min(size[k] - 1);
            let bytes = samples(side, has_coarser).into_iter().flat_map(|[i, j]| number(at(0, i), at(1, j)).to_le_bytes());
            file.tiles.push(bytes.collect());
            let raster = (at(1, 0)..=at(1, side - 1)).flat_map(|r| (at(0, 0)..=at(0, side - 1)).map(move |c| (c, r)));
            let heights: Vec<f32> = raster.map(|(c, r)| number(c, r)).filter(|&n| n != 0xffff).map(f32::from).collect();
            let mut entry = vec![0; ENTRY];
            if !heights.is_empty() {
                let low = heights.iter().fold(f32::MAX, |a, &b| a.min(b));
                let high = heights.iter().fold(f32::MIN, |a, &b| a.max(b));
                let numbers = [low.next_down(), high.next_up(), (high - low) * level as f32, 0.0];
                entry[..16].copy_from_slice(&numbers.map(f32::to_le_bytes).concat());
                entry[16..20].copy_from_slice(&(heights.len() as u32).to_le_bytes());
            }
            file.table.push(entry);
        }
        file
    }

    /// Takes a whole file apart.
    pub fn take_apart(bytes: &[u8]) -> Self {
        let mut file = Self { head: bytes[..HEADER].to_vec(), table: vec![], tiles: vec![] };
        let lengths = file.lengths().expect("a sound header");
        let (table, mut rest) = bytes[HEADER..].split_at(ENTRY * lengths.len());
        file.table = table.chunks(ENTRY).map(<[u8]>::to_vec).collect();
        for length in lengths {
            let (tile, after) = rest.split_at(length);
            file.tiles.push(tile.to_vec());
            rest = after;
        }
        assert!(rest.is_empty(), "the tiles are all");
        file
    }

    /// A `u32` of the header.
    pub fn field(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.head[at..at + 4].try_into().expect("four bytes"))
    }

    /// Bytes by tile, as the header has it; `None` where it has nonsense, or more than some hundred tiles.
    fn lengths(&self) -> Option<Vec<usize>> {
        const MOST: u64 = 512;
        let [width, columns, rows, side, divided] = [12, 16, 20, 24, 28].map(|at| self.field(at));
        let known = [2, 4].contains(&width) && [33, 65, 129].contains(&side) && divided < 2;
        let [across, down] = [columns, rows].map(|n| u64::from(n.saturating_sub(1)).div_ceil(u64::from(side.max(2) - 1)));
        if !known || columns < 2 || rows < 2 || across * down > MOST {
            return None;
        }
        let tiles = tiles([columns, rows], side, divided == 1).into_iter();
        Some(tiles.map(|(_, _, has_coarser)| samples(side, has_coarser).len() * width as usize).collect())
    }

    /// Cuts or fills table and tiles to what the header says, where that is no nonsense.
    pub fn fit(&mut self) {
        let Some(lengths) = self.lengths() else { return };
        let last = self.table.last().cloned().unwrap_or_else(|| vec![0; ENTRY]);
        self.table.resize(lengths.len(), last);
        self.tiles.resize(lengths.len(), Vec::new());
        self.tiles.iter_mut().zip(lengths).for_each(|(tile, length)| tile.resize(length, 0));
    }

    /// Puts each tile's checksum into the table.
    pub fn sign(&mut self) {
        for (entry, tile) in self.table.iter_mut().zip(&self.tiles) {
            entry[24..].copy_from_slice(&xxh3_64(tile).to_le_bytes());
        }
    }

    /// Where a tile begins.
    pub fn place(&self, tile: usize) -> usize {
        HEADER + ENTRY * self.table.len() + self.tiles[..tile].iter().map(Vec::len).sum::<usize>()
    }

    /// The file, with the right length and the checksums of header and table.
    pub fn bytes(&self) -> Vec<u8> {
        let (table, mut head) = (self.table.concat(), self.head.clone());
        let length = HEADER + table.len() + self.tiles.iter().map(Vec::len).sum::<usize>();
        head[32..40].copy_from_slice(&(length as u64).to_le_bytes());
        head[96..104].copy_from_slice(&xxh3_64(&table).to_le_bytes());
        let sum = xxh3_64(&head[..104]);
        head[104..].copy_from_slice(&sum.to_le_bytes());
        [head, table, self.tiles.concat()].concat()
    }
}

/// A small ground of hills, in levels.
pub fn hills() -> GroundFile {
    let mut file = GroundFile::by_hand([70, 90], 33, true, |c, r| 300 + (c * c / 7 + 13 * r) as u16 % 211);
    file.sign();
    file
}
