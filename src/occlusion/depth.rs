//! Occlusion queries without a graphics processor: a tiled depth buffer, and exact box tests per pixel.
//!
//! Based on: Greene, Kass, Miller, *Hierarchical Z-buffer visibility*, 1993 (here with three levels: pixels, tiles of 8 by 8, blocks of 8
//! by 8 tiles); Hasselgren, Andersson, Akenine-Möller, *Masked software occlusion culling*, 2016 (tiles as lanes; here with a depth for
//! every pixel, or one plane for a tile covered by one triangle, so that no merging is necessary); Olano, Greer, *Triangle scan conversion
//! using 2D homogeneous coordinates*, 1997 (edge functions and 1/w are linear over the image even behind the eye, so nothing is clipped).
//!
//! # What is hidden
//!
//! A box is hidden if, at the centre of every pixel that it covers, a drawn surface is nearer than the box. A triangle covers the pixels
//! whose centres are inside it, as with a graphics processor's samples, decided in `f64`. Its depth, an `f32`, is rounded towards far, and
//! boxes are rounded outwards. So no box is hidden that a depth buffer of this size and unlimited precision would show. A larger picture
//! may show more: use the size of the picture that is drawn.

#![expect(
    clippy::needless_range_loop,
    reason = "inner loops: where iterators are not inlined, they take longer than the work"
)]

mod ask;
mod closed;
mod draw;
mod lanes;
mod squares;
mod tile;
mod whole;

use super::bounds::Bounds;
use super::geometry::{Geometry, GeometryObject};
use super::oracle::{OcclusionOracle, QueryId};
use super::pixels::Rays;
use super::slabs::Place;
use super::view::View;
use crate::ObjectId;
use crate::math::parallel;
use crate::math::simd::vectorized;
use closed::Outside;
use glam::DVec3;
use lanes::{COUNT, F32x8, Lanes, SIDE};

/// Pixels along the side of a block.
const BLOCK: usize = SIDE * SIDE;
/// Depth is 1/w, so infinity is 0. A tile without any drawn triangle has this farthest depth, and its pixels are from an earlier frame.
const UNTOUCHED: f32 = -1.0;
/// Initial capacity for queries per frame and object: a binary tree has two nodes per object, and CHC++ may query each twice. More queries
/// allocate.
const QUESTIONS: usize = 4;

/// Pixels of a tile, row by row.
#[derive(Clone, Copy)]
#[repr(align(32))]
struct Tile([Lanes; SIDE]);

/// A number for each of eight tiles in a row of a block.
#[derive(Clone, Copy)]
#[repr(align(32))]
struct Eight(Lanes);

/// The depth plane of a tile covered by one triangle, a linear function of the pixel, not below `floor`; NaN if the tile has a depth per
/// pixel.
#[derive(Clone, Copy)]
struct Plane {
    at: f32,
    x: f32,
    y: f32,
    floor: f32,
}

#[cfg(test)]
impl Plane {
    fn depth(&self, column: usize, row: usize) -> f32 {
        ((self.at + self.y * COUNT[row]) + self.x * COUNT[column]).max(self.floor)
    }
}

/// The planes of eight tiles in a row of a block, as a structure of arrays.
#[derive(Clone, Copy)]
#[repr(align(32))]
struct Planes {
    at: Lanes,
    x: Lanes,
    y: Lanes,
    floor: Lanes,
}

impl Planes {
    const NONE: Self = Self { at: [f32::NAN; SIDE], x: [0.0; SIDE], y: [0.0; SIDE], floor: [0.0; SIDE] };

    #[inline(always)]
    fn get(&self, k: usize) -> Plane {
        Plane { at: self.at[k], x: self.x[k], y: self.y[k], floor: self.floor[k] }
    }
}

/// Position of a tile in memory: by block, and by row in a block.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Index {
    block: usize,
    /// Row number over all blocks.
    row: usize,
    /// Column in the row.
    column: usize,
}

