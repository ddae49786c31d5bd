//! Ground, judged: every sample of a raster against where the selected tiles draw it, and the mesh of what is drawn, edge by edge.

use enfilade::runtime::{Camera, Rect};
use enfilade_terrain::{Disk, Ground, GroundError, GroundView, Heights, MakeOptions, Patch, drawn, make};
use glam::{DVec2, DVec3};
use std::collections::HashSet;
use std::io::Cursor;
use std::ops::Range;
use std::path::Path;

/// A raster in memory.
pub struct Raster {
    pub size: [u32; 2],
    pub spacing: [f64; 2],
    pub first: [f64; 2],
    pub lattice: Option<f64>,
    pub heights: Vec<f64>,
}

impl Raster {
    /// Heights by column and row, 10 m apart.
    pub fn of(size: [u32; 2], height: impl Fn(u32, u32) -> f64) -> Self {
        let heights = (0..size[1]).flat_map(|r| (0..size[0]).map(move |c| (c, r))).map(|(c, r)| height(c, r)).collect();
        Self { size, spacing: [10.0; 2], first: [0.0; 2], lattice: None, heights }
    }

    /// All of any raster.
    pub fn read(from: &mut dyn Heights) -> Self {
        let size = from.size();
        let mut heights = vec![f64::NAN; size[0] as usize * size[1] as usize];
        from.read(0..size[1], &mut heights).expect("a raster");
        Self { size, spacing: from.spacing(), first: from.first(), lattice: from.lattice(), heights }
    }

    pub fn height(&self, column: u32, row: u32) -> f64 {
        self.heights[row as usize * self.size[0] as usize + column as usize]
    }

    /// True where a finest triangle has the sample as a corner: the raster's surface.
    pub fn is_surface(&self, column: u32, row: u32) -> bool {
        let there = |c: i64, r: i64| {
            let inside = c >= 0 && r >= 0 && c < i64::from(self.size[0]) && r < i64::from(self.size[1]);
            inside && !self.height(c as u32, r as u32).is_nan()
        };
        let (c, r) = (i64::from(column), i64::from(row));
        // The six triangles about a sample, diagonals from the north-east to the south-west.
        let around = [[1, 0], [0, 1], [-1, 1], [-1, 0], [0, -1], [1, -1]];
        there(c, r) && (0..6).any(|k| [around[k], around[(k + 1) % 6]].iter().all(|&[dc, dr]| there(c + dc, r + dr)))
    }
}

impl Heights for Raster {
    fn size(&self) -> [u32; 2] {
        self.size
    }
    fn spacing(&self) -> [f64; 2] {
        self.spacing
    }
    fn first(&self) -> [f64; 2] {
        self.first
    }
    fn lattice(&self) -> Option<f64> {
        self.lattice
    }
    fn read(&mut self, rows: Range<u32>, out: &mut [f64]) -> Result<(), String> {
        let columns = self.size[0] as usize;
        out.copy_from_slice(&self.heights[rows.start as usize * columns..rows.end as usize * columns]);
        Ok(())
    }
}

/// The bytes of a raster's ground.
pub fn bytes(raster: &mut Raster, options: &MakeOptions) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    make(raster, options, &mut out).expect("a ground");
    out.into_inner()
}

/// A raster as a ground, all of it in memory.
pub fn ground(raster: &mut Raster) -> Ground {
    ground_with(raster, &MakeOptions::default())
}

pub fn ground_with(raster: &mut Raster, options: &MakeOptions) -> Ground {
    let bytes = bytes(raster, options);
    let length = bytes.len() as u64;
    Ground::read(Cursor::new(bytes), length, u64::MAX).expect("what was made")
}

/// Writes a raster's ground.
pub fn written(raster: &mut Raster, path: &Path) {
    std::fs::write(path, bytes(raster, &MakeOptions::default())).expect("a folder to write to");
}

