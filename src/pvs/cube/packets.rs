//! Cubes by packets of 64 rays: one walk down the hierarchy for each tile of eight by eight pixels.
//!
//! Based on: Boulos, Wald, Shirley, *Geometric and arithmetic culling methods for entire ray packets*, 2006 (slabs in interval
//! arithmetic: a box is asked once for all rays), and Reshetov, *Faster ray packet-triangle intersection through vertex culling*,
//! 2007 (rays of one origin: edge functions are set up once a packet). Deviations: eight boxes are asked at a time, by a packet as a
//! whole; a triangle meets the packet as it meets a tile when it is drawn, by the same arithmetic.

use super::face::{Face, Rect, Triangles};
use super::raster::gather;
use super::tiles::Tile;
use super::tree::{Block, LANES, LEAF, Node, Tree};
use super::{Cube, CubeEngine, CubeScene, CubeView, NONE, SeeThrough};
use crate::vectorized::vectorized;
use glam::DVec3;
use pulp::Simd;

/// Packets grow by this much on each side, pixels: more than what triangles may reach beyond their bounds.
const MARGIN: f64 = 0.01;
/// Distances are off by less than this fraction of themselves.
const PAD: f32 = 1e-5;

/// Casts packets.
pub struct Packets<'s> {
    scene: &'s CubeScene,
    stack: Vec<Open>,
    layer: Tile,
    hits: Vec<SeeThrough>,
    /// Of the tile's see-through objects: which, and where its hits end.
    runs: Vec<(u32, u32, u32)>,
}

/// A node or, marked by [`LEAF`], a leaf, and how near it may be.
#[derive(Clone, Copy)]
struct Open {
    item: u32,
    distance: f32,
}

/// The directions of a packet, as intervals by axis, and its origin.
struct Packet {
    eye_parts: [[f32; 3]; 2],
    /// Boxes are entered no earlier than at the greatest of their lesser and greater sides times these, and 0.
    enter: [[f32; 2]; 3],
    /// They are left no later than at the side given (0 the lesser) times this; `None` where directions of both signs are in the packet.
    leave: [Option<(usize, f32)>; 3],
}

impl Packet {
    fn new(view: &CubeView, axes: [DVec3; 3], columns: [usize; 2], rows: [usize; 2], eye_parts: [[f32; 3]; 2]) -> Self {
        let ends = |pixels: [usize; 2]| {
            [view.tangent(pixels[0] as f64 + 0.5 - MARGIN), view.tangent(pixels[1] as f64 + 0.5 + MARGIN)]
        };
        let (x, y) = (ends(columns), ends(rows));
        let at = |i: usize| axes[0] * x[i & 1] + axes[1] * y[i >> 1] + axes[2];
        let (low, high) = (at(0).min(at(1)).min(at(2).min(at(3))), at(0).max(at(1)).max(at(2).max(at(3))));
        let (mut enter, mut leave) = ([[0.0; 2]; 3], [None; 3]);
        for k in 0..3 {
            if high[k] > 0.0 {
                enter[k][0] = (1.0 / high[k]) as f32;
            }
            if low[k] < 0.0 {
                enter[k][1] = (1.0 / low[k]) as f32;
            }
            if low[k] > 0.0 {
                leave[k] = Some((1, (1.0 / low[k]) as f32));
            } else if high[k] < 0.0 {
                leave[k] = Some((0, (1.0 / high[k]) as f32));
            }
        }
        Self { eye_parts, enter, leave }
    }

    /// How far along the packet each child of a node is, at least; lanes that it may meet, as bits.
    #[inline(always)]
    fn meets(&self, node: &Node, farthest: f32, distance: &mut [f32; LANES]) -> u32 {
        let mut near = [0.0f32; LANES];
        let mut far = [f32::MAX; LANES];
        for k in 0..3 {
            let [high, low] = [self.eye_parts[0][k], self.eye_parts[1][k]];
            let [for_min, for_max] = self.enter[k];
            let (mut min, mut max) = ([0.0f32; LANES], [0.0f32; LANES]);
            for l in 0..LANES {
                min[l] = (node.min[k][l] - high) - low;
                max[l] = (node.max[k][l] - high) - low;
                let (a, b) = (min[l] * for_min, max[l] * for_max);
                near[l] = if a > near[l] { a } else { near[l] };
                near[l] = if b > near[l] { b } else { near[l] };
            }
            if let Some((side, factor)) = self.leave[k] {
                let sides = if side == 0 { &min } else { &max };
                for l in 0..LANES {
                    let t = sides[l] * factor;
                    far[l] = if t < far[l] { t } else { far[l] };
                }
            }
        }
        let mut bits = 0;
        for l in 0..LANES {
            distance[l] = near[l] * (1.0 - PAD);
            // An empty lane lies beyond the greatest distance there is.
            let seen =
                (distance[l] <= far[l] * (1.0 + PAD)) & (distance[l] * farthest <= 1.0) & (node.min[0][l] <= node.max[0][l]);
            bits |= u32::from(seen) << l;
        }
        bits
    }
}

impl<'s> Packets<'s> {
    /// For one thread.
    pub fn new(scene: &'s CubeScene) -> Self {
        Self { scene, stack: Vec::new(), layer: Tile::EMPTY, hits: Vec::new(), runs: Vec::new() }
    }

