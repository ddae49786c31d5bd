//! Files made by hand: a `.pvs` file taken apart, changed and put together again with right checksums. Written from
//! docs/format.md, not with the library, so that the page is tested, too.

use crate::random::Random;
use enfilade::cells::{PortalKind, PortalState, Strategy};
use enfilade::file::{
    Bounds, FileCell, FileObject, FilePortal, FileRelevance, FileViewCell, FileWaysIn, Gap, Import, PairCounts,
};
use enfilade::file::{PvsFile, ViewBounds, Views};
use enfilade::pvs::{Guarantee, PvsStats, Repair, Witness};
use enfilade::types::placed::PlacedBox;
use enfilade::{BitMatrix, CellId, DirectedPortal, ObjectId};
use glam::{DVec3, Vec3};
use xxhash_rust::xxh3::xxh3_64;

/// A section as it stands in a file.
#[derive(Clone, Debug)]
pub struct Part {
    pub number: u32,
    pub flags: u32,
    pub stored: Vec<u8>,
    pub decoded: u64,
}

/// A file in pieces.
#[derive(Clone, Debug)]
pub struct Forged {
    pub magic: [u8; 8],
    pub version: u32,
    pub model_hash: u128,
    pub guarantee: u8,
    pub reserved: [u8; 7],
    pub parts: Vec<Part>,
}

pub const REQUIRED: u32 = 1;
pub const ZSTD: u32 = 2;

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
}

impl Forged {
    pub fn take_apart(bytes: &[u8]) -> Self {
        let count = u32_at(bytes, 12) as usize;
        let mut offset = 56 + 32 * count;
        let parts = (0..count)
            .map(|i| {
                let at = 56 + 32 * i;
                let start = offset;
                offset += u64_at(bytes, at + 8) as usize;
                let stored = bytes[start..offset].to_vec();
                assert_eq!(xxh3_64(&stored), u64_at(bytes, at + 24));
                Part { number: u32_at(bytes, at), flags: u32_at(bytes, at + 4), stored, decoded: u64_at(bytes, at + 16) }
            })
            .collect();
        Self {
            magic: bytes[..8].try_into().unwrap(),
            version: u32_at(bytes, 8),
            model_hash: u128::from_le_bytes(bytes[24..40].try_into().unwrap()),
            guarantee: bytes[40],
            reserved: bytes[41..48].try_into().unwrap(),
            parts,
        }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let table_end = 56 + 32 * self.parts.len();
        let length = table_end + self.parts.iter().map(|p| p.stored.len()).sum::<usize>();
        let mut out = Vec::new();
        out.extend(self.magic);
        out.extend(self.version.to_le_bytes());
        out.extend((self.parts.len() as u32).to_le_bytes());
        out.extend((length as u64).to_le_bytes());
        out.extend(self.model_hash.to_le_bytes());
        out.push(self.guarantee);
        out.extend(self.reserved);
        out.extend([0; 8]);
        for p in &self.parts {
            out.extend(p.number.to_le_bytes());
            out.extend(p.flags.to_le_bytes());
            out.extend((p.stored.len() as u64).to_le_bytes());
            out.extend(p.decoded.to_le_bytes());
            out.extend(xxh3_64(&p.stored).to_le_bytes());
        }
        sign(&mut out);
        self.parts.iter().for_each(|p| out.extend(&p.stored));
        out
    }

    pub fn part(&mut self, number: u32) -> &mut Part {
        self.parts.iter_mut().find(|p| p.number == number).expect("the sample has the section")
    }

    pub fn remove(&mut self, number: u32) {
        self.parts.retain(|p| p.number != number);
    }

    /// The decoded bytes of a section.
    pub fn decoded(&self, number: u32) -> Vec<u8> {
        let part = self.parts.iter().find(|p| p.number == number).expect("the sample has the section");
        if part.flags & ZSTD != 0 {
            zstd::bulk::decompress(&part.stored, part.decoded as usize).unwrap()
        } else {
            part.stored.clone()
        }
    }