/// What was found of one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Verdict {
    /// Samples of the raster's surface on the screen.
    pub samples: u64,
    /// The farthest of one from where it is drawn, pixels.
    pub worst: f64,
    /// Samples on the screen of which nothing is drawn within so many pixels as were allowed, though they are no void.
    pub beyond: u64,
    /// Drawn edges with a drawn triangle beyond them that does not share them.
    pub open_edges: u64,
    /// Samples drawn at two heights.
    pub torn: u64,
    /// The greatest step of levels between drawn tiles beside each other.
    pub steps: u32,
}

/// What is drawn: heights by sample.
struct Drawn<'a> {
    ground: &'a Ground,
    patches: &'a [Patch],
    triangles: Vec<[[u32; 2]; 3]>,
    /// Where each patch's triangles end.
    ends: Vec<usize>,
    /// By sample, row after row: its height as a corner, and that of the surface; not a number where there is none.
    heights: Vec<f32>,
    surface: Vec<f64>,
    torn: u64,
}

impl<'a> Drawn<'a> {
    fn new(ground: &'a Ground, patches: &'a [Patch]) -> Self {
        let grid = &ground.header().grid;
        let samples = grid.size().map(|k| k as usize).into_iter().product();
        let (heights, surface) = (vec![f32::NAN; samples], vec![f64::NAN; samples]);
        let mut drawn_now = Self { ground, patches, triangles: vec![], ends: vec![], heights, surface, torn: 0 };
        for patch in patches {
            let cells = patch.drawn_cells(grid.side());
            for triangle in cells.flat_map(|[i, j]| drawn(i, j, grid.side(), patch.coarser)) {
                let at = triangle.map(|[i, j]| [grid.column(patch.key, i), grid.row(patch.key, j)]);
                let heights = triangle.map(|sample| ground.sample(patch.tile, sample));
                let [Some(a), Some(b), Some(c)] = heights else { continue };
                if doubled(at) != 0 {
                    drawn_now.add(at, [a, b, c]);
                }
            }
            drawn_now.ends.push(drawn_now.triangles.len());
        }
        drawn_now
    }

    fn add(&mut self, at: [[u32; 2]; 3], heights: [f32; 3]) {
        for (at, height) in at.into_iter().zip(heights) {
            let at = self.index(at);
            self.torn += u64::from(!self.heights[at].is_nan() && self.heights[at].to_bits() != height.to_bits());
            self.heights[at] = height;
        }
        let low = [0, 1].map(|k| at.iter().map(|p| p[k]).min().unwrap_or(0));
        let high = [0, 1].map(|k| at.iter().map(|p| p[k]).max().unwrap_or(0));
        for row in low[1]..=high[1] {
            for column in low[0]..=high[0] {
                if let Some(weights) = weights(at, [column, row].map(f64::from)) {
                    let height = weights.iter().zip(heights).map(|(w, h)| w * f64::from(h)).sum();
                    let at = self.index([column, row]);
                    self.surface[at] = height;
                }
            }
        }
        self.triangles.push(at);
    }

    fn index(&self, [column, row]: [u32; 2]) -> usize {
        row as usize * self.ground.header().grid.size()[0] as usize + column as usize
    }

    /// Edges that have a drawn triangle on their other side that has not the same edge.
    fn open_edges(&self) -> u64 {
        let of = |[a, b, c]: &[[u32; 2]; 3]| [(*a, *b), (*b, *c), (*c, *a)];
        let edges: HashSet<([u32; 2], [u32; 2])> = self.triangles.iter().flat_map(of).collect();
        let alone = edges.iter().filter(|&&(a, b)| !edges.contains(&(b, a)));
        alone.filter(|&&(a, b)| self.is_drawn_beyond(a, b)).count() as u64
    }