impl Index {
    /// Tile number over all blocks.
    #[inline(always)]
    fn tile(self) -> usize {
        self.row * SIDE + self.column
    }
}

/// The software oracle.
pub struct DepthBuffer<'s> {
    model: Geometry<'s>,
    rays: Rays,
    /// Blocks along a row.
    across: usize,
    tiles: Vec<Tile>,
    planes: Vec<Planes>,
    /// The farthest depth of each tile; infinitely near outside the picture.
    farthest: Vec<Eight>,
    /// The same before anything is drawn.
    empty: Vec<Eight>,
    /// By column of blocks, above 0 if all columns of a tile are in the picture.
    complete: Vec<Eight>,
    /// By object: the outside of its triangles, if it is closed.
    outsides: Vec<Option<Outside>>,
    /// The farthest depth of each block, NaN if one of its tiles has changed since; padded to fill registers.
    blocks: Vec<f32>,
    /// Whether there is a block with NaN.
    is_stale: bool,
    /// 1 or more.
    min_pixels: u32,
    answers: Vec<bool>,
}

impl<'s> DepthBuffer<'s> {
    /// A buffer of `width` by `height` pixels, both above 0. Opaque objects are occluders.
    pub fn new(model: impl Into<Geometry<'s>>, width: usize, height: usize) -> Self {
        Self::over(model.into(), width, height)
    }

    fn over(model: Geometry<'s>, width: usize, height: usize) -> Self {
        let tiles = [width, height].map(|s| s.div_ceil(SIDE));
        let blocks = tiles.map(|s| s.div_ceil(SIDE));
        let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, 1.0, 1.0, 0.1);
        let rows = blocks[0] * blocks[1] * SIDE;
        let mut buffer = Self {
            rays: Rays::new(&view, [width, height]),
            across: blocks[0],
            tiles: vec![Tile([[0.0; SIDE]; SIDE]); rows * SIDE],
            outsides: parallel::map(&model.objects, |object| Outside::of(&model, object)),
            planes: vec![Planes::NONE; rows],
            farthest: Vec::new(),
            empty: vec![Eight([f32::INFINITY; SIDE]); rows],
            complete: vec![Eight([-1.0; SIDE]); blocks[0]],
            blocks: vec![UNTOUCHED; blocks[0] * blocks[1] + SIDE],
            is_stale: false,
            min_pixels: 1,
            answers: Vec::with_capacity(QUESTIONS * model.objects.len()),
            model,
        };
        for (x, y) in (0..tiles[1]).flat_map(|y| (0..tiles[0]).map(move |x| (x, y))) {
            let index = buffer.index([x, y]);
            buffer.empty[index.row].0[index.column] = UNTOUCHED;
        }
        for x in 0..width / SIDE {
            buffer.complete[x / SIDE].0[x % SIDE] = 1.0;
        }
        buffer.farthest.clone_from(&buffer.empty);
        buffer
    }

    /// Starts an empty frame.
    pub fn begin(&mut self, view: &View) {
        self.rays = Rays::new(view, self.rays.size);
        self.farthest.copy_from_slice(&self.empty);
        self.blocks.fill(UNTOUCHED);
        self.is_stale = false;
        self.answers.clear();
    }

    /// Sets the number of pixels below which a box counts as hidden; 0 and 1 (default): any pixel counts.
    pub fn set_min_pixels(&mut self, pixels: u32) {
        self.min_pixels = pixels.max(1);
    }

    /// Whether a box would show at least as many pixels as [`Self::set_min_pixels`] sets, over the drawn objects.
    pub fn shows(&mut self, bounds: &Bounds) -> bool {
        self.show(std::slice::from_ref(bounds))
    }

    /// The same for several boxes together. A pixel that shows two of them counts twice.
    fn show(&mut self, boxes: &[Bounds]) -> bool {
        let mut wanted = self.min_pixels;
        boxes.iter().any(|bounds| vectorized(ask::Ask { buffer: self, bounds, wanted: &mut wanted }))
    }

    #[inline(always)]
    fn index(&self, [x, y]: [usize; 2]) -> Index {
        let block = y / SIDE * self.across + x / SIDE;
        Index { block, row: block * SIDE + y % SIDE, column: x % SIDE }
    }

    /// The farthest depth of a tile.
    #[inline(always)]
    fn farthest(&self, index: Index) -> f32 {
        self.farthest[index.row].0[index.column]
    }

    /// Writes the depths of a tile's plane to its pixels.
    #[inline(always)]
    fn unfold(&mut self, index: Index) {
        let planes = &mut self.planes[index.row];
        let plane = planes.get(index.column);
        if !plane.at.is_nan() {
            let (steps, floor) = (F32x8::COUNT * plane.x, F32x8::splat(plane.floor));
            let tile = &mut self.tiles[index.tile()];
            for row in 0..SIDE {
                (F32x8::splat(plane.at + plane.y * COUNT[row]) + steps).max(floor).store(&mut tile.0[row]);
            }
            planes.at[index.column] = f32::NAN;
        }
    }

    /// Sets the farthest depth of a changed tile.
    #[inline(always)]
    fn set_farthest(&mut self, index: Index, depth: f32) {
        let farthest = &mut self.farthest[index.row].0[index.column];
        if *farthest != depth {
            *farthest = depth;
            self.blocks[index.block] = f32::NAN;
            self.is_stale = true;
        }
    }

    /// Updates the farthest depth of each block.
    #[inline(always)]
    fn freshen(&mut self) {
        if self.is_stale {
            for block in 0..self.blocks.len() - SIDE {
                self.block(block);
            }
            self.is_stale = false;
        }
    }

    /// The farthest depth in a block.
    #[inline(always)]
    fn block(&mut self, block: usize) -> f32 {
        if self.blocks[block].is_nan() {
            let rows = &self.farthest[block * SIDE..][..SIDE];
            let mut least = F32x8::INFINITY;
            for row in rows {
                least = least.min(F32x8::load(&row.0));
            }
            self.blocks[block] = least.least();
        }
        self.blocks[block]
    }
}