    /// Puts decoded bytes into a section, not compressed.
    pub fn put(&mut self, number: u32, decoded: Vec<u8>) {
        let part = self.part(number);
        part.flags &= !ZSTD;
        part.decoded = decoded.len() as u64;
        part.stored = decoded;
    }
}

pub fn u32s(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

/// Writes the header's checksum over its table.
pub fn sign(bytes: &mut [u8]) {
    let table_end = 56 + 32 * u32_at(bytes, 12) as usize;
    let checksum = xxh3_64(&[&bytes[..48], &bytes[56..table_end]].concat());
    bytes[48..56].copy_from_slice(&checksum.to_le_bytes());
}

impl Random {
    fn point(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed()) * 50.0
    }

    fn text(&mut self) -> String {
        let letters = ['a', 'Z', '7', ' ', '"', '\n', 'é', '扉', '🚪'];
        (0..self.below(9)).map(|_| letters[self.below(letters.len())]).collect()
    }

    fn source(&mut self) -> Option<String> {
        (self.below(2) == 1).then(|| self.text())
    }

    /// A state that a file may hold: nothing is shut that isn't closable.
    fn state(&mut self) -> PortalState {
        let closable = self.below(2) == 1;
        let shut = closable && self.below(2) == 1;
        let see_through = self.below(2) == 1;
        PortalState { shut, see_through, closable, ajar: shut && see_through }
    }

    fn plane(&mut self) -> glam::Vec4 {
        let n = (self.point() + DVec3::splat(0.5)).normalize_or(DVec3::Y);
        n.as_vec3().extend(self.signed() as f32 * 30.0)
    }

    fn cell(&mut self) -> FileCell {
        FileCell {
            name: self.text(),
            source: self.source(),
            open: self.below(2) == 1,
            pieces: (0..self.below(3)).map(|_| (0..self.below(8)).map(|_| self.plane()).collect()).collect(),
        }
    }

    /// A portal between two of these cells, of which there are two or more.
    fn portal(&mut self, cells: usize) -> FilePortal {
        let kinds = [PortalKind::Door, PortalKind::Window, PortalKind::Opening];
        let from = self.below(cells);
        let to = (from + 1 + self.below(cells - 1)) % cells;
        FilePortal {
            cells: [CellId(from as u32), CellId(to as u32)],
            plane: self.plane(),
            winding: (0..3 + self.below(4)).map(|_| self.point().as_vec3()).collect(),
            kind: kinds[self.below(3)],
            state: self.state(),
            source: self.source(),
        }
    }

    fn object(&mut self) -> FileObject {
        let (a, b) = (self.point().as_vec3(), self.point().as_vec3());
        FileObject { node: self.text(), triangles: 1 + self.below(300) as u32, bounds: [Vec3::min(a, b), Vec3::max(a, b)] }
    }

    fn placed_box(&mut self) -> PlacedBox {
        // Least, then greatest.
        let mut corners: [[u8; 3]; 2] = std::array::from_fn(|_| std::array::from_fn(|_| self.below(256) as u8));
        (0..3).for_each(|axis| {
            let [a, b] = corners.map(|corner| corner[axis]);
            (corners[0][axis], corners[1][axis]) = (a.min(b), a.max(b));
        });
        let [[a, b, c], [d, e, f]] = corners;
        PlacedBox([a, b, c, d, e, f])
    }

    fn repair(&mut self, cells: usize) -> Repair {
        Repair {
            cells: [CellId(self.below(cells) as u32), CellId(self.below(cells) as u32)],
            at: self.point(),
            segment: [self.point(), self.point()],
        }
    }

    /// A witness for each pair.
    fn witnesses(&mut self, lower: &BitMatrix) -> Vec<Witness> {
        let pairs = (0..lower.rows()).flat_map(|cell| lower.ones(cell).map(move |object| (cell, object)));
        let witness = |(cell, object)| Witness {
            cell: CellId(cell as u32),
            object: ObjectId(object as u32),
            from: self.point(),
            to: self.point(),
        };
        pairs.map(witness).collect()
    }

    fn stats(&mut self) -> PvsStats {
        PvsStats {
            rays: self.word(),
            cubes: 3,
            flow_steps: self.word(),
            flow_over_budget: 1,
            kept_unproven: 2,
            left_out_unproven: 3,
            contradictions: self.word(),
        }
    }

    /// A lower set within an upper set.
    fn sides(&mut self, rows: usize, columns: usize, eighths: usize) -> [BitMatrix; 2] {
        let (upper, mut lower) = (self.matrix(rows, columns, eighths), BitMatrix::new(rows, columns));
        for row in 0..rows {
            upper.ones(row).filter(|_| self.below(4) > 0).for_each(|column| {
                lower.set(row, column);
            });
        }
        [lower, upper]
    }

    /// Bits set with a probability of `eighths` / 8, and the diagonal.
    pub fn matrix(&mut self, rows: usize, columns: usize, eighths: usize) -> BitMatrix {
        let mut out = BitMatrix::new(rows, columns);
        for row in 0..rows {
            for column in 0..columns {
                if self.below(8) < eighths || row == column {
                    out.set(row, column);
                }
            }
        }
        out
    }
}

