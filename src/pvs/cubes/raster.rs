//! Cubes by an item buffer: the hierarchy is drawn from front to back, and hidden boxes are skipped.
//!
//! Based on: Greene, Kass, Miller, *Hierarchical Z-buffer visibility*, 1993. Deviations: children of a node are visited in the order of
//! their nearest depth, and each is tested again before its visit; boxes between pixel centres are skipped, too; see-through objects are
//! drawn after opaque ones, each into a separate layer, so that its nearest triangle is known before the next object.

use super::face::{Boxes, Drawn, Face, Rect, Triangles};
use super::tiles::{Tile, Tiles};
use super::tree::{Block, LANES, LEAF, Tree};
use super::{Cube, CubeEngine, CubeScene, CubeView, SeeThrough};
use crate::math::simd::dispatch;
use pulp::Simd;

/// Something to draw: a node or, marked by [`LEAF`], a leaf.
#[derive(Clone, Copy)]
struct Open {
    item: u32,
    rect: Rect,
    nearest: f32,
}

/// The hits of an object in a tile.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Run {
    tile: u32,
    object: u32,
    start: u32,
    end: u32,
}

/// Draws cubes.
pub struct Raster<'s> {
    scene: &'s CubeScene,
    opaque: Tiles,
    layer: Tiles,
    stack: Vec<Open>,
    touched: Vec<usize>,
    hits: Vec<SeeThrough>,
    runs: Vec<Run>,
}

impl<'s> Raster<'s> {
    /// For one thread.
    pub fn new(scene: &'s CubeScene) -> Self {
        let (opaque, layer) = (Tiles::default(), Tiles::default());
        Self { scene, opaque, layer, stack: Vec::new(), touched: Vec::new(), hits: Vec::new(), runs: Vec::new() }
    }

    #[inline(always)]
    fn face<S: Simd>(&mut self, simd: S, view: &CubeView, index: usize, out: &mut Cube) {
        let face = Face::new(view, index);
        let size = view.size as usize;
        let first = index * size * size;
        self.opaque.clear(size);
        self.draw_opaque(simd, &face, size);
        self.opaque.copy_to(size, &mut out.triangles[first..][..size * size]);
        if self.scene.see_through.nodes.is_empty() {
            return;
        }
        if self.layer.across != self.opaque.across {
            self.layer.clear(size);
        }
        self.draw_see_through(simd, &face, size, first);
        self.runs.sort_unstable();
        for run in &self.runs {
            out.see_through.extend_from_slice(&self.hits[run.start as usize..run.end as usize]);
        }
    }

    #[inline(always)]
    fn draw_opaque<S: Simd>(&mut self, simd: S, face: &Face, size: usize) {
        let Self { scene, opaque, stack, .. } = self;
        walk(
            &scene.opaque,
            face,
            size,
            stack,
            opaque,
            #[inline(always)]
            |blocks, tiles, _| {
                seen(
                    blocks,
                    face,
                    tiles,
                    #[inline(always)]
                    |drawn, rect, Tiles { tiles, farthest, across }| {
                        over(
                            simd,
                            &drawn,
                            rect,
                            tiles,
                            farthest,
                            *across,
                            #[inline(always)]
                            |_, far, new| *far = new,
                        );
                    },
                );
            },
        );
    }

    /// Collects see-through hits in front of the opaque triangles, object by object; pixels count from `first`.
    #[inline(always)]
    fn draw_see_through<S: Simd>(&mut self, simd: S, face: &Face, size: usize, first: usize) {
        let Self { scene, opaque, layer, stack, touched, hits, runs } = self;
        hits.clear();
        runs.clear();
        walk(
            &scene.see_through,
            face,
            size,
            stack,
            opaque,
            #[inline(always)]
            |blocks, tiles, leaf| {
                let marked = &mut layer.farthest;
                seen(
                    blocks,
                    face,
                    tiles,
                    #[inline(always)]
                    |drawn, rect, tiles| {
                        over(
                            simd,
                            &drawn,
                            rect,
                            &mut layer.tiles,
                            &mut tiles.farthest,
                            tiles.across,
                            #[inline(always)]
                            |tile, _, _| {
                                if marked[tile] == 0.0 {
                                    marked[tile] = 1.0;
                                    touched.push(tile);
                                }
                            },
                        );
                    },
                );
                for tile in touched.drain(..) {
                    let start = hits.len() as u32;
                    let corner = [tile % tiles.across * LANES, tile / tiles.across * LANES];
                    gather(&layer.tiles[tile], &tiles.tiles[tile], size, first, corner, hits);
                    layer.tiles[tile] = Tile::EMPTY;
                    layer.farthest[tile] = 0.0;
                    let end = hits.len() as u32;
                    runs.push(Run { tile: tile as u32, object: scene.objects[leaf as usize], start, end });
                }
            },
        );
    }
}