impl OcclusionOracle for DepthBuffer<'_> {
    fn begin(&mut self, view: &View) {
        Self::begin(self, view);
    }

    fn issue(&mut self, boxes: &[Bounds]) -> QueryId {
        let shows = self.show(boxes);
        self.answers.push(shows);
        QueryId(self.answers.len() as u32 - 1)
    }

    fn poll(&mut self, query: QueryId) -> Option<bool> {
        Some(self.answers[query.0 as usize])
    }

    fn answers_at_once(&self) -> bool {
        true
    }

    fn draw(&mut self, object: ObjectId) {
        let GeometryObject { opaque, triangles, bounds } = self.model.objects[object.index()].clone();
        if !opaque {
            return;
        }
        // If a closed object is not cut by the near plane, its front hides its back.
        let front =
            self.outsides[object.index()].filter(|_| !matches!(Place::of(&self.rays, &Bounds::from(bounds)), Place::Near));
        vectorized(draw::Draw { buffer: self, triangles, front });
    }
}

#[cfg(test)]
mod tests {
    use super::super::scenes::{Picture, add, crowd, own_bounds, random_view, row, turned};
    use super::*;
    use crate::math::random::Prng;
    use crate::types::scene::Scene;
    use glam::DQuat;

    fn all(scene: &Scene) -> Vec<ObjectId> {
        (0..scene.objects.len() as u32).map(ObjectId).collect()
    }