/// How large a file is.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    pub cells: usize,
    pub portals: usize,
    pub objects: usize,
    pub keep_bounds: bool,
}

/// The rows that a file has of two sets; none where every pair is in them.
fn shipped(guarantee: Guarantee, [lower, upper]: [&BitMatrix; 2]) -> Option<BitMatrix> {
    let rows = if guarantee == Guarantee::Conservative { upper } else { lower };
    (rows.count_ones() < (rows.rows() * rows.columns()) as u64).then(|| rows.clone())
}

/// Undecided pairs by their reasons; none where all are decided.
fn gap(pairs: &PairCounts) -> Option<Gap> {
    (pairs.upper > pairs.lower).then(|| {
        let undecided = pairs.upper - pairs.lower;
        let part = undecided / 3;
        Gap { closed_upper: pairs.upper, tolerance: part, inside: part, budget: undecided - 2 * part, open: 0 }
    })
}

/// A file whose fields agree with each other and are otherwise anything.
pub fn random_file(seed: u64, shape: Shape) -> PvsFile {
    let r = &mut Random::new(seed);
    let Shape { cells, objects, .. } = shape;
    let portals = if cells > 1 { shape.portals } else { 0 };
    let density = r.below(9);
    let [cells_lower, cells_upper] = r.sides(cells, cells, density);
    let [objects_lower, objects_upper] = r.sides(cells, objects, density);
    let guarantee = if r.below(2) == 0 { Guarantee::Conservative } else { Guarantee::Sampled };
    let pairs = PairCounts {
        lower: objects_lower.count_ones(),
        upper: objects_upper.count_ones(),
        cell_lower: cells_lower.count_ones(),
        cell_upper: cells_upper.count_ones(),
    };
    let cell_rows = shipped(guarantee, [&cells_lower, &cells_upper]);
    let object_rows = shipped(guarantee, [&objects_lower, &objects_upper]);
    let witnesses = r.witnesses(&objects_lower);
    let bounds = Bounds { cells_lower, cells_upper, objects_lower, objects_upper, witnesses };
    let strategies = [Strategy::Authored, Strategy::Plan, Strategy::Given, Strategy::Bsp];
    let placement = r.matrix(cells, objects, 1);
    let placed = (placement.count_ones() > 0 && r.below(2) == 1)
        .then(|| (0..placement.count_ones()).map(|_| r.placed_box()).collect());
    PvsFile {
        model_hash: u128::from(r.word()) << 64 | u128::from(r.word()),
        origin: r.point().round(),
        guarantee,
        import: import(1 + r.below(1000) as u32, r.below(2) == 1),
        strategy: strategies[r.below(4)],
        reason: r.text(),
        smallest_hole: r.signed().abs(),
        left_out: (0..r.below(4)).map(|_| r.text()).collect(),
        notes: (0..r.below(4)).map(|_| r.text()).collect(),
        cells: (0..cells).map(|_| r.cell()).collect(),
        portals: (0..portals).map(|_| r.portal(cells)).collect(),
        objects: (0..objects).map(|_| r.object()).collect(),
        placement,
        placed,
        cell_rows,
        object_rows,
        bounds: shape.keep_bounds.then_some(bounds),
        pairs,
        repairs: (0..if cells > 0 { r.below(3) } else { 0 }).map(|_| r.repair(cells)).collect(),
        unseen: None,
        gap: gap(&pairs),
        stats: r.stats(),
        views: views(r, objects, guarantee, shape.keep_bounds),
        closed_holes: (0..r.below(3)).map(|_| (0..3 + r.below(4)).map(|_| r.point().as_vec3()).collect()).collect(),
        clusters: if r.below(2) > 0 { (0..cells).map(|_| 1 + r.below(9) as u32).collect() } else { Vec::new() },
        relevance: relevance(r, cells, objects),
        ways_in: ways_in(r, portals, cells, objects),
        bake: (r.below(2) > 0).then(|| [(r.below(1 << 30) as u128) << 64 | 7, 1 << 100]),
    }
}