    fn is_drawn_beyond(&self, a: [u32; 2], b: [u32; 2]) -> bool {
        let [p, q] = [a, b].map(|p| DVec2::new(f64::from(p[0]), f64::from(p[1])));
        let along = q - p;
        // Triangles are counter-clockwise with the south to the right of the east, so their inside is on the other side.
        let outward = DVec2::new(-along.y, along.x).normalize() * 0.01;
        let inside_of = |of: &[[u32; 2]; 3], p: DVec2| weights(*of, [p.x, p.y]).is_some();
        // Near both ends and in the middle: a part of an edge may be open.
        [0.1, 0.5, 0.9].iter().any(|t| {
            let beyond = p + along * *t + outward;
            (0..self.patches.len()).filter(|&k| self.covers(&self.patches[k], beyond)).any(|k| {
                let from = if k == 0 { 0 } else { self.ends[k - 1] };
                self.triangles[from..self.ends[k]].iter().any(|of| inside_of(of, beyond))
            })
        })
    }

    fn covers(&self, patch: &Patch, p: DVec2) -> bool {
        let grid = &self.ground.header().grid;
        let range = |from: u32, to: u32, at: f64| f64::from(from) <= at && at <= f64::from(to);
        let last = grid.side() - 1;
        range(grid.column(patch.key, 0), grid.column(patch.key, last), p.x)
            && range(grid.row(patch.key, 0), grid.row(patch.key, last), p.y)
    }

    /// The greatest step of levels over a shared border.
    fn steps(&self) -> u32 {
        let grid = &self.ground.header().grid;
        let last = grid.side() - 1;
        let extent = |p: &Patch| {
            let [w, e] = [0, last].map(|i| grid.column(p.key, i));
            let [n, s] = [0, last].map(|j| grid.row(p.key, j));
            [w, e, n, s]
        };
        let mut steps = 0;
        for (k, a) in self.patches.iter().enumerate() {
            for b in &self.patches[..k] {
                let ([w, e, n, s], [w2, e2, n2, s2]) = (extent(a), extent(b));
                let beside = (e == w2 || e2 == w) && n.max(n2) < s.min(s2);
                let above = (s == n2 || s2 == n) && w.max(w2) < e.min(e2);
                if beside || above {
                    steps = steps.max(a.key.level.abs_diff(b.key.level));
                }
            }
        }
        steps
    }
}