    /// The depth of a pixel; 0 if empty.
    fn depth(buffer: &DepthBuffer<'_>, x: usize, y: usize) -> f32 {
        let index = buffer.index([x / SIDE, y / SIDE]);
        match buffer.planes[index.row].get(index.column) {
            _ if buffer.farthest(index) < 0.0 => 0.0,
            plane if plane.at.is_nan() => buffer.tiles[index.tile()].0[y % SIDE][x % SIDE],
            plane => plane.depth(x % SIDE, y % SIDE),
        }
    }

    /// Exactly the pixels of the reference picture are drawn; never nearer, and hardly farther.
    #[test]
    fn the_depth_is_that_of_the_picture() {
        let mut rng = Prng::new(1, 0);
        for round in 0..40 {
            let scene = crowd(30, round);
            let size = [[64, 48], [37, 29]][round as usize % 2];
            // Often the eye is in the middle, surrounded by triangles.
            let view = random_view(&mut rng, [0.01, 1.0][round as usize / 2 % 2]);
            let mut buffer = DepthBuffer::new(&scene, size[0], size[1]);
            buffer.begin(&view);
            all(&scene).into_iter().for_each(|o| buffer.draw(o));
            let picture = Picture::new(&scene, &all(&scene), &view, size);
            for (p, pixel) in picture.pixels.iter().enumerate() {
                let (want, got) = (pixel.map_or(0.0, |p| p.0), f64::from(depth(&buffer, p % size[0], p / size[0])));
                assert!(got <= want && got >= want * (1.0 - 1e-3), "round {round}, pixel {p}: {got} for {want}");
            }
            for tile in (0..size[1].div_ceil(SIDE)).flat_map(|y| (0..size[0].div_ceil(SIDE)).map(move |x| [x, y])) {
                let index = buffer.index(tile);
                if buffer.farthest(index) >= 0.0 {
                    buffer.unfold(index);
                    let least = buffer.tiles[index.tile()].0.as_flattened().iter().copied().fold(f32::INFINITY, f32::min);
                    assert_eq!(buffer.farthest(index), least);
                }
            }
        }
    }

    /// A wall that fills the screen, with its diagonal through pixel centres, and one seen edge-on.
    #[test]
    fn there_is_no_crack_between_two_triangles() {
        let mut scene = row(&[]);
        add(&mut scene, &turned(DVec3::ZERO, DQuat::IDENTITY, DVec3::new(8.0, 8.0, 0.1)), 1);
        for (eye, target) in [([0., 0., 5.], [0., 0., 0.]), ([0., 0., 5.], [8., 8., 0.1]), ([0., 0., 9.], [0.5, 0.25, 0.])] {
            let view = View::look_at(eye.into(), target.into(), 0.7, 1.0, 0.1);
            let mut buffer = DepthBuffer::new(&scene, 64, 64);
            buffer.begin(&view);
            buffer.draw(ObjectId(0));
            let picture = Picture::new(&scene, &[ObjectId(0)], &view, [64, 64]);
            for p in 0..64 * 64 {
                let (got, want) = (depth(&buffer, p % 64, p / 64) > 0.0, picture.pixels[p].is_some());
                assert_eq!(got, want, "pixel {p} from {eye:?}");
            }
        }
    }