/// Draws a triangle into `tiles` where it is not farther than `farthest`, tile by tile; calls `drawn_to` for tiles that may have changed.
#[inline(always)]
fn over<S: Simd>(
    simd: S,
    drawn: &Drawn,
    rect: Rect,
    tiles: &mut [Tile],
    farthest: &mut [f32],
    across: usize,
    mut drawn_to: impl FnMut(usize, &mut f32, f32),
) {
    drawn.tiles(
        rect,
        #[inline(always)]
        |[x, y], rows| {
            let index = y * across + x;
            let (tile, far) = (&mut tiles[index], &mut farthest[index]);
            if drawn.nearest >= *far {
                let at = drawn.at((x * LANES) as f64, (y * LANES) as f64);
                if let Some(new) = tile.draw(simd, drawn, at, *far, rows) {
                    drawn_to(index, far, new);
                }
            }
        },
    );
}

/// Adds the pixels of a see-through object's tile that are not behind the opaque one.
#[inline(always)]
fn gather(layer: &Tile, opaque: &Tile, size: usize, first: usize, corner: [usize; 2], hits: &mut Vec<SeeThrough>) {
    for row in 0..LANES.min(size - corner[1]) {
        let place = first + (corner[1] + row) * size + corner[0];
        for column in 0..LANES.min(size - corner[0]) {
            let p = row * LANES + column;
            if layer.depth[p] > 0.0 && layer.depth[p] >= opaque.depth[p] {
                hits.push(SeeThrough { pixel: (place + column) as u32, triangle: layer.triangle[p] });
            }
        }
    }
}

/// Calls `draw` for each possibly visible triangle of some blocks.
#[inline(always)]
fn seen(blocks: &[Block], face: &Face, tiles: &mut Tiles, mut draw: impl FnMut(Drawn, Rect, &mut Tiles)) {
    for block in blocks {
        let mut triangles = Triangles::new();
        face.triangles(block, &mut triangles);
        let mut left = triangles.seen;
        while left != 0 {
            let l = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            let rect = triangles.rect(l);
            if !tiles.hides(rect, triangles.nearest(l))
                && let Some(drawn) = triangles.set_up(l, face, block.triangles[l])
            {
                draw(drawn, rect, tiles);
            }
        }
    }
}

/// Calls `leaf` for the possibly visible leaves of a tree, near ones first.
#[inline(always)]
fn walk(
    tree: &Tree,
    face: &Face,
    size: usize,
    stack: &mut Vec<Open>,
    tiles: &mut Tiles,
    mut leaf: impl FnMut(&[Block], &mut Tiles, u32),
) {
    if tree.nodes.is_empty() {
        return;
    }
    let all = [0, size as u16 - 1];
    stack.clear();
    stack.push(Open { item: 0, rect: Rect { x: all, y: all }, nearest: f32::INFINITY });
    let mut boxes = Boxes::new();
    while let Some(open) = stack.pop() {
        if tiles.hides(open.rect, open.nearest) {
            continue;
        }
        if open.item & LEAF != 0 {
            let index = open.item & !LEAF;
            leaf(tree.blocks(index), tiles, index);
            continue;
        }
        let node = &tree.nodes[open.item as usize];
        face.boxes(node, &mut boxes);
        let first = stack.len();
        let mut left = boxes.seen;
        while left != 0 {
            let l = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            let new = Open { item: node.child[l], rect: boxes.rect(l), nearest: boxes.nearest[l] };
            stack.push(new);
            let mut i = stack.len() - 1;
            while i > first && stack[i - 1].nearest > new.nearest {
                stack.swap(i, i - 1);
                i -= 1;
            }
        }
    }
}

/// A cube to render, for dispatch.
struct Draw<'a, 's> {
    raster: &'a mut Raster<'s>,
    view: &'a CubeView,
    out: &'a mut Cube,
}

impl pulp::WithSimd for Draw<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for face in 0..6 {
            self.raster.face(simd, self.view, face, self.out);
        }
    }
}

impl CubeEngine for Raster<'_> {
    fn cube(&mut self, view: &CubeView, out: &mut Cube) {
        out.clear(view);
        dispatch(Draw { raster: self, view, out });
    }
}