/// In every other file.
fn relevance(r: &mut Random, cells: usize, objects: usize) -> Option<FileRelevance> {
    let (is_kept, metres) = (r.below(2) == 1, r.signed().abs());
    is_kept.then(|| FileRelevance { metres, cells: r.matrix(cells, cells, 4), objects: r.matrix(cells, objects, 4) })
}

/// In every other file that has portals.
fn ways_in(r: &mut Random, portals: usize, cells: usize, objects: usize) -> Option<FileWaysIn> {
    let is_in = |r: &mut Random| (0..2 * portals as u32).filter(|_| r.below(3) == 0).map(DirectedPortal).collect();
    (r.below(2) == 1).then(|| {
        let portals: Vec<DirectedPortal> = is_in(r);
        let (cells, objects) = (r.matrix(portals.len(), cells, 4), r.matrix(portals.len(), objects, 4));
        FileWaysIn { portals, cells, objects }
    })
}

/// Up to three view cells, ids apart.
fn views(r: &mut Random, objects: usize, guarantee: Guarantee, keep_bounds: bool) -> Views {
    let n = r.below(4);
    if n == 0 {
        return Views::default();
    }
    let density = r.below(9);
    let [lower, upper] = r.sides(n, objects, density);
    let rows = shipped(guarantee, [&lower, &upper]);
    let pieces = |r: &mut Random| (0..r.below(3)).map(|_| (0..r.below(8)).map(|_| r.plane()).collect()).collect();
    let cells = (0..n).map(|i| FileViewCell { id: format!("{i}{}", r.text()).as_str().into(), pieces: pieces(r) }).collect();
    let witnesses = (0..lower.count_ones()).map(|_| [r.point(), r.point()]).collect();
    Views { cells, rows, bounds: keep_bounds.then_some(ViewBounds { lower, upper, witnesses }) }
}

/// A file with every section in it: 3 cells, 4 portals, 70 objects.
pub fn sample() -> PvsFile {
    let shape = Shape { cells: 3, portals: 4, objects: 70, keep_bounds: true };
    (0..)
        .map(|seed| random_file(seed, shape))
        .find(|f| {
            let full = f.cell_rows.is_some() && f.object_rows.is_some() && !f.repairs.is_empty() && !f.notes.is_empty();
            let full = full
                && f.views.cells.len() == 2
                && f.views.rows.is_some()
                && !f.closed_holes.is_empty()
                && !f.clusters.is_empty();
            full && f.guarantee == Guarantee::Conservative && f.cells.iter().all(|c| c.pieces.iter().any(|p| !p.is_empty()))
        })
        .expect("one of them has every section")
}

/// How a model was imported: with options or without.
fn import(object_triangles: u32, has_options: bool) -> Import {
    let [metres_per_unit, tube_radius] = [0.3048, 0.05].map(|metres| has_options.then_some(metres));
    Import {
        object_triangles,
        metres_per_unit,
        z_up: has_options,
        tube_radius,
        tubes: !has_options,
        smallest_hole: tube_radius,
    }
}