    /// The guarantee: no visible box is reported hidden; and nearly all hidden boxes are reported.
    #[test]
    fn what_is_called_hidden_has_no_pixel_and_little_else_has_none() {
        let mut rng = Prng::new(2, 0);
        // Limits of visible pixels: any, or several.
        const LIMITS: [u32; 4] = [1, 2, 10, 40];
        let (mut hidden, mut called, mut shown) = ([0; 4], [0; 4], [0; 4]);
        for round in 0..40 {
            let scene = crowd(40, round + 100);
            let size = [[64, 48], [75, 50]][round as usize % 2];
            let view = random_view(&mut rng, [0.01, 0.5][round as usize / 2 % 2]);
            let mut buffer = DepthBuffer::new(&scene, size[0], size[1]);
            buffer.begin(&view);
            let occluders = &all(&scene)[..20];
            occluders.iter().for_each(|&o| buffer.draw(o));
            let picture = Picture::new(&scene, occluders, &view, size);
            for i in 0..60 {
                let bounds = if i < 40 {
                    let object = &scene.objects[i];
                    if i % 2 == 0 { object.bounds.into() } else { own_bounds(&scene, object) }
                } else {
                    let reach = |rng: &mut Prng| DVec3::new(rng.unit(), rng.unit(), rng.unit());
                    let half = reach(&mut rng) * [3.0, 0.3][i % 2];
                    turned((reach(&mut rng) * 2.0 - 1.0) * 12.0, DQuat::from_rotation_y(rng.unit() * 6.0), half)
                };
                let near = bounds.corners().iter().any(|p| view.w.dot(*p - view.eye) < view.near);
                let count = if near { 0 } else { picture.count(&view, &bounds) };
                for (l, limit) in LIMITS.into_iter().enumerate() {
                    buffer.set_min_pixels(limit);
                    let shows = buffer.shows(&bounds);
                    if near {
                        assert!(shows, "what reaches the near plane can't be known");
                    } else if count >= limit as usize {
                        shown[l] += 1;
                        assert!(shows, "round {round}, box {i}, limit {limit}");
                    } else {
                        hidden[l] += 1;
                        called[l] += usize::from(!shows);
                    }
                }
            }
        }
        for l in 0..LIMITS.len() {
            let [hidden, called, shown] = [hidden[l], called[l], shown[l]];
            assert!(called * 100 >= hidden * 98, "{called} of {hidden}");
            assert!(hidden > 300 && shown > 300, "{hidden} and {shown}: a test of nothing");
        }
    }

    #[test]
    fn a_box_behind_a_wall_is_hidden_until_the_next_frame_and_glass_hides_nothing() {
        let mut scene = row(&[]);
        add(&mut scene, &turned(DVec3::ZERO, DQuat::IDENTITY, DVec3::new(0.1, 2.0, 2.0)), 1);
        let view = View::look_at(DVec3::NEG_X * 5.0, DVec3::ZERO, 1.0, 1.5, 0.1);
        let at = |x: f64, y: f64| turned(DVec3::new(x, y, 0.0), DQuat::IDENTITY, DVec3::splat(0.5));
        let mut buffer = DepthBuffer::new(&scene, 160, 120);
        buffer.begin(&view);
        assert!(buffer.shows(&at(3.0, 0.0)), "nothing is drawn yet");
        buffer.draw(ObjectId(0));
        assert!(!buffer.shows(&at(3.0, 0.0)));
        assert!(buffer.shows(&at(-2.0, 0.0)), "before the wall");
        assert!(buffer.shows(&at(3.0, 3.2)), "above it");
        assert!(buffer.shows(&at(-5.0, 0.0)), "around the eye");
        // Several boxes in one query: hidden if all are.
        let ask = |buffer: &mut DepthBuffer<'_>, boxes: &[Bounds]| {
            let query = buffer.issue(boxes);
            buffer.poll(query)
        };
        assert_eq!(ask(&mut buffer, &[at(3.0, 0.0), at(4.0, 0.5)]), Some(false));
        assert_eq!(ask(&mut buffer, &[at(3.0, 0.0), at(3.0, 3.2)]), Some(true));
        buffer.begin(&view);
        assert!(buffer.shows(&at(3.0, 0.0)));
        // A wall nearer than the near plane is not drawn.
        buffer.begin(&View { near: 5.2, ..view });
        buffer.draw(ObjectId(0));
        assert!(buffer.shows(&at(3.0, 0.0)));
        let mut glass = scene.clone();
        glass.objects[0].opaque = false;
        let mut buffer = DepthBuffer::new(&glass, 160, 120);
        buffer.begin(&view);
        buffer.draw(ObjectId(0));
        assert!(buffer.shows(&at(3.0, 0.0)));
    }
}