fn doubled([a, b, c]: [[u32; 2]; 3]) -> i64 {
    let [ax, ay, bx, by, cx, cy] = [a[0], a[1], b[0], b[1], c[0], c[1]].map(i64::from);
    (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
}

/// The weights of a triangle's corners at a point in it.
fn weights(triangle: [[u32; 2]; 3], [x, y]: [f64; 2]) -> Option<[f64; 3]> {
    let [a, b, c] = triangle.map(|p| DVec2::new(f64::from(p[0]), f64::from(p[1])));
    let p = DVec2::new(x, y);
    let whole = (b - a).perp_dot(c - a);
    let parts = [(b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)].map(|part| part / whole);
    parts.iter().all(|&part| part >= 0.0).then_some(parts)
}

/// Where points are on the screen.
pub struct Screen {
    camera: Camera,
    half: DVec2,
    windows: Vec<Rect>,
}

impl Screen {
    pub fn new(view: &GroundView<'_>) -> Self {
        let half = DVec2::new(f64::from(view.size[0]), f64::from(view.size[1])) / 2.0;
        Self { camera: view.camera, half, windows: view.windows.to_vec() }
    }

    /// Pixels from the middle; `None` behind the eye.
    pub fn at(&self, p: DVec3) -> Option<DVec2> {
        let p = p - self.camera.eye.as_dvec3();
        let [x, y, w] = [self.camera.x, self.camera.y, self.camera.w].map(|row| row.as_dvec3().dot(p));
        (w > 0.0).then(|| DVec2::new(x, y) / w * self.half)
    }

    pub fn shows(&self, at: DVec2) -> bool {
        let ndc = (at / self.half).as_vec2();
        self.windows.iter().any(|w| ndc.cmpge(w.min).all() && ndc.cmple(w.max).all())
    }
}

/// Judges what is drawn of a view. `allowed` pixels; edges are looked at only with `edges`, which takes long.
pub fn judge(
    ground: &Ground,
    raster: &Raster,
    view: &GroundView<'_>,
    patches: &[Patch],
    allowed: f64,
    edges: bool,
) -> Verdict {
    let of = Drawn::new(ground, patches);
    let screen = Screen::new(view);
    let header = ground.header();
    let mut verdict = Verdict { torn: of.torn, steps: of.steps(), ..Verdict::default() };
    let place = |c: u32, r: u32, height: f64| {
        let [x, z] = header.plan(c, r);
        DVec3::new(x, height, z)
    };
    for row in 0..raster.size[1] {
        for column in 0..raster.size[0] {
            let height = raster.height(column, row) - header.origin[2];
            let Some(at) = screen.at(place(column, row, height)).filter(|&at| screen.shows(at)) else { continue };
            if !raster.is_surface(column, row) {
                continue;
            }
            verdict.samples += 1;
            let drawn_at = |c: u32, r: u32| {
                Some(of.surface[of.index([c, r])]).filter(|h| !h.is_nan()).and_then(|h| screen.at(place(c, r, h)))
            };
            let error = drawn_at(column, row).map_or_else(
                || {
                    // Beside a void: the nearest that is drawn.
                    let around = |v: u32, most: u32| v.saturating_sub(REACH)..=(v + REACH).min(most - 1);
                    let near = around(row, raster.size[1]).flat_map(|r| around(column, raster.size[0]).map(move |c| (c, r)));
                    near.filter_map(|(c, r)| drawn_at(c, r)).map(|p| p.distance(at)).fold(f64::INFINITY, f64::min)
                },
                |p| p.distance(at),
            );
            verdict.beyond += u64::from(error > allowed);
            verdict.worst = verdict.worst.max(error);
        }
    }
    if edges {
        verdict.open_edges = of.open_edges();
    }
    verdict
}

/// Samples about one without a surface in which a surface is looked for.
const REACH: u32 = 12;

/// A disk that answers late: a tile comes so many frames after it was asked for, and so many are taken a frame.
pub struct Scripted {
    bytes: Vec<Vec<u8>>,
    late: u64,
    a_frame: usize,
    frame: u64,
    asked_now: usize,
    queue: std::collections::VecDeque<(u64, u32)>,
}

impl Scripted {
    /// The tiles of a file.
    pub fn new(path: &std::path::Path, of: &Ground, late: u64, a_frame: usize) -> Self {
        let file = std::fs::read(path).expect("a ground");
        let header = of.header();
        let tile = |t: u32| file[header.place(t) as usize..header.place(t + 1) as usize].to_vec();
        let bytes = (0..header.grid.tiles()).map(tile).collect();
        Self { bytes, late, a_frame, frame: 0, asked_now: 0, queue: std::collections::VecDeque::with_capacity(1024) }
    }
}

impl Disk for Scripted {
    fn ask(&mut self, tile: u32) -> bool {
        let takes = self.asked_now < self.a_frame;
        if takes {
            self.asked_now += 1;
            self.queue.push_back((self.frame + self.late, tile));
        }
        takes
    }

    fn take(&mut self, bytes: &mut [u8]) -> Option<(u32, Result<(), GroundError>)> {
        match self.queue.front() {
            Some(&(due, tile)) if due <= self.frame => {
                self.queue.pop_front();
                let of = &self.bytes[tile as usize];
                bytes[..of.len()].copy_from_slice(of);
                Some((tile, Ok(())))
            }
            // Nothing more has come: the frame's requests follow.
            _ => {
                self.frame += 1;
                self.asked_now = 0;
                None
            }
        }
    }
}