    #[inline(always)]
    fn face<S: Simd>(&mut self, simd: S, view: &CubeView, index: usize, out: &mut Cube) {
        let Self { scene, stack, layer, hits, runs } = self;
        let face = Face::new(view, index);
        let size = view.size as usize;
        let first = index * size * size;
        let pixels = |tile: usize| [tile * LANES, size.min((tile + 1) * LANES) - 1];
        for (ty, tx) in (0..size.div_ceil(LANES)).flat_map(|ty| (0..size.div_ceil(LANES)).map(move |tx| (ty, tx))) {
            let (columns, rows) = (pixels(tx), pixels(ty));
            let packet = Packet::new(view, view.axes(index), columns, rows, face.eye_parts());
            let (corner, mut tile) = ([columns[0], rows[0]], Tile::EMPTY);
            for p in (0..LANES * LANES).filter(|p| p % LANES > columns[1] - columns[0] || p / LANES > rows[1] - rows[0]) {
                tile.depth[p] = f32::INFINITY;
            }
            let mut farthest = 0.0;
            walk(
                &scene.opaque,
                &packet,
                stack,
                &mut farthest,
                #[inline(always)]
                |blocks, _, farthest| {
                    if let Some(new) = draw(simd, blocks, &face, [columns, rows], *farthest, &mut tile) {
                        *farthest = new;
                    }
                },
            );
            for (row, triangles) in tile.triangle.chunks_exact(LANES).take(rows[1] + 1 - rows[0]).enumerate() {
                let at = first + (corner[1] + row) * size + corner[0];
                let width = columns[1] + 1 - columns[0];
                out.triangles[at..at + width].copy_from_slice(&triangles[..width]);
            }
            if scene.see_through.nodes.is_empty() {
                continue;
            }
            walk(
                &scene.see_through,
                &packet,
                stack,
                &mut farthest,
                #[inline(always)]
                |blocks, leaf, farthest| {
                    if draw(simd, blocks, &face, [columns, rows], *farthest, layer).is_some() {
                        let start = hits.len() as u32;
                        gather(layer, &tile, size, first, corner, hits);
                        runs.push((scene.objects[leaf as usize], start, hits.len() as u32));
                        *layer = Tile::EMPTY;
                    }
                },
            );
            runs.sort_unstable();
            for (_, start, end) in runs.drain(..) {
                out.see_through.extend_from_slice(&hits[start as usize..end as usize]);
            }
            hits.clear();
        }
    }
}

/// Draws the triangles of a leaf into the packet's tile. Returns the depth of what is farthest, or `None` where it is certain that nothing
/// changed.
#[inline(always)]
fn draw<S: Simd>(
    simd: S,
    blocks: &[Block],
    face: &Face,
    [columns, rows]: [[usize; 2]; 2],
    farthest: f32,
    tile: &mut Tile,
) -> Option<f32> {
    let mut changed = None;
    for block in blocks {
        let mut triangles = Triangles::new();
        face.triangles(block, &mut triangles);
        let mut left = triangles.seen;
        while left != 0 {
            let l = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            let Rect { x, y } = triangles.rect(l);
            let [x0, x1, y0, y1] = [x[0], x[1], y[0], y[1]].map(usize::from);
            // By tiles, as when a triangle is drawn; by rows, too.
            let beside = x1 < columns[0] || x0 / LANES > columns[0] / LANES || y1 < rows[0] || y0 > rows[1];
            if beside || triangles.nearest(l) < farthest {
                continue;
            }
            let Some(drawn) = triangles.set_up(l, face, block.triangles[l]) else { continue };
            let at = drawn.at(columns[0] as f64, rows[0] as f64);
            let rows = [y0.saturating_sub(rows[0]), (y1 - rows[0]).min(LANES - 1)];
            changed = tile.draw(simd, &drawn, at, farthest, rows).or(changed);
        }
    }
    changed
}

/// Hands the leaves of a tree that a packet may meet to `leaf`, near ones first; `leaf` may say that nothing farther than `1 / farthest`
/// matters any more.
#[inline(always)]
fn walk(
    tree: &Tree,
    packet: &Packet,
    stack: &mut Vec<Open>,
    farthest: &mut f32,
    mut leaf: impl FnMut(&[Block], u32, &mut f32),
) {
    if tree.nodes.is_empty() {
        return;
    }
    stack.clear();
    stack.push(Open { item: 0, distance: 0.0 });
    let mut distance = [0.0; LANES];
    while let Some(open) = stack.pop() {
        if open.distance * *farthest > 1.0 {
            continue;
        }
        if open.item & LEAF != 0 {
            let index = open.item & !LEAF;
            leaf(tree.blocks(index), index, farthest);
            continue;
        }
        let node = &tree.nodes[open.item as usize];
        let first = stack.len();
        let mut left = packet.meets(node, *farthest, &mut distance);
        while left != 0 {
            let l = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            let new = Open { item: node.child[l], distance: distance[l] };
            stack.push(new);
            let mut i = stack.len() - 1;
            while i > first && stack[i - 1].distance < new.distance {
                stack.swap(i, i - 1);
                i -= 1;
            }
        }
    }
}

/// A cube yet to be made.
struct Cast<'a, 's> {
    packets: &'a mut Packets<'s>,
    view: &'a CubeView,
    out: &'a mut Cube,
}

impl pulp::WithSimd for Cast<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for face in 0..6 {
            self.packets.face(simd, self.view, face, self.out);
        }
    }
}

impl CubeEngine for Packets<'_> {
    fn cube(&mut self, view: &CubeView, out: &mut Cube) {
        out.clear(view);
        out.triangles.fill(NONE);
        vectorized(Cast { packets: self, view, out });
    }
}
